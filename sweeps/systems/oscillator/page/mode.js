// Systems of small oscillations: the motion of the chosen mode, x(t) = cos Ωt, or cosh λt where Ω² < 0.

function modeMotion(square) {
  const rate = Math.sqrt(Math.abs(square));
  if (square > 0) return { end: (6 * Math.PI) / rate, x: (t) => Math.cos(rate * t), words: `It oscillates: one period takes ${timeText((2 * Math.PI) / rate)}.` };
  if (square < 0) return { end: 4 / rate, x: (t) => Math.cosh(rate * t), words: `It runs away: e times as far every ${timeText(1 / rate)}.` };
  return { end: 1, x: (t) => 1 + t, words: "Neither oscillates nor grows: it drifts in proportion to time." };
}

/** Ω² of the chosen point; zero where the map calls it marginal, for then its sign means nothing. */
function modeSquare() {
  const { omega_squared: square, regime } = theMap.columns;
  return regime?.meanings.get(regime.at(state.place)) === "marginal" ? 0 : square.at(state.place);
}

function drawMode() {
  const square = modeSquare();
  const words = document.getElementById("mode-words");
  document.getElementById("mode-where").textContent = placeText(state.place);
  if (!Number.isFinite(square)) {
    words.textContent = "There is no such mode at this point.";
    Plotly.purge("mode-plot");
    return;
  }
  const { end, x, words: said } = modeMotion(square);
  words.textContent = said;
  const times = Array.from({ length: 401 }, (_, i) => (i * end) / 400);
  const trace = { type: "scatter", mode: "lines", x: times, y: times.map(x), line: { color: pageColor("accent"), width: 2 }, hoverinfo: "skip" };
  const layout = { height: 300, showlegend: false, dragmode: false, xaxis: { title: { text: "time (s)" }, exponentformat: "power" }, yaxis: { title: { text: "displacement over its start" } } };
  Plotly.react("mode-plot", [trace], plotLayout(layout), PLOT_CONFIG);
}

function buildMode() {
  if (!theMap.columns.omega_squared) return;
  document.getElementById("mode").hidden = false;
  drawMode();
  onChange(drawMode);
}
