// How far the draws spread: quantiles of what was measured, about every axis, and which input matters.

function spreadNames() {
  return Object.keys(theMap.spread).filter((name) => name.endsWith("_quantile"));
}

/** The row of a variable at a place, and its errors; the place's number counts all dimensions of the points. */
function spreadAt(name, place) {
  const at = theMap.dims.reduce((sum, { size }, k) => sum * size + place[k], 0);
  return [theMap.spread[name]?.[at], theMap.spread[`${name}_error`]?.[at]].map((row) => row ?? []);
}

const SPREADS = {
  growth_rate_quantile: "growth rate (s⁻¹)", frequency_quantile: "angular frequency (rad s⁻¹)",
  flip_period_quantile: "time between two flips (s)", max_tilt_quantile: "largest tilt (rad)", twist_quantile: "twist (rad)",
};

function spreadWords(name) {
  return SPREADS[name] ?? name.replaceAll("_", " ");
}

/** One line for each axis: the share of the draws that do not exceed a value. */
function drawSpread() {
  const chosen = document.querySelector("#spread-controls select").value;
  const axes = theMap.coordinates.axis.values;
  const traces = axes.map((axis, j) => {
    const [values, errors] = spreadAt(chosen, placeWith({ axis: j }));
    const color = inkOf(theMap.seriesColors[j % theMap.seriesColors.length]);
    const array = values.map((_, i) => errors[i] ?? 0);
    return { type: "scatter", mode: "lines+markers", name: `axis ${axis}`, x: values, y: theMap.levels.map((level) => 100 * level), error_x: { type: "data", array, color, thickness: 1.2, width: 4 }, line: { color, width: axis === coordinateAt("axis", state.place) ? 2 : 1.5, dash: DASHES_OF_AXES[j % 3] }, marker: { color, size: 7 } };
  });
  const layout = { xaxis: { title: { text: spreadWords(chosen) }, exponentformat: "power" }, yaxis: { title: { text: "fraction of the draws (%)" }, range: [0, 100] }, height: 300, showlegend: true, legend: { orientation: "h", y: 1.15 } };
  draw("spread-plot", traces, layout);
  const cell = ([values, errors], i) => (values[i] === null || values[i] === undefined ? "–" : `${numberText(values[i], 4)}${errors[i] === null || errors[i] === undefined ? "" : ` ± ${numberText(errors[i], 2)}`}`);
  const rows = spreadNames().map((name) => [spreadWords(name), ...theMap.levels.map((_, i) => cell(spreadAt(name, state.place), i))]);
  fillTable(document.getElementById("spread-table"), [`spun about axis ${coordinateAt("axis", state.place)}`, ...theMap.levels.map((level) => `${100 * level} % quantile`)], rows);
}

const DASHES_OF_AXES = ["solid", "dash", "dot"];

function drawMatters() {
  const kinds = { sensitivity_first: "first order", sensitivity_total: "total" };
  const all = Object.keys(kinds).map((name) => spreadAt(name, state.place));
  const at = theMap.inputs.map((_, i) => i).filter((i) => all.some(([values]) => values[i] !== null && values[i] !== undefined));
  document.getElementById("matters").hidden = at.length === 0;
  if (at.length === 0) return;
  const inputs = at.map((i) => symbolText(theMap.inputs[i]));
  const traces = Object.values(kinds).map((name, k) => {
    const [values, errors] = all[k].map((row) => at.map((i) => row[i] ?? 0));
    const color = inkOf(theMap.seriesColors[k]);
    return { type: "bar", name, x: inputs, y: values, marker: { color, pattern: { shape: k ? "/" : "" } }, error_y: { type: "data", array: errors, color: pageColor("ink"), thickness: 1.2, width: 4 } };
  });
  const layout = { xaxis: {}, yaxis: { title: { text: "fraction of the variance" } }, height: 260, barmode: "group", showlegend: true, legend: { orientation: "h", y: 1.18 } };
  draw("matters-plot", traces, layout);
  const cell = (k, i) => `${numberText(all[k][0][i], 3)} ± ${numberText(all[k][1][i], 2)}`;
  fillTable(document.getElementById("matters-table"), ["input", ...Object.values(kinds)], at.map((i) => [symbolText(theMap.inputs[i]), cell(0, i), cell(1, i)]));
}

function buildSpread() {
  const names = spreadNames();
  if (names.length === 0) return;
  for (const id of ["spread", "matters"]) document.getElementById(id).hidden = false;
  document.getElementById("spread-controls").append(selectBox("of", names.map((name) => [name, spreadWords(name)]), names[0], drawSpread));
  for (const [id, drawn] of [["spread", drawSpread], ["matters", drawMatters]]) {
    const late = whenSeen(document.getElementById(id), drawn);
    late();
    onChange(late);
  }
}
