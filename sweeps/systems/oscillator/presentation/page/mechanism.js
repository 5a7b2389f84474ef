// The mechanism itself, its masses and rods, moving as the full equations have it.

const PLAYED = 8; // s in which the motion is shown once

const mechanism = { at: 0, playing: false };

/** Where the masses are in each state of the motion: [x, y] each, m. */
function placesOfMasses({ followed, theory, times }) {
  const { particles, coordinates } = theMap.equations;
  const at = Object.fromEntries(coordinateNames().map((name) => [name, coordinateAt(name, state.place)]));
  const trees = particles.map((place) => place.map(closure));
  return times.slice(0, (followed ?? theory)[0].length).map((_, k) => {
    coordinates.forEach(({ name }, i) => (at[name] = (followed ?? theory)[i][k]));
    return trees.map((place) => place.map((one) => one(at)));
  });
}

function showMechanism() {
  const figure = document.getElementById("mechanism");
  const there = Boolean(theMap.mode?.followed && theMap.equations?.particles.length);
  figure.hidden = !there;
  if (!there) return setMechanismPlaying(false);
  mechanism.places = placesOfMasses(theMap.mode);
  mechanism.reach = Math.max(...mechanism.places.flat(2).map(Math.abs)) || 1;
  mechanism.at = 0;
  drawMechanism();
}

function drawMechanism() {
  const { pen, width, on, line } = planePen(document.getElementById("mechanism-canvas"), mechanism.reach);
  if (width === 0 || !mechanism.places) return;
  const k = Math.min(mechanism.places.length - 1, Math.floor(mechanism.at * mechanism.places.length));
  const dot = (point, size, color) => {
    pen.beginPath();
    pen.arc(...on(point), size, 0, 2 * Math.PI);
    pen.fillStyle = color;
    pen.fill();
  };
  const now = mechanism.places[k];
  now.forEach((_, i) => line(mechanism.places.slice(Math.max(0, k - 40), k + 1).map((one) => one[i]), pageColor("accent"), 1.5));
  for (const [i, j] of theMap.equations.rods) line([j < 0 ? [0, 0] : now[j], now[i]], pageColor("ink"), 2.5);
  dot([0, 0], 3.5, pageColor("quiet"));
  now.forEach((place, i) => dot(place, 9, inkOf(theMap.seriesColors[i % theMap.seriesColors.length])));
}

function playMechanism(now) {
  if (!mechanism.playing) return;
  mechanism.at = (mechanism.at + Math.max(0, Math.min(0.1, (now - mechanism.last) / 1000)) / PLAYED) % 1;
  mechanism.last = now;
  drawMechanism();
  requestAnimationFrame(playMechanism);
}

function setMechanismPlaying(playing) {
  Object.assign(mechanism, { playing, last: performance.now() });
  const button = document.getElementById("mechanism-play");
  button.textContent = playing ? "❚❚ Pause" : "▶ Play";
  button.setAttribute("aria-pressed", String(playing));
  if (playing) requestAnimationFrame(playMechanism);
}

function buildMechanism() {
  document.getElementById("mechanism-play").onclick = () => setMechanismPlaying(!mechanism.playing);
  addEventListener("beforeprint", drawMechanism);
  onChange(showMechanism);
  showMechanism();
  if (!document.getElementById("mechanism").hidden && !matchMedia("(prefers-reduced-motion: reduce)").matches) setMechanismPlaying(true);
}
