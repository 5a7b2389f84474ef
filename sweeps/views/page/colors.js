// Colours: of regimes and flags, of numbers of one or both signs, and of the page around them.

// Red to blue by Brewer, as in the figures: apart for every kind of colour vision, dark at both ends.
const DIVERGING = [
  [0, "#67001f"], [0.1, "#b2182b"], [0.2, "#d6604d"], [0.3, "#f4a582"], [0.4, "#fddbc7"], [0.5, "#f7f7f7"],
  [0.6, "#d1e5f0"], [0.7, "#92c5de"], [0.8, "#4393c3"], [0.9, "#2166ac"], [1, "#053061"],
];
// Cividis by Nuñez, Anderton and Renslow (2018): from dark to light for every kind of colour vision.
const SEQUENTIAL = [
  [0, "#00204c"], [0.1, "#00316f"], [0.2, "#31446b"], [0.3, "#4d566c"], [0.4, "#666970"], [0.5, "#7c7b78"],
  [0.6, "#958f78"], [0.7, "#afa473"], [0.8, "#cabb69"], [0.9, "#e6d059"], [1, "#ffe945"],
];

function flagColor(meaning, order) {
  return theMap.colors[meaning] ?? theMap.seriesColors[order % theMap.seriesColors.length];
}

/** Return the colour of a line or a dot: the darkest colour of the series would be invisible on a dark page. */
function inkOf(color) {
  return color === "#333333" ? pageColor("ink") : color;
}

/** Return the colour scale of a column: `z` maps a value to a number of the scale from `zmin` to `zmax`. */
function colorScale(column, values, exists) {
  if (column.isFlag) return flagScale(column);
  const finite = values.filter((value, i) => Number.isFinite(value) && exists[i]);
  const shown = Float64Array.from(finite.length ? finite : values.filter(Number.isFinite)).sort();
  const [low, high] = shown.length ? [shown[0], shown[shown.length - 1]] : [0, 1];
  const unit = unitText(column.units);
  if (column.isSigned ?? (low < 0 && high > 0)) {
    const limit = Math.max(Math.abs(low), Math.abs(high)) || 1;
    const colorscale = part.grows?.(column) ? DIVERGING.map(([at], i) => [at, DIVERGING[DIVERGING.length - 1 - i][1]]) : DIVERGING;
    return { z: (v) => v, zmin: -limit, zmax: limit, colorscale, bar: { unit, ticks: evenTicks(-limit, limit), ends: endsOfScale(column) } };
  }
  const positive = shown.filter((value) => value > 0);
  if (low >= 0 && positive.length > 1 && high > 1e3 * quantile(positive, 0.02)) return decadeScale(positive, unit);
  const top = high > low ? high : low + (Math.abs(low) || 1);
  return { z: (v) => v, zmin: low, zmax: top, colorscale: SEQUENTIAL, bar: { unit, ticks: evenTicks(low, top) } };
}

/** Return words for the ends of a scale of both signs: for a rate of growth, or for a square or a rate that is negative at growth. */
function endsOfScale(column) {
  if (part.grows?.(column)) return ["stable", "unstable"];
  return /^(omega_squared|signed_rate)/.test(column.name) ? ["unstable", "stable"] : null;
}

/** Return about five round numbers between two numbers, each with its text. */
function evenTicks(low, high) {
  const rough = (high - low) / 5;
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map((k) => k * power).find((one) => one >= rough * (1 - 1e-9)) ?? rough;
  const digits = Math.min(12, Math.max(3, 1 + Math.ceil(Math.log10(Math.max(Math.abs(low), Math.abs(high)) / step))));
  const first = Math.ceil(low / step - 1e-9);
  const all = Array.from({ length: 8 }, (_, i) => (first + i) * step).filter((at) => Number.isFinite(at) && at <= high + 1e-9 * step);
  return all.filter((_, i) => digits <= 6 || i % 3 === 0).map((at) => ({ at, text: numberText(at, digits) })); // long ones stand apart
}

/** Return the bar of colours below a picture: Plotly's own bar takes a third of the time of a slider's step. */
function colorBar({ zmin, zmax, colorscale, bar: { unit, ticks, ends } }) {
  const stripe = element("i", {});
  stripe.style.background = `linear-gradient(to right, ${colorscale.map(([at, color]) => `${color} ${100 * at}%`).join(", ")})`;
  const labels = ticks.map(({ at, text }) => {
    const label = element("span", { textContent: text });
    label.style.left = `${(100 * (at - zmin)) / (zmax - zmin)}%`;
    return label;
  });
  const [low, high] = ends ? [`${ends[0]} ←`, `→ ${ends[1]}`] : ["", ""];
  return element("li", { className: "bar" }, low, element("div", {}, stripe, ...labels), `${unit} ${high}`);
}

function decadeScale(positive, unit) {
  const [low, high] = [Math.log10(positive[0]), Math.log10(positive[positive.length - 1])];
  const step = Math.max(1, Math.ceil((high - low) / 8));
  const ticks = [];
  for (let decade = Math.ceil(low); decade <= high; decade += step) ticks.push({ at: decade, text: `10${superscript(String(decade))}` });
  return { z: (v) => (v > 0 ? Math.log10(v) : null), zmin: low, zmax: high, colorscale: SEQUENTIAL, bar: { unit, ticks } };
}

function flagScale(column) {
  const n = column.flags.length;
  const colors = column.flags.map((flag, i) => flagColor(flag.meaning, i));
  const order = new Map(column.flags.map((flag, i) => [flag.value, i]));
  const colorscale = colors.flatMap((color, i) => [[i / n, color], [(i + 1) / n, color]]);
  return { z: (v) => order.get(v) ?? null, zmin: -0.5, zmax: n - 0.5, colorscale };
}

function pageColor(name) {
  return getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
}

/** Return a text for Plotly, which interprets some HTML in its texts: all tags but line breaks are escaped. */
function escapeText(text) {
  return text.replace(/&/g, "&amp;").replace(/<(?!br>|\/?extra>)/g, "&lt;");
}

/** Return traces or a layout with all texts escaped. */
function escapeTexts(value) {
  if (typeof value === "string") return escapeText(value);
  if (Array.isArray(value)) return value.some((one) => typeof one === "string" || typeof one === "object") ? value.map(escapeTexts) : value;
  return value?.constructor === Object ? Object.fromEntries(Object.entries(value).map(([key, one]) => [key, escapeTexts(one)])) : value;
}

/** Draws traces by Plotly in the page's colours; all texts of the file that Plotly draws are escaped here. */
function draw(target, traces, layout, config = {}) {
  Plotly.react(target, escapeTexts(traces), escapeTexts(plotLayout(layout)), { ...PLOT_CONFIG, ...config });
}

/** Plotly's layout in the page's colours. */
function plotLayout(more) {
  const ink = pageColor("ink");
  const axis = { gridcolor: pageColor("grid"), linecolor: pageColor("quiet"), zerolinecolor: pageColor("grid"), ticks: "outside", tickcolor: pageColor("quiet"), automargin: true };
  return {
    paper_bgcolor: "rgba(0,0,0,0)",
    plot_bgcolor: "rgba(0,0,0,0)",
    font: { family: "system-ui, sans-serif", size: textSize(), color: ink },
    margin: { l: 64, r: 12, t: 24, b: 56 },
    ...more,
    ...Object.fromEntries(Object.entries(more).filter(([key]) => /^[xy]axis/.test(key)).map(([key, value]) => [key, { ...axis, ...value }])),
  };
}

// Plotly's own button would send the chart to a web service: this page requests nothing from the network.
const PLOT_CONFIG = { displaylogo: false, showSendToCloud: false, showEditInChartStudio: false, plotlyServerURL: "", responsive: true, modeBarButtonsToRemove: ["select2d", "lasso2d", "autoScale2d"], doubleClick: "reset" };
