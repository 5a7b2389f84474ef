// The mechanism itself moving, as the full equations have it: drawn as its description says.

const PLAYED = 8; // s in which a motion of few turns is shown once; of more, as many turns a second
const TURNS_PLAYED = 12;
const TRAIL = 1500; // samples of a motion that a mass's trail holds
const FACE = [176, 190, 204];

const mechanism = { at: 0 };

/** A place in space, from the picture's middle; one of a plane lies in that of the screen. */
function placeInView(point) {
  const [x, y, z] = point.map((part, i) => part - mechanism.middle[i]);
  if (z !== undefined) return [x, y, z];
  const [right, up] = viewAxes();
  return right.map((part, i) => x * part + y * up[i]);
}

function showMechanism() {
  const { motion, equations, times, cycles, rest, sizes } = theMap.mode ?? {};
  const there = Boolean(motion && equations.drawn.length > 0);
  document.getElementById("mechanism").hidden = !there;
  if (!there) return mechanism.player.set(false);
  const trails = motion.map((y, k) => equations.picture(times[k], y, "mass"));
  const states = [0, 1, -1].map((sign) => equations.upright(rest.map((x, i) => x + sign * (sizes[i] ?? 0) / 2)));
  const natural = states.flatMap((state) => equations.picture(0, state)).flatMap(({ points }) => points).filter((point) => point.every(Number.isFinite));
  mechanism.middle = natural[0].map((_, i) => 0.5 * (Math.max(...natural.map((point) => point[i])) + Math.min(...natural.map((point) => point[i]))));
  const farthest = (points) => points.reduce((far, point) => Math.max(far, Math.hypot(...point.map((x, i) => x - mechanism.middle[i]))), 0);
  const reach = farthest([...trails.flat(), ...equations.picture(0, motion[0])].flatMap(({ points }) => points));
  mechanism.scene.reach = 1.12 * (Math.min(reach, 1.4 * farthest(natural)) || 1);
  Object.assign(mechanism, { at: 0, trails, motion, equations, times, length: PLAYED * Math.max(1, cycles / TURNS_PLAYED) });
  mechanism.scene.render();
}

function drawMechanism(view) {
  const { trails, motion, equations, times } = mechanism;
  if (!motion) return;
  const k = Math.min(motion.length - 1, Math.floor(mechanism.at * motion.length));
  const parts = equations.picture(times[k], motion[k]);
  drawPolygons(view.pen, parts.filter(({ kind }) => kind === "face").map(({ points }) => facing(points.map(placeInView), view)));
  const past = trails.slice(Math.max(0, k - TRAIL), k + 1);
  past[0].forEach((_, i) => strokeLine(view, past.map((masses) => placeInView(masses[i].points[0])), pageColor("accent"), 1.3));
  parts.forEach(({ kind, label, points }, i) => {
    const places = points.map(placeInView);
    if (kind === "line") strokeLine(view, places, pageColor("ink"), points.length > 2 ? 1.3 : 2.2);
    if (kind === "body") drawDisc(view.pen, view.project(places[0]), 4, pageColor("quiet"));
    if (kind === "mass") drawDisc(view.pen, view.project(places[0]), 7, inkOf(theMap.seriesColors[i % theMap.seriesColors.length]));
    if (label) writeAt(view, places.at(-1), label, pageColor("ink"));
  });
}

/** A face of the mechanism, lighter where it looks upwards. */
function facing(places, { project }) {
  const normal = directionOf(cross(places[1].map((x, i) => x - places[0][i]), places[2].map((x, i) => x - places[0][i])));
  return { corners: places.map(project), fill: shaded(FACE, Math.abs(normal[2])), edge: shaded(FACE, 0.2) };
}

function buildMechanism(drawCurves) {
  mechanism.scene = new Scene(document.getElementById("mechanism-canvas"), 1, drawMechanism);
  mechanism.player = new Player(document.getElementById("mechanism-play"), (seconds) => {
    mechanism.at = (mechanism.at + seconds / mechanism.length) % 1;
    mechanism.scene.render();
  });
  addEventListener("beforeprint", () => mechanism.scene.render());
  const show = () => {
    drawCurves();
    showMechanism();
  };
  show();
  onChange(atRest(show));
  if (!document.getElementById("mechanism").hidden) mechanism.player.begin();
}
