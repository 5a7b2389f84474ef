// Any body: typed, chosen among well-known ones, or dragged over the plane; its motion is the closed form's.
//
// `state.moments` and `state.spin` are null where the body and the spin rate are those of the map's chosen point.

const LARGE_ENOUGH = 0.1; // perturbation that a page begins with: that of a throw by hand, and large enough to be seen

function momentsOfLink(text) {
  const moments = (text ?? "").split(",").map(Number);
  return impossibleInWords(moments) === "" ? moments : null;
}

function refusalOfLink(name, text) {
  return ["moments", "_moments"].includes(name) ? impossibleInWords(text.split(",").map(Number)) : undefined;
}

function spinOfLink(text) {
  return Number(text) > 1e-150 && Number(text) < 1e150 ? Number(text) : null;
}

/** A choice of another body or spin rate of the map ends that of one of the reader's own. */
function backToTheMap(changes) {
  if (!changes.place) return;
  const moved = (names) => names.some((name) => theMap.order.includes(name) && changes.place[theMap.order.indexOf(name)] !== state.place[theMap.order.indexOf(name)]);
  if (!("moments" in changes) && moved([...MOMENTS, "I1_over_I3", "thickness", "body"])) Object.assign(changes, { moments: null, named: null });
  if (!("spin" in changes) && moved(["omega0", "body"])) changes.spin = null;
}

function dragBody(X, Y) {
  const moments = momentsAt(X, Y);
  if (!moments || !isPossible(moments)) return;
  const size = slanted() ? coordinateAt("I3", state.place) : 1;
  choose({ moments: moments.map((I) => I * size), named: null, place: locate(X, Y)?.place ?? state.place });
}

/** The outcome of a spin about an axis: Ω² of linear theory, its words, and the period of the flip or the wobble. */
function axisOutcome(moments, axis, omega0, epsilon, phase) {
  const [a, b, c] = [0, 1, 2].map((k) => moments[(axis - 1 + k) % 3]);
  const square = omega0 ** 2 * ((a - b) / b) * ((a - c) / c);
  const trajectory = new Trajectory(moments, perturbedSpin({ axis, omega0, epsilon, phase }));
  const { flips } = span(trajectory, { axis, omega0 });
  const rate = Math.sqrt(Math.abs(square));
  const period = trajectory.flipPeriod * (flips ? 1 : 2);
  const { regime, words, more } = verdictOf(moments, axis);
  const exact = Number.isFinite(period) ? `${flips ? "flips every" : "wobbles in"} ${timeText(period)}` : "never comes round";
  if (square === 0) return { square, rate, period, regime, flips, words: `${words}: ${more}${flips ? `; ${exact} at ε = ${numberText(epsilon, 2)}` : ""}` };
  const linear = square > 0 ? `wobble period ${timeText((2 * Math.PI) / rate, 6)}` : `perturbations grow e-fold in ${timeText(1 / rate, 6)}`;
  return { square, rate, period, regime, flips, words: `${words}: ${linear} (linear theory); ${exact} at ε = ${numberText(epsilon, 2)}${more && `; ${more}`}` };
}

/** What is known of a body between the points of the map: the closed form. Null on a point. */
function between() {
  if (state.shaken || state.days != null || (!state.moments && !state.spin)) return null;
  const { moments, axis, omega0, epsilon, phase } = bodyStart(state.place);
  const { square, rate, period, regime, flips } = axisOutcome(moments, axis, omega0, epsilon, phase);
  const rows = [["regime", "–", theMap.verdicts[regime].words], ["Ω² (negative: unstable)", "–", withUnit(square, "s-2")]];
  rows.push([square < 0 ? "growth rate" : "frequency", "–", withUnit(rate, square < 0 ? "s-1" : "rad s-1")]);
  if (Number.isFinite(period)) rows.push([flips ? "flip period, exact" : "wobble period, exact", "–", withUnit(period, "s")]);
  const words = `Between the points of the map: nothing is measured here. I = ${moments.map((I) => numberText(I, 6)).join(", ")} kg m², ω₀ = ${withUnit(omega0, "rad s-1")}, axis ${axis}.`;
  return { rows, words };
}

function namedBodies() {
  if (![state.x, state.y].some((name) => MOMENTS.includes(name)) && !slanted()) return [];
  const shown = theMap.presets.map(({ name, moments }) => ({ name, at: placeOfBody(moments) }));
  const [xs, ys] = [theMap.plane.xEdges, theMap.plane.yEdges].map((edges) => [edges[0], edges[edges.length - 1]]);
  const inside = ([x, y]) => xs[0] <= x && x <= xs[1] && (slanted() ? y <= 1 : ys[0] <= y && y <= ys[1]);
  const seen = lecture.on ? [] : shown.filter(({ at }) => at && inside(at)); // large names have no room
  return seen.map(({ name, at: [x, y] }) => ({ name, x, y }));
}

// ---------------------------------------------------------------------------------------------------------
// The controls

function choosePreset({ name, moments, omega0, axis, mass }) {
  const place = theMap.order.includes("axis") ? placeWith({ axis: Math.max(0, theMap.coordinates.axis.values.indexOf(axis)) }) : state.place;
  if (mass) document.getElementById("own-mass").value = String(mass);
  chooseBody({ moments, spin: omega0, named: name, place, shaken: null });
}

const CM = 0.01; // m; the edges of a box are given in centimetres

/** Return true if the reader gives the edges and the mass of a box, not three moments. */
function givesBox() {
  return document.getElementById("own-by").value === "box";
}

function ownField(name) {
  return Number(document.getElementById(`own-${name}`).value.trim().replace(",", ".").replace("−", "-") || NaN);
}

/** Return the edges, cm, of the uniform box of the typed mass m with these moments: edge i has m a_i²/12 = (I_j + I_k − I_i)/2. */
function boxEdges(moments) {
  const half = moments.reduce((sum, I) => sum + I) / 2;
  return moments.map((I) => Math.sqrt((12 / ownField("mass")) * Math.max(0, half - I)) / CM);
}

function boxMoments(edges, mass) {
  const squares = edges.map((edge) => (mass / 12) * (edge * CM) ** 2);
  return squares.map((square) => squares.reduce((sum, one) => sum + one) - square);
}

/** Return why no body has these moments; "" if one has. */
function impossibleInWords(moments) {
  if (moments.length !== 3 || !moments.every((I) => I > 0 && Number.isFinite(I))) return "Three positive numbers are needed (kg m²).";
  const most = moments.indexOf(Math.max(...moments));
  return isPossible(moments) ? "" : `No rigid body has these moments: ${symbolText(MOMENTS[most])} is greater than the sum of the others.`;
}

function typedBody() {
  const values = MOMENTS.map(ownField);
  const isBox = givesBox() && [...values, ownField("mass")].every((value) => value > 0);
  const moments = isBox ? boxMoments(values, ownField("mass")) : values;
  const notice = document.getElementById("own-notice");
  notice.textContent = givesBox() && !isBox ? "Four positive numbers are needed (cm, kg)." : impossibleInWords(moments);
  notice.hidden = notice.textContent === "";
  if (notice.hidden) return chooseBody({ moments, named: null });
  motion.player.set(false);
  for (const id of ["say", "motion-words"]) document.getElementById(id).textContent = notice.textContent;
}

function chooseBody(changes) {
  choose(changes);
  renewLecture();
}

/** A slider's value and no place; or, within a step of one of the map's values, that one and its place. */
function snapped(name, value) {
  const values = theMap.coordinates[name].values.map(Math.abs);
  const at = values.findIndex((one) => Math.abs(Math.log10(one / value)) < 0.006);
  return at < 0 ? [value, null] : [values[at], theMap.order.includes(name) ? placeWith({ [name]: at }) : state.place];
}

function buildOwn() {
  const chips = theMap.presets.map((preset) => element("button", { type: "button", textContent: preset.name, onclick: () => choosePreset(preset) }));
  document.getElementById("presets").append(...chips);
  for (const name of [...MOMENTS, "mass"]) document.getElementById(`own-${name}`).oninput = typedBody;
  const [spin, epsilonSlider] = ["spin", "epsilon-shown"].map((id) => document.getElementById(id));
  spin.oninput = () => {
    const [value, place] = snapped("omega0", 10 ** Number(spin.value));
    choose(place ? { spin: null, place } : { spin: value });
  };
  epsilonSlider.oninput = () => {
    const [value, place] = snapped("epsilon", 10 ** Number(epsilonSlider.value));
    choose({ epsilon: value, place: place ?? state.place });
  };
  const show = () => {
    const { omega0, epsilon } = bodyStart(state.place);
    const { moments } = lecture.on ? teaching.body : bodyStart(state.place);
    const isBox = givesBox();
    const values = isBox ? boxEdges(moments) : moments;
    MOMENTS.forEach((name, i) => {
      const input = document.getElementById(`own-${name}`);
      input.previousSibling.textContent = isBox ? `edge ${i + 1} (cm)` : `${symbolText(name)} (kg m²)`;
      if (document.activeElement !== input) input.value = String(Number(values[i].toPrecision(6)));
    });
    document.getElementById("own-mass").parentElement.hidden = !isBox;
    if (!document.activeElement?.matches("#own .moment input")) document.getElementById("own-notice").hidden = true;
    document.getElementById("own").toggleAttribute("data-days", state.days != null);
    document.getElementById("days").value = String(state.days ?? 0);
    document.getElementById("days-text").textContent = `${numberText(state.days ?? 0, 3)} days`;
    spin.value = String(Math.log10(Math.abs(omega0)));
    epsilonSlider.value = String(Math.log10(epsilon));
    document.getElementById("spin-text").textContent = `ω₀ = ${withUnit(omega0, "rad s-1", 4)}`;
    document.getElementById("epsilon-text").textContent = `ε = ${numberText(epsilon, 2)}`;
    const { named } = lecture.on ? teaching.body : state;
    chips.forEach((chip, i) => chip.setAttribute("aria-pressed", String(theMap.presets[i].name === named)));
  };
  document.getElementById("own-by").onchange = show;
  document.getElementById("days").oninput = ({ target }) => choose({ days: Number(target.value) });
  onChange(show);
  show();
}

// ---------------------------------------------------------------------------------------------------------
// Three axes side by side

function buildThree() {
  const scenes = [1, 2, 3].map((axis) => {
    const scene = new Scene(document.getElementById(`three-${axis}`), 1.36, (view) => drawThrown(view, scene, axis));
    scene.late = whenSeen(scene.canvas, () => scene.render());
    return scene;
  });
  const show = () => {
    const { shaken, ...start } = bodyStart(state.place);
    scenes.forEach((scene, i) => {
      const { moments, omega0, epsilon, phase } = start;
      scene.attitudes = new Attitude(new Trajectory(moments, perturbedSpin({ ...start, axis: i + 1 })));
      const { words } = axisOutcome(moments, i + 1, omega0, epsilon, phase);
      document.getElementById(`outcome-${i + 1}`).replaceChildren(element("strong", { textContent: `Axis ${i + 1} ` }), words);
      scene.late();
    });
  };
  motion.thrown = scenes;
  motion.ticks.push(() => scenes.forEach((scene) => scene.late()));
  onChange(show);
  show();
}

function drawThrown(view, { attitudes }, axis) {
  if (!attitudes || !motion.faces) return;
  const attitude = attitudes.at(motion.t);
  drawSolid(view, motion.faces, attitude);
  drawBodyAxes(view, attitude, axis);
}

// ---------------------------------------------------------------------------------------------------------
// The lecture

const RESONANT = 0.35; // depth of the shaking

/** One moment across the axis shaken at twice the wobble's rate, which pumps a stable spin. */
function shaking({ moments, axis, omega0 }) {
  const { rate } = axisOutcome(moments, axis, omega0, 0.1, 0);
  return { depths: [0, 1, 2].map((i) => (i === axis % 3 ? RESONANT : 0)), lags: [0, 0, 0], frequency: 2 * rate, inverse: true };
}

// A satellite that loses energy, L' = L × ω + α L × (L × ω), with two equal moments: the exact tilt is
// tan θ = tan θ(0) exp(α L² (1/I_least − 1/I_other) t), and |L| stays.
const LOSS = 1e-6; // α|L|, assumed: flat spin after some 1.4 days; Explorer 1 took some hours
const FIRST_TILT = 0.01; // rad

/** Return the angle between L and the axis of least inertia, rad, after a time, s, at a loss α|L|. */
function tiltAfter(time, [least, other], omega0, loss = LOSS, tilt = FIRST_TILT) {
  return Math.atan(Math.tan(tilt) * Math.exp(loss * omega0 * (1 - least / other) * time));
}

/** The free motion at a number of days, with its angular momentum on the sphere that it never leaves. */
function losingStart(start, days) {
  const { moments, omega0 } = start;
  const tilt = tiltAfter(86400 * days, moments, omega0);
  const L = [Math.cos(tilt), Math.sin(tilt), 0].map((part) => moments[0] * omega0 * part);
  const omega = L.map((l, i) => l / moments[i]);
  const energy = dot(L, omega) / (moments[0] * omega0 ** 2); // relative to that about the axis of least inertia
  return { ...start, omega, omega0: Math.hypot(...omega), onSphere: true, losing: { days, tilt, energy } };
}

function losingInWords({ losing, omega0, moments }) {
  if (!losing) return null;
  const { days, tilt, energy } = losing;
  const stage = tilt < 0.02 ? "It seems stable" : tilt < 1.55 ? "It goes over" : "Flat spin";
  return `${stage}. After ${numberText(days, 3)} days, ${subjectInWords({ moments })} has its long axis ${numberText((180 * tilt) / Math.PI, 3)}° from L, ${numberText(100 * energy, 3)} % of the energy, and rotates at ${numberText((30 * omega0) / Math.PI, 3)} rpm.`;
}

/** The body of the lecture, {moments, named, spin}, and the state to which the page returns after it. */
const teaching = { body: null, after: null };

function beginLecture() {
  const { moments, omega0 } = bodyStart(state.place);
  const [racket] = theMap.presets;
  teaching.body = state.moments ? { moments, named: state.named, spin: omega0 } : { moments: racket.moments, named: racket.name, spin: racket.omega0 };
  const { named, spin, epsilon, place } = state;
  teaching.after = teaching.after ? { ...teaching.after, ...teaching.body } : { moments: state.moments, named, spin, epsilon, place, shaken: null, days: null };
}

function endLecture() {
  const { after } = teaching;
  teaching.after = null;
  return after;
}

function lectureOfBodies() {
  beginLecture();
  const { body } = teaching;
  const { moments } = body;
  const [least, middle, greatest] = orderOfMoments(moments);
  const at = (i) => (theMap.order.includes("axis") ? placeWith({ axis: Math.max(0, theMap.coordinates.axis.values.indexOf(i + 1)) }) : state.place);
  const own = { ...body, epsilon: 0.01, shaken: null, days: null };
  const [explorer] = theMap.presets.slice(-1);
  const lost = { title: "Explorer 1, 1958", text: "Its antennas bent and lost energy, while angular momentum stayed. Slide the days: the spin about the axis of least inertia, which a rigid body keeps, ends in a flat spin.", changes: () => ({ moments: explorer.moments, named: explorer.name, spin: explorer.omega0, epsilon: null, shaken: null, days: 0, place: at(0) }) };
  const name = nameInWords(body.named);
  if (hasEqualMoments(moments)) {
    const symmetry = Math.abs(moments[least] - moments[middle]) < Math.abs(moments[middle] - moments[greatest]) ? greatest : least;
    return [
      { title: "1. Throw it", text: `Two moments of ${name} are equal: no axis is intermediate, and about its axis of symmetry it keeps its rotation and wobbles.`, changes: () => ({ ...own, place: at(symmetry) }) },
      { title: "2. Change the axis", text: "About the other two axes a perturbation grows in proportion to time, no faster: nothing turns over at once.", three: true, changes: () => ({ ...own, epsilon: 0.1, place: at(symmetry) }) },
      { ...lost, title: `3. ${lost.title}` },
    ];
  }
  const nearlyEqual = moments.map((I, i) => (i === least ? moments[middle] - 0.03 * (moments[middle] - I) : I));
  const first = body.named === theMap.presets[0].name ? "A racket spun about the axis across its handle, in the plane of the face: it turns over, and over again." : `Spun about its axis of intermediate inertia, ${name} turns over, and over again.`;
  return [
    { title: "1. Throw it", text: first, changes: () => ({ ...own, place: at(middle) }) },
    { title: "2. A larger perturbation", text: "Thirty times the perturbation: it flips sooner, as the time goes with the logarithm of ε alone.", changes: () => ({ ...own, epsilon: 0.3, place: at(middle) }) },
    { title: "3. Towards two equal moments", text: "As the two lesser moments become equal, growth ceases: the flip takes for ever.", changes: () => ({ ...own, moments: nearlyEqual, named: null, place: at(middle) }) },
    { title: "4. Change the axis", text: "About the axes of least and of greatest inertia the same throw only wobbles: the intermediate axis theorem.", three: true, changes: () => ({ ...own, epsilon: 0.1, place: at(middle) }) },
    { title: "5. Shake the moments", text: "Spun about the axis of greatest inertia, which is stable; but one moment is changed at twice the wobble’s rate: parametric resonance makes the wobble grow, again and again.", changes: () => ({ ...own, epsilon: 0.05, place: at(greatest), shaken: true }) },
    { ...lost, title: `6. ${lost.title}` },
  ];
}
