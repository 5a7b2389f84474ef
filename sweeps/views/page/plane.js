// The map itself: a plane of two dimensions (or a curve over one), coloured by one variable, with theory on top.

/** Indices of a dimension in the order of its values. */
function ascending(name) {
  const values = theMap.coordinates[name].values;
  return values.map((_, i) => i).sort((a, b) => values[a] - values[b]);
}

function chosenColumn() {
  return theMap.choices.find((choice) => choice.name === state.color);
}

/** The plane as rows of places, values and whether what they are of can exist. */
function planeCells() {
  const [xs, ys] = [state.x, state.y].map((name) => (name ? ascending(name) : [null]));
  const column = chosenColumn();
  const margin = theMap.existence;
  const [kx, ky] = [state.x, state.y].map((name) => theMap.order.indexOf(name));
  const place = [...state.place];
  const cells = ys.map((j) => xs.map((i) => {
    if (kx >= 0) place[kx] = i;
    if (ky >= 0) place[ky] = j;
    return { value: column.at(place), exists: !margin || !(margin.at(place) < 0), place: [...place] };
  }));
  const values = (name, order) => (name ? order.map((i) => theMap.coordinates[name].values[i]) : []);
  return { cells, x: values(state.x, xs), y: values(state.y, ys), column };
}

/** As high as what stands beside it, or nearly square. */
function mapHeight(target) {
  const beside = document.querySelector(".explorer.turns") && innerWidth > 860;
  return beside ? Math.max(300, Math.min(520, innerHeight - 330)) : Math.min(innerWidth > 860 ? 560 : 380, Math.max(300, target.clientWidth * 0.8));
}

/** The plane as it is drawn: each cell where what follows from both sides is upwards, as fine as the plane itself. */
function slantedCells(plane, slant) {
  if (!slant) return plane;
  const [xEdges, yEdges] = [cellEdges(plane.x), cellEdges(plane.y).map((edge) => slant.clip(edge))];
  const ends = xEdges.map((edge) => slant.clipAcross(edge)).flatMap((x) => [yEdges[0], yEdges[yEdges.length - 1]].map((y) => slant.up(x, y)));
  const [low, high] = [Math.min(...ends), Math.max(...ends)];
  const n = Math.max(SLANTED_ROWS, plane.y.length);
  const y = Array.from({ length: n }, (_, k) => low + ((k + 0.5) / n) * (high - low));
  const [last, rows] = [yEdges[yEdges.length - 1], plane.x.map(() => 0)]; // of each column the row that is reached
  const cells = y.map((shown) => plane.x.map((x, i) => {
    const at = slant.down(x, shown);
    while (rows[i] < plane.y.length - 1 && yEdges[rows[i] + 1] <= at) rows[i] += 1;
    const cell = plane.cells[rows[i]][i];
    return yEdges[0] <= at && at <= last ? cell : { value: NaN, exists: slant.clip(at) === at, place: cell.place };
  }));
  return { ...plane, cells, y };
}

const SLANTED_ROWS = 80; // at least: some five pixels each

function drawPlane() {
  const own = planeCells();
  theMap.slant = part.slanted?.() ?? null;
  const plane = slantedCells(own, theMap.slant);
  [theMap.plane, theMap.own] = [plane, own];
  const target = document.getElementById("map");
  theMap.brief = headlines();
  const drawn = state.y ? heatmap(plane, own) : curve(plane);
  plane.scale = drawn.scale;
  const size = { height: mapHeight(target) };
  const view = [state.x, state.y].join();
  const touch = matchMedia("(pointer: coarse)").matches;
  draw(target, drawn.traces, { ...drawn.layout, ...size, showlegend: false, hovermode: "closest", uirevision: view, dragmode: touch ? false : "zoom" });
  document.getElementById("map-summary").textContent = planeSummary(own);
  drawLegend(plane);
  if (document.getElementById("map-table").open) fillPlaneTable(own);
}

function axisOf(name, values) {
  return { title: { text: dimensionLabel(name) }, type: isLogarithmic(values) ? "log" : "linear", showgrid: false, exponentformat: "power" };
}

function rangeOf(edges, type) {
  const ends = [edges[0], edges[edges.length - 1]];
  return type === "log" ? ends.map(Math.log10) : ends;
}

function heatmap({ cells, x, y, column }, own) {
  const flat = cells.flat();
  const scale = colorScale(column, flat.map((cell) => cell.value), flat.map((cell) => cell.exists));
  const [xEdges, yEdges] = [cellEdges(x), cellEdges(y)];
  const z = cells.map((row) => row.map((cell) => (Number.isFinite(cell.value) ? scale.z(cell.value) : null)));
  const text = cells.map((row) => row.map(() => ""));
  const base = { type: "heatmap", x: xEdges, y: yEdges, z, text, hovertemplate: "%{text}<extra></extra>", hoverongaps: true };
  const colors = { zmin: scale.zmin, zmax: scale.zmax, colorscale: scale.colorscale, showscale: false };
  const layout = { xaxis: axisOf(state.x, x), yaxis: axisOf(state.y, y) };
  if (theMap.slant) layout.yaxis.title = { text: theMap.slant.label };
  layout.xaxis.range = rangeOf(xEdges, layout.xaxis.type);
  layout.yaxis.range = rangeOf(yEdges, layout.yaxis.type);
  const lines = part.boundaries?.(xEdges, yEdges) ?? [];
  layout.annotations = [...regionNames(cells, x, y), ...lines.map((line) => line.label)];
  return { scale, traces: [{ ...base, ...colors }, ...hatch(cells, xEdges, yEdges), ...lines.flatMap((line) => line.traces), mark(own)], layout };
}

const MOST_LOOKED_AT = 2500; // cells, more tell no better where a name has room

/** The leading flag's meanings, each written where its region has most room. */
function regionNames(all, xs, ys) {
  const step = Math.ceil(Math.sqrt((all.length * all[0].length) / MOST_LOOKED_AT));
  const thin = (list) => (step === 1 ? list : list.filter((_, k) => k % step === 0));
  const [cells, x, y] = [thin(all).map(thin), thin(xs), thin(ys)];
  const flag = Object.values(theMap.columns).find((column) => column.role === "headline" && column.isFlag);
  if (!flag || cells.length < 6 || cells[0].length < 6) return [];
  const values = cells.map((row) => row.map((cell) => (cell.exists ? flag.at(cell.place) : null)));
  const room = roomOf(values);
  const [mi, mj] = chosenCell(xs, ys).map((k) => k / step);
  const hides = (i, j) => Math.abs(i - mi) < 0.14 * cells[0].length && Math.abs(j - mj) < 0.07 * cells.length; // the chosen cell
  const best = new Map();
  room.forEach((row, j) => row.forEach((free, i) => {
    const value = values[j][i];
    if (value !== null && !hides(i, j) && free > (best.get(value)?.free ?? 0)) best.set(value, { free, i, j });
  }));
  const log = (values, value) => (isLogarithmic(values) ? Math.log10(value) : value);
  const least = 0.06 * Math.min(cells.length, cells[0].length);
  return [...best].filter(([, at]) => at.free > least).map(([value, { i, j }]) => {
    const text = flagText(flag.meanings.get(value) ?? "").replace(", ", "<br>");
    const xanchor = i < 0.15 * x.length ? "left" : i > 0.85 * x.length ? "right" : "center";
    return { x: log(x, x[i]), y: log(y, y[j]), xanchor, text, showarrow: false, font: { size: 12, color: "#1a1a1a" }, bgcolor: "rgba(255,255,255,0.72)", borderpad: 2 };
  });
}

/** How many cells away the nearest cell of another value, or the edge, is. */
function roomOf(values) {
  const [rows, columns] = [values.length, values[0].length];
  const room = values.map((row) => row.map(() => Infinity));
  const look = (j, i, steps) => {
    for (const [dj, di] of steps) {
      const [v, u] = [j + dj, i + di];
      const inside = v >= 0 && u >= 0 && v < rows && u < columns;
      room[j][i] = Math.min(room[j][i], inside && values[v][u] === values[j][i] ? room[v][u] + 1 : 1);
    }
  };
  const before = [[-1, -1], [-1, 0], [-1, 1], [0, -1]];
  const after = before.map(([dj, di]) => [-dj, -di]);
  for (let j = 0; j < rows; j++) for (let i = 0; i < columns; i++) look(j, i, before);
  for (let j = rows - 1; j >= 0; j--) for (let i = columns - 1; i >= 0; i--) look(j, i, after);
  return room;
}

function tooltip(column, cell) {
  const sides = [state.x, state.y].filter(Boolean).map((name) => `${symbolText(name)} = ${coordinateText(name, coordinateAt(name, cell.place))}`);
  if (theMap.slant) sides.push(`${theMap.slant.label} = ${numberText(theMap.slant.up(...[state.x, state.y].map((name) => coordinateAt(name, cell.place))), 6)}`);
  const lines = [...sides, `${column.name} = ${column.text(cell.value)}`];
  for (const one of theMap.brief ?? []) {
    const [measured, theory] = headlineTexts(one, cell.place);
    if (one !== column) lines.push(`${one.name} = ${measured}${theory ? ` (theory ${theory})` : ""}`);
  }
  return [...lines, ...(cell.exists ? [] : ["physically impossible"])].join("<br>");
}

/** Hatching over the cells of what cannot exist: runs of cells of each row, one outline each. */
function hatch(cells, xEdges, yEdges) {
  const [x, y] = [[], []];
  cells.forEach((row, j) => {
    for (let i = 0; i < row.length; i++) {
      if (row[i].exists) continue;
      const first = i;
      while (i < row.length && !row[i].exists) i++;
      x.push(xEdges[first], xEdges[i], xEdges[i], xEdges[first], xEdges[first], null);
      y.push(yEdges[j], yEdges[j], yEdges[j + 1], yEdges[j + 1], yEdges[j], null);
    }
  });
  if (x.length === 0) return [];
  const fillpattern = { shape: "/", size: 7, solidity: 0.16, fgcolor: "#3c3f43", bgcolor: "rgba(255,255,255,0.55)" };
  return [{ type: "scatter", mode: "lines", x, y, fill: "toself", fillpattern, fillcolor: "rgba(255,255,255,0.55)", line: { width: 0 }, hoverinfo: "skip" }];
}

function boundaryLine(x, y, name, at) {
  const line = (color, width) => ({ type: "scatter", mode: "lines", x, y, name, line: { color, width }, hoverinfo: "skip" });
  const log = (value, side) => (isLogarithmic(theMap.coordinates[state[side]].values) ? Math.log10(value) : value);
  const label = { x: log(at.x, "x"), y: log(at.y, "y"), text: name, showarrow: false, font: { size: 12, color: "#1a1a1a" }, bgcolor: "rgba(255,255,255,0.8)", xanchor: at.above ? "center" : "right", yanchor: at.above ? "top" : "bottom" };
  return { traces: [line("#ffffff", 4), line("#1a1a1a", 1.8)], label };
}

/** Where the chosen cell is among those drawn: across, up. */
function chosenCell(x, y) {
  const own = [state.x, state.y].map((name) => ascending(name).indexOf(state.place[theMap.order.indexOf(name)]));
  if (!theMap.slant) return own;
  const shown = theMap.slant.up(coordinateAt(state.x, state.place), coordinateAt(state.y, state.place));
  return [own[0], y.findLastIndex((value) => value <= shown)];
}

/** The frame around the chosen cell. */
function mark(own) {
  const [i, j] = [state.x, state.y].map((name) => ascending(name).indexOf(state.place[theMap.order.indexOf(name)]));
  const [[x0, x1], [y0, y1]] = [[own.x, i], [own.y, j]].map(([values, k]) => cellEdges(values).slice(k, k + 2));
  const middle = own.x[i]; // a slanted plane is drawn column by column
  const up = (value) => (theMap.slant ? theMap.slant.up(middle, theMap.slant.clip(value)) : value);
  const line = { color: "#000000", width: 2.5 };
  return { type: "scatter", mode: "lines", name: "chosen", x: [x0, x1, x1, x0, x0], y: [y0, y0, y1, y1, y0].map(up), line, hoverinfo: "skip" };
}

/** A curve where one dimension varies, one point where none does. */
function curve({ cells, x, column }) {
  const row = cells[0];
  const along = state.x ? x : [0];
  const color = pageColor("accent");
  const trace = { type: "scatter", mode: "lines+markers", x: along, y: row.map((cell) => (column.isFlag ? column.text(cell.value) : cell.value)), text: row.map((cell) => tooltip(column, cell)), hovertemplate: "%{text}<extra></extra>", line: { color }, marker: { color, size: 7 } };
  const at = state.x ? ascending(state.x).indexOf(state.place[theMap.order.indexOf(state.x)]) : 0;
  const chosen = { type: "scatter", mode: "markers", x: [along[at]], y: [trace.y[at]], marker: { size: 15, symbol: "circle-open", color: pageColor("ink"), line: { width: 2.5 } }, hoverinfo: "skip" };
  const yaxis = { title: { text: unitText(column.units) }, exponentformat: "power" };
  return { traces: [trace, chosen], layout: { xaxis: state.x ? axisOf(state.x, x) : { visible: false }, yaxis } };
}

// ---------------------------------------------------------------------------------------------------------
// In words, and by keys

function planeSummary({ cells, column }) {
  const flat = cells.flat();
  const fixed = theMap.dims.filter(({ name, size }) => size > 1 && name !== state.x && name !== state.y);
  const where = fixed.map(({ name }) => `${symbolText(name)} = ${coordinateText(name, coordinateAt(name, state.place))}`).join(", ");
  const impossible = flat.filter((cell) => !cell.exists).length;
  const possible = impossible < flat.length ? flat.filter((cell) => cell.exists) : flat;
  const also = impossible ? ` ${impossible} more points, hatched, are physically impossible.` : "";
  return `${column.longName}: ${valuesInWords(column, possible)}${where ? ` (${where})` : ""}.${also}`;
}

function valuesInWords(column, cells) {
  if (column.isFlag) {
    const found = column.flags.map((flag) => [flagText(flag.meaning), cells.filter((cell) => cell.value === flag.value).length]);
    return found.filter(([, n]) => n > 0).map(([word, n]) => `${n} × ${word}`).join("; ");
  }
  const values = cells.map((cell) => cell.value).filter(Number.isFinite);
  if (values.length === 0) return "no number at any of these points";
  const [low, high] = values.reduce(([low, high], v) => [Math.min(low, v), Math.max(high, v)], [Infinity, -Infinity]);
  const missing = cells.length - values.length;
  return `${cells.length} points from ${column.text(low)} to ${column.text(high)}${missing ? `, ${missing} without a number` : ""}`;
}

function drawLegend({ cells, column, scale }) {
  const legend = document.getElementById("legend");
  if (scale?.bar) return legend.replaceChildren(colorBar(scale));
  const entries = column.isFlag ? usedFlags(column, cells.flat()) : [];
  legend.replaceChildren(...entries.map(({ text, color }) => {
    const swatch = element("span", { className: "swatch" });
    swatch.style.background = color;
    return element("li", {}, swatch, text);
  }));
}

function usedFlags(column, cells) {
  const used = new Set(cells.map((cell) => cell.value));
  return column.flags.map((flag, i) => ({ ...flag, text: flagText(flag.meaning), color: flagColor(flag.meaning, i) })).filter((flag) => used.has(flag.value));
}

/** At most so many of n numbers from 0, both ends included. */
function fewOf(n, most) {
  const kept = Math.min(n, most);
  return Array.from({ length: kept }, (_, i) => Math.round((i * (n - 1)) / Math.max(1, kept - 1)));
}

/** A table of texts, the first of each row its head. */
function fillTable(table, heads, rows) {
  const head = element("tr", {}, ...heads.map((text) => element("th", { scope: "col", textContent: text })));
  const lines = rows.map(([first, ...rest]) => element("tr", {}, element("th", { scope: "row", textContent: first }), ...rest.map((text) => element("td", { className: "n", textContent: text }))));
  table.replaceChildren(element("thead", {}, head), element("tbody", {}, ...lines));
}

const MOST_TABLE = 30; // rows and columns that the table of the plane has at most

function fillPlaneTable({ cells, column }) {
  const [rows, columns] = [cells.length, cells[0].length].map((n) => fewOf(n, MOST_TABLE));
  rows.reverse();
  const heading = (name, cell) => (name ? numberText(coordinateAt(name, cell.place), 4) : "");
  const head = element("tr", {}, element("th", { textContent: [state.y, state.x].filter(Boolean).map(dimensionLabel).join(" ↓  ") + (state.y ? " →" : "") }));
  for (const i of columns) head.append(element("th", { scope: "col", textContent: heading(state.x, cells[0][i]) }));
  const lines = rows.map((j) => {
    const line = element("tr", {}, element("th", { scope: "row", textContent: heading(state.y, cells[j][0]) }));
    for (const i of columns) line.append(element("td", { textContent: column.isFlag ? column.text(cells[j][i].value) : numberText(cells[j][i].value, 3) }));
    return line;
  });
  document.querySelector("#map-table table").replaceChildren(element("thead", {}, head), element("tbody", {}, ...lines));
}

/** Moves the choice by cells; the sense is that of the picture. */
function moveInPlane(dx, dy) {
  const changes = {};
  for (const [name, by] of [[state.x, dx], [state.y, dy]]) {
    if (!name || by === 0) continue;
    const order = ascending(name);
    const at = order.indexOf(state.place[theMap.order.indexOf(name)]);
    changes[name] = order[Math.max(0, Math.min(order.length - 1, at + by))];
  }
  choose({ place: placeWith(changes) });
}

/** The cell at a place on the screen, or nothing beside the plot; of a curve, the point above or below. */
function cellAt({ clientX, clientY }) {
  const { _fullLayout: layout } = document.getElementById("map");
  const box = document.getElementById("map").getBoundingClientRect();
  const { cells, x, y } = theMap.plane;
  const [across, up] = [clientX - box.left - layout.xaxis._offset, clientY - box.top - layout.yaxis._offset];
  if (across < 0 || across > layout.xaxis._length || up < 0 || up > layout.yaxis._length) return null;
  const cell = (axis, values, pixel) => {
    const edges = cellEdges(values).map((edge) => axis.d2p(edge));
    return values.findIndex((_, i) => (edges[i] - pixel) * (edges[i + 1] - pixel) <= 0);
  };
  if (state.y) return cells[cell(layout.yaxis, y, up)]?.[cell(layout.xaxis, x, across)] ?? null;
  const away = x.map((value) => Math.abs(layout.xaxis.d2p(value) - across));
  return cells[0][Math.max(0, away.indexOf(Math.min(...away)))];
}

/** A click or a tap chooses the cell under it: Plotly's own event names, on touch, the cell tapped before. */
function listenForTaps(target) {
  let down = null;
  target.addEventListener("pointerdown", (event) => {
    down = event.isPrimary && event.button === 0 && !event.target.closest(".modebar") ? event : null;
  }, true);
  addEventListener("pointerup", (event) => {
    const still = down && Math.hypot(event.clientX - down.clientX, event.clientY - down.clientY) < 6;
    const cell = still && event.pointerId === down.pointerId ? cellAt(down) : null;
    down = null;
    if (cell) choose({ place: cell.place });
  }, true);
}

/** Writes the tooltip of the cell under the pointer, just before Plotly shows it: all of them would take a slider's time. */
function tellUnderPointer(event) {
  const { cells, column } = theMap.plane;
  const cell = state.y ? cellAt(event) : null;
  if (!cell) return;
  const { text } = document.getElementById("map").data[0];
  const j = cells.findIndex((row) => row.includes(cell));
  text[j][cells[j].indexOf(cell)] ||= plain(tooltip(column, cell));
}

function cellOf(point) {
  const { cells } = theMap.plane;
  if (!state.y) return cells[0][point.pointNumber];
  return cells[point.pointNumber[0]][point.pointNumber[1]];
}

/** Scrolls to the first section of the system's part, and takes the keys there. */
function goToPart() {
  const section = document.querySelector(".side > section:not(.point):not([hidden])") ?? document.querySelector("#part > section:not([hidden])");
  section?.scrollIntoView();
  (section?.querySelector("button") ?? section?.querySelector("h2"))?.focus({ preventScroll: true });
}

function buildPlane() {
  const target = document.getElementById("map");
  drawPlane();
  const onMap = (event) => event.points.find((point) => point.curveNumber === 0);
  let byKeys = false; // where the pointer rests says nothing while keys move the choice
  target.addEventListener("pointermove", (event) => {
    byKeys = false;
    tellUnderPointer(event);
  }, true);
  target.on("plotly_hover", (event) => !byKeys && onMap(event) && showRow(cellOf(onMap(event)).place));
  target.on("plotly_unhover", () => showRow(state.place));
  listenForTaps(target);
  const steps = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
  target.addEventListener("keydown", (event) => {
    byKeys = true;
    if (event.key in steps) moveInPlane(...steps[event.key]);
    else if (event.key === "Enter") goToPart();
    else return;
    event.preventDefault();
  });
  document.getElementById("map-table").addEventListener("toggle", () => fillPlaneTable(theMap.own));
  onChange(drawPlane);
}
