// The picture of the map: a plane of two dimensions, coloured by one variable, with theory's lines; or a curve over one.

/** Return the indices of a dimension in the order of its values. */
function ascending(name) {
  const values = theMap.coordinates[name].values;
  return values.map((_, i) => i).sort((a, b) => values[a] - values[b]);
}

function chosenColumn() {
  return theMap.choices.find((choice) => choice.name === state.color);
}

/** The cells of two dimensions (or one, or none), row by row upwards: values, and whether they are possible. */
class Plane {
  constructor() {
    this.column = chosenColumn();
    const sides = [state.x, state.y];
    [this.across, this.up] = sides.map((name) => (name ? ascending(name) : [null]));
    [this.x, this.y] = sides.map((name, k) => (name ? [this.across, this.up][k].map((i) => theMap.coordinates[name].values[i]) : []));
    this.values = new Float64Array(this.across.length * this.up.length);
    this.exists = new Uint8Array(this.values.length).fill(1);
    const [kx, ky] = sides.map((name) => theMap.order.indexOf(name));
    const place = [...state.place];
    this.values.forEach((_, cell) => {
      if (kx >= 0) place[kx] = this.across[cell % this.across.length];
      if (ky >= 0) place[ky] = this.up[Math.floor(cell / this.across.length)];
      this.values[cell] = this.column.at(place);
      if (theMap.existence?.at(place) < 0) this.exists[cell] = 0;
    });
    const possible = this.exists.includes(0) ? this.values.filter((_, cell) => this.exists[cell]) : this.values;
    this.impossible = this.values.length - possible.length;
    this.possible = possible.length > 0 ? possible : this.values; // the values described: all if none is possible
  }

  /** Return value, possibility and place of the cell in row j and column i. */
  at(j, i) {
    const cell = j * this.across.length + i;
    const sides = { [state.x]: this.across[i], [state.y]: this.up[j] };
    return { value: this.values[cell], exists: this.exists[cell] === 1, place: placeWith(sides) };
  }
}

/** Return the height of the map: that of the pictures next to it, or nearly its width. */
function mapHeight(target) {
  if (lecture.on && innerWidth > 860) return innerHeight - 17.5 * textSize(); // room for a step's text, the colours and the verdict
  const beside = document.querySelector(".explorer.turns") && innerWidth > 860;
  return beside ? Math.max(300, Math.min(520, innerHeight - 330)) : Math.min(innerWidth > 860 ? 560 : 380, Math.max(300, target.clientWidth * 0.8));
}

/** Return the cells' edges [x, y]; on a slanted plane, the outermost cells end at the limits of possible bodies. */
function planeEdges({ x, y }, slant) {
  const [xEdges, yEdges] = [cellEdges(x), cellEdges(y)];
  if (!slant) return [xEdges, yEdges];
  const closed = (edges) => {
    const step = 1.5 * (edges[1] - edges[0]);
    return edges.map((edge, i) => (i === 0 && edge < step ? 0 : i === edges.length - 1 && edge > 1 - step ? 1 : edge));
  };
  return [closed(xEdges), closed(yEdges)];
}

/** Return the number of the cell that contains a value; -1 beyond the edges. */
function cellNumber(edges, value) {
  let [low, high] = [0, edges.length - 1];
  if (!(value >= edges[low] && value <= edges[high])) return -1;
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    [low, high] = value < edges[middle] ? [low, middle] : [middle, high];
  }
  return low;
}

/** Return the number of the row of cells at a point of the picture; -1 outside. */
function rowNumber(X, Y) {
  const { slant, plane } = theMap;
  if (!slant) return cellNumber(plane.yEdges, Y);
  return Y < 0 || Y > 1 ? -1 : cellNumber(plane.yEdges, slant.clip(slant.down(X, Y)));
}

/** Return the cell at a point of the picture: null outside, and `exists: false` if bodies are impossible there. */
function locate(X, Y) {
  if (part.possible && !part.possible(X, Y)) return { exists: false, place: null };
  const [j, i] = [rowNumber(X, Y), cellNumber(theMap.plane.xEdges, X)];
  return i < 0 || j < 0 ? null : theMap.plane.at(j, i);
}

/** Return 256 colours of a scale as pixels. */
function paletteOf(colorscale) {
  const context = new OffscreenCanvas(256, 1).getContext("2d", { willReadFrequently: true });
  context.fillStyle = context.createLinearGradient(0, 0, 256, 0);
  for (const [at, color] of colorscale) context.fillStyle.addColorStop(at, color);
  context.fillRect(0, 0, 256, 1);
  return new Uint32Array(context.getImageData(0, 0, 256, 1).data.buffer);
}

/** Paints the cells under Plotly's axes: its own heatmap takes half of the time of a slider's step. */
function paintCells() {
  const canvas = document.getElementById("cells");
  canvas.hidden = !state.y;
  if (!state.y) return;
  const { xEdges, values, across, scale } = theMap.plane;
  const { xaxis, yaxis } = document.getElementById("map")._fullLayout;
  const [width, height] = [xaxis, yaxis].map((axis) => Math.round(axis._length * devicePixelRatio));
  Object.assign(canvas, { width, height });
  Object.assign(canvas.style, { left: `${xaxis._offset}px`, top: `${yaxis._offset}px`, width: `${xaxis._length}px`, height: `${yaxis._length}px` });
  const palette = paletteOf(scale.colorscale);
  const tint = palette.length / (scale.zmax - scale.zmin);
  const colors = new Uint32Array(values.length);
  values.forEach((value, cell) => {
    const z = Number.isFinite(value) ? scale.z(value) : null;
    if (z !== null) colors[cell] = palette[Math.max(0, Math.min(palette.length - 1, Math.floor((z - scale.zmin) * tint)))];
  });
  const middles = (axis, n) => Array.from({ length: n }, (_, k) => axis.p2d((k + 0.5) / devicePixelRatio));
  const [xs, ys] = [middles(xaxis, width), middles(yaxis, height)];
  const columns = xs.map((X) => cellNumber(xEdges, X));
  const points = new Uint32Array(width * height);
  for (let r = 0; r < height; r++) {
    const row = rowNumber(null, ys[r]);
    for (let c = 0; c < width; c++) {
      const j = theMap.slant ? rowNumber(xs[c], ys[r]) : row;
      if (columns[c] >= 0 && j >= 0) points[r * width + c] = colors[j * across.length + columns[c]];
    }
  }
  canvas.getContext("2d", { willReadFrequently: true }).putImageData(new ImageData(new Uint8ClampedArray(points.buffer), width), 0, 0);
}

/** Paints everything that Plotly does not draw: cells, names of regions, and the selected point. */
function paintPlane() {
  paintCells();
  markPoint();
}

/** Draws the map if anything but the selected point has changed; then marks the point. */
function drawPlane() {
  const target = document.getElementById("map");
  const others = state.place.filter((_, k) => ![state.x, state.y].includes(theMap.order[k]));
  const look = [target.clientWidth, innerHeight, document.documentElement.dataset.theme, state.units].join();
  const key = [state.x, state.y, state.color, ...others, look].join();
  if (key !== drawPlane.key || !state.y) {
    theMap.slant = part.slanted?.() ?? null;
    const plane = new Plane();
    theMap.plane = plane;
    if (state.y) [plane.xEdges, plane.yEdges] = planeEdges(plane, theMap.slant);
    if (state.y) plane.scale = colorScale(plane.column, plane.values, plane.exists);
    plane.names = state.y ? regionNames(plane) : [];
    const drawn = state.y ? frame(plane) : curve(plane);
    const view = [state.x, state.y].join();
    const touch = matchMedia("(pointer: coarse)").matches;
    const picture = JSON.stringify([look, drawn, drawPlane.key === null]);
    if (picture === drawPlane.picture) paintPlane();
    else draw(target, drawn.traces, { ...drawn.layout, width: target.clientWidth, height: mapHeight(target), showlegend: false, hovermode: state.y ? false : "closest", uirevision: view, dragmode: touch ? false : "zoom" }, state.y ? WITH_CELLS : {});
    drawPlane.picture = picture;
    document.getElementById("map-summary").textContent = planeSummary(plane);
    drawLegend(plane.column, plane.possible, plane.scale);
    showTable("map-table", () => planeTable(plane));
    drawPlane.key = key;
  }
  markPoint();
}

/** Return the position of the selected point in the picture; a system may have selected a point between cells. */
function pointShown() {
  const { across: cells, values, x, column } = theMap.plane;
  if (!state.y) {
    const i = state.x ? cells.indexOf(state.place[theMap.order.indexOf(state.x)]) : 0;
    const value = values[i];
    return [state.x ? x[i] : 0, column.isFlag ? column.text(value) : value];
  }
  const [across, up] = [state.x, state.y].map((name) => coordinateAt(name, state.place));
  return part.shownAt?.() ?? [across, theMap.slant ? theMap.slant.up(across, up) : up];
}

function overlap(one, other) {
  const apart = (start, length) => one[start] + one[length] <= other[start] || other[start] + other[length] <= one[start];
  return !apart("left", "width") && !apart("top", "height");
}

// Directions to the right and up, the best first; a text at 0.5 or −0.5 begins or ends above or below its point.
const DIRECTIONS = [[1, 1], [-1, 1], [1, -1], [-1, -1], [0.5, 1], [-0.5, 1], [0.5, -1], [-0.5, -1], [0, 1], [0, -1], [1, 0], [-1, 0]];

/** Return boxes of a text beside a point, the best first; farther ones follow in steps of the text's height. */
function boxesBeside([x, y], [width, height], gap, side = 1) {
  return [0, 1, 2, 3].flatMap((step) => DIRECTIONS.map(([across, up]) => {
    const away = gap + step * height;
    const starts = new Map([[1, away], [0.5, -4], [0, -width / 2], [-0.5, 4 - width], [-1, -away - width]]);
    const middle = up * (Math.abs(across) === 1 ? away / 2 + 2 : away + height / 2);
    return { left: x + starts.get(side * across), top: y - middle - height / 2, width, height };
  }));
}

/** Return the first box within an area, if one is given, that overlaps none of the others. */
function freeBox(boxes, others, area = null) {
  const isInside = ({ left, top, width, height }) => left >= area.left && top >= area.top && left + width <= area.left + area.width && top + height <= area.top + area.height;
  return boxes.find((box) => (!area || isInside(box)) && !others.some((other) => overlap(box, other)));
}

/** Return the box of pixels around a point. */
function boxAround([x, y], radius) {
  return { left: x - radius, top: y - radius, width: 2 * radius, height: 2 * radius };
}

const RING_RADIUS = 12; // pixels

/** Writes names over the plot, none on another: of the chosen point, of the system's points, and of regions. */
function drawNames(chosen) {
  const target = document.getElementById("map");
  const { xaxis, yaxis } = target._fullLayout;
  const { left, top } = target.getBoundingClientRect();
  const pixel = (x, y, convert) => [xaxis._offset + xaxis[convert](x), yaxis._offset + yaxis[convert](y)];
  const area = { left: xaxis._offset, top: 0, width: target.clientWidth - xaxis._offset, height: yaxis._offset + yaxis._length };
  const others = [...target.querySelectorAll(".annotation")].map((one) => one.getBoundingClientRect()).map((box) => ({ left: box.left - left, top: box.top - top, width: box.width, height: box.height }));
  const points = (theMap.plane && state.y ? (part.landmarks?.() ?? []) : []).map(({ name, x, y }) => ({ text: name, at: pixel(x, y, "d2p"), kind: "landmark" }));
  const isChosen = ({ at }) => chosen && Math.hypot(at[0] - chosen[0], at[1] - chosen[1]) < RING_RADIUS;
  const names = [
    ...(chosen && !points.some(isChosen) ? [{ at: chosen, kind: "chosen", text: part.pointName?.() ?? "selected" }] : []),
    ...points,
    ...(theMap.plane?.names ?? []).map(({ x, y, value, text }) => ({ at: pixel(x, y, "l2p"), kind: "region", text, value })),
  ];
  if (chosen) others.push(boxAround(chosen, RING_RADIUS));
  others.push(...points.map(({ at }) => boxAround(at, 4)));
  const labels = names.map(({ text, kind }) => element("span", { className: kind, textContent: text }));
  document.getElementById("names").replaceChildren(...labels);
  const sizes = labels.map((label) => label.getBoundingClientRect()).map(({ width, height }) => [width, height]);
  names.forEach(({ at, kind, value }, i) => {
    const boxes = kind === "region" ? boxesOfRegion(at, sizes[i], value) : boxesBeside(at, sizes[i], isChosen({ at }) ? RING_RADIUS + 2 : 6);
    const box = freeBox(boxes, others, area);
    labels[i].hidden = !box;
    if (!box) return;
    labels[i].style.translate = `${box.left}px ${box.top}px`;
    others.push(box);
  });
}

/** Return boxes of a region's name, about its middle, then beside it, while their middles are in the region. */
function boxesOfRegion([x, y], [width, height], value) {
  const { xaxis, yaxis } = document.getElementById("map")._fullLayout;
  const isOfRegion = (u, v) => {
    const place = locate(xaxis.p2d(u - xaxis._offset), yaxis.p2d(v - yaxis._offset))?.place;
    return place && leadingFlag().at(place) === value;
  };
  const steps = [[0, 0], ...[1, 2, 3].flatMap((step) => DIRECTIONS.map(([across, up]) => [across * step, up * step]))];
  const middles = steps.map(([across, up]) => [x + across * height, y - up * height]);
  return middles.filter(([u, v], i) => i === 0 || isOfRegion(u, v)).map(([u, v]) => ({ left: u - width / 2, top: v - height / 2, width, height }));
}

/** Marks the chosen point by a ring, and writes all names. */
function markPoint(at = pointShown()) {
  const ring = document.getElementById("ring");
  const { xaxis, yaxis } = document.getElementById("map")._fullLayout;
  const [x, y] = [xaxis.d2p(at[0]), yaxis.d2p(at[1])];
  ring.hidden = !(x >= -1 && x <= xaxis._length + 1 && y >= -1 && y <= yaxis._length + 1);
  const place = [xaxis._offset + x, yaxis._offset + y];
  ring.style.translate = `${place[0]}px ${place[1]}px`;
  drawNames(ring.hidden ? null : place);
}

function axisOf(name, values) {
  const type = isLogarithmic(values) ? "log" : "linear";
  const few = type === "log" && Math.max(...values) < 1e3 * Math.min(...values); // decades: 1, 2 and 5 have room
  return { title: { text: dimensionLabel(name) }, type, ...(few ? { dtick: "D2" } : {}), showgrid: false, zeroline: false, exponentformat: "power" };
}

function rangeOf(edges, type) {
  const ends = [edges[0], edges[edges.length - 1]];
  return type === "log" ? ends.map(Math.log10) : ends;
}

/** Return traces and layout that Plotly draws over the cells: axes, hatching, boundaries and points with names. */
function frame(plane) {
  const { slant } = theMap;
  const [x, y] = [plane.xEdges, slant ? [0, 1] : plane.yEdges];
  const layout = { xaxis: axisOf(state.x, plane.x), yaxis: axisOf(state.y, plane.y) };
  layout.xaxis.range = rangeOf(x, layout.xaxis.type);
  layout.yaxis.range = rangeOf(y, layout.yaxis.type);
  if (slant) Object.assign(layout.yaxis, { title: { text: slant.label }, range: [0, 1.06] }); // names stand above the uppermost bodies
  const lines = part.boundaries?.(x, y) ?? [];
  const hatched = [...(part.impossible?.(x, y) ?? []), ...impossibleOutlines(plane)];
  layout.annotations = lines.map((line) => line.label);
  return { traces: [...hatch(hatched), ...lines.flatMap((line) => line.traces), ...landmarks()], layout };
}

/** Plotly's button that saves a picture, with the cells and the regions' names. */
const SAVE = {
  name: "save",
  title: "Download plot as a PNG",
  get icon() { return Plotly.Icons.camera; },
  click: ({ data, layout, _fullLayout: { xaxis, yaxis } }) => {
    const images = [{ source: document.getElementById("cells").toDataURL(), x: 0, y: 1, sizex: 1, sizey: 1, sizing: "stretch", layer: "below" }];
    const { left, top } = document.getElementById("map").getBoundingClientRect();
    const names = [...document.querySelectorAll("#names span:not([hidden])")].map((label) => {
      const box = label.getBoundingClientRect();
      const place = { x: xaxis.p2l(box.left + box.width / 2 - left - xaxis._offset), y: yaxis.p2l(box.top + box.height / 2 - top - yaxis._offset) };
      return escapeTexts(annotation({ ...place, text: label.textContent.replace("\n", "<br>") }, 0.72));
    });
    const annotations = [...layout.annotations, ...names];
    Plotly.downloadImage({ data, layout: { ...layout, images, annotations } }, { format: "png", filename: "map" });
  },
};
const WITH_CELLS = { modeBarButtonsToAdd: [SAVE], modeBarButtonsToRemove: [...PLOT_CONFIG.modeBarButtonsToRemove, "toImage"] };

/** Return the trace of the system's named points on this plane. */
function landmarks() {
  const all = part.landmarks?.() ?? [];
  const pick = (name) => all.map((one) => one[name]);
  if (all.length === 0) return [];
  return [{ type: "scatter", mode: "markers", x: pick("x"), y: pick("y"), text: pick("name"), cliponaxis: false, marker: { size: 6, color: "#1a1a1a", line: { color: "#ffffff", width: 1.5 } }, hoverinfo: "skip" }];
}

const MAX_LABEL_CELLS = 2500; // cells from which places of regions' names are computed; more cells do not improve them

function leadingFlag() {
  return Object.values(theMap.columns).find((column) => column.role === "headline" && column.isFlag);
}

/** Return the names of the leading flag's regions, each at the point farthest from its region's edge. */
function regionNames(plane) {
  const flag = leadingFlag();
  const step = Math.ceil(Math.sqrt(plane.values.length / MAX_LABEL_CELLS));
  const [rows, columns] = [plane.up, plane.across].map((side) => [...side.keys()].filter((k) => k % step === 0));
  if (!flag || rows.length < 6 || columns.length < 6) return [];
  const values = rows.map((j) => columns.map((i) => {
    const { exists, place } = plane.at(j, i);
    return exists ? flag.at(place) : null;
  }));
  const [x, y] = [columns.map((i) => plane.x[i]), rows.map((j) => plane.y[j])];
  const best = new Map();
  const before = regionNames.best; // a name stays if its old place has half of the greatest distance
  distanceToEdge(values).forEach((row, j) => row.forEach((room, i) => {
    const was = before.get(values[j][i]);
    const free = was?.i === i && was.j === j ? 2 * room : room;
    if (values[j][i] !== null && free > (best.get(values[j][i])?.free ?? 0)) best.set(values[j][i], { free, i, j });
  }));
  regionNames.best = best;
  const log = (values, value) => (isLogarithmic(values) ? Math.log10(value) : value);
  const least = 0.06 * Math.min(rows.length, columns.length);
  return [...best].sort(([a], [b]) => a - b).filter(([, at]) => at.free > least).map(([value, { i, j }]) => {
    const up = theMap.slant ? theMap.slant.up(x[i], y[j]) : log(y, y[j]);
    return { x: log(x, x[i]), y: up, value, text: flagText(flag.meanings.get(value) ?? "").replace(", ", "\n") };
  });
}

regionNames.best = new Map();

/** Return Plotly's annotation for a text on the picture. */
function annotation(at, veil) {
  return { showarrow: false, font: { size: textSize(12), color: "#1a1a1a" }, bgcolor: `rgba(255,255,255,${veil})`, ...at };
}

/** Return the distance of each cell, in cells, from the nearest cell with another value, or from the edge. */
function distanceToEdge(values) {
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

/** Return at most four lines on a point: its coordinates, its value and its leading flag. */
function tipLines(column, { value, exists, place }, at = null) {
  if (!exists && !place) return ["No rigid body has these moments."];
  const sides = [state.x, state.y].map((name, k) => {
    if (!name) return null;
    return k === 1 && theMap.slant && at ? `${theMap.slant.label} = ${numberText(theMap.slant.up(...[state.x, state.y].map((one) => coordinateAt(one, place))), 4)}` : `${symbolText(name)} = ${coordinateText(name, coordinateAt(name, place))}`;
  });
  const [measured] = theMap.columns[column.name] ? headlineTexts(column, place) : [column.text(value)];
  const flag = headlines().find((one) => one.isFlag && one.name !== column.name);
  const lines = [...(place && theMap.coordinates.name?.dim === "point" ? [coordinateAt("name", place)] : []), ...sides, `${column.longName.split(/ ?[,(;]/)[0]}: ${measured}`, flag ? flag.text(flag.at(place)) : null].filter(Boolean);
  return exists ? lines : [...lines.slice(0, 2), "physically impossible"];
}

/** Shows the small box next to the pointer, or hides it. */
function showTip(lines, { clientX, clientY } = {}) {
  const tip = document.getElementById("tip");
  tip.hidden = !lines;
  if (!lines) return;
  tip.replaceChildren(...lines.map((text) => element("div", { textContent: text })));
  const box = tip.parentElement.getBoundingClientRect();
  const [x, y] = [clientX - box.left, clientY - box.top];
  tip.style.left = `${x > box.width / 2 ? Math.max(0, x - tip.offsetWidth - 14) : x + 14}px`;
  tip.style.top = `${Math.max(0, y - tip.offsetHeight - 8)}px`;
}

/** Return outlines of impossible cells that the system does not outline itself: runs of cells of each row. */
function impossibleOutlines({ exists, across, up, x: xs, y: ys, xEdges, yEdges }) {
  const [x, y] = [[], []];
  const n = across.length;
  for (let j = 0; j < up.length; j++) {
    const apart = (i) => i < n && !exists[j * n + i] && (part.possible?.(xs[i], ys[j]) ?? true);
    for (let i = 0; i < n; i++) {
      if (!apart(i)) continue;
      const first = i;
      while (apart(i)) i++;
      x.push(xEdges[first], xEdges[i], xEdges[i], xEdges[first], xEdges[first], null);
      y.push(yEdges[j], yEdges[j], yEdges[j + 1], yEdges[j + 1], yEdges[j], null);
    }
  }
  return x.length > 0 ? [{ x, y }] : [];
}

/** Return traces that hatch impossible regions. */
function hatch(outlines) {
  const bgcolor = pageColor("paper");
  const fillpattern = { shape: "/", size: 8, solidity: 0.1, fgcolor: pageColor("quiet"), bgcolor };
  return outlines.map(({ x, y }) => ({ type: "scatter", mode: "lines", x, y, fill: "toself", fillpattern, fillcolor: bgcolor, line: { width: 1, color: pageColor("quiet") }, hoverinfo: "skip" }));
}

function boundaryLine(x, y, name, at) {
  const line = (color, width) => ({ type: "scatter", mode: "lines", x, y, name, line: { color, width }, hoverinfo: "skip" });
  const log = (value, side) => (isLogarithmic(theMap.coordinates[state[side]].values) ? Math.log10(value) : value);
  const label = annotation({ x: log(at.x, "x"), y: log(at.y, "y"), text: name, xanchor: at.above ? "center" : "right", yanchor: at.above ? "top" : "bottom" }, 0.8);
  return { traces: [line("#ffffff", 4), line("#1a1a1a", 1.8)], label };
}

/** Return traces and layout of a curve over one dimension, or of a point if no dimension varies. */
function curve({ values, x, column }) {
  const along = state.x ? x : [0];
  const color = pageColor("accent");
  const trace = { type: "scatter", mode: "lines+markers", x: along, y: Array.from(values, (value) => (column.isFlag ? column.text(value) : value)), hoverinfo: "none", line: { color }, marker: { color, size: 7 } };
  const yaxis = { title: { text: unitText(column.units) }, exponentformat: "power" };
  return { traces: [trace], layout: { xaxis: state.x ? axisOf(state.x, x) : { visible: false }, yaxis } };
}

// ---------------------------------------------------------------------------------------------------------
// Text, tables, keyboard and pointer

function planeSummary({ column, possible, impossible }) {
  const where = placeText(state.place, [state.x, state.y]);
  const also = impossible ? ` ${impossible} more points, hatched, are physically impossible.` : "";
  return `${column.longName}: ${valuesInWords(column, possible)}${where ? ` (${where})` : ""}.${also}`;
}

function valuesInWords(column, values) {
  if (column.isFlag) return usedFlags(column, values).map(({ count, text }) => `${count} × ${text}`).join("; ");
  const finite = values.filter(Number.isFinite);
  if (finite.length === 0) return "no number at any of these points";
  const [low, high] = finite.reduce(([low, high], v) => [Math.min(low, v), Math.max(high, v)], [Infinity, -Infinity]);
  const missing = values.length - finite.length;
  return `${values.length} points from ${column.text(low)} to ${column.text(high)}${missing ? `, ${missing} without a number` : ""}`;
}

function drawLegend(column, values, scale) {
  const legend = document.getElementById("legend");
  if (scale?.bar) return legend.replaceChildren(colorBar(scale));
  const entries = column.isFlag ? usedFlags(column, values) : [];
  legend.replaceChildren(...entries.map(({ text, color }) => {
    const swatch = element("span", { className: "swatch" });
    swatch.style.background = color;
    return element("li", {}, swatch, text);
  }));
}

/** Return count, words and colour of each flag that occurs among values. */
function usedFlags(column, values) {
  const counts = new Map();
  values.forEach((value) => counts.set(value, (counts.get(value) ?? 0) + 1));
  return column.flags.map(({ value, meaning }, i) => ({ count: counts.get(value), text: flagText(meaning), color: flagColor(meaning, i) })).filter(({ count }) => count);
}

/** Return at most `most` evenly spaced numbers of 0 … n - 1, both ends included. */
function spacedIndices(n, most) {
  const kept = Math.min(n, most);
  return Array.from({ length: kept }, (_, i) => Math.round((i * (n - 1)) / Math.max(1, kept - 1)));
}

/** Fills a table with texts; the first text of each row is its heading. */
function fillTable(table, heads, rows) {
  const head = element("tr", {}, ...heads.map((text) => element("th", { scope: "col", textContent: text })));
  const lines = rows.map(([first, ...rest]) => element("tr", {}, element("th", { scope: "row", textContent: first }), ...rest.map((text) => element("td", { className: "n", textContent: text }))));
  table.replaceChildren(element("thead", {}, head), element("tbody", {}, ...lines));
}

/** Fills the table in a <details> by the headings and rows that `made` returns: now if it is open, else when it opens. */
function showTable(id, made) {
  const details = document.getElementById(id);
  details.ontoggle = () => details.open && fillTable(details.querySelector("table"), ...made());
  details.ontoggle();
}

const MAX_TABLE_LENGTH = 30; // maximum number of rows and of columns of a table of the picture

function planeTable(plane) {
  const { across, up, column } = plane;
  const [rows, columns] = [up, across].map((side) => spacedIndices(side.length, MAX_TABLE_LENGTH));
  const heading = (name, { place }) => (name ? numberText(coordinateAt(name, place), 4) : "");
  const text = ({ value }) => (column.isFlag ? column.text(value) : numberText(value, 3));
  const corner = [state.y, state.x].filter(Boolean).map(dimensionLabel).join(" ↓  ") + (state.y ? " →" : "");
  const heads = [corner, ...columns.map((i) => heading(state.x, plane.at(0, i)))];
  return [heads, rows.reverse().map((j) => [heading(state.y, plane.at(j, 0)), ...columns.map((i) => text(plane.at(j, i)))])];
}

/** Moves the selected point by dx cells to the right and dy upwards in the picture. */
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

/** Return the coordinates of an event in the picture, and its pixel across; null outside the plot. */
function dataAt({ clientX, clientY }) {
  const target = document.getElementById("map");
  const { xaxis, yaxis } = target._fullLayout;
  const box = target.getBoundingClientRect();
  const [across, up] = [clientX - box.left - xaxis._offset, clientY - box.top - yaxis._offset];
  if (across < 0 || across > xaxis._length || up < 0 || up > yaxis._length) return null;
  return [xaxis.p2d(across), yaxis.p2d(up), across];
}

/** Return the cell at an event, null outside the plot; for a curve, the point above or below. */
function cellAt(event) {
  const at = dataAt(event);
  if (!at) return null;
  if (state.y) return locate(at[0], at[1]);
  const { x } = theMap.plane;
  const { xaxis } = document.getElementById("map")._fullLayout;
  const away = x.map((value) => Math.abs(xaxis.d2p(value) - at[2]));
  return theMap.plane.at(0, Math.max(0, away.indexOf(Math.min(...away))));
}

const GRIP_RADIUS = 15; // pixels from the ring's centre, within which the ring can be dragged
const STILL_RADIUS = 6; // pixels; a pointer that moves less between press and release clicks

/** Return true if a press can drag the chosen point: on the ring, or on any possible body of the triangle. */
function isGrip(event) {
  if (!part.drag || !state.y || event.target.closest(".modebar")) return false;
  const ring = document.getElementById("ring");
  const { left, top } = ring.getBoundingClientRect();
  const isOnRing = !ring.hidden && Math.hypot(event.clientX - left, event.clientY - top) < GRIP_RADIUS;
  return isOnRing || Boolean(theMap.slant && cellAt(event)?.exists);
}

/** Selects the cell under a click or a tap; a drag moves the chosen point if the system can compute points between cells. */
function listenForTaps(target) {
  let [down, dragged] = [null, null];
  const move = () => {
    const at = dragged && dataAt(dragged);
    if (at) part.drag(at[0], at[1]);
    dragged = null;
  };
  const isStill = (event) => Math.hypot(event.clientX - down.clientX, event.clientY - down.clientY) < STILL_RADIUS;
  target.addEventListener("pointerdown", (event) => {
    down = event.isPrimary && event.button === 0 && !event.target.closest(".modebar") ? event : null;
    if (!down || !isGrip(event)) return;
    down.drags = true;
    event.preventDefault(); // else Plotly zooms
    event.stopPropagation();
  }, true);
  target.addEventListener("touchstart", (event) => isGrip(event.touches[0]) && event.preventDefault(), { capture: true, passive: false });
  target.addEventListener("mousedown", (event) => down?.drags && event.stopPropagation(), true);
  target.addEventListener("pointermove", (event) => {
    if (down?.drags) {
      if (!down.moved && isStill(event)) return;
      down.moved = true;
      if (!dragged) requestAnimationFrame(move);
      dragged = event;
      return showTip(null);
    }
    const cell = down ? null : cellAt(event);
    showTip(cell ? tipLines(theMap.plane.column, cell, theMap.slant) : null, event);
  }, true);
  target.addEventListener("pointerleave", () => showTip(null));
  addEventListener("pointerup", (event) => {
    const cell = down && !down.moved && isStill(event) && event.pointerId === down.pointerId ? cellAt(down) : null;
    down = null;
    if (cell?.exists) choose({ place: cell.place });
    else if (cell) showTip(tipLines(theMap.plane.column, cell, theMap.slant), event);
  }, true);
}

/** Scrolls to the first section of the system's part, and moves the keyboard's focus there. */
function goToPart() {
  const section = document.querySelector(".side > section:not(.point):not([hidden])") ?? document.querySelector("#part > section:not([hidden])");
  section?.scrollIntoView();
  (section?.querySelector("button") ?? section?.querySelector("h2"))?.focus({ preventScroll: true });
}

function buildPlane() {
  const target = document.getElementById("map");
  target.before(element("canvas", { id: "cells", "aria-hidden": "true" }));
  drawPlane();
  paintPlane();
  for (const event of ["plotly_relayout", "plotly_relayouting", "plotly_afterplot"]) target.on(event, paintPlane);
  listenForTaps(target);
  onArrows(target, moveInPlane, goToPart);
  onChange(drawPlane);
}
