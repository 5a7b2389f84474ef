// Relative equilibria: the eigenvalues of the chosen point.

const part = {
  color: "regime",
  grows: ({ name }) => /^(growth_rate|eigenvalue_real)/.test(name),
  say: (place) => (PARTS.every((name) => theMap.columns[name]) ? spectrumInWords(spectrum()) : sentenceOf(place)),
  build: buildSpectrum,
};
