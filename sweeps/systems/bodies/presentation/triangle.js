// Bodies on a plane of their moments: which are possible, where one between the cells stands, shapes on the triangle.

const MOMENTS = ["I1", "I2", "I3"];

/** On a grid of shapes I2/I3 is upwards, so that the plane is the triangle of all bodies. */
function slanted() {
  if (state.x !== "I1_over_I3" || state.y !== "thickness") return null;
  const clip = (value) => Math.max(0, Math.min(1, value));
  return { label: "I₂/I₃", up: (x, t) => 1 - x * (1 - t), down: (x, y) => 1 - (1 - y) / x, clip };
}

/** Moments at a point of the plane; null where none of its sides is a moment. */
function momentsAt(X, Y) {
  if (slanted()) return [X, Y, 1];
  const sides = { [state.x]: X, [state.y]: Y };
  if (!MOMENTS.some((name) => name in sides)) return null;
  return MOMENTS.map((name) => sides[name] ?? coordinateAt(name, state.place));
}

function possible(X, Y) {
  const moments = momentsAt(X, Y);
  return !moments || isPossible(moments);
}

/** Outlines of what no body can be, in a rectangle of the plane: beyond the lines where one moment is the others' sum. */
function impossible(xEdges, yEdges) {
  const [[left, right], [low, high]] = [xEdges, yEdges].map((edges) => [edges[0], edges[edges.length - 1]]);
  if (!momentsAt(left, low)) return [];
  const corners = [[left, low], [right, low], [right, high], [left, high]];
  return [0, 1, 2].flatMap((a) => {
    const excess = (corner) => momentsAt(...corner).reduce((sum, I, i) => sum + (i === a ? -I : I), 0);
    const outline = dense(cut(corners, excess));
    return outline.length > 0 ? [{ x: outline.map(([x]) => x), y: outline.map(([, y]) => y) }] : [];
  });
}

/** A closed outline with points along its edges, which a logarithmic side bends. */
function dense(corners) {
  return corners.flatMap((corner, i) => {
    const next = corners[(i + 1) % corners.length];
    return Array.from({ length: 33 }, (_, k) => corner.map((value, d) => value + (k / 32) * (next[d] - value)));
  });
}

/** Where a body with any moments stands on the plane: it is scaled to the moment that the plane does not show. */
function placeOfBody(moments) {
  if (slanted()) return [moments[0] / moments[2], moments[1] / moments[2]];
  const sides = [state.x, state.y].map((name) => MOMENTS.indexOf(name));
  if (sides.some((i) => i < 0)) return null;
  const third = 3 - sides[0] - sides[1];
  const scale = coordinateAt(MOMENTS[third], state.place) / moments[third];
  return sides.map((i) => scale * moments[i]);
}

const RATIOS = { "I1/I3": "I1", "I2/I3": "I2" };

/** Ratios of moments as coordinates, where the points are bodies: on the inertia triangle all shapes are. */
function addRatios() {
  const moments = MOMENTS.map((name) => theMap.coordinates[name]);
  if (moments.some((one) => !one || (one.dim !== "point" && one.values.length > 1))) return;
  const at = (one, i) => one.values[one.dim === "point" ? i : 0];
  for (const [name, moment] of Object.entries(RATIOS)) {
    const values = Array.from({ length: sizeOf("point") }, (_, i) => at(theMap.coordinates[moment], i) / at(moments[2], i));
    theMap.coordinates[name] = { dim: "point", values, numeric: true, whole: false, units: "", longName: `ratio of moments ${name}`, comment: "", flags: [] };
    theMap.cloud.push(name);
  }
  theMap.start.plane = Object.keys(RATIOS);
}

const REACH = 1.05; // of the farthest ratio, where shapes without an end are cut off

/** Shapes over (I1/I3, I2/I3) by which moment is the middle one (0: no body), as corners, cut off at `most`. */
function shapeRegions(most) {
  const far = 2 * most + 2;
  const regions = [
    [2, [[0.5, 0.5], [0, 1], [1, 1]]], [1, [[0.5, 0.5], [1, 0], [1, 1]]], // I3 the greatest
    [3, [[0, 1], [1, 1], [1, 2]]], [3, [[1, 0], [1, 1], [2, 1]]],
    [1, [[1, 1], [1, 2], [far, far + 1], [far, far]]], [2, [[1, 1], [2, 1], [far + 1, far], [far, far]]], // I3 the least
    [0, [[0, 0], [0, 1], [1, 0]]], [0, [[0, 1], [0, far + 1], [far, far + 1]]], [0, [[1, 0], [far + 1, 0], [far + 1, far]]],
  ];
  return regions.map(([middle, corners]) => ({ middle, corners: [0, 1].reduce((left, k) => cut(left, (corner) => corner[k] - most), corners) })).filter(({ corners }) => corners.length > 2);
}

/** A polygon's part where something linear is not above zero. */
function cut(corners, excess) {
  return corners.flatMap((corner, i) => {
    const before = corners[(i + corners.length - 1) % corners.length];
    const [now, was] = [excess(corner), excess(before)];
    const edge = now <= 0 === was <= 0 ? [] : [before.map((value, d) => value + (was / (was - now)) * (corner[d] - value))];
    return now <= 0 ? [...edge, corner] : edge;
  });
}

function regionWord(isMiddle) {
  return flagText(isMiddle ? "unstable" : "stable");
}

/** Where theory has a spin about an axis (if any) stable and where not, beneath a cloud of shapes; hatched: no body. */
function stabilityRegions(axis, most) {
  return shapeRegions(most).map(({ middle, corners }) => {
    const closed = [...corners, corners[0]];
    const look = middle === 0
      ? { fillpattern: { shape: "/", size: 7, solidity: 0.16, fgcolor: "#7b8087", bgcolor: "rgba(0,0,0,0)" }, fillcolor: "rgba(0,0,0,0)" }
      : { fillcolor: axis === null ? "rgba(0,0,0,0)" : `${flagColor(middle === axis ? "unstable" : "stable", 0)}${middle === axis ? "38" : "1f"}` };
    const [x, y] = [0, 1].map((k) => closed.map((corner) => corner[k]));
    return { type: "scatter", mode: "lines", x, y, fill: "toself", ...look, line: { color: pageColor("quiet"), width: 0.8 }, hoverinfo: "skip", zorder: -1 };
  });
}

/** The stability regions of the chosen axis, where the picture is over both ratios. */
function triangle() {
  if (state.x !== "I1/I3" || state.y !== "I2/I3") return [];
  const most = Math.max(1, ...Object.keys(RATIOS).map((name) => theMap.coordinates[name].values.reduce((a, b) => Math.max(a, b), 0)));
  const axis = theMap.coordinates.axis ? coordinateAt("axis", state.place) : null;
  return stabilityRegions(axis, REACH * most);
}

/** A number as it was measured, else as the closed form has it. */
function measuredOrExact(name, place) {
  const measured = theMap.columns[name]?.at(place);
  return Number.isFinite(measured) ? measured : theMap.columns[`${name}_exact`]?.at(place) ?? NaN;
}

/** What all pages of bodies share: the plane's limits, and the triangle under points. */
const BODIES = { slanted, possible, impossible, coordinates: addRatios, guides: triangle };
