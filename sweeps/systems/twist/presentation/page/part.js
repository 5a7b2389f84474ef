// The part of thrown bodies: how they come down, in one sentence.

function twistInWords(place) {
  const [twist, time] = ["twist", "time_of_turn"].map((name) => {
    const measured = theMap.columns[name]?.at(place);
    return Number.isFinite(measured) ? measured : theMap.columns[`${name}_exact`]?.at(place) ?? NaN;
  });
  if (!Number.isFinite(twist)) return sentenceOf(place);
  const name = theMap.coordinates.body ? coordinateAt("body", place) : "this body";
  const degrees = Math.abs((180 * twist) / Math.PI);
  const turned = Math.round(degrees / 180) % 2 === 1;
  const face = turned ? "the other face is up" : "the same face is up";
  return `Per revolution of its handle${Number.isFinite(time) ? `, in ${timeText(time)},` : ""} ${name} twists by ${numberText(degrees, 4)}°: ${face}.`;
}

const part = { say: twistInWords, coordinates: addRatios, guides: triangle };
