// Small oscillations: the motion of one mode, and where linear theory ends.

const part = {
  choices: signedRate,
  build() {
    buildNudges();
    buildMode();
  },
};
