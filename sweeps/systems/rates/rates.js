// For systems with a signed square of a rate: that rate, and its deviation from theory over the size of the perturbation.
//
// Their `part.limit` has the dimension of the sizes, `along`, and the dimensions of the curves, `over`: name → words for
// that choice, and the name of a curve at one of its values.

/** Columns that follow from those of the map: the signed rate, above 0 oscillating, below 0 growing. */
function signedRate() {
  const square = theMap.columns.omega_squared;
  if (!square) return [];
  const at = (place) => {
    const value = square.at(place);
    return Math.sign(value) * Math.sqrt(Math.abs(value));
  };
  const text = (value) => withUnit(value, "rad s-1", square.digits);
  return [{ name: "signed_rate", longName: "measured rate (positive: frequency, negative: growth rate)", units: "s-1", at, text, flags: [] }];
}

const MIN_SIZES = 6;
const DASHES = ["solid", "dash", "dot", "dashdot", "longdash", "longdashdot"];
const SYMBOLS = ["circle", "square", "diamond", "cross", "triangle-up", "x"];

/** |r/r_theory − 1| of the rate r = sign(Ω²) √|Ω²|; NaN if the rate is 0 in theory. */
function rateDeviation(place) {
  const { omega_squared: measured, omega_squared_theory: theory } = theMap.columns;
  const [value, expected] = [measured.at(place), theory.at(place)];
  if (expected === 0) return NaN;
  const ratio = value / expected;
  return Math.abs(Math.sign(ratio) * Math.sqrt(Math.abs(ratio)) - 1);
}

/** One curve for each value of the selected dimension; a single one without such a dimension. */
function limitCurves() {
  const { along, over } = part.limit;
  const chosen = document.getElementById("limit-over").value;
  const order = ascending(along);
  const names = chosen ? theMap.coordinates[chosen].values : [""];
  return names.map((name, i) => {
    const y = order.map((j) => rateDeviation(placeWith({ [along]: j, ...(chosen ? { [chosen]: i } : {}) })));
    const ink = inkOf(theMap.seriesColors[i % theMap.seriesColors.length]);
    return { type: "scatter", mode: "lines+markers", name: chosen ? over[chosen].curve(name) : "rate", x: order.map((j) => theMap.coordinates[along].values[j]), y: y.map((v) => (v > 0 ? v : null)), line: { color: ink, width: 1.6, dash: DASHES[Math.floor(i / 7) % 6] }, marker: { color: ink, size: 6, symbol: SYMBOLS[i % 6] } };
  });
}

function drawLimit() {
  const curves = limitCurves().filter((curve) => curve.y.some((value) => value !== null));
  const sizes = theMap.coordinates[part.limit.along].values;
  const [low, high] = [Math.min(...sizes), Math.max(...sizes)];
  const law = { type: "scatter", mode: "lines", name: "ε²", x: [low, high], y: [low ** 2, high ** 2], line: { color: pageColor("quiet"), width: 1, dash: "dash" }, hoverinfo: "skip" };
  const target = document.getElementById("limit-plot");
  const narrow = target.clientWidth < 520;
  const legend = narrow ? { orientation: "h", y: -0.3 } : {};
  const layout = { height: narrow ? 480 : 420, showlegend: true, legend, hovermode: "closest", dragmode: matchMedia("(pointer: coarse)").matches ? false : "zoom", xaxis: { type: "log", title: { text: "perturbation ε" }, exponentformat: "power" }, yaxis: { type: "log", title: { text: "|rate/theory − 1|" }, exponentformat: "power", range: [-16, 0.5] } };
  draw(target, [...curves, law], layout);
  document.getElementById("limit-summary").textContent = limitInWords(curves);
}

function limitInWords(curves) {
  const parts = curves.map((curve) => {
    const at = curve.y.findIndex((value) => value > 0.01);
    return at >= 0 ? `${curve.name}: deviates by 1 % from ε = ${numberText(curve.x[at], 2)}` : `${curve.name}: within 1 % everywhere`;
  });
  return parts.join("; ") + ".";
}

function buildLimit() {
  const section = document.getElementById("limit");
  const { omega_squared: measured, omega_squared_theory: theory } = theMap.columns;
  const { along, over: choices } = part.limit;
  if (!theMap.order.includes(along) || sizeOf(along) < MIN_SIZES || !measured || !theory) return;
  section.hidden = false;
  const over = document.getElementById("limit-over");
  const able = Object.keys(choices).filter((name) => theMap.order.includes(name) && sizeOf(name) > 1);
  for (const name of able) over.append(element("option", { value: name, textContent: choices[name].words }));
  over.parentElement.hidden = able.length < 2;
  const draw = whenSeen(document.getElementById("limit-plot"), drawLimit);
  over.onchange = drawLimit;
  draw();
  onChange(draw);
}
