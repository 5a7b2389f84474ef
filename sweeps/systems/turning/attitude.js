// The attitude: quaternions [w, x, y, z] that turn body vectors into space, from the exact angular velocity.
//
// dq/dt = q ω/2. Each step is Magnus' of order four: ω at the two Gauss points and their commutator; the angular
// momentum, known exactly, shows its error.

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

function cross([a, b, c], [x, y, z]) {
  return [b * z - c * y, c * x - a * z, a * y - b * x];
}

const GAUSS = Math.sqrt(3) / 6;

function attitudeStep(q, trajectory, t, h) {
  const early = trajectory.at(t + (0.5 - GAUSS) * h);
  const late = trajectory.at(t + (0.5 + GAUSS) * h);
  const twist = cross(early, late);
  const vector = early.map((w, i) => (h / 2) * (w + late[i]) + (Math.sqrt(3) / 12) * h * h * twist[i]);
  const turned = quaternionProduct(q, quaternionOf(vector));
  const size = Math.hypot(...turned);
  return turned.map((x) => x / size);
}

/** The attitude that puts the angular momentum of the start on the z axis of space. */
function uprightAttitude(trajectory) {
  const L = trajectory.moments.map((I, i) => I * trajectory.start[i]);
  const size = Math.hypot(...L);
  const [x, y, z] = L.map((l) => l / size);
  if (z < -0.999999) return [0, 1, 0, 0];
  const q = [1 + z, y, -x, 0];
  const norm = Math.hypot(...q);
  return q.map((component) => component / norm);
}

/** Attitudes at regular times, and between them by one more step. */
class AttitudeTable {
  constructor(trajectory, end, most = 60000) {
    const speed = Math.hypot(...trajectory.start) * trajectory.unit;
    this.trajectory = trajectory;
    this.count = Math.max(1, Math.min(most, Math.ceil((end * speed) / 0.2)));
    this.step = end / this.count;
    this.keys = [uprightAttitude(trajectory)];
  }

  at(t) {
    const k = Math.max(0, Math.min(this.count, Math.floor(t / this.step)));
    while (this.keys.length <= k) {
      const last = this.keys.length - 1;
      this.keys.push(attitudeStep(this.keys[last], this.trajectory, last * this.step, this.step));
    }
    return attitudeStep(this.keys[k], this.trajectory, k * this.step, t - k * this.step);
  }
}
