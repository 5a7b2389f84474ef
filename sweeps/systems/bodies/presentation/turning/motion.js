// The motion of the chosen point: the body turning, its polhode and ω(t), from the exact solution.
//
// A system whose motion it is says in its `part`:
//   start(place)   moments, axis, omega0, epsilon and phase; `sizeInWords`, if epsilon alone is not clear; or
//                  moments, omega0 and `omega`, the angular velocity at time 0, where it is no perturbed spin;
//                  `onSphere` to draw the angular momentum on its sphere in place of the polhode
//   spoken(shown)  the motion in a sentence, where that is not the stability of a spin (then null)
//   marks(shown)   periods to be marked over time: [name, s]
//   isBox()        true if the body is known to be a uniform box

const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 5, 10, 30, 100];
const TRAIL_ROTATIONS = 3;
const PLOT_MARGIN = { l: 70, r: 12 };

const motion = { t: 0, ticks: [] };

/** What of it the console may look at. */
const MOTION_SHOWN = { jacobi, completeK, Trajectory, perturbedSpin, Attitude, rotated, motion };

/** Moments, spin and perturbation of the chosen point; the drawing may show another perturbation than the map's. */
function motionOf(place) {
  const given = part.start(place);
  const rotation = (2 * Math.PI) / Math.abs(given.omega0);
  if (given.shaken) {
    const trajectory = new ShakenTrajectory(given, rotation);
    return { ...given, trajectory, rotation, flips: false, end: trajectory.end, attitudes: { at: (t) => trajectory.attitudeAt(t) } };
  }
  const trajectory = new (given.onSphere ? SphereTrajectory : Trajectory)(given.moments, given.omega ?? perturbedSpin(given));
  return { ...given, trajectory, rotation, ...span(trajectory, given), attitudes: new Attitude(trajectory), ...(given.end > 0 ? { end: given.end } : {}) };
}

/** How long the drawing runs, s: two flips or two turns of the wobble, within what an eye can follow. */
function span(trajectory, { axis, omega0 }) {
  const rotation = (2 * Math.PI) / Math.abs(omega0);
  const flips = axis > 0 && trajectory.roles[2] !== axis - 1 && trajectory.p > 0 && !trajectory.isStationary;
  const whole = trajectory.flipPeriod * (flips ? 2 : 4);
  const end = Number.isFinite(whole) ? Math.max(3 * rotation, Math.min(whole, (flips ? 5000 : 700) * rotation)) : 12 * rotation;
  return { flips, end };
}

const RANKS = ["least", "intermediate", "greatest"];

function hasEqualMoments(moments) {
  return moments.some((I, i) => moments.some((other, k) => i !== k && Math.abs(I - other) < 1e-9 * I));
}

/** "its intermediate axis", or the axis by its number where two moments are the same. */
function axisInWords(moments, axis) {
  return hasEqualMoments(moments) ? `axis ${axis}` : `its axis of ${RANKS[orderOfMoments(moments).indexOf(axis - 1)]} inertia`;
}

function nameInWords(named) {
  return (named ?? "your body").replace(/^(?=phone|book)/, "your ").replace(/^(?=tennis)/, "the ");
}

function subjectInWords({ moments }) {
  const body = theMap.coordinates.body;
  if (state.moments) return nameInWords(state.named);
  if (body) return String(coordinateAt("body", state.place));
  return looksLikeRacket(meanSquares(moments)) ? "this racket" : "this body";
}

/** The verdict on a spin, in the words of the command: its regime follows from the order of the moments alone. */
function verdictOf(moments, axis) {
  const [a, b, c] = [0, 1, 2].map((k) => moments[(axis - 1 + k) % 3]);
  const equal = b === c ? "sphere" : "marginal";
  const apart = a < b !== a < c ? "unstable" : a < b ? "stable_minor" : "stable_major";
  const regime = a === b || a === c ? equal : apart;
  return { regime, ...theMap.verdicts[regime] };
}

function capitalized(text) {
  return text && text[0].toUpperCase() + text.slice(1);
}

function motionInWords(shown) {
  const { trajectory, flips, rotation, axis, moments } = shown;
  const spoken = part.spoken?.(shown);
  if (spoken) return spoken;
  if (shown.shaken) return shakenOutcome(shown);
  const period = trajectory.flipPeriod;
  const spun = `Spun about ${axisInWords(moments, axis)}, ${subjectInWords(shown)}`;
  const turns = (time) => `${numberText(time / rotation, 3)} rotations`;
  const { regime, words, more } = verdictOf(moments, axis);
  const verdict = capitalized(words.split(",")[0]);
  if (trajectory.isStationary) return `${verdict}. ${spun} keeps its steady rotation.`;
  if (!Number.isFinite(period)) return `${verdict}. ${spun} flips once and never again: it is on the separatrix.`;
  const sizeInWords = shown.sizeInWords ?? `ε = ${numberText(shown.epsilon, 2)}`;
  const flipping = `flips every ${timeText(period)} (${turns(period)}; ${sizeInWords})`;
  if (regime === "marginal") return `${verdict}. ${spun} is neither stable nor unstable: ${more}; it ${flipping}.`;
  const too = flips && regime !== "unstable" ? `${verdict}, but this perturbation is too large` : verdict;
  const outcome = flips ? flipping : `keeps its axis and wobbles with period ${timeText(2 * period)} (${turns(2 * period)}; ${sizeInWords})`;
  return `${too}. ${spun} ${outcome}.${more && ` ${capitalized(more)}.`}`;
}

/** The growth of a shaken body's wobble, as drawn: its greatest tilt over that of the first period of the modulation. */
function shakenOutcome({ trajectory, rotation, axis, moments, shaken, end }) {
  const period = (2 * Math.PI) / shaken.frequency;
  const tilt = (t) => {
    const L = directionOf(trajectory.momentum(t));
    return Math.acos(Math.min(1, Math.abs(L[axis - 1])));
  };
  const tilts = Array.from({ length: 2000 }, (_, k) => tilt((k * end) / 2000));
  const first = Math.max(...tilts.filter((_, k) => (k * end) / 2000 <= period));
  const greatest = tilts.reduce((best, one, k) => (one > tilts[best] ? k : best), 0);
  const factor = tilts[greatest] / first;
  const outcome = factor > 1.5 ? `its wobble grows ${numberText(factor, 2)} times within ${numberText((greatest * end) / 2000 / rotation, 2)} rotations: unstable` : "its wobble does not grow";
  return `Spun about ${axisInWords(moments, axis)}, ${subjectInWords({ moments })} has one moment changed every ${timeText(period)}, and ${outcome}.`;
}

/** First time, s, at which the spin about its axis passes zero, which it does once in a flip's period; or nothing. */
function firstFlip({ trajectory, axis, end }) {
  const spin = (t) => trajectory.at(t)[axis - 1];
  let [low, high] = [0, Math.min(end, trajectory.flipPeriod)];
  const start = spin(low);
  if (start * spin(high) > 0) return null;
  for (let k = 0; k < 60; k++) {
    const middle = 0.5 * (low + high);
    if (start * spin(middle) <= 0) high = middle;
    else low = middle;
  }
  return low;
}

function showMotion() {
  const there = part.start(state.place) !== null;
  for (const id of ["motion", "motion-first"]) document.getElementById(id).hidden = !there;
  if (!there) return motion.player.set(false);
  const shown = motionOf(state.place);
  Object.assign(motion, { axis: null, shaken: null, losing: null }, shown, { t: 0, flip: shown.flips ? firstFlip(shown) : null });
  const { moments } = motion;
  motion.squares = meanSquares(moments);
  const shape = document.getElementById("shape");
  const own = ownSurface();
  const option = shape.querySelector("[value=own]");
  option.hidden = option.disabled = !own;
  if (!shape.dataset.chosen || (shape.value === "own" && !own)) selectOption(shape, own ? "own" : part.isBox?.() ? "box" : looksLikeRacket(motion.squares) ? "racket" : "box");
  motion.faces = bodyFaces(motion.squares, shape.value);
  motion.polhode.show(motion.trajectory, motion.axis);
  motion.herpolhode.show(motion);
  document.getElementById("motion-where").textContent = placeText(state.place);
  motion.words = motionInWords(motion) + (isPossible(moments) ? "" : " Physically impossible moments: the body shown is the nearest possible one.");
  document.getElementById("motion-words").textContent = motion.words;
  const marks = part.marks?.(motion) ?? [];
  document.getElementById("marks-note").textContent = marks.map(([name, period], i) => ` ${["Dashed", "Dotted"][i]}: every ${name} = ${timeText(period)}.`).join("");
  document.getElementById("say").textContent = motion.words;
  showFlipPeriod();
  showFilmCommand(shown);
  document.getElementById("to-flip").hidden = motion.flip === null;
  document.getElementById("polhode-note").textContent = motion.polhode.tiny ? "At this ε the polhode is too small to see: choose a larger perturbation." : "";
  setSpeed();
  motion.drawTraces();
  seek(motion.flip === null ? 0 : Math.max(0, motion.flip - 2 * motion.rotation));
}

/** Shows the command that makes a film of this motion. */
function showFilmCommand({ moments, axis, omega, omega0, epsilon, phase, shaken }) {
  const line = document.getElementById("film");
  line.hidden = Boolean(shaken) || !isPossible(moments);
  const spin = omega ? `--omega ${omega.join(" ")}` : `--axis ${axis} --omega0 ${omega0} --epsilon ${epsilon} --phase ${phase}`;
  line.querySelector("code").textContent = `polhode motion --moments ${moments.join(" ")} ${spin} -o body.mp4`;
}

function showFlipPeriod() {
  const data = document.getElementById("flip-period");
  document.getElementById("flip-line").hidden = !motion.flips || !Number.isFinite(motion.trajectory.flipPeriod);
  data.value = String(motion.trajectory.flipPeriod);
  data.textContent = Number.isFinite(motion.trajectory.flipPeriod) ? withUnit(motion.trajectory.flipPeriod, "s", 8) : "infinite";
}

/** A speed at which the whole motion takes about half a minute, between half a rotation and five a second. */
function setSpeed() {
  const speed = document.getElementById("speed");
  if (speed.dataset.chosen) return;
  const wanted = Math.max(0.5, Math.min(5, motion.end / motion.rotation / 30));
  selectOption(speed, String(SPEEDS.reduce((best, one) => (Math.abs(Math.log(one / wanted)) < Math.abs(Math.log(best / wanted)) ? one : best))));
}

function drawTraces() {
  const times = traceTimes();
  const omegas = times.map((t) => motion.trajectory.at(t));
  const [factor, unit] = [["years", 31557600], ["days", 86400], ["h", 3600], ["s", 1]].filter(([, one]) => motion.end >= 3 * one || one === 1).map(([name, one]) => [one, name])[0];
  const colors = [theMap.seriesColors[0], theMap.seriesColors[1], theMap.seriesColors[2]];
  const hasPowers = Math.abs(Math.log10(Math.max(...omegas.flat().map(Math.abs)))) > 2.5; // in the numbers of its axes
  const traces = [0, 1, 2].map((i) => ({ type: "scatter", mode: "lines", name: `ω${SUBSCRIPTS[i]}`, x: times.map((t) => t / factor), y: omegas.map((w) => w[i]), xaxis: "x", yaxis: i ? `y${i + 1}` : "y", line: { color: colors[i], width: 2 }, hovertemplate: `ω${SUBSCRIPTS[i]} = %{y} rad s⁻¹<br>t = %{x} ${unit}<extra></extra>` }));
  const layout = { height: document.documentElement.hasAttribute("data-printing") ? 190 : 420, margin: { ...PLOT_MARGIN, ...(hasPowers && { l: 92 }), t: 10, b: 46 }, showlegend: false, dragmode: false, hovermode: "closest", xaxis: { title: { text: `time (${unit})` }, range: [0, motion.end / factor], fixedrange: true, anchor: "y3", automargin: false, exponentformat: "power" } };
  [0, 1, 2].forEach((i) => {
    layout[i ? `yaxis${i + 1}` : "yaxis"] = { domain: [0.7 - 0.35 * i, 1 - 0.35 * i], title: { text: `ω${SUBSCRIPTS[i]}`, standoff: 4 }, fixedrange: true, automargin: false, exponentformat: "power", nticks: 4, ...componentRange(omegas.map((w) => w[i])) };
  });
  layout.shapes = (part.marks?.(motion) ?? []).flatMap(([, period], i) => [1, 2, 3, 4].filter((k) => k * period <= motion.end).map((k) => ({ type: "line", xref: "x", yref: "paper", x0: (k * period) / factor, x1: (k * period) / factor, y0: 0, y1: 1, line: { color: pageColor("quiet"), width: 1.2, dash: DASHES_OF_PERIODS[i] } })));
  draw("traces", traces, layout, { displayModeBar: false });
}
const DASHES_OF_PERIODS = ["dash", "dot"];

const EVEN = 900; // points of ω(t)
const AT_FLIP = 120; // more around each flip, over sixteen of the times in which it grows e-fold

/** Times of ω(t), close together where the body flips, so that the curves are smooth there too. */
function traceTimes() {
  const { end, flip, trajectory } = motion;
  const even = Array.from({ length: EVEN + 1 }, (_, i) => (i * end) / EVEN);
  const period = trajectory.flipPeriod;
  if (flip === null || !Number.isFinite(period)) return even;
  const flips = Array.from({ length: Math.min(8, 1 + Math.floor((end - flip) / period)) }, (_, k) => flip + k * period);
  const close = flips.flatMap((at) => Array.from({ length: AT_FLIP + 1 }, (_, i) => at + (16 * (i / AT_FLIP - 0.5)) / (trajectory.p * trajectory.unit)));
  return [...even, ...close.filter((t) => t > 0 && t < end)].sort((a, b) => a - b);
}
const SUBSCRIPTS = "₁₂₃";

/** A component that hardly changes is drawn as a level line, not as its last digits. */
function componentRange(values) {
  const [low, high] = values.reduce(([low, high], v) => [Math.min(low, v), Math.max(high, v)], [Infinity, -Infinity]);
  const size = Math.max(Math.abs(low), Math.abs(high));
  if (high - low > 1e-4 * size) return { range: [low - 0.08 * (high - low), high + 0.08 * (high - low)] };
  return { range: size > 0 ? [low - 0.1 * size, high + 0.1 * size] : [-1, 1] };
}

function seek(t) {
  motion.t = Math.max(0, Math.min(motion.end, t));
  const slider = document.getElementById("time");
  slider.value = String(Math.round((1000 * motion.t) / motion.end));
  slider.setAttribute("aria-valuetext", timeText(motion.t));
  document.getElementById("time-text").textContent = `${timeText(motion.t)} · ${numberText(motion.t / motion.rotation, 3)} rotations`;
  motion.attitude = motion.attitudes.at(motion.t);
  motion.omega = motion.trajectory.at(motion.t);
  motion.trail = handleTrail(motion);
  motion.scene.render();
  motion.polhode.tick(motion.trajectory.tip(motion.t));
  motion.herpolhode.tick(motion.t);
  motion.moveCursor();
  for (const tick of motion.ticks) tick();
}

/** The line over ω(t) where the motion is. */
function moveCursor() {
  const width = document.getElementById("traces").clientWidth - PLOT_MARGIN.l - PLOT_MARGIN.r;
  document.getElementById("cursor").style.left = `${PLOT_MARGIN.l + (width * motion.t) / motion.end}px`;
}

/** Where something has pointed in the last rotations: the newest point last. */
function trailOf(pointing) {
  const { rotation, t } = motion;
  const length = Math.min(t, TRAIL_ROTATIONS * rotation);
  const n = Math.ceil((length / rotation) * 48) + 1;
  return Array.from({ length: n + 1 }, (_, i) => pointing(t - length + (i * length) / n));
}

/** The trail in space of the handle, the axis of least moment. */
function handleTrail({ trajectory, attitudes }) {
  const handle = orderOfMoments(trajectory.moments)[0];
  return trailOf((t) => rotated(attitudes.at(t), [0, 1, 2].map((i) => Number(i === handle))));
}

/** The trail of L in the body, which stands as it began. */
function momentumTrail({ trajectory, attitudes }) {
  return trailOf((t) => rotated(attitudes.at(0), directionOf(trajectory.momentum(t))));
}

/** How what stands in space is drawn: as it is, or as the body sees it, which then stands as it began. */
function frameOfView() {
  if (document.getElementById("frame").value === "space") return (vector) => vector;
  const back = quaternionProduct(motion.attitudes.at(0), reversed(motion.attitude));
  return (vector) => rotated(back, vector);
}

function drawBody(view) {
  if (!motion.attitude) return;
  const inSpace = document.getElementById("frame").value === "space";
  const seen = frameOfView();
  const attitude = inSpace ? motion.attitude : motion.attitudes.at(0);
  const trail = inSpace ? motion.trail : momentumTrail(motion);
  drawSphere(view);
  strokeLine(view, [seen([0, 0, -1.3]), seen([0, 0, 1.05])], pageColor("grid"), 1.5, [3, 4]);
  drawTrail(view, trail, false);
  drawSolid(view, motion.faces, attitude);
  arrow(view, seen([0, 0, 1.05]), seen([0, 0, 1.28]), pageColor("quiet"), "L");
  drawBodyAxes(view, attitude, motion.axis);
  drawTrail(view, trail, true);
  const omega = directionOf(seen(rotated(motion.attitude, motion.omega)));
  view.pen.globalAlpha = 0.9;
  arrow(view, [0, 0, 0], omega.map((w) => 1.2 * w), theMap.seriesColors[3], "ω", -1);
  view.pen.globalAlpha = 1;
}

/** The outline of the sphere on which the trail runs. */
function drawSphere({ pen, project, width, height }) {
  const [right] = viewAxes();
  pen.beginPath();
  pen.arc(width / 2, height / 2, project(right)[0] - width / 2, 0, 2 * Math.PI);
  pen.strokeStyle = pageColor("grid");
  pen.lineWidth = 1;
  pen.stroke();
}

/** The part of a trail on the near or the far side of the sphere, older parts fainter. */
function drawTrail(view, points, near) {
  const { pen, toward } = view;
  for (let i = 1; i < points.length; i++) {
    if (dot(points[i], toward) > 0 !== near) continue;
    pen.globalAlpha = (near ? 1 : 0.35) * (0.15 + 0.85 * (i / points.length));
    strokeLine(view, [points[i - 1], points[i]], pageColor("accent"), near ? 2.4 : 1.4);
  }
  pen.globalAlpha = 1;
}

function advance(seconds) {
  const next = motion.t + seconds * Number(document.getElementById("speed").value) * motion.rotation;
  seek(next >= motion.end ? 0 : next);
}

/** Space plays and pauses where it does nothing else: not on a button of a map of bodies, which it presses. */
function playBySpace(event) {
  if (event.key !== " " || event.target !== event.currentTarget) return;
  motion.player.set(!motion.player.playing);
  event.preventDefault();
}

function fillMotionControls() {
  const speed = document.getElementById("speed");
  for (const one of SPEEDS) speed.append(element("option", { value: String(one), textContent: `${numberText(one, 3)} rotation${one === 1 ? "" : "s"} per second` }));
  speed.onchange = () => (speed.dataset.chosen = "yes");
  document.getElementById("frame").onchange = showFrame;
  const shape = document.getElementById("shape");
  shape.onchange = () => {
    shape.dataset.chosen = "yes";
    motion.faces = bodyFaces(motion.squares, shape.value);
    motion.scene.render();
  };
}

function showFrame() {
  const inSpace = document.getElementById("frame").value === "space";
  document.getElementById("body-note").textContent = inSpace ? "Inertial frame: L fixed, line = path of the handle." : "Body frame: line = path of L.";
  motion.scene.render();
}

function buildMotion() {
  fillMotionControls();
  motion.scene = new Scene(document.getElementById("body-canvas"), 1.36, drawBody);
  motion.polhode = new PolhodePicture(document.getElementById("polhode-canvas"));
  motion.herpolhode = new HerpolhodePicture(document.getElementById("herpolhode-canvas"));
  motion.drawTraces = whenSeen(document.getElementById("traces"), drawTraces);
  motion.moveCursor = whenSeen(document.getElementById("traces"), moveCursor);
  motion.player = new Player(document.getElementById("play"), advance);
  document.getElementById("to-flip").onclick = () => {
    seek(motion.flip - 1.5 * motion.rotation);
    motion.player.set(true);
  };
  document.getElementById("time").oninput = (event) => seek((event.target.value / 1000) * motion.end);
  document.getElementById("copy-link").onclick = copyLink;
  for (const name of ["map", "body-canvas", "polhode-canvas"]) document.getElementById(name).addEventListener("keydown", playBySpace);
  onChange(showMotion);
  showFrame();
  showMotion();
  motion.player.begin();
}

async function copyLink() {
  const said = document.getElementById("copied");
  const address = location.href.split("#")[0] + link();
  try {
    await navigator.clipboard.writeText(address);
    said.textContent = "copied";
  } catch {
    location.hash = link();
    said.textContent = "the link is in the address bar";
  }
}
