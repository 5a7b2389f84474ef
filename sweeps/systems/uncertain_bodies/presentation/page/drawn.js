// The draws of the chosen body: on the inertia triangle, or over any two of their numbers, and how they are distributed.

const SHAPE = ["I1/I3", "I2/I3"];
const VIEW = 0.3; // least width of the picture of the triangle
const ROOM = 2.2; // widths of the cloud in it, so that the nearest boundary is seen beside it

/** Numbers in single precision, as the page's facts pack them. */
function unpackedNumbers({ scale, values }) {
  const numbers = new Float32Array(decodeBase64(values).buffer);
  return Float64Array.from(numbers, (value) => value * scale);
}

/** Which spin of its body a place is. */
function spinNumber(place) {
  return theMap.dims.reduce((at, { name, size }, k) => (name === "body" ? at : at * size + place[k]), 0);
}

function drawColumn(described, values) {
  const meanings = new Map(described.flags.map(({ value, meaning }) => [value, meaning]));
  const isFlag = meanings.size > 0;
  const text = (value) => (isFlag ? flagText(meanings.get(value) ?? String(value)) : withUnit(value, described.units, 5));
  return { ...described, isFlag, meanings, text, values: isFlag ? values.map(Math.round) : values };
}

/** Name → column over the draws of the chosen body in its chosen spin; null where the page has none. */
function drawsOf(place) {
  const body = theMap.drawn.bodies?.[coordinateAt("body", place)];
  if (!body || theMap.dims.some(({ size, of }) => size < of)) return null;
  const columns = theMap.drawn.columns.map((described) => {
    const rows = body.columns[`${described.name}_draw`];
    return drawColumn(described, unpackedNumbers(rows[rows.length > 1 ? spinNumber(place) : 0]));
  });
  const named = Object.fromEntries(columns.map((column) => [column.name, column]));
  const ratios = SHAPE.map((name) => {
    const values = named[name.slice(0, 2)].values.map((value, i) => value / named.I3.values[i]);
    return drawColumn({ name, longName: `ratio of moments ${name}`, units: "", flags: [] }, values);
  });
  return { body, columns: Object.fromEntries([...ratios, ...columns].map((column) => [column.name, column])) };
}

/** What is drawn over what: a link's choice where there is such a number. */
function drawnChoice(columns) {
  const numbers = Object.values(columns).filter((column) => !column.isFlag).map((column) => column.name);
  const or = (name, usual) => (numbers.includes(name) ? name : usual);
  const [across, up] = [or(state.across, SHAPE[0]), or(state.up, SHAPE[1])];
  const told = columns[state.told] ? state.told : columns.growth_rate ? "growth_rate" : up;
  return { across, up, told };
}

/** From the least to the greatest of a cloud along each side, with room around it; on the triangle as wide as high. */
function drawnRanges(sides, onTriangle) {
  const ends = sides.map(({ values }) => {
    const finite = Float64Array.from(values).filter(Number.isFinite).sort();
    return finite.length > 0 ? [finite[0], finite[finite.length - 1]] : [0, 1];
  });
  const halves = ends.map(([low, high]) => 0.55 * (high - low) || 0.05 * Math.abs(high) || 1);
  const half = 0.5 * Math.max(VIEW, ...ends.map(([low, high]) => ROOM * (high - low)));
  return ends.map(([low, high], k) => [-1, 1].map((sign) => (low + high) / 2 + sign * (onTriangle ? half : halves[k])));
}

function drawDrawn() {
  const found = drawsOf(state.place);
  for (const id of ["drawn", "distribution"]) document.getElementById(id).hidden = !found;
  theMap.draws = found;
  if (!found) return;
  const { columns } = found;
  const choice = drawnChoice(columns);
  const [x, y] = [columns[choice.across], columns[choice.up]];
  const onTriangle = x.name === SHAPE[0] && y.name === SHAPE[1];
  const ranges = drawnRanges([x, y], onTriangle);
  const axis = coordinateAt("axis", state.place);
  const at = drawnNumber(found);
  const ring = { type: "scatter", mode: "markers", name: "chosen", x: [x.values[at]], y: [y.values[at]], marker: { size: 15, symbol: "circle-open", color: pageColor("ink"), line: { width: 2.5 } }, hoverinfo: "skip" };
  const target = document.getElementById("drawn-plot");
  const touch = matchMedia("(pointer: coarse)").matches;
  const side = (column, range) => ({ title: { text: labelled(symbolText(column.name), column.units) }, range, showgrid: false, zeroline: false, exponentformat: "power" });
  const yaxis = { ...side(y, ranges[1]), ...(onTriangle ? { scaleanchor: "x", constrain: "domain" } : {}) };
  const layout = { xaxis: { ...side(x, ranges[0]), constrain: "domain" }, yaxis, height: innerWidth > 860 ? 380 : 340, showlegend: false, hovermode: "closest", dragmode: touch ? false : "zoom", uirevision: [coordinateAt("body", state.place), x.name, y.name].join() };
  const under = onTriangle ? stabilityRegions(axis, Math.max(...ranges.flat())) : [];
  draw(target, [drawnDots(columns, x, y), ...under, ring], layout);
  fillDrawnWords(found, axis, onTriangle, at);
  const told = columns[choice.told];
  drawHistogram({ ...told, longName: symbolText(told.name) }, Array.from(told.values, (value) => ({ value })), document.getElementById("drawn-histogram"), "draws");
  showTable("drawn-table", () => drawnTable(found));
  showDrawnControls(choice);
}

function drawnDots(columns, x, y) {
  const { regime } = columns;
  const tint = (value) => inkOf(flagColor(regime.meanings.get(value), 0));
  const color = regime ? Array.from(regime.values, tint) : pageColor("ink");
  const lines = (i) => Object.values(columns).map((column) => `${column.name} = ${column.text(column.values[i])}`);
  const text = Array.from(x.values, (_, i) => lines(i).join("<br>"));
  return { type: "scatter", mode: "markers", name: "draws", x: Array.from(x.values), y: Array.from(y.values), marker: { size: 4, color, opacity: 0.75 }, text, hovertemplate: "%{text}<extra></extra>" };
}

/** The draw that is marked: by its number in the map where the map holds it. */
function drawnNumber({ body }) {
  const at = body.numbers.length ? body.numbers.indexOf(state.draw) : state.draw;
  return Number.isInteger(at) && at >= 0 && at < body.shown ? at : 0;
}

function drawnName({ body }, i) {
  return body.numbers.length ? body.numbers[i] : i;
}

function fillDrawnWords(found, axis, onTriangle, at) {
  const { body, columns } = found;
  const few = body.shown < body.of ? `${body.shown.toLocaleString("en")} of the ${body.of.toLocaleString("en")} draws` : `All ${body.of.toLocaleString("en")} draws`;
  const source = theMap.drawn.measured
    ? `${few}, as measured${columns.regime ? ", coloured by regime" : ""}.`
    : `${body.shown.toLocaleString("en")} samples regenerated for display (${body.of.toLocaleString("en")} were measured).`;
  const ground = onTriangle ? ` Shading: linear theory, spin about axis ${axis}; orange: ${regionWord(true)} (intermediate axis), blue: ${regionWord(false)}. Hatched: physically impossible.` : "";
  document.getElementById("drawn-note").textContent = `${source}${ground} Click a dot, or use the arrow keys, to mark a draw.`;
  const told = Object.values(columns).map((column) => `${symbolText(column.name)} = ${column.text(column.values[at])}`).join(", ");
  document.getElementById("drawn-chosen").textContent = `Draw ${drawnName(found, at)}: ${told}`;
}

/** A probability in per cent with as many digits as its error has one of, "75.0 ± 0.6 %"; of no hit or no miss, its bound of 95 %. */
function shareText(value, error) {
  const bound = 100 * 1.96 * error;
  if (value === 0) return `less than ${numberText(bound, 2)} % (95 % confidence)`;
  if (value === 1) return `more than ${(100 - bound).toFixed(Math.max(0, Math.min(6, 1 - Math.floor(Math.log10(bound)))))} % (95 % confidence)`;
  const decimals = error > 0 ? Math.max(0, Math.min(6, -Math.floor(Math.log10(100 * error)))) : 2;
  return `${(100 * value).toFixed(decimals)} ± ${(100 * error).toFixed(decimals)} %`;
}

/** How likely the spin is lost, and how sure that is. */
function outlookInWords(place) {
  const told = (name) => [theMap.columns[name]?.at(place), theMap.columns[`${name}_error`]?.at(place)];
  const [unstable, flips] = ["probability_unstable", "probability_flip"].map(told);
  if (!Number.isFinite(unstable[0]) || !Number.isFinite(unstable[1])) return sentenceOf(place);
  const draws = theMap.columns.draws?.at(place);
  const of = draws ? ` (${draws.toLocaleString("en")} draws)` : "";
  const body = coordinateAt("body", place);
  const also = Number.isFinite(flips[0]) && flips[0] > 0 ? `, and the body flips with a probability of ${shareText(...flips)}` : "";
  return `Spun about axis ${coordinateAt("axis", place)}, ${body} is unstable with a probability of ${shareText(...unstable)}${also}${of}.`;
}

function drawnTable(found) {
  const columns = Object.values(found.columns);
  const rows = spacedIndices(found.body.shown, MAX_TABLE_LENGTH).map((i) => [String(drawnName(found, i)), ...columns.map((column) => column.text(column.values[i]))]);
  return [["draw", ...columns.map((column) => column.longName)], rows];
}

const DRAWN_SIDES = { across: ["x axis", "drawn-controls"], up: ["y axis", "drawn-controls"], told: ["of", "histogram-controls"] };

function showDrawnControls(choice) {
  for (const [key, [label, bar]] of Object.entries(DRAWN_SIDES)) {
    let select = document.querySelector(`#${bar} [data-key=${key}] select`);
    if (!select) {
      const able = Object.values(theMap.draws.columns).filter((column) => key === "told" || !column.isFlag);
      const control = selectBox(label, able.map((column) => [column.name, symbolText(column.name)]), choice[key], (name) => choose({ [key]: name }));
      control.dataset.key = key;
      document.getElementById(bar).append(control);
      select = control.querySelector("select");
    }
    select.value = choice[key];
  }
}

function buildDrawn() {
  const target = document.getElementById("drawn-plot");
  drawDrawn();
  const mark = (i) => choose({ draw: drawnName(theMap.draws, i) });
  if (theMap.draws) target.on("plotly_click", ({ points }) => points[0].curveNumber === 0 && mark(points[0].pointNumber));
  onArrows(target, (right, up) => theMap.draws && mark(Math.max(0, Math.min(theMap.draws.body.shown - 1, drawnNumber(theMap.draws) + right + up))));
  onChange(drawDrawn);
}
