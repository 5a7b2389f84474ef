// Where equilibria are over the parameter across the map: a bifurcation shows as one curve that becomes three.

const REGIME_LINES = { stable: "solid", unstable: "dash", marginal: "dot" };

/** Columns of places that move along a parameter. */
function movingPlaces(name) {
  const moves = (column) => theMap.coordinates.equilibrium.values.some((_, slot) => {
    const values = theMap.coordinates[name].values.map((_, i) => column.at(placeWith({ [name]: i, equilibrium: slot }))).filter(Number.isFinite);
    return values.length > 1 && Math.max(...values) - Math.min(...values) > 1e-6 * Math.max(...values.map(Math.abs));
  });
  return Object.values(theMap.columns).filter((column) => column.name.endsWith("_equilibrium") && moves(column));
}

/** What a regime says of all modes together: unstable if one is. */
function regimeOfAll(column, place) {
  const m = theMap.order.indexOf("mode");
  const words = (theMap.coordinates.mode?.values ?? [1]).map((_, mode) => column.meanings.get(column.at(place.map((at, d) => (d === m ? mode : at)))));
  return ["undetermined", "unstable", "marginal", "stable"].find((word) => words.includes(word));
}

/** The equilibria along a parameter: slot, place in the map, value, coordinate, regimes by theory and as measured, and whether it is undecided. */
function restingPlaces(name, column) {
  const { regime_theory: theory, regime, status } = theMap.columns;
  return theMap.coordinates.equilibrium.values.map((slot, s) => ({
    slot,
    points: ascending(name).map((i) => {
      const place = placeWith({ [name]: i, equilibrium: s });
      return { place, x: theMap.coordinates[name].values[i], rests: column.at(place), theory: regimeOfAll(theory, place), measured: regimeOfAll(regime, place), undecided: status?.meanings.get(status.at(place)) === "equilibrium_undecided" };
    }),
  }));
}

function placesTraces(resting) {
  const lines = resting.flatMap(({ slot, points }) => Object.entries(REGIME_LINES).map(([regime, dash]) => {
    const y = points.map((point, i) => {
      const near = [points[i - 1], point, points[i + 1]].filter(Boolean).some((one) => one.theory === regime);
      return near && (point.theory === regime || regime === "stable") && Number.isFinite(point.rests) ? point.rests : null;
    });
    return { type: "scatter", mode: "lines", name: `${slot}, theory: ${flagText(regime)}`, x: points.map((point) => point.x), y, line: { color: pageColor("ink"), width: 1.3, dash }, hoverinfo: "skip", showlegend: false };
  })).filter(({ y }) => y.some((value) => value !== null));
  const { regime } = theMap.columns;
  const dots = regime.flags.map((flag, i) => {
    const points = resting.flatMap(({ slot, points }) => points.filter((point) => point.measured === flag.meaning && Number.isFinite(point.rests)).map((point) => ({ ...point, slot })));
    return { type: "scatter", mode: "markers", name: flagText(flag.meaning), x: points.map((point) => point.x), y: points.map((point) => point.rests), customdata: points.map((point) => point.place), text: points.map((point) => `${point.slot}: ${flagText(point.measured)}, theory ${flagText(point.theory)}`), hovertemplate: "%{text}<br>%{x:.4g}: %{y:.4g}<extra></extra>", marker: { color: inkOf(flagColor(flag.meaning, i)), size: 6 } };
  }).filter(({ x }) => x.length > 0);
  return [...lines, ...dots];
}

function drawPlaces() {
  const section = document.getElementById("places");
  const able = movingPlaces(state.x);
  section.hidden = able.length === 0;
  if (section.hidden) return;
  const select = document.getElementById("places-of");
  const chosen = able.find((column) => column.name === select.value) ?? able[0];
  select.replaceChildren(...able.map((column) => element("option", { value: column.name, textContent: column.longName, selected: column === chosen })));
  select.parentElement.hidden = able.length < 2;
  const resting = restingPlaces(state.x, chosen);
  const undecided = resting[0].points.filter((_, i) => resting.some(({ points }) => points[i].undecided)).length;
  const open = undecided > 0 ? ` (undecided at ${undecided} of ${resting[0].points.length} values)` : "";
  const beside = placeText(state.place, [state.x, "equilibrium", "mode"]);
  document.getElementById("places-over").textContent = `${theMap.coordinates[state.x].longName}${beside ? `, at ${beside}` : ""}${open}`;
  const here = { type: "scatter", mode: "markers", name: "chosen", showlegend: false, x: [coordinateAt(state.x, state.place)], y: [chosen.at(state.place)], marker: { size: 15, symbol: "circle-open", color: pageColor("ink"), line: { width: 2.5 } }, hoverinfo: "skip" };
  const yaxis = { title: { text: labelled(symbolText(chosen.name.replace(/_equilibrium$/, "")), chosen.units) }, exponentformat: "power" };
  const layout = { height: 380, showlegend: true, legend: { orientation: "h", y: -0.25 }, hovermode: "closest", dragmode: false, xaxis: axisOf(state.x, theMap.coordinates[state.x].values), yaxis };
  draw("places-plot", [...placesTraces(resting), here], layout);
  showTable("places-table", () => placesTable(resting, chosen));
}

function placesTable(resting, chosen) {
  const heads = [dimensionLabel(state.x), ...resting.map(({ slot }) => flagText(String(slot)))];
  const rows = spacedIndices(resting[0].points.length, 30).map((i) => [numberText(resting[0].points[i].x, 4), ...resting.map(({ points }) => (Number.isFinite(points[i].rests) ? `${chosen.text(points[i].rests)}, ${flagText(points[i].measured)}` : points[i].undecided ? "undecided" : "–"))]);
  return [heads, rows];
}

function buildPlaces() {
  const { regime_theory: theory, regime } = theMap.columns;
  if (!theory || !regime || !theMap.order.includes("equilibrium") || !state.x) return;
  const target = document.getElementById("places-plot");
  const late = whenSeen(document.getElementById("part"), () => {
    drawPlaces();
    target.removeAllListeners?.("plotly_click");
    target.on?.("plotly_click", ({ points }) => points[0].customdata && choose({ place: points[0].customdata }));
  });
  document.getElementById("places-of").onchange = drawPlaces;
  late();
  onChange(atRest(late));
}
