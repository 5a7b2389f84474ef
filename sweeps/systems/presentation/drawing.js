// Turning bodies in three dimensions on a canvas: one camera, dragged by pointer or keys, for all pictures.
//
// Plotly's own 3-D needs WebGL and redraws its scene for each frame; these pictures move at the screen's rate, on
// machines without it too.

const camera = { yaw: 0.6, pitch: 0.35, watchers: [] };

function turnCamera(yaw, pitch) {
  camera.yaw += yaw;
  camera.pitch = Math.max(-1.5, Math.min(1.5, camera.pitch + pitch));
  for (const watcher of camera.watchers) watcher();
}

/** The camera's directions: to the right, up, and towards the viewer. */
function viewAxes() {
  const [cy, sy, cp, sp] = [Math.cos(camera.yaw), Math.sin(camera.yaw), Math.cos(camera.pitch), Math.sin(camera.pitch)];
  return [[-sy, cy, 0], [-sp * cy, -sp * sy, cp], [cp * cy, cp * sy, sp]];
}

function quaternionProduct([a, b, c, d], [e, f, g, h]) {
  return [a * e - b * f - c * g - d * h, a * f + b * e + c * h - d * g, a * g - b * h + c * e + d * f, a * h + b * g - c * f + d * e];
}

/** The turn by a rotation vector, rad. */
function quaternionOf([x, y, z]) {
  const angle = Math.hypot(x, y, z);
  const s = angle > 1e-12 ? Math.sin(angle / 2) / angle : 0.5;
  return [Math.cos(angle / 2), s * x, s * y, s * z];
}

/** A body vector in space. */
function rotated([a, b, c, d], [x, y, z]) {
  const [u, v, w] = [2 * (c * z - d * y), 2 * (d * x - b * z), 2 * (b * y - c * x)];
  return [x + a * u + c * w - d * v, y + a * v + d * u - b * w, z + a * w + b * v - c * u];
}

/** The turn back. */
function reversed([a, b, c, d]) {
  return [a, -b, -c, -d];
}

function cross([a, b, c], [x, y, z]) {
  return [b * z - c * y, c * x - a * z, a * y - b * x];
}

/** The shortest arc from a unit vector to the z axis. */
function uprightOf([x, y, z]) {
  const norm = Math.hypot(1 + z, y, x);
  return [(1 + z) / norm, y / norm, -x / norm, 0];
}

function dot([a, b, c], [x, y, z]) {
  return a * x + b * y + c * z;
}

/** A vector of length one in the direction of another; 0 stays. */
function directionOf(vector) {
  const size = Math.hypot(...vector) || 1;
  return vector.map((x) => x / size);
}

/** A canvas cleared, as sharp as its screen, and what draws on it in the page's own pixels. */
function sharpPen(canvas) {
  const ratio = window.devicePixelRatio || 1;
  const [width, height] = [canvas.clientWidth, canvas.clientHeight];
  const pen = canvas.getContext("2d");
  if (width === 0) return { pen, width, height };
  if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
    canvas.width = Math.round(width * ratio);
    canvas.height = Math.round(height * ratio);
  }
  pen.setTransform(ratio, 0, 0, ratio, 0, 0);
  pen.clearRect(0, 0, width, height);
  return { pen, width, height };
}

/** A pen over a plane that reaches so far from the canvas's middle, with what places points and draws lines on it. */
function planePen(canvas, reach) {
  const { pen, width, height } = sharpPen(canvas);
  const scale = (0.42 * Math.min(width, height)) / reach;
  const on = ([x, y]) => [width / 2 + scale * x, height / 2 - scale * y];
  const line = (points, color, thick) => {
    pen.beginPath();
    for (const point of points) pen.lineTo(...on(point));
    Object.assign(pen, { strokeStyle: color, lineWidth: thick, lineJoin: "round" });
    pen.stroke();
  };
  return { pen, width, height, scale, on, line };
}

/** A canvas sharp on any screen; `draw(pen)` is called with what it needs to draw in a unit of its own. */
class Scene {
  constructor(canvas, reach, draw) {
    Object.assign(this, { canvas, reach, draw });
    camera.watchers.push(() => this.render());
    new ResizeObserver(() => this.render()).observe(canvas);
    this.listen();
  }

  listen() {
    const { canvas } = this;
    canvas.addEventListener("pointerdown", (event) => canvas.setPointerCapture(event.pointerId));
    canvas.addEventListener("pointermove", (event) => {
      if (canvas.hasPointerCapture(event.pointerId)) turnCamera(-event.movementX * 0.01, event.movementY * 0.01);
    });
    onArrows(canvas, (right, up) => turnCamera(-0.1 * right, 0.1 * up));
  }

  /** Draws what is asked for several times once, after all else has changed: sizes are read of a page that rests. */
  render() {
    if (!this.due) queueMicrotask(() => this.renderNow());
    this.due = true;
  }

  renderNow() {
    this.due = false;
    const { pen, width, height } = sharpPen(this.canvas);
    if (width === 0) return;
    const [right, up, toward] = viewAxes();
    const scale = this.fit ? this.fit(width, height, right, up) : Math.min(width, height) / 2 / this.reach;
    const project = (v) => [width / 2 + scale * dot(v, right), height / 2 - scale * dot(v, up), dot(v, toward)];
    this.labels = [];
    this.draw({ pen, project, toward, width, height, scale, labels: this.labels });
  }
}

function strokeLine({ pen, project }, points, color, width, dash = []) {
  pen.beginPath();
  for (const point of points) pen.lineTo(...project(point).slice(0, 2));
  pen.strokeStyle = color;
  pen.lineWidth = width;
  pen.setLineDash(dash);
  pen.lineJoin = pen.lineCap = "round";
  pen.stroke();
  pen.setLineDash([]);
}

/** Draws an arrow with its name at the tip: at its right side, or at its left one if `side` is −1. */
function arrow(view, from, to, color, label, side = 1) {
  const { pen, project } = view;
  const [[x0, y0], [x1, y1]] = [project(from), project(to)];
  const length = Math.hypot(x1 - x0, y1 - y0);
  strokeLine(view, [from, to], color, 2.2);
  if (length > 6) {
    const [ux, uy] = [(x1 - x0) / length, (y1 - y0) / length];
    pen.beginPath();
    pen.moveTo(x1 + 5 * ux, y1 + 5 * uy);
    pen.lineTo(x1 - 6 * ux - 4 * uy, y1 - 6 * uy + 4 * ux);
    pen.lineTo(x1 - 6 * ux + 4 * uy, y1 - 6 * uy - 4 * ux);
    pen.fillStyle = color;
    pen.fill();
  }
  writeAt(view, to, label, color, side);
}

/** Writes a text beside a point, where it lies on no other text of the picture: their boxes are in `labels`. */
function writeAt({ pen, project, labels, width, height }, point, text, color, side = 1) {
  const size = textSize();
  pen.font = `600 ${size}px system-ui, sans-serif`;
  const extent = [pen.measureText(text).width, size];
  const boxes = boxesBeside(project(point), extent, 8, side);
  const box = freeBox(boxes, labels, { left: 0, top: 0, width, height }) ?? freeBox(boxes, labels) ?? boxes[0];
  labels.push({ ...box, text });
  pen.textBaseline = "middle";
  pen.lineWidth = 3;
  pen.strokeStyle = pageColor("paper");
  pen.strokeText(text, box.left, box.top + size / 2);
  pen.fillStyle = color;
  pen.fillText(text, box.left, box.top + size / 2);
}

function drawDisc(pen, [x, y], radius, color) {
  pen.beginPath();
  pen.arc(x, y, radius, 0, 2 * Math.PI);
  pen.fillStyle = color;
  pen.fill();
}

function shaded(color, light) {
  const k = 0.55 + 0.45 * light;
  return `rgb(${color.map((part) => Math.round(part * k)).join(",")})`;
}

/** Polygons, the farthest first: corners as they are projected, colour, edge, how much hides what is behind, and nearer by. */
function drawPolygons(pen, polygons) {
  const deep = polygons.map((one) => ({ ...one, depth: one.corners.reduce((sum, corner) => sum + corner[2], 0) / one.corners.length + (one.nearer ?? 0) }));
  for (const { corners, fill, edge, veil = 1 } of deep.sort((one, other) => one.depth - other.depth)) {
    pen.beginPath();
    for (const [x, y] of corners) pen.lineTo(x, y);
    pen.closePath();
    Object.assign(pen, { globalAlpha: veil, fillStyle: fill, strokeStyle: edge, lineWidth: 0.8 });
    pen.fill();
    pen.globalAlpha = 1;
    pen.stroke();
  }
}

/** A button that plays and pauses: `advance` is called with the seconds since the picture before. */
class Player {
  constructor(button, advance) {
    Object.assign(this, { button, advance, playing: false });
    button.onclick = () => this.set(!this.playing);
  }

  set(playing) {
    Object.assign(this, { playing, last: performance.now() });
    this.button.textContent = playing ? "❚❚ Pause" : "▶ Play";
    this.button.setAttribute("aria-pressed", String(playing));
    if (playing) requestAnimationFrame((now) => this.tick(now));
  }

  tick(now) {
    if (!this.playing) return;
    this.advance(Math.max(0, Math.min(0.1, (now - this.last) / 1000)));
    this.last = now;
    requestAnimationFrame((later) => this.tick(later));
  }

  /** Plays as soon as the page opens, for who has not asked for less motion. */
  begin() {
    if (!matchMedia("(prefers-reduced-motion: reduce)").matches) this.set(true);
  }
}
