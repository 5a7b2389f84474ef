// The motion of the selected mode by linear theory and, if the page has them, by the full equations.

const MODE_EPSILONS = [1e-6, 1e-3, 0.01, 0.1, 0.3];
const MODE_POINTS = 400;
const MODE_TOLERANCE = 1e-9; // truncation error of the integration, relative to the sizes
const MAX_POINTS = 3000; // points of a motion of many periods
const MAX_DISTANCE = 40; // distance from the equilibrium over the sizes at which the integration stops

/** Duration, s, that shows modes with eigenvalues [growth, frequency], and their description. */
function linearMotion(rates, pace, epsilon) {
  const growth = Math.max(...rates.map(([real]) => real));
  const turnings = [...new Set(rates.map(([, imaginary]) => Math.abs(imaginary)))].filter(Boolean);
  if (!(pace > 0) || (growth === 0 && turnings.length === 0)) return { end: pace > 0 ? (12 * Math.PI) / pace : 1, words: "Perturbations stay constant or grow in proportion to time." };
  const periods = turnings.map((turning) => (2 * Math.PI) / turning).sort((one, other) => other - one);
  const longest = periods[0] ?? 0;
  const [folds, changes] = [1 / Math.abs(growth), Math.abs(growth) > 1e-6 * Math.max(...turnings, Math.abs(growth))];
  const round = periods.length > 0 ? `oscillate with period${periods.length > 1 ? "s" : ""} ${periods.map((period) => timeText(period)).join(", ")}` : "";
  const change = changes ? `${growth > 0 ? "grow" : "decay"} by a factor e in ${timeText(folds)}` : "";
  const grown = longest > 0 ? Math.log(4 / epsilon) + 1 : theMap.equations ? 3 * Math.log(2 / epsilon) + 4 : Math.log(1 / epsilon);
  const end = Math.max(3 * longest, changes ? Math.min(folds * (growth > 0 ? grown : 4), MAX_TURNS_SHOWN * longest || Infinity) : 0);
  return { end, words: `Perturbations ${[round, change].filter(Boolean).join(" and ")}.` };
}
const MAX_TURNS_SHOWN = 40;

/** Times and coordinates, by the full equations (null without them) and by linear theory. */
function modeMotion(rates) {
  const epsilon = state.epsilon ?? 0.01;
  const scale = theMap.columns.rate_scale?.at(state.place);
  if (!theMap.equations) {
    const linear = linearMotion(rates, Math.hypot(...rates[0]) || scale, epsilon);
    const times = evenTimes(linear.end, MODE_POINTS);
    return { ...linear, times, followed: null, theory: [times.map((t) => waved(rates[0], t))], coordinates: [{ name: "displacement / initial value", unit: "" }] };
  }
  const equations = new Equations(theMap.equations, state.place);
  const { sizes, coordinates, spin, period, states } = equations;
  const rest = equations.rest.slice(0, states);
  const speeds = rates?.map((rate) => Math.hypot(...rate)) ?? [];
  const pace = Math.max(spin, ...speeds) || scale;
  const grows = !rates && theMap.columns.growth_per_period?.at(state.place) > 1e-6;
  const linear = rates ? linearMotion(rates, pace, epsilon) : { end: periodicEnd(period, epsilon), words: `The perturbed motion${grows ? ", along the Floquet vector that grows most" : ""}, beside the unperturbed one.` };
  const end = spin > 0 ? Math.min(linear.end, (MAX_TURNS_SHOWN * 2 * Math.PI) / spin) : linear.end;
  const cycles = period === null ? (pace * end) / (2 * Math.PI) : end / period;
  const times = evenTimes(end, Math.round(Math.max(MODE_POINTS, Math.min(MAX_POINTS, 40 * cycles))));
  const modes = rates?.map((rate) => equations.mode(rate).map((part) => part.map((x) => (epsilon * x) / rates.length)));
  const displaced = modes ? rest.map((_, i) => modes.reduce((sum, v) => sum + v[i][0], 0)) : grows ? equations.growing().map((x) => epsilon * x) : equations.sizesAt(0).map((size, i) => epsilon * size * 0.6 ** i);
  const whole = equations.sizesAt(Math.max(...speeds, 20 / end));
  const out = (y) => y.some((x) => !Number.isFinite(x)) || sizes.some((size, i) => Math.abs(y[i] - rest[i]) > MAX_DISTANCE * size);
  const moved = (start) => integrated((t, y) => equations.slope(t, y), equations.upright(start), times, MODE_TOLERANCE * epsilon, spin > 0 ? [...whole, 1, 1, 1, 1] : whole, out);
  const motion = moved(rest.map((x, i) => x + displaced[i]));
  const unmoved = modes ? null : moved(rest);
  const linearly = (i, t) => modes.reduce((sum, v, k) => sum + waved(rates[k], t, v[i]), rest[i]);
  const [followed, theory] = [sizes.map((_, i) => motion.map((y) => y[i])), sizes.map((_, i) => (modes ? times.map((t) => linearly(i, t)) : unmoved.map((y) => y[i])))];
  return { ...linear, end, cycles, epsilon, times, motion, equations, followed, theory, coordinates, rest, sizes };
}

function evenTimes(end, points) {
  return Array.from({ length: points + 1 }, (_, i) => (i * end) / points);
}

/** The real part of v e^{λt}, with parts [real, imaginary] of v and λ. */
function waved([growth, turning], t, [x, y] = [1, 0]) {
  return Math.exp(growth * t) * (x * Math.cos(turning * t) - y * Math.sin(turning * t));
}

/** Duration, s, of a motion near a periodic one: until a growing perturbation is large, or three periods of a stable one. */
function periodicEnd(period, epsilon) {
  const { growth_rate: growth, exponent_imag: turning } = Object.fromEntries(["growth_rate", "exponent_imag"].map((name) => [name, theMap.columns[name]?.at(state.place)]));
  const long = growth * period > 1e-6 ? Math.log(4 / epsilon) / growth : 0;
  const round = Math.abs(turning) * period > 1e-6 ? (6 * Math.PI) / Math.abs(turning) : 0;
  return period * Math.ceil(Math.max(8, Math.min(60, Math.max(long, round) / period)));
}

function followedInWords({ followed, times, rest, coordinates, end, unstable }) {
  if (!followed) return unstable ? " Linear theory, within its range: the equations of this system are not part of the page." : "";
  const gone = followed[0].length < times.length;
  if (gone) return ` With the full equations it leaves the plotted range after ${timeText(times[followed[0].length - 1])}.`;
  if (!unstable) return "";
  const far = followed.map((x, i) => x.reduce((most, q) => Math.max(most, Math.abs(q - rest[i])), 0));
  const k = far.indexOf(Math.max(...far));
  return ` With the full equations it moves, within ${timeText(end)}, at most ${withUnit(far[k], coordinates[k].unit, 3)} away.`;
}

/** Description of the selected mode, with the name of its equilibrium if a map has several. */
function sentenceOfMode() {
  const rates = part.rates();
  if (!rates.flat().every(Number.isFinite)) return missingInWords(state.place);
  const { words } = linearMotion(rates, Math.hypot(...rates[0]), 1);
  if ((theMap.coordinates.equilibrium?.values.length ?? 0) < 2) return words;
  return `Near the ${namedPlace("equilibrium", state.place)} ${words[0].toLowerCase()}${words.slice(1)}`;
}

const MAX_CURVES = 4;

/** Coordinates or states with the largest motion, of one unit, which are drawn over time. */
function movingMost({ followed, coordinates, sizes, rest }) {
  if (!followed) return [0];
  const far = followed.map((x, i) => x.reduce((most, q) => Math.max(most, Math.abs(q - rest[i]) / sizes[i]), 0));
  const order = far.map((_, i) => i).sort((i, k) => far[k] - far[i]);
  return order.filter((i) => coordinates[i].unit === coordinates[order[0]].unit && !(far[i] < 1e-3 * far[order[0]])).slice(0, MAX_CURVES).sort((i, k) => i - k);
}

function modeTraces({ times, followed, theory, coordinates, curves, equations }) {
  const line = (x, y, name, color, dash, width) => ({ type: "scatter", mode: "lines", x, y, name, line: { color, dash, width }, hovertemplate: `${name}: %{y:.4g}<br>t = %{x:.4g} s<extra></extra>` });
  const several = curves.length > 1;
  const beside = equations?.period == null ? "linear theory" : "unperturbed";
  return curves.flatMap((i, k) => {
    const color = several ? inkOf(theMap.seriesColors[k % theMap.seriesColors.length]) : pageColor("accent");
    const own = symbolText(coordinates[i].name);
    const theories = line(times, theory[i], `${own}, ${beside}`, pageColor("quiet"), "dash", 1.3);
    const first = { ...theories, name: beside, showlegend: k === 0 };
    return followed ? [first, line(times.slice(0, followed[i].length), followed[i], several ? own : `${own}, integrated`, color, "solid", 2.2)] : [{ ...theories, line: { color, width: 2 } }];
  });
}

/** Range of the integrated motion, which linear theory may leave. */
function modeRange({ followed, theory, curves }) {
  if (!followed) return undefined;
  const values = curves.flatMap((i) => followed[i]);
  const [low, high] = values.reduce(([low, high], v) => [Math.min(low, v), Math.max(high, v)], [Infinity, -Infinity]);
  const room = 0.08 * (high - low) || Math.abs(theory[curves[0]][0]) || 1;
  return [low - room, high + room];
}

/** Whether the map has the start of the periodic motion. */
function startIsKnown() {
  return theMap.equations.coordinates.every(({ name }) => Number.isFinite(theMap.columns[`${name}_start`].at(state.place)));
}

function drawMode() {
  const rates = part.rates();
  const words = document.getElementById("mode-words");
  const there = rates === null ? startIsKnown() : rates.length > 0 && rates.flat().every(Number.isFinite);
  for (const id of ["mode-plot", "mode-table"]) document.getElementById(id).hidden = !there;
  if (!there) {
    theMap.mode = null;
    words.textContent = missingInWords(state.place);
    return;
  }
  const shown = { ...modeMotion(rates), unstable: rates !== null && rates.some((rate) => rate[0] > 1e-6 * Math.hypot(...rate)) };
  shown.curves = movingMost(shown);
  theMap.mode = shown;
  words.textContent = shown.words + followedInWords(shown);
  const [{ name, unit }] = shown.curves.map((i) => shown.coordinates[i]);
  const title = shown.curves.length > 1 ? "coordinates" : symbolText(name);
  const yaxis = { title: { text: labelled(title, unit) }, range: modeRange(shown), exponentformat: "power", nticks: lecture.on ? 4 : 0 };
  const look = lecture.on ? { height: 0.34 * innerHeight, margin: { l: 64, r: 12, t: 8, b: 3 * textSize() }, legend: { orientation: "h", y: 1, yanchor: "bottom" } } : { height: 300, margin: { l: 64, r: 12, t: 8, b: 44 }, legend: { orientation: "h", y: -0.34 } };
  const layout = { ...look, showlegend: true, dragmode: false, xaxis: { title: { text: "time (s)" }, exponentformat: "power", range: [0, shown.end] }, yaxis };
  draw("mode-plot", modeTraces(shown), layout, { displayModeBar: false });
  showTable("mode-table", () => modeTable(shown));
}

function modeTable({ times, followed, theory, coordinates, curves }) {
  const beside = theMap.equations?.period ? "unperturbed" : "linear theory";
  const heads = ["time (s)", ...curves.map((k) => coordinates[k]).flatMap(({ name }) => [...(followed ? [`${symbolText(name)}, integrated`] : []), `${symbolText(name)}, ${beside}`])];
  const rows = spacedIndices(times.length, 21).map((i) => [times[i], ...curves.flatMap((k) => [...(followed ? [followed[k][i]] : []), theory[k][i]])]);
  return [heads, rows.map((row) => row.map((value) => numberText(value, 4)))];
}

function buildMode() {
  if (theMap.columns.omega_squared === undefined && !theMap.equations) return;
  document.getElementById("mode").hidden = false;
  const select = document.getElementById("mode-epsilon");
  for (const one of MODE_EPSILONS) select.append(element("option", { value: String(one), textContent: `ε = ${numberText(one, 3)}` }));
  select.onchange = () => choose({ epsilon: Number(select.value) });
  const draw = () => {
    const value = String(state.epsilon ?? 0.01);
    if (![...select.options].some((option) => option.value === value)) select.append(element("option", { value, textContent: `ε = ${numberText(Number(value), 3)}` }));
    select.value = value;
    drawMode();
  };
  buildMechanism(draw);
}

/** Members of a system's `part` for the perturbation shown. */
const MODES = {
  kept: { epsilon: perturbationFromLink },
  opening: () => (state.epsilon ??= 0.3), // large enough to be seen
};
