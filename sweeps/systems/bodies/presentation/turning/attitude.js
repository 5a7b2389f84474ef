// The attitude: quaternions [w, x, y, z] that turn body vectors into space, at any time by one step.
//
// With d the axis that the polhode encircles and m the direction of the angular momentum in the body, the attitude is
// the shortest arc from m to d, a turn by ψ about d, and the shortest arc back from where m was. ψ is an integral over
// one period of the closed form.

/** The attitude that puts the angular momentum of the start on the z axis of space. */
function uprightAttitude(trajectory) {
  const [x, y, z] = directionOf(trajectory.moments.map((I, i) => I * trajectory.start[i]));
  if (z < -0.999999) return quaternionProduct(uprightOf([x, -y, -z]), [0, 1, 0, 0]);
  return uprightOf([x, y, z]);
}

// Gauss and Legendre's rule of five points on (0, 1): [place, weight].
const GAUSS = [
  [0.046910077030668, 0.1184634425280945], [0.230765344947158, 0.2393143352496832], [0.5, 0.2844444444444444],
  [0.769234655052842, 0.2393143352496832], [0.953089922969332, 0.1184634425280945],
];
const PANEL = 0.5; // of the time 1/p in which the motion changes: the rule then leaves some 1e-11 of the angle

/** Attitudes of a trajectory at any time, the angular momentum along z. */
class Attitude {
  constructor(trajectory) {
    this.trajectory = trajectory;
    this.upright = uprightAttitude(trajectory);
    if (trajectory.isStationary) return;
    const { moments, start, roles, p, unit, flipPeriod } = trajectory;
    const d = roles[2];
    const L = moments.map((I, i) => I * start[i]);
    const size = Math.hypot(...L);
    Object.assign(this, { d, j: (d + 1) % 3, k: (d + 2) % 3, turned: start[d] < 0 ? -1 : 1 });
    Object.assign(this, { shares: moments.map((I) => I / size / unit), along: (dot(L, start) / size) * unit, period: flipPeriod });
    Object.assign(this, { panel: PANEL / (p || Math.hypot(...start)) / unit, before: [0], after: [0] });
  }

  /** The attitude at time t, s. */
  at(t) {
    const { trajectory, upright } = this;
    if (trajectory.isStationary) return quaternionProduct(upright, quaternionOf(trajectory.start.map((w) => w * trajectory.unit * t)));
    const angle = this.halfTurn(t);
    const [nd, nj, nk] = this.momentumAt(0);
    const [x, y] = [Math.cos(angle), Math.sin(angle)];
    const back = [(1 + nd) * x, (1 + nd) * y, nj * y - nk * x, nj * x + nk * y];
    const [md, mj, mk] = this.momentumAt(t);
    const [q0, qd, qj, qk] = quaternionProduct(back, [1 + md, 0, mk, -mj]);
    const q = [];
    [q[this.d], q[this.j], q[this.k]] = [this.turned * qd, qj, this.turned * qk];
    return quaternionProduct(upright, directionOf([q0, ...q]));
  }

  /** The direction of the angular momentum in the body, along (d, j, k), with d on its side. */
  momentumAt(t) {
    const { trajectory, shares, d, j, k, turned } = this;
    const m = trajectory.at(t).map((w, i) => shares[i] * w);
    return [turned * m[d], m[j], turned * m[k]];
  }

  /** Half of ψ, rad, at time t, s: what it is after whole periods of the motion, and the rest. */
  halfTurn(t) {
    const periods = Number.isFinite(this.period) ? Math.floor(t / this.period) : 0;
    return periods === 0 ? this.upTo(t) : periods * this.upTo(this.period) + this.upTo(t - periods * this.period);
  }

  /** The integral from 0 to t, by panels whose sums are kept. */
  upTo(t) {
    const [panel, sums] = t < 0 ? [-this.panel, this.before] : [this.panel, this.after];
    const k = Math.floor(t / panel);
    while (sums.length <= k) sums.push(sums.at(-1) + this.across((sums.length - 1) * panel, panel));
    return sums[k] + this.across(k * panel, t - k * panel);
  }

  /** Half of what ψ gains from a time on, by its rate (ω·d + ω·m)/(1 + m·d). */
  across(from, length) {
    const { trajectory, shares, along, d, turned } = this;
    return 0.5 * length * GAUSS.reduce((sum, [place, weight]) => {
      const w = turned * trajectory.at(from + place * length)[d];
      return sum + (weight * (w + along)) / (1 + shares[d] * w);
    }, 0);
  }
}
