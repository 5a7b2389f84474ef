// The herpolhode: the curve of the angular velocity on the plane at right angles to L, which stands still in space.

const HERPOLHODE_ROTATIONS = 20; // that are drawn at once
const POINTS_PER_ROTATION = 80;
const TAIL_ROTATIONS = 1.5;

class HerpolhodePicture {
  constructor(canvas) {
    this.canvas = canvas;
    this.draw = whenSeen(canvas, () => this.render());
    new ResizeObserver(this.draw).observe(canvas);
  }

  show({ trajectory, attitudes, rotation, end }) {
    this.place = (t) => rotated(attitudes.at(t), trajectory.at(t)).slice(0, 2);
    const length = Math.min(end, HERPOLHODE_ROTATIONS * rotation);
    const n = Math.ceil((length / rotation) * POINTS_PER_ROTATION);
    this.curve = Array.from({ length: n + 1 }, (_, i) => this.place((i * length) / n));
    this.rotation = rotation;
    const radii = trajectory.surface ? this.curve.map((at) => Math.hypot(...at)) : trajectory.polhode().map((w) => this.offAxis(w, trajectory));
    [this.inner, this.outer] = [Math.min(...radii), Math.max(...radii)];
    this.still = !(this.outer > 1e-14 * Math.hypot(...trajectory.start) * trajectory.unit);
  }

  /** Size of the angular velocity's part across L. */
  offAxis(w, { moments }) {
    const L = moments.map((I, i) => I * w[i]);
    const across = cross(L, w);
    return Math.hypot(...across) / Math.hypot(...L);
  }

  tick(t) {
    this.t = t;
    this.draw();
  }

  /** The way of the tip up to now. */
  tail() {
    const { t } = this;
    const from = Math.max(0, t - TAIL_ROTATIONS * this.rotation);
    const n = Math.ceil(((t - from) / this.rotation) * POINTS_PER_ROTATION) + 1;
    return Array.from({ length: n + 1 }, (_, i) => this.place(from + ((t - from) * i) / n));
  }

  render() {
    if (this.t === undefined) return;
    const tail = this.tail();
    const { pen, width, height, scale, on, line } = planePen(this.canvas, this.outer || 1);
    if (width === 0) return;
    for (const radius of this.still ? [] : [this.inner, this.outer]) {
      pen.beginPath();
      pen.arc(...on([0, 0]), scale * radius, 0, 2 * Math.PI);
      Object.assign(pen, { strokeStyle: pageColor("grid"), lineWidth: 1 });
      pen.stroke();
    }
    if (!this.still) line(this.curve, pageColor("polhode"), 1);
    if (!this.still) line(tail, pageColor("accent"), 2.6);
    this.labels = [];
    for (const [at, color, text] of [[[0, 0], pageColor("quiet"), "L"], [this.still ? [0, 0] : tail.at(-1), theMap.seriesColors[3], "ω"]]) {
      drawDisc(pen, on(at), 5, color);
      writeAt({ pen, project: on, labels: this.labels, width, height }, at, text, color);
    }
  }
}
