// Sampled and listed points over two of their coordinates, coloured by one variable, and its histogram.

const MAX_DOTS = 5000; // shapes that a browser draws without delay
const BINS = 50;

const pointNumber = () => theMap.order.indexOf("point");

/** Return the points as dots: place, two coordinates, value. */
function cloudDots() {
  const [column, k] = [chosenColumn(), pointNumber()];
  const place = [...state.place];
  const values = (name) => (name ? theMap.coordinates[name].values : null);
  const [x, y] = [values(state.x), values(state.y)];
  const margin = theMap.existence;
  return Array.from({ length: sizeOf("point") }, (_, i) => {
    place[k] = i;
    return { x: x ? x[i] : i, y: y ? y[i] : 0, value: column.at(place), exists: !margin || !(margin.at(place) < 0), place: [...place] };
  });
}

/** Return a fixed random subset of at most `most` of the numbers 0 … n - 1, in order (Knuth, TAOCP 3.4.2, algorithm S). */
function randomSubset(n, most) {
  let seed = 1;
  const kept = [];
  for (let i = 0; i < n; i++) {
    seed = (Math.imul(seed, 1664525) + 1013904223) >>> 0;
    if ((seed / 2 ** 32) * (n - i) < most - kept.length) kept.push(i);
  }
  return kept;
}

function drawCloud() {
  const column = chosenColumn();
  const dots = cloudDots();
  const shown = randomSubset(dots.length, MAX_DOTS).map((i) => dots[i]);
  theMap.shownDots = shown;
  const scale = colorScale(column, dots.map((dot) => dot.value), dots.map((dot) => dot.exists));
  const marker = { size: shown.length > 1000 ? 4 : 6, symbol: shown.map((dot) => (dot.exists ? "circle" : "x-thin-open")), color: shown.map((dot) => (Number.isFinite(dot.value) ? scale.z(dot.value) : null)), cmin: scale.zmin, cmax: scale.zmax, colorscale: scale.colorscale, showscale: false, line: { width: 0.4, color: pageColor("quiet") } };
  const points = { type: "scatter", mode: "markers", x: shown.map((dot) => dot.x), y: shown.map((dot) => dot.y), marker, hoverinfo: "none" };
  theMap.dots = dots;
  const target = document.getElementById("map");
  const touch = matchMedia("(pointer: coarse)").matches;
  const axes = { xaxis: cloudAxis(state.x), yaxis: state.y ? cloudAxis(state.y) : { visible: false } };
  const layout = { ...axes, height: mapHeight(target), showlegend: false, hovermode: "closest", uirevision: [state.x, state.y].join(), dragmode: touch ? false : "zoom" };
  draw(target, [points, ...(part.guides?.() ?? [])], layout);
  markDot();
  const few = shown.length < dots.length ? ` ${shown.length} of the ${dots.length} points, chosen at random, are drawn.` : "";
  document.getElementById("map-summary").textContent = `${column.longName}: ${cloudInWords(column, dots)}${few}`;
  drawLegend(column, dots.map((dot) => dot.value), scale);
  drawHistogram(column, dots, document.getElementById("histogram"), "points");
  showTable("map-table", () => cloudTable(column, shown));
}

function markDot() {
  const { x, y } = theMap.dots[state.place[pointNumber()]];
  markPoint([x, y]);
}

function cloudInWords(column, dots) {
  const possible = dots.filter((dot) => dot.exists);
  const impossible = dots.length - possible.length;
  return `${valuesInWords(column, (possible.length > 0 ? possible : dots).map((dot) => dot.value))}.${impossible > 0 ? ` ${impossible} points, crossed, are physically impossible.` : ""}`;
}

function cloudAxis(name) {
  const values = Float64Array.from(theMap.coordinates[name].values).sort();
  const [low, middle, high] = [values[0], values[values.length >> 1], values[values.length - 1]];
  return { title: { text: dimensionLabel(name) }, type: low > 0 && high > 30 * low && middle < 0.2 * high ? "log" : "linear", showgrid: false, exponentformat: "power" };
}

/** Draws how many dots (named `what`) have which value. */
function drawHistogram(column, dots, target, what) {
  const values = dots.map((dot) => dot.value).filter(Number.isFinite);
  const [x, y, color] = column.isFlag ? flagBars(column, values) : numberBars(values);
  const words = column.longName.replace(/ \([^)]*\)$/, ""); // the list of colours has the explanation in brackets
  const title = column.isFlag ? words : labelled(words, column.units);
  const trace = { type: "bar", x, y, marker: { color: color ?? pageColor("accent") }, hovertemplate: `%{y} ${what}<extra></extra>` };
  const xaxis = { title: { text: title }, exponentformat: "power", showgrid: false };
  draw(target, [trace], { xaxis, yaxis: { title: { text: what } }, height: 220, bargap: column.isFlag ? 0.3 : 0, showlegend: false });
}

function flagBars(column, values) {
  const used = column.flags.map((flag, i) => [flagText(flag.meaning), values.filter((value) => value === flag.value).length, flagColor(flag.meaning, i)]).filter(([, n]) => n > 0);
  return [0, 1, 2].map((k) => used.map((bar) => bar[k]));
}

/** Return bars between the percentiles 0.5 and 99.5; the outermost bars include all values beyond. */
function numberBars(values) {
  const sorted = Float64Array.from(values).sort();
  if (sorted.length === 0) return [[], []];
  const low = quantile(sorted, 0.005);
  const step = (quantile(sorted, 0.995) - low || Math.abs(low) || 1) / BINS;
  const counts = new Array(BINS).fill(0);
  for (const value of sorted) counts[Math.max(0, Math.min(BINS - 1, Math.floor((value - low) / step)))]++;
  return [counts.map((_, i) => low + (i + 0.5) * step), counts];
}

function cloudTable(column, dots) {
  const names = [state.x, state.y].filter(Boolean);
  const row = ({ place, value }) => [pointText(place), ...names.map((name) => numberText(coordinateAt(name, place), 4)), column.text(value)];
  return [["point", ...names.map(dimensionLabel), column.longName], dots.slice(0, MAX_TABLE_LENGTH).map(row)];
}

function buildCloud() {
  const target = document.getElementById("map");
  document.getElementById("legend").before(element("div", { id: "histogram", role: "group", "aria-label": "histogram" }));
  drawCloud();
  const dotOf = (event) => event.points.filter((point) => point.curveNumber === 0).map((point) => theMap.shownDots[point.pointNumber])[0];
  target.on("plotly_hover", (event) => dotOf(event) && showTip(tipLines(chosenColumn(), { ...dotOf(event), exists: true }), event.event));
  target.on("plotly_unhover", () => showTip(null));
  for (const event of ["plotly_relayout", "plotly_afterplot"]) target.on(event, markDot);
  target.on("plotly_click", (event) => dotOf(event) && choose({ place: dotOf(event).place }));
  const step = (right, up) => choose({ place: placeWith({ point: Math.max(0, Math.min(sizeOf("point") - 1, state.place[pointNumber()] + right + up)) }) });
  onArrows(target, step, goToPart);
  onChange(drawCloud);
}
