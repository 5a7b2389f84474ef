// A body on its orbit: its attitude by the full equations after a perturbation, in space and in the orbit's frame.

const ORBIT_EPSILONS = [1e-4, 1e-3, 0.01, 0.05, 0.2]; // rad, tilts shown
const USUAL_TILT = 0.01; // rad, until another one is chosen
const ORBIT_SAMPLES = 240; // an orbit
const [MIN_ORBITS, MAX_ORBITS] = [6, 40];
const ORBITS_A_SECOND = 0.4; // of the player
const BODY_SIZE = 0.28; // of the semi-major axis, as drawn
const orbiting = { at: 0 };

/** Moments over I3, as `sweeps/systems/orbit/shapes.py` has them. */
function orbitMoments(place) {
  const has = (name) => theMap.coordinates[name] !== undefined;
  const value = (name) => coordinateAt(name, place);
  let [A, D] = [1, 0];
  if (has("K")) A = 1 / value("K");
  else if (has("asymmetry")) D = value("asymmetry");
  else if (has("k1")) {
    const scale = 1 - value("k1") * value("k3");
    [A, D] = [(1 - value("k1")) / scale, (value("k1") - value("k3")) / scale];
  } else if (has("a_over_b")) {
    const [radial, normal] = [value("a_over_b") ** 2, value("b_over_c") ** -2];
    [A, D] = [(1 + normal) / (1 + radial), (radial - 1) / (1 + radial)];
  } else [A, D] = [value("I1") / value("I3"), (value("I2") - value("I1")) / value("I3")];
  return has("radial_axis") && value("radial_axis") === 2 ? [A + D, A, 1] : [A, A + D, 1];
}

/** d/df of attitude (body to space) and body rates in units of n (1 - e²)^(-3/2): Euler's equations, point-mass primary. */
function orbitSlope(f, [a, b, c, d, u, v, w], [A, B, C], eccentricity) {
  const radius = 1 + eccentricity * Math.cos(f);
  const [x, y, z] = rotated(reversed([a, b, c, d]), [Math.cos(f), Math.sin(f), 0]);
  const pull = 3 * radius ** 3;
  const turn = quaternionProduct([a, b, c, d], [0, u, v, w]).map((part) => part / 2);
  return [...turn, ((B - C) * (v * w - pull * y * z)) / A, ((C - A) * (w * u - pull * z * x)) / B, ((A - B) * (u * v - pull * x * y)) / C].map((part) => part / radius ** 2);
}

/** The motion of a point after a tilt, of `epsilon` rad; null where the map has no reference motion. */
function orbitMotion(place, epsilon) {
  const [angle, rate] = ["angle_start", "rate_start"].map((name) => theMap.columns[name].at(place));
  if (!Number.isFinite(angle + rate)) return null;
  const eccentricity = theMap.coordinates.eccentricity ? coordinateAt("eccentricity", place) : 0;
  const inPlane = coordinateAt("plane", place) === "in_plane";
  const moments = orbitMoments(place);
  const growth = theMap.columns.growth_per_orbit.at(place);
  const orbits = Math.ceil(Math.min(MAX_ORBITS, Math.max(MIN_ORBITS, growth > 1e-6 ? Math.log(2 / epsilon) / growth + 2 : 12)));
  const n = orbits * ORBIT_SAMPLES;
  const anomalies = Array.from({ length: n + 1 }, (_, k) => (2 * Math.PI * k) / ORBIT_SAMPLES);
  const tilts = inPlane ? [[0, 0, epsilon]] : [[epsilon, 0, 0], [0, 0.6 * epsilon, 0]];
  const attitude = [[0, 0, angle], ...tilts].map(quaternionOf).reduce(quaternionProduct);
  const spin = rotated(reversed(attitude), [0, 0, (1 + eccentricity) ** 2 * (1 + rate)]);
  const slope = (f, y) => orbitSlope(f, y, moments, eccentricity);
  const states = integrated(slope, [...attitude, ...spin], anomalies, 1e-9 * Math.min(1, epsilon), [1, 1, 1, 1, 1, 1, 1], (y) => !y.every(Number.isFinite));
  return { states, anomalies, eccentricity, inPlane, moments, orbits, faces: bodyFaces(meanSquares(moments), "box") };
}

/** The attitude relative to the radius, the track and the normal. */
function relativeAttitude(k) {
  const { states, anomalies } = orbiting;
  return quaternionProduct(quaternionOf([0, 0, -anomalies[k]]), directionOf(states[k].slice(0, 4)));
}

/** The view with a body of this size at a place. */
function viewAt(view, place, size) {
  return { ...view, project: (v) => view.project(v.map((x, i) => place[i] + size * x)) };
}

function sampleShown() {
  return Math.min(orbiting.states.length - 1, Math.round(orbiting.at * (orbiting.states.length - 1)));
}

function placeOnOrbit(f) {
  const r = (1 - orbiting.eccentricity ** 2) / (1 + orbiting.eccentricity * Math.cos(f));
  return [r * Math.cos(f) + orbiting.eccentricity, r * Math.sin(f), 0];
}

function drawOrbit(view) {
  if (!orbiting.states) return;
  const k = sampleShown();
  const [primary, place] = [[orbiting.eccentricity, 0, 0], placeOnOrbit(orbiting.anomalies[k])];
  const attitude = directionOf(orbiting.states[k].slice(0, 4));
  const path = Array.from({ length: 181 }, (_, i) => placeOnOrbit((i * Math.PI) / 90));
  const body = viewAt(view, place, BODY_SIZE);
  const parts = [
    [dot(primary, view.toward), () => drawDisc(view.pen, view.project(primary), 13, pageColor("quiet"))],
    [dot(place, view.toward), () => {
      drawSolid(body, orbiting.faces, attitude);
      drawBodyAxes(body, attitude, 1);
    }],
  ];
  strokeLine(view, path, pageColor("grid"), 1.5);
  strokeLine(view, [primary, place], pageColor("quiet"), 1, [4, 4]);
  for (const [, drawPart] of parts.sort(([one], [other]) => one - other)) drawPart();
}

function drawAttitude(view) {
  if (!orbiting.states) return;
  const k = sampleShown();
  const attitude = relativeAttitude(k);
  const first = Math.max(0, k - 3 * ORBIT_SAMPLES);
  const trail = Array.from({ length: Math.ceil((k - first) / 4) + 1 }, (_, i) => rotated(relativeAttitude(Math.min(k, first + 4 * i)), [1.12, 0, 0]));
  for (const [end, label] of [[[1.3, 0, 0], "radius"], [[0, 1.3, 0], "track"], [[0, 0, 1.3], "normal"]]) arrow(view, end.map((x) => -0.85 * x), end, pageColor("quiet"), label);
  drawSolid(view, orbiting.faces, attitude);
  drawBodyAxes(view, attitude, 1);
  strokeLine(view, trail, pageColor("accent"), 1.6);
}

/** Angle of axis 1 in the orbit's plane from p rotations an orbit, continuous, and tilt of axis 3 from the normal, degrees. */
function orbitAngles() {
  const turns = theMap.coordinates.p ? coordinateAt("p", state.place) - 1 : 0;
  let last = 0;
  const along = orbiting.states.map((_, k) => {
    const [x, y] = rotated(relativeAttitude(k), [1, 0, 0]);
    const angle = Math.atan2(y, x);
    last += angle - last - 2 * Math.PI * Math.round((angle - last) / (2 * Math.PI));
    return (180 / Math.PI) * last - (360 * turns * k) / ORBIT_SAMPLES;
  });
  const tilt = orbiting.states.map((_, k) => (180 / Math.PI) * Math.acos(Math.max(-1, Math.min(1, rotated(relativeAttitude(k), [0, 0, 1])[2]))));
  return { along, tilt };
}

function drawAngles() {
  if (!orbiting.states) return;
  const { along, tilt } = orbitAngles();
  const step = Math.max(1, Math.round(orbiting.states.length / 2000));
  const thin = (values) => values.filter((_, k) => k % step === 0);
  const x = thin(orbiting.anomalies).map((f) => f / (2 * Math.PI));
  const libration = theMap.coordinates.p ? "angle in the plane, from uniform rotation" : "angle in the plane, from the radius";
  const curves = [...(theMap.coordinates.spin ? [] : [[libration, along]]), ...(orbiting.inPlane ? [] : [["tilt from the normal", tilt]])];
  const traces = curves.map(([name, y], i) => ({ type: "scatter", mode: "lines", name, x, y: thin(y), line: { color: inkOf(theMap.seriesColors[i]), width: 1.8 }, hovertemplate: `${name}: %{y:.4g}°<br>%{x:.2f} orbits<extra></extra>` }));
  const layout = { height: 260, margin: { l: 64, r: 12, t: 8, b: 44 }, showlegend: true, legend: { orientation: "h", y: -0.34 }, dragmode: false, xaxis: { title: { text: "orbits (true anomaly / 2π)" }, range: [0, orbiting.orbits] }, yaxis: { title: { text: "angle (°)" } } };
  draw("orbiting-plot", traces, layout, { displayModeBar: false });
}

function seekOrbit(at) {
  orbiting.at = Math.max(0, Math.min(1, at));
  document.getElementById("orbiting-time").value = String(Math.round(1000 * orbiting.at));
  const text = `${numberText(orbiting.at * orbiting.orbits, 3)} of ${orbiting.orbits} orbits`;
  document.getElementById("orbiting-time-text").textContent = text;
  document.getElementById("orbiting-time").setAttribute("aria-valuetext", text);
  for (const scene of orbiting.scenes) scene.render();
}

function orbitInWords(place) {
  const { regime, growth_per_orbit: growth } = theMap.columns;
  const value = growth.at(place);
  if (!Number.isFinite(value)) return missingInWords(place);
  const words = regime.text(regime.at(place));
  const where = coordinateAt("plane", place) === "in_plane" ? "in the orbit's plane" : "out of the orbit's plane";
  const outcome = value > 1e-9 ? `grow by a factor ${numberText(Math.exp(value), 3)} an orbit` : "stay bounded";
  return `${words[0].toUpperCase()}${words.slice(1)}: perturbations ${where} ${outcome}.`;
}

function showOrbit() {
  const [select, epsilon] = [document.getElementById("orbiting-epsilon"), state.epsilon ?? USUAL_TILT];
  if (![...select.options].some(({ value }) => Number(value) === epsilon)) select.append(element("option", { value: String(epsilon), textContent: `${numberText(epsilon, 3)} rad` }));
  select.value = String(epsilon);
  const shown = orbitMotion(state.place, epsilon);
  document.getElementById("orbiting").hidden = shown === null;
  if (shown === null) return orbiting.player.set(false);
  Object.assign(orbiting, shown);
  const { along, tilt } = orbitAngles();
  const most = Math.max(...(shown.inPlane ? along.map(Math.abs) : tilt));
  const name = shown.inPlane ? "angle from uniform rotation" : "tilt from the normal";
  document.getElementById("orbiting-words").textContent = `${orbitInWords(state.place)} By the full equations, the largest ${name} within ${shown.orbits} orbits is ${numberText(most, 3)}°.`;
  drawAngles();
  seekOrbit(0);
}

function buildOrbit() {
  const select = document.getElementById("orbiting-epsilon");
  for (const one of ORBIT_EPSILONS) select.append(element("option", { value: String(one), textContent: `${numberText(one, 3)} rad` }));
  select.onchange = () => choose({ epsilon: Number(select.value) });
  orbiting.scenes = [["orbit-canvas", 1, drawOrbit], ["attitude-canvas", 1.5, drawAttitude]].map(([id, reach, how]) => new Scene(document.getElementById(id), reach, how));
  orbiting.player = new Player(document.getElementById("orbiting-play"), (seconds) => seekOrbit((orbiting.at + (seconds * ORBITS_A_SECOND) / orbiting.orbits) % 1));
  document.getElementById("orbiting-time").oninput = (event) => seekOrbit(event.target.value / 1000);
  showOrbit();
  onChange(atRest(showOrbit));
  if (!document.getElementById("orbiting").hidden) orbiting.player.begin();
}

const part = {
  color: "regime",
  grows: ({ name }) => /^(growth|exponent_real)/.test(name),
  kept: { epsilon: perturbationFromLink },
  opening: () => {
    const outOfPlane = theMap.coordinates.plane.values.indexOf("out_of_plane");
    if (outOfPlane > 0) state.place = placeWith({ plane: outOfPlane });
  },
  say: orbitInWords,
  shown: { orbiting, orbitMotion, orbitMoments, relativeAttitude },
  build: buildOrbit,
};
