// The eigenvalues of the chosen point in the plane: measured with their errors, and theory's as rings around them.

const PARTS = ["eigenvalue_real", "eigenvalue_imag"];

/** Measured, error and theory of every eigenvalue at the chosen place: [real, imaginary] each. */
function spectrum() {
  const all = theMap.coordinates.eigenvalue.values.map((number, eigenvalue) => {
    const of = (suffix) => PARTS.map((name) => theMap.columns[`${name}${suffix}`]?.at(placeWith({ eigenvalue })) ?? NaN);
    return { number, measured: of(""), error: of("_error"), theory: of("_theory") };
  });
  return all.filter(({ measured, theory }) => [...measured, ...theory].some(Number.isFinite));
}

/** a ± b i as people write it. */
function complexText([real, imaginary], digits = 5) {
  const sign = imaginary < 0 ? "−" : "+";
  return `${numberText(real, digits)} ${sign} ${numberText(Math.abs(imaginary), digits)} i`;
}

const FATES = { asymptotically_stable: "stable", flutter: "unstable, by flutter" }; // others read as they are called

/** What the rightmost eigenvalue means. */
function spectrumInWords(values) {
  const known = values.filter(({ measured }) => measured.every(Number.isFinite));
  if (known.length === 0) return missingInWords(state.place);
  const { regime } = theMap.columns;
  const meaning = regime?.meanings.get(regime.at(state.place));
  const word = FATES[meaning] ?? (meaning ? flagText(meaning) : "");
  const named = theMap.coordinates.equilibrium?.values.length > 1 ? namedPlace("equilibrium", state.place) : "equilibrium";
  const [growth, turning] = known.reduce((top, { measured }) => (measured[0] > top[0] ? measured : top), [-Infinity, 0]);
  const round = Math.abs(turning) > 1e-9 * Math.abs(growth) ? `, oscillating with period ${timeText((2 * Math.PI) / Math.abs(turning))}` : "";
  const slow = Math.max(...known.map(({ measured }) => Math.hypot(...measured))) * 1e-9;
  const fate = Math.abs(growth) <= slow ? "perturbations neither grow nor decay" : growth > 0 ? `perturbations grow by a factor e in ${timeText(1 / growth)}${round}` : `the slowest mode decays by a factor e in ${timeText(-1 / growth)}${round}`;
  return `${word ? `The ${named} is ${word}` : "Here"}: ${fate}.`;
}

function spectrumTraces(values) {
  const { regime } = theMap.columns;
  const at = regime ? regime.at(state.place) : null;
  const color = regime ? inkOf(flagColor(regime.meanings.get(at), regime.flags.findIndex(({ value }) => value === at))) : pageColor("accent");
  const pick = (kind, k) => values.map((one) => one[kind][k]);
  const bars = (k) => ({ type: "data", array: pick("error", k).map((e) => (Number.isFinite(e) ? e : 0)), color, thickness: 1.2, width: 4 });
  const text = values.map(({ number, measured, error, theory }) => `${number}: ${complexText(measured)}<br>± ${numberText(error[0], 2)}, ± ${numberText(error[1], 2)}<br>theory ${complexText(theory)}`);
  const rings = { type: "scatter", mode: "markers", name: "theory", x: pick("theory", 0), y: pick("theory", 1), marker: { symbol: "circle-open", size: 16, color: pageColor("ink"), line: { width: 1.6 } }, hoverinfo: "skip" };
  const dots = { type: "scatter", mode: "markers", name: "measured, with error", x: pick("measured", 0), y: pick("measured", 1), error_x: bars(0), error_y: bars(1), marker: { color, size: 8 }, text, hovertemplate: "%{text}<extra></extra>" };
  const alone = values.find(({ number }) => number === state.mode);
  const chosen = { type: "scatter", mode: "markers", name: "its mode is shown alone", x: [alone?.measured[0]], y: [alone?.measured[1]], marker: { symbol: "diamond-open", size: 24, color: pageColor("accent"), line: { width: 2 } }, hoverinfo: "skip" };
  return alone ? [rings, dots, chosen] : [rings, dots];
}

/** Room around what is drawn; an axis along which all is zero to rounding gets that of the other. */
function spectrumRanges(values) {
  const reach = [0, 1].map((k) => Math.max(...values.flatMap(({ measured, theory, error }) => [Math.abs(measured[k]) + (error[k] || 0), Math.abs(theory[k])].filter(Number.isFinite)), 0));
  const most = Math.max(...reach) || 1;
  return reach.map((one) => 1.25 * (one > 1e-6 * most ? one : 0.2 * most)).map((one) => [-one, one]);
}

function drawSpectrum() {
  const values = spectrum();
  document.getElementById("spectrum-words").textContent = spectrumInWords(values);
  for (const id of ["spectrum-plot", "spectrum-table"]) document.getElementById(id).hidden = values.length === 0;
  if (values.length === 0) return;
  const [x, y] = spectrumRanges(values);
  const zero = { zeroline: true, zerolinecolor: pageColor("quiet"), zerolinewidth: 1.4, exponentformat: "power" };
  const unit = unitText(theMap.columns.eigenvalue_real.units);
  const side = { type: "rect", xref: "x", yref: "paper", x0: 0, x1: x[1], y0: 0, y1: 1, fillcolor: pageColor("bad"), opacity: 0.5, line: { width: 0 }, layer: "below" };
  const label = { x: 1, y: 1, xref: "paper", yref: "paper", xanchor: "right", yanchor: "top", text: "grows", showarrow: false, font: { size: 12 } };
  const layout = { height: 320, margin: { l: 64, r: 12, t: 8, b: 44 }, showlegend: true, legend: { orientation: "h", y: -0.26 }, hovermode: "closest", dragmode: false, shapes: [side], annotations: [label] };
  const axes = { xaxis: { title: { text: `real part (${unit})` }, range: x, ...zero }, yaxis: { title: { text: `imaginary part (${unit})` }, range: y, ...zero } };
  draw("spectrum-plot", spectrumTraces(values), { ...layout, ...axes }, { displayModeBar: false });
  showTable("spectrum-table", () => spectrumTable(values));
}

function spectrumTable(values) {
  const both = ([a, b]) => `${numberText(a, 2)}, ${numberText(b, 2)}`;
  const rows = values.map(({ number, measured, error, theory }) => [String(number), complexText(measured, 6), both(error), complexText(theory, 6)]);
  return [["eigenvalue", "measured (s⁻¹)", "errors of both parts (s⁻¹)", "theory (s⁻¹)"], rows];
}

function buildSpectrum() {
  if (!theMap.order.includes("eigenvalue") || !PARTS.every((name) => theMap.columns[name])) return;
  document.getElementById("spectrum").hidden = false;
  drawSpectrum();
  onChange(atRest(drawSpectrum));
  document.getElementById("spectrum-plot").on("plotly_click", ({ points: [{ curveNumber, pointNumber }] }) => {
    const { number } = spectrum()[pointNumber];
    if (curveNumber < 2) choose({ mode: number === state.mode ? null : number, place: placeWith({ eigenvalue: number - 1 }) });
  });
}
