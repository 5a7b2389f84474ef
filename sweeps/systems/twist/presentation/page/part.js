// The part of thrown bodies: how they come down, in one sentence, and the throw itself.

/** One revolution of the handle: L = I2 ω0 is at chi from the intermediate axis, theta from the least. */
function throwOf(place) {
  const value = (name) => coordinateAt(name, place);
  const moments = MOMENTS.map(value).sort((a, b) => a - b);
  const [chi, theta, L] = [value("chi"), value("theta"), moments[1] * value("omega0")];
  const sides = [Math.cos(theta), Math.sin(theta) * Math.cos(chi), Math.sin(theta) * Math.sin(chi)];
  const end = measuredOrExact("time_of_turn", place);
  return { moments, axis: 2, omega0: value("omega0"), omega: sides.map((side, i) => (L * side) / moments[i]), end };
}

function twistInWords(place) {
  const [twist, time] = ["twist", "time_of_turn"].map((name) => measuredOrExact(name, place));
  if (!Number.isFinite(twist)) return sentenceOf(place);
  const name = theMap.coordinates.body ? coordinateAt("body", place) : "this body";
  const degrees = Math.abs((180 * twist) / Math.PI);
  const turned = Math.round(degrees / 180) % 2 === 1;
  const face = turned ? "the other face is up" : "the same face is up";
  return `Per revolution of its handle${Number.isFinite(time) ? `, in ${timeText(time)},` : ""} ${name} twists by ${numberText(degrees, 4)}°: ${face}.`;
}

const part = { ...BODIES, say: twistInWords, spoken: () => twistInWords(state.place), start: throwOf, shown: MOTION_SHOWN, build: buildMotion };
