// Small oscillations: the motion of one mode, where equilibria are, and where linear theory ends.

const part = {
  choices: signedRate,
  nudges: { along: "epsilon", over: {} },
  kept: { nudge: (text) => (Number(text) > 0 && Number(text) < 1 ? Number(text) : null) },
  opening: () => (state.nudge ??= 0.3), // large enough to be seen
  say: (place) => (theMap.columns.omega_squared ? sentenceOfMode(document.getElementById("mode-words").textContent) : sentenceOf(place)),
  build() {
    buildMode();
    buildMechanism();
    buildPlaces();
    buildNudges();
  },
};
