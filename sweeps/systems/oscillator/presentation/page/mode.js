// The motion of the chosen mode: followed by the full equations where the page has them, beside linear theory.

const MODE_NUDGES = [1e-6, 1e-3, 0.01, 0.1, 0.3];
const MODE_POINTS = 400;
const FOLLOWED = 1e-9; // of the sizes: the tolerance of what is followed
const OUT = 40; // sizes from the equilibrium: farther is not followed

/** Displacement over its start by linear theory, cos Ωt, or cosh λt where Ω² < 0, and how long to look. */
function linearMotion(square, nudge) {
  const rate = Math.sqrt(Math.abs(square));
  if (square > 0) return { end: (6 * Math.PI) / rate, x: (t) => Math.cos(rate * t), words: `Perturbations oscillate with period ${timeText((2 * Math.PI) / rate)}.` };
  const long = theMap.equations ? 3 * Math.log(2 / nudge) + 4 : Math.log(1 / nudge);
  if (square < 0) return { end: long / rate, x: (t) => Math.cosh(rate * t), words: `Perturbations grow by a factor e in ${timeText(1 / rate)}.` };
  const scale = theMap.columns.rate_scale?.at(state.place);
  return { end: scale > 0 ? (12 * Math.PI) / scale : 1, x: () => 1, words: "Perturbations stay constant or grow in proportion to time." };
}

/** Ω² of the chosen point; zero where the map calls it marginal, for then its sign means nothing. */
function modeSquare() {
  const { omega_squared: square, regime } = theMap.columns;
  return regime?.meanings.get(regime.at(state.place)) === "marginal" ? 0 : square.at(state.place);
}

/** Times, the coordinates as they are followed (null without equations), and as linear theory has them. */
function modeMotion(square) {
  const nudge = state.nudge ?? 0.01;
  const linear = linearMotion(square, nudge);
  const times = Array.from({ length: MODE_POINTS + 1 }, (_, i) => (i * linear.end) / MODE_POINTS);
  if (!theMap.equations) return { ...linear, nudge, times, followed: null, theory: [times.map(linear.x)], coordinates: [{ name: "displacement / initial value", unit: "" }] };
  const equations = new Equations(theMap.equations, state.place);
  const { rest, sizes, coordinates } = equations;
  const shape = equations.shape(square).map((x) => nudge * x);
  const speeds = sizes.map((size) => (size * 20) / linear.end);
  const out = (y) => y.some((x) => !Number.isFinite(x)) || rest.some((q, i) => Math.abs(y[i] - q) > OUT * sizes[i]);
  const states = integrated((y) => equations.slope(y), [...rest.map((q, i) => q + shape[i]), ...rest.map(() => 0)], times, FOLLOWED * nudge, [...sizes, ...speeds], out);
  const followed = rest.map((_, i) => states.map((y) => y[i]));
  const theory = rest.map((q, i) => times.map((t) => q + shape[i] * linear.x(t)));
  return { ...linear, nudge, times, followed, theory, coordinates, rest, sizes };
}

function followedInWords({ followed, times, rest, coordinates, end }, square) {
  if (!followed) return square < 0 ? " Linear theory, within its range: the equations of this system are not part of the page." : "";
  const gone = followed[0].length < times.length;
  if (gone) return ` With the full equations it leaves the plotted range after ${timeText(times[followed[0].length - 1])}.`;
  if (!(square < 0)) return "";
  const far = followed.map((x, i) => x.reduce((most, q) => Math.max(most, Math.abs(q - rest[i])), 0));
  const k = far.indexOf(Math.max(...far));
  return ` With the full equations it moves, within ${timeText(end)}, at most ${withUnit(far[k], coordinates[k].unit, 3)} away.`;
}

/** What is said of a mode, after the name of its equilibrium where a map has several. */
function sentenceOfMode(words) {
  const names = theMap.coordinates.equilibrium?.values ?? [];
  if (names.length < 2 || !theMap.mode) return words;
  return `Near the ${namedPlace("equilibrium", state.place)} ${words[0].toLowerCase()}${words.slice(1)}`;
}

function modeTraces({ times, followed, theory, coordinates }) {
  const line = (x, y, name, color, dash, width) => ({ type: "scatter", mode: "lines", x, y, name, line: { color, dash, width }, hovertemplate: `${name}: %{y:.4g}<br>t = %{x:.4g} s<extra></extra>` });
  const several = coordinates.length > 1;
  return coordinates.flatMap(({ name }, i) => {
    const color = several ? inkOf(theMap.seriesColors[i % theMap.seriesColors.length]) : pageColor("accent");
    const own = symbolText(name);
    const theories = line(times, theory[i], `${own}, linear theory`, pageColor("quiet"), "dash", 1.3);
    const first = { ...theories, name: "linear theory", showlegend: i === 0 };
    return followed ? [first, line(times.slice(0, followed[i].length), followed[i], several ? own : `${own}, integrated`, color, "solid", 2.2)] : [{ ...theories, line: { color, width: 2 } }];
  });
}

/** Room for what is followed; linear theory leaves the picture where it runs away. */
function modeRange({ followed, theory }) {
  if (!followed) return undefined;
  const values = followed.flat();
  const [low, high] = values.reduce(([low, high], v) => [Math.min(low, v), Math.max(high, v)], [Infinity, -Infinity]);
  const room = 0.08 * (high - low) || Math.abs(theory[0][0]) || 1;
  return [low - room, high + room];
}

function drawMode() {
  const square = modeSquare();
  const words = document.getElementById("mode-words");
  const there = Number.isFinite(square);
  for (const id of ["mode-plot", "mode-table"]) document.getElementById(id).hidden = !there;
  if (!there) {
    theMap.mode = null;
    words.textContent = missingInWords(state.place);
    return;
  }
  const shown = modeMotion(square);
  theMap.mode = shown;
  words.textContent = shown.words + followedInWords(shown, square);
  const [{ name, unit }] = shown.coordinates;
  const title = shown.coordinates.length > 1 ? "coordinates" : symbolText(name);
  const yaxis = { title: { text: unit ? `${title} (${unitText(unit)})` : title }, range: modeRange(shown), exponentformat: "power" };
  const layout = { height: 300, margin: { l: 64, r: 12, t: 8, b: 44 }, showlegend: true, legend: { orientation: "h", y: -0.28 }, dragmode: false, xaxis: { title: { text: "time (s)" }, exponentformat: "power", range: [0, shown.end] }, yaxis };
  draw("mode-plot", modeTraces(shown), layout, { displayModeBar: false });
  if (document.getElementById("mode-table").open) fillModeTable();
}

function fillModeTable() {
  const { times, followed, theory, coordinates } = theMap.mode;
  const heads = ["time (s)", ...coordinates.flatMap(({ name }) => [...(followed ? [`${symbolText(name)}, integrated`] : []), `${symbolText(name)}, linear theory`])];
  const rows = fewOf(times.length, 21).map((i) => [times[i], ...coordinates.flatMap((_, k) => [...(followed ? [followed[k][i]] : []), theory[k][i]])]);
  fillTable(document.querySelector("#mode-table table"), heads, rows.map((row) => row.map((value) => numberText(value, 4))));
}

function buildMode() {
  if (!theMap.columns.omega_squared) return;
  document.getElementById("mode").hidden = false;
  const nudge = document.getElementById("mode-nudge");
  for (const one of MODE_NUDGES) nudge.append(element("option", { value: String(one), textContent: `ε = ${numberText(one, 3)}` }));
  nudge.onchange = () => choose({ nudge: Number(nudge.value) });
  const draw = () => {
    const value = String(state.nudge ?? 0.01);
    if (![...nudge.options].some((option) => option.value === value)) nudge.append(element("option", { value, textContent: `ε = ${numberText(Number(value), 3)}` }));
    nudge.value = value;
    drawMode();
  };
  document.getElementById("mode-table").addEventListener("toggle", () => theMap.mode && fillModeTable());
  draw();
  onChange(draw);
}
