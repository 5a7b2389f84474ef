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

/** The sides of the inertia triangle, and where its two lesser moments are equal. */
function triangle() {
  if (state.x !== "I1/I3" || state.y !== "I2/I3") return [];
  const line = (x, y, dash) => ({ type: "scatter", mode: "lines", x, y, line: { color: pageColor("quiet"), width: 1.5, dash }, hoverinfo: "skip" });
  return [line([0, 1, 1, 0], [1, 0, 1, 1], "solid"), line([0.5, 1], [0.5, 1], "dot")];
}
