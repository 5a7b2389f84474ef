// Bodies whose moments change: the spin, perturbed and followed while its moments are shaken.

const MOST_TURNS = 150; // of the body, that are followed

function shakenStart(place) {
  const value = (name) => coordinateAt(name, place);
  const [depths, lags] = ["depth", "lag"].map((kind) => [1, 2, 3].map((i) => value(`${kind}${i}`)));
  const start = { moments: MOMENTS.map(value), axis: value("axis"), omega0: value("omega0"), epsilon: state.epsilon ?? value("epsilon"), phase: value("phase") };
  const turn = (2 * Math.PI) / Math.abs(start.omega0);
  const rate = theMap.columns.growth_rate?.at(place);
  const length = Math.max(20 * turn, Math.min(MOST_TURNS * turn, rate > 0 ? (2 * Math.log(2 / start.epsilon)) / rate : 0));
  return { ...start, shaken: { depths, lags, frequency: value("frequency"), inverse: theMap.inverse, length } };
}

function shakenInWords(place) {
  const { regime, growth_rate: rate } = theMap.columns;
  const [growth, period] = [rate.at(place), (2 * Math.PI) / coordinateAt("frequency", place)];
  const word = regime.text(regime.at(place));
  const spun = `${word[0].toUpperCase()}${word.slice(1)}. Spun about axis ${coordinateAt("axis", place)}, its moments changed every ${timeText(period)}`;
  return growth > 0 ? `${spun}: perturbations grow by a factor ${numberText(Math.exp(growth * period), 3)} per period.` : `${spun}: perturbations stay bounded.`;
}

const part = {
  ...BODIES,
  color: "regime",
  start: shakenStart,
  kept: { epsilon: perturbationFromLink },
  opening: () => (state.epsilon ??= 0.05),
  grows: ({ name }) => /^(growth|exponent_real)/.test(name),
  say: shakenInWords,
  spoken: () => shakenInWords(state.place),
  shown: MOTION_SHOWN,
  build: buildMotion,
};
