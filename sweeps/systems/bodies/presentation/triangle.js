// Points that are bodies: their shapes on the inertia triangle.

const RATIOS = { "I1/I3": "I1", "I2/I3": "I2" };

/** Ratios of moments as coordinates, where the points are bodies: on the inertia triangle all shapes are. */
function addRatios() {
  const moments = ["I1", "I2", "I3"].map((name) => theMap.coordinates[name]);
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
  return regions.map(([middle, corners]) => ({ middle, corners: cutOff(cutOff(corners, 0, most), 1, most) })).filter(({ corners }) => corners.length > 2);
}

/** A polygon's part whose coordinate k is not above `most`. */
function cutOff(corners, k, most) {
  return corners.flatMap((corner, i) => {
    const before = corners[(i + corners.length - 1) % corners.length];
    const [inside, was] = [corner[k] <= most, before[k] <= most];
    const share = (most - before[k]) / (corner[k] - before[k]);
    const edge = inside === was ? [] : [before.map((value, d) => value + share * (corner[d] - value))];
    return inside ? [...edge, corner] : edge;
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
