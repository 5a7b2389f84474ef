// Bodies that lose energy: when the flat spin comes, in one sentence, and the motion until then.

const MOST_ROTATIONS = 300; // that are followed

/** The start of the map: L = I1 ω0 at from_angle from the axis of least inertia. */
function losingStart(place) {
  const value = (name) => coordinateAt(name, place);
  const [angle, phase, omega0, loss] = ["from_angle", "phase", "omega0", "loss"].map(value);
  const moments = MOMENTS.map(value).sort((a, b) => a - b);
  const sides = [Math.cos(angle), Math.sin(angle) * Math.cos(phase), Math.sin(angle) * Math.sin(phase)];
  const most = (MOST_ROTATIONS * 2 * Math.PI) / omega0;
  const length = Math.min(1.05 * theMap.columns.settling_time.at(place) || most, most);
  const shaken = { depths: [0, 0, 0], lags: [0, 0, 0], frequency: omega0, loss, length };
  return { moments, omega0, omega: sides.map((side, i) => (moments[0] * omega0 * side) / moments[i]), shaken };
}

function losingInWords(place) {
  const [crossing, settling] = ["crossing_time", "settling_time"].map((name) => theMap.columns[name].at(place));
  if (!Number.isFinite(settling)) return sentenceOf(place);
  const sense = { positive: " in the positive sense", negative: " in the negative sense" }[theMap.columns.final_sense.text(theMap.columns.final_sense.at(place))];
  const name = theMap.coordinates.body ? coordinateAt("body", place) : "This body";
  return `${name} passes the energy of its intermediate axis after ${timeText(crossing)} and is in a flat spin${sense ?? ""} after ${timeText(settling)}, if the loss is the same for all wobbles.`;
}

const part = { ...BODIES, say: losingInWords, spoken: () => losingInWords(state.place), start: losingStart, shown: MOTION_SHOWN, build: buildMotion };
