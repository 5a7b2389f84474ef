// Motions of systems that are periodic in time: the perturbed motion beside the unperturbed one.

function periodicInWords(place) {
  const { regime, growth_per_period: growth } = theMap.columns;
  const value = growth?.at(place);
  if (!regime || !Number.isFinite(value)) return missingInWords(place);
  const word = regime.text(regime.at(place));
  return `${word[0].toUpperCase()}${word.slice(1)}: perturbations ${value > 1e-9 ? `grow by a factor ${numberText(Math.exp(value), 3)} per period` : value < -1e-9 ? `decay by a factor ${numberText(Math.exp(-value), 3)} per period` : "stay bounded"}.`;
}

const part = {
  color: "regime",
  grows: ({ name }) => /^(growth|exponent_real)/.test(name),
  ...MODES,
  rates: () => null,
  say: periodicInWords,
  build: buildMode,
};
