// The symmetric top: the body turning, from the closed form.

/** A symmetric top in units of I1: the angular velocity stands at the half-angle to the figure axis, axis 3. */
function topStart(place) {
  const value = (name) => coordinateAt(name, place);
  const degrees = theMap.coordinates.half_angle.units.startsWith("deg");
  const angle = value("half_angle") * (degrees ? Math.PI / 180 : 1);
  const sizeInWords = `angle between ω and the figure axis ${numberText((angle * 180) / Math.PI, 3)}°`;
  return { moments: [1, 1, value("ratio")], axis: 3, omega0: value("omega3"), epsilon: Math.tan(angle), phase: 0, sizeInWords };
}

const part = { start: topStart, shown: MOTION_SHOWN, say: () => motion.words, build: buildMotion };
