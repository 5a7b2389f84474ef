// The attitude in closed form: quaternions [w, x, y, z] that turn body vectors into space, at any time by one step.
//
// With d the axis that the polhode goes round and m the direction of the angular momentum in the body, the attitude is
// the shortest arc from m to d, a turn by ψ about d, and the shortest arc back from where m was. ψ is an elliptic
// integral of the third kind of half the time, and an angle that the addition theorem gives at the middle.

/** The attitude that puts the angular momentum of the start on the z axis of space. */
function uprightAttitude(trajectory) {
  const L = trajectory.moments.map((I, i) => I * trajectory.start[i]);
  const size = Math.hypot(...L);
  const [x, y, z] = L.map((l) => l / size);
  if (z < -0.999999) return quaternionProduct(uprightOf([x, -y, -z]), [0, 1, 0, 0]);
  return uprightOf([x, y, z]);
}

/** Attitudes of a trajectory at any time, the angular momentum along z. */
class Attitude {
  constructor(trajectory) {
    this.trajectory = trajectory;
    this.upright = uprightAttitude(trajectory);
    if (trajectory.isStationary) return;
    const { moments, start, roles, p, m, m1 } = trajectory;
    const d = roles[2];
    Object.assign(this, { d, j: (d + 1) % 3, k: (d + 2) % 3, turned: start[d] < 0 ? -1 : 1 });
    const [Is, Ic, Id] = roles.map((i) => moments[i]);
    const [ws, wc, wd] = roles.map((i) => start[i]);
    const [Ls, Lc, Ld] = [Is * ws, Ic * wc, Id * wd];
    const L2 = Ls * Ls + Lc * Lc + Ld * Ld;
    const [L, mean, gap] = [Math.sqrt(L2), (Ls * ws + Lc * wc + Ld * wd) / Math.sqrt(L2), Math.abs(Id - Ic)];
    const Ad = Math.hypot(wd, Math.sqrt(Math.abs(((Is - Ic) / Id) * (Is / (gap || 1)))) * ws);
    const muc2 = Math.min(1, (Ls * (Math.abs(Id - Is) / (gap || 1)) * (Ic * ws) + Lc * Lc) / L2);
    const a = (Id * Ad) / L;
    const k1 = m / (1 + Math.sqrt(m1)) ** 2;
    const sigma = Id > Ic ? 1 : -1;
    const Q = p > 0 ? (sigma * 2 * k1 * (1 + k1) * Ad * ((muc2 * gap) / Ic)) / ((1 + a) * (1 + a)) / p : 0;
    Object.assign(this, { a, sigma, Q, rate: (Ad + mean) / (1 + a), shares: moments.map((I) => I / L) });
    Object.assign(this, { muc: Math.sqrt(muc2), mus: Math.sqrt(Math.min(1, muc2 + a * a * m)) });
    this.integral = new ThirdKind((k1 * muc2) / ((1 + a) * (1 + a)), k1, m1);
  }

  /** The attitude at time t, s. */
  at(t) {
    const { trajectory, upright } = this;
    if (trajectory.isStationary) return quaternionProduct(upright, quaternionOf(trajectory.start.map((w) => w * trajectory.unit * t)));
    const angle = this.halfTurn(t * trajectory.unit);
    const [nd, nj, nk] = this.momentumAt(0);
    const [x, y] = [Math.cos(angle), Math.sin(angle)];
    const back = [(1 + nd) * x, (1 + nd) * y, nj * y - nk * x, nj * x + nk * y];
    const [md, mj, mk] = this.momentumAt(t);
    const [q0, qd, qj, qk] = quaternionProduct(back, [1 + md, 0, mk, -mj]);
    const q = [];
    [q[this.d], q[this.j], q[this.k]] = [this.turned * qd, qj, this.turned * qk];
    const size = Math.hypot(q0, ...q);
    return quaternionProduct(upright, [q0, ...q].map((one) => one / size));
  }

  /** The direction of the angular momentum in the body, along (d, j, k), with d on its side. */
  momentumAt(t) {
    const { trajectory, shares, d, j, k, turned } = this;
    const m = trajectory.at(t).map((w, i) => (shares[i] * w) / trajectory.unit);
    return [turned * m[d], m[j], turned * m[k]];
  }

  /** Half of ψ, rad, at a time in the trajectory's own unit. */
  halfTurn(t) {
    const { a, muc, mus, sigma, rate, Q, integral, trajectory } = this;
    const far = trajectory.m1 > 0 ? Infinity : 700; // beyond it nothing moves on the separatrix, and sech underflows
    const half = Math.max(-far, Math.min(far, 0.5 * trajectory.p * t));
    const [sn, cn, dn] = trajectory.ladder ? climb(half, trajectory.ladder) : separatrixFunctions(half);
    const below = a * a + muc * muc * sn * sn;
    const [zr, zi] = below > 0 ? [(a * a * dn) / below, (a * muc * mus * sn * cn) / below] : [1, 0];
    const [middle] = this.momentumAt((trajectory.p > 0 ? half / trajectory.p : 0.5 * t) / trajectory.unit);
    return 0.5 * rate * t + Q * integral.at(0.5 * trajectory.p * t) + sigma * (Math.atan2(zi, middle + zr) - Math.atan2(zi, a + zr));
  }
}

/** ∫ s²/(1 + ν s²) dv from 0 to u/(1 + k1), s = sn v of the modulus k1: Landen's below the modulus with 1 − k² = m1. */
class ThirdKind {
  constructor(nu, k1, m1) {
    const complement = (2 * m1 ** 0.25) / (1 + Math.sqrt(m1));
    Object.assign(this, { nu, k1 });
    this.ladder = m1 > 0 ? meanLadder(k1 * k1, complement * complement) : null;
    this.whole = m1 > 0 ? completeThird(complement, nu) : 0;
  }

  at(u) {
    const v = u / (1 + this.k1);
    if (!this.ladder) return this.onSeparatrix(v);
    let [s, c, d] = climb(v, this.ladder);
    let turns = Math.floor((v * this.ladder.a[0]) / Math.PI + 0.5);
    if (turns % 2 !== 0) [s, c] = [-s, -c];
    if (c < 0) {
      turns += Math.sign(s);
      [s, c] = [-s, -c];
    }
    return this.part(s, Math.min(c * c, d * d), d) + 2 * turns * this.whole;
  }

  onSeparatrix(v) {
    const root = Math.sqrt(this.nu);
    const tanh = Math.tanh(v);
    if (Math.abs(v) > 20) return (v - (root > 0 ? Math.atan(root * tanh) / root : tanh)) / (1 + this.nu);
    const [s, c, d] = separatrixFunctions(v);
    return this.part(s, c * c, d);
  }

  part(s, c2, d) {
    return ((s * s * s) / 3) * carlsonRJ(c2, d * d, 1, 1 + this.nu * s * s);
  }
}

/** ∫ s²/(1 + ν s²) dv over a quarter period, by arithmetic-geometric means (Bulirsch's cel(k', 1 + ν, 0, 1)). */
function completeThird(complement, nu) {
  let [kc, p, a, b, e, em] = [complement, Math.sqrt(1 + nu), 0, 1 / Math.sqrt(1 + nu), complement, 1];
  for (let i = 0; i < 40; i++) {
    const [f, g] = [a, e / p];
    a += b / p;
    b = 2 * (b + f * g);
    p += g;
    const last = em;
    em += kc;
    if (Math.abs(last - kc) <= 1e-8 * last) break;
    kc = 2 * Math.sqrt(e);
    e = kc * em;
  }
  return (0.5 * Math.PI * (b + a * em)) / (em * (em + p));
}

/** Carlson's R_J for 0 ≤ x ≤ y ≤ z ≤ p (Numer. Algorithms 10 (1995) 13). */
function carlsonRJ(x, y, z, p) {
  let mean = 0.2 * (x + y + z + 2 * p);
  const delta = (p - x) * (p - y) * (p - z);
  const [X0, Y0, Z0] = [mean - x, mean - y, mean - z];
  const spread = Math.max(Math.abs(X0), Math.abs(Y0), Math.abs(Z0), Math.abs(mean - p));
  let [power, total] = [1, 0];
  for (let i = 0; i < 600 && spread * power >= 2e-3 * mean; i++) {
    const [rx, ry, rz, rp] = [x, y, z, p].map(Math.sqrt);
    const shift = rx * ry + ry * rz + rz * rx;
    const d = (rp + rx) * (rp + ry) * (rp + rz);
    const e = (Math.sqrt(delta * power) * power) / d;
    total += (power / d) * (e > 0 ? Math.atan(e) / e : 1);
    [x, y, z, p] = [x, y, z, p].map((one) => 0.25 * (one + shift));
    mean = 0.25 * (mean + shift);
    power *= 0.25;
  }
  const [X, Y, Z] = [X0, Y0, Z0].map((one) => (one * power) / mean);
  const P = -0.5 * (X + Y + Z);
  const e2 = X * Y + X * Z + Y * Z - 3 * P * P;
  const e3 = X * Y * Z + 2 * e2 * P + 4 * P * P * P;
  const e4 = (2 * X * Y * Z + e2 * P + 3 * P * P * P) * P;
  const e5 = X * Y * Z * P * P;
  const series = e2 * (-3 / 14 + (9 * e2) / 88 - (9 * e3) / 52) + e3 / 6 - (3 * e4) / 22 + (3 * e5) / 26;
  return (power * (1 + series)) / (mean * Math.sqrt(mean)) + 6 * total;
}
