// Relative equilibria: the eigenvalues of the chosen point, and the motion of their modes.

/** The eigenvalue that the reader has chosen; else those that grow, else all, one of each pair: their modes are shown together. */
function ratesShown() {
  const chosen = spectrum().find(({ number }) => number === state.mode);
  if (chosen) return [chosen.measured];
  const rates = spectrum().map(({ measured }) => measured).filter(([, imaginary]) => imaginary >= 0);
  const least = 1e-6 * Math.max(...rates.map((rate) => Math.hypot(...rate)));
  const growing = rates.filter(([growth]) => growth > least);
  return growing.length > 0 ? growing : rates;
}

/** A choice of an eigenvalue alone is one of its mode. */
function chooseMode(changes) {
  const k = theMap.order.indexOf("eigenvalue");
  if (changes.place && k >= 0 && changes.place[k] !== state.place[k]) changes.mode = theMap.coordinates.eigenvalue.values[changes.place[k]];
}

const part = {
  color: "regime",
  grows: ({ name }) => /^(growth_rate|eigenvalue_real)/.test(name),
  ...MODES,
  kept: { ...MODES.kept, mode: (text) => theMap.coordinates.eigenvalue?.values.find((number) => String(number) === text) ?? null },
  adjust: chooseMode,
  opening: () => (state.epsilon ??= 0.1),
  rates: ratesShown,
  say: (place) => (PARTS.every((name) => theMap.columns[name]) ? spectrumInWords(spectrum()) : sentenceOf(place)),
  build() {
    buildSpectrum();
    buildMode();
  },
};
