// Small oscillations: the motion of one mode, and where linear theory ends.

const part = {
  choices: signedRate,
  nudges: { along: "epsilon", over: {} },
  build() {
    buildNudges();
    buildMode();
  },
};
