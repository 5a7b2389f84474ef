// A body whose moments change periodically, or that loses energy, by steps of Runge and Kutta: L keeps its size alone.

const STEPS_A_TURN = 160; // of the body's turn or of the modulation, whichever is shorter
const MOST_SHAKEN = 60000; // steps

/** What `Trajectory` and `Attitude` are for constant moments: I_i (1 + d_i cos(νt + l_i)), or so the inverses. */
class ShakenTrajectory {
  constructor(given, rotation) {
    const { moments, shaken } = given;
    Object.assign(this, { moments, shaken, unit: 1, roles: [], flipPeriod: NaN, isStationary: false, p: NaN });
    const spin = given.omega ?? perturbedSpin(given);
    this.start = spin.map((w, i) => (w * moments[i]) / this.momentsAt(0)[i]); // L is that of the mean moments
    this.size = Math.hypot(...spin.map((w, i) => w * moments[i]));
    const turn = Math.min(rotation, (2 * Math.PI) / shaken.frequency);
    this.end = shaken.length ?? 40 * rotation;
    const n = Math.min(MOST_SHAKEN, Math.ceil((this.end / turn) * STEPS_A_TURN));
    this.h = this.end / n;
    const L = spin.map((w, i) => w * moments[i]);
    this.states = [[...L, ...uprightAttitude({ moments, start: spin })]];
    for (let k = 0; k < n; k++) this.states.push(this.step(k * this.h, this.states[k]));
  }

  momentsAt(t) {
    const { depths, lags, frequency, inverse } = this.shaken;
    return this.moments.map((I, i) => {
      const factor = 1 + depths[i] * Math.cos(frequency * t + lags[i]);
      return inverse ? I / factor : I * factor;
    });
  }

  /** d/dt of (L, q): L × w, and half of q times w, with w = ω + α L × ω where energy is lost at α = loss/|L|. */
  slope([A, B, C], [x, y, z, a, b, c, d]) {
    const lost = (this.shaken.loss ?? 0) / this.size;
    const [u, v, w] = [x / A + lost * y * z * (1 / C - 1 / B), y / B + lost * z * x * (1 / A - 1 / C), z / C + lost * x * y * (1 / B - 1 / A)];
    const turn = [-b * u - c * v - d * w, a * u + c * w - d * v, a * v + d * u - b * w, a * w + b * v - c * u];
    return [y * w - z * v, z * u - x * w, x * v - y * u, 0.5 * turn[0], 0.5 * turn[1], 0.5 * turn[2], 0.5 * turn[3]];
  }

  step(t, y) {
    const { h } = this;
    const to = (k, part) => y.map((x, i) => x + part * h * k[i]);
    const [before, middle, after] = [t, t + h / 2, t + h].map((at) => this.momentsAt(at));
    const a = this.slope(before, y);
    const b = this.slope(middle, to(a, 0.5));
    const c = this.slope(middle, to(b, 0.5));
    const d = this.slope(after, to(c, 1));
    return y.map((x, i) => x + (h / 6) * (a[i] + 2 * b[i] + 2 * c[i] + d[i]));
  }

  stateAt(t) {
    const at = Math.max(0, Math.min(this.states.length - 1.001, t / this.h));
    const [k, part] = [Math.floor(at), at - Math.floor(at)];
    return this.states[k].map((x, i) => x + part * (this.states[k + 1][i] - x));
  }

  momentum(t) {
    return this.stateAt(t).slice(0, 3);
  }

  /** Angular velocity, rad/s, at time t, s. */
  at(t) {
    const I = this.momentsAt(t);
    return this.momentum(t).map((l, i) => l / I[i]);
  }

  attitudeAt(t) {
    return directionOf(this.stateAt(t).slice(3));
  }

  /** What runs along the curve: the angular momentum, on its sphere. */
  tip(t) {
    return this.momentum(t);
  }

  polhode() {
    const step = Math.max(1, Math.floor(this.states.length / 6000));
    return this.states.filter((_, k) => k % step === 0).map((state) => state.slice(0, 3));
  }

  surface() {
    return momentumSphere(this.moments, this.size);
  }
}

/** The sphere of the angular momentum, and on it the curves of the body with its mean moments. */
function momentumSphere(moments, size) {
  const onSphere = (w) => directionOf(moments.map((I, i) => I * w[i])).map((l) => l * size);
  return { semi: [1, 1, 1], largest: size, family: neighbours(moments, size ** 2 / moments[0]).map((curve) => curve.map(onSphere)) };
}

/** A free motion of which the angular momentum is drawn, on its sphere. */
class SphereTrajectory extends Trajectory {
  tip(t) {
    return this.momentum(t);
  }

  polhode(n) {
    return super.polhode(n).map((w) => w.map((x, i) => x * this.moments[i]));
  }

  surface() {
    return momentumSphere(this.moments, Math.hypot(...this.moments.map((I, i) => I * this.start[i])));
  }
}
