// The part of tumbling bodies: how they tumble, in one sentence, and the motion itself.

const TUMBLING = { sam: ["short-axis mode", "greatest"], lam: ["long-axis mode", "least"] }; // mode → words, moment encircled
const RESTING = {
  impossible: "This energy is outside the range of the body.",
  principal: "It rotates about a principal axis.",
  separatrix: "It is on the separatrix and approaches rotation about the intermediate axis for ever.",
};

function tumblingInWords(place) {
  const mode = theMap.columns.mode ?? theMap.columns.mode_exact;
  const meaning = mode?.meanings.get(mode.at(place));
  const [words, moment] = TUMBLING[meaning] ?? [];
  const [round, body] = ["period_phi_encircled", "period_psi"].map((name) => measuredOrExact(name, place));
  if (!words || !Number.isFinite(round) || !Number.isFinite(body)) return RESTING[meaning] ?? sentenceOf(place);
  const name = theMap.coordinates.body ? coordinateAt("body", place) : "This body";
  const tilt = theMap.columns.tilt_mean?.at(place);
  const off = Number.isFinite(tilt) ? ` (mean nutation angle ${numberText((180 * tilt) / Math.PI, 3)}°)` : "";
  return `${name} tumbles in ${words}: its axis of ${moment} inertia precesses about L${off} with mean period ${timeText(round)}; the angular velocity has period ${timeText(body)} in the body.`;
}

/** The start of the map: L = I3 ω0, no spin about the intermediate axis; null for an energy that the body cannot have. */
function tumblingStart(place) {
  const value = (name) => coordinateAt(name, place);
  const [I1, I2, I3] = MOMENTS.map(value).sort((a, b) => a - b);
  const [E, omega0] = [value("energy"), value("omega0")];
  const least = Math.sqrt(((E - 1) * I1) / (I3 - I1 || 1));
  const greatest = Math.sqrt((I3 - E * I1) / (I3 - I1 || 1));
  if (!Number.isFinite(least) || !Number.isFinite(greatest)) return null;
  return { moments: [I1, I2, I3], omega0, omega: [(omega0 * least * I3) / I1, 0, omega0 * greatest] };
}

const part = {
  ...BODIES,
  say: tumblingInWords,
  spoken: () => tumblingInWords(state.place),
  start: tumblingStart,
  marks: () => [["P_ψ", "period_psi"], ["P_φ", "period_phi_encircled"]].map(([name, column]) => [name, measuredOrExact(column, state.place)]),
  shown: MOTION_SHOWN,
  build: buildMotion,
};
