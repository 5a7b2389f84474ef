// Relative equilibria: the eigenvalues of the chosen point, and the motion of their modes.

/** The eigenvalues whose modes are shown together: those that grow, else all; one of each pair. */
function ratesShown() {
  const rates = spectrum().map(({ measured }) => measured).filter(([, imaginary]) => imaginary >= 0);
  const least = 1e-6 * Math.max(...rates.map((rate) => Math.hypot(...rate)));
  const growing = rates.filter(([growth]) => growth > least);
  return growing.length > 0 ? growing : rates;
}

const part = {
  color: "regime",
  grows: ({ name }) => /^(growth_rate|eigenvalue_real)/.test(name),
  ...MODES,
  opening: () => (state.epsilon ??= 0.1),
  rates: ratesShown,
  say: (place) => (PARTS.every((name) => theMap.columns[name]) ? spectrumInWords(spectrum()) : sentenceOf(place)),
  build() {
    buildSpectrum();
    buildMode();
  },
};
