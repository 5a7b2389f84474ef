// The rigid body: theory's boundaries on the plane, the body turning, and where linear theory ends.

function bodyStart(place) {
  const value = (name) => coordinateAt(name, place);
  const start = { moments: state.moments ?? MOMENTS.map(value), axis: value("axis"), omega0: state.spin ?? value("omega0"), epsilon: state.epsilon ?? (state.moments ? LARGE_ENOUGH : value("epsilon")), phase: value("phase") };
  if (state.days != null) return losingStart(start, state.days);
  return state.shaken ? { ...start, shaken: shaking(start) } : start;
}

/** Where linear theory has Ω² = 0 about the axis: I_a = I_b and I_a = I_c. */
function boundaries(xEdges, yEdges) {
  if (theMap.table || [state.x, state.y].includes("axis")) return [];
  const axis = coordinateAt("axis", state.place);
  if (theMap.order.includes("thickness")) return axis === 3 ? [] : equalLesserMoments(xEdges);
  const a = MOMENTS[axis - 1];
  const partners = MOMENTS.filter((name) => name !== a);
  return partners.flatMap((partner) => boundary([a, partner], xEdges, yEdges));
}

/** On a grid of shapes, I1 = I2: where x = I1/I3 and thickness t have x (2 - t) = 1; the other boundaries are its edges. */
function equalLesserMoments(xEdges) {
  const curves = { I1_over_I3: (x) => 2 - 1 / x, thickness: (t) => 1 / (2 - t) }; // the other of the two, on the boundary
  if (!(state.x in curves)) return [];
  const ends = [xEdges[0], xEdges[xEdges.length - 1]];
  const along = Array.from({ length: 101 }, (_, i) => ends[0] + ((ends[1] - ends[0]) * i) / 100);
  const up = slanted()?.up ?? ((_, y) => y);
  const points = along.map((x) => [x, curves[state.x](x)]).filter(([x, y]) => y >= 0 && y <= 1 && x <= 1).map(([x, y]) => [x, up(x, y)]);
  if (!(state.y in curves) || points.length < 2) return [];
  const at = points[Math.floor(0.55 * points.length)];
  return [boundaryLine(points.map(([x]) => x), points.map(([, y]) => y), `${symbolText("I1")} = ${symbolText("I2")}`, { x: at[0], y: at[1] })];
}

function boundary(pair, xEdges, yEdges) {
  const [xEnds, yEnds] = [xEdges, yEdges].map((edges) => [edges[0], edges[edges.length - 1]]);
  const other = (name) => coordinateAt(pair.find((one) => one !== name), state.place);
  const inside = ([low, high], value) => low < value && value < high;
  const name = [...pair].sort().map(symbolText).join(" = ");
  if (pair.includes(state.x) && pair.includes(state.y)) {
    const [low, high] = [Math.max(xEnds[0], yEnds[0]), Math.min(xEnds[1], yEnds[1])];
    if (low >= high) return [];
    const points = Array.from({ length: 101 }, (_, i) => low + ((high - low) * i) / 100);
    return [boundaryLine(points, points, name, { x: points[88], y: points[88] })];
  }
  if (pair.includes(state.x) && inside(xEnds, other(state.x))) {
    return [boundaryLine([other(state.x), other(state.x)], yEnds, name, { x: other(state.x), y: yEnds[1], above: true })];
  }
  if (pair.includes(state.y) && inside(yEnds, other(state.y))) {
    return [boundaryLine(xEnds, [other(state.y), other(state.y)], name, { x: xEnds[1], y: other(state.y) })];
  }
  return [];
}

/** In the first plane, about any axis, the point that grows fastest for its spin among bodies that can exist. */
function mostUnstable() {
  const rate = theMap.columns.growth_rate;
  const margin = theMap.existence;
  if (!rate) return state.place;
  const names = theMap.order.filter((name) => [state.x, state.y, "axis", "body"].includes(name) && sizeOf(name) > 1);
  const growth = (place) => (margin && margin.at(place) < 0 ? 0 : rate.at(place) / Math.abs(coordinateAt("omega0", place)));
  return bestPlace(names, (place) => growth(place) || NaN);
}

const part = {
  ...BODIES,
  choices: signedRate,
  start: bodyStart,
  kept: { epsilon: perturbationFromLink, moments: momentsOfLink, spin: spinOfLink, named: (text) => text },
  refusal: refusalOfLink,
  shown: { ...MOTION_SHOWN, axisOutcome, tiltAfter },
  hides: ["omega0", "epsilon"],
  limit: {
    along: "epsilon",
    over: {
      axis: { words: "the axes of the chosen body", curve: (axis) => `axis ${axis}` },
      body: { words: "all bodies about the chosen axis", curve: (name) => name },
    },
  },
  boundaries,
  shownAt: () => (state.moments ? placeOfBody(state.moments) : null),
  pointName: () => (state.moments ? state.named ?? "your body" : "selected"),
  isBox: () => givesBox() || theMap.presets.some(({ name, mass }) => mass && name === state.named),
  drag: dragBody,
  adjust: backToTheMap,
  between,
  aside: (place) => (state.epsilon ? `; measured at ε = ${numberText(coordinateAt("epsilon", place), 2)}, the motion is drawn at ε = ${numberText(state.epsilon, 2)}` : ""),
  landmarks: namedBodies,
  lecture: lectureOfBodies,
  leave: endLecture,
  begin: () => motion.end && (seek(0), motion.player.set(true)),
  first: () => (theMap.start.whole ? state.place : mostUnstable()),
  opening: () => (state.epsilon ??= LARGE_ENOUGH),
  say: () => motion.words,
  spoken: losingInWords,
  buildTable: buildBodies,
  build() {
    buildLimit();
    buildMotion();
    buildOwn();
    buildThree();
  },
};
