// The part of tumbling bodies: how they tumble, in one sentence.

const TUMBLING = { sam: ["short-axis mode", "greatest"], lam: ["long-axis mode", "least"] }; // mode → words, moment encircled
const RESTING = {
  impossible: "This energy is outside the range of the body.",
  principal: "It rotates about a principal axis.",
  separatrix: "It is on the separatrix and approaches rotation about the intermediate axis for ever.",
};

/** A number as it was measured, else as the closed form has it. */
function measuredOrExact(name, place) {
  const measured = theMap.columns[name]?.at(place);
  return Number.isFinite(measured) ? measured : theMap.columns[`${name}_exact`]?.at(place) ?? NaN;
}

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

const part = { say: tumblingInWords, coordinates: addRatios, guides: triangle };
