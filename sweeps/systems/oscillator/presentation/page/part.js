// Small oscillations: the motion of one mode, where equilibria are, and where linear theory ends.

/** The eigenvalue of the chosen mode; zero where the map calls it marginal, for then its sign means nothing. */
function ratesOfSquare() {
  const { omega_squared: column, regime } = theMap.columns;
  const marginal = regime?.meanings.get(regime.at(state.place)) === "marginal";
  const square = marginal ? 0 : column.at(state.place);
  return [square < 0 ? [Math.sqrt(-square), 0] : [0, Math.sqrt(square)]];
}

const part = {
  choices: signedRate,
  limit: { along: "epsilon", over: {} },
  ...MODES,
  rates: ratesOfSquare,
  say: (place) => (theMap.columns.omega_squared ? sentenceOfMode() : sentenceOf(place)),
  build() {
    buildMode();
    buildPlaces();
    buildLimit();
  },
};
