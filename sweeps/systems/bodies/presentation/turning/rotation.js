// The free rotation of a rigid body in closed form: Euler's equations by Jacobi's elliptic functions.
//
// Roles: sn runs on the axis of middle moment, dn on the axis that the polhode encircles, cn on the third. The
// angular velocity at any time comes from the addition theorems, so a perturbation keeps its relative digits.

/** The power of two next above the largest of some magnitudes; 1 where all are zero. */
function unitOf(values) {
  const largest = Math.max(...values.map(Math.abs));
  return largest > 0 ? 2 ** Math.min(1023, Math.floor(Math.log2(largest)) + 1) : 1;
}

/** Axes (0, 1, 2) of the least, the middle and the greatest moment; three different ones, ties or not. */
function orderOfMoments([I1, I2, I3]) {
  const greatest = I1 >= I2 && I1 >= I3 ? 0 : I2 >= I3 ? 1 : 2;
  const least = I3 <= I1 && I3 <= I2 ? 2 : I2 <= I1 ? 1 : 0;
  return [least, 3 - least - greatest, greatest];
}

/** L² − 2E·I_mid, in double-double with exact differences of the moments. */
function separatrixOffset(Imin, Imid, Imax, wmin, wmax) {
  const a = doubleProduct(doubleProduct(twoSum(Imax, -Imid), [Imax, 0]), twoProduct(wmax, wmax));
  const b = doubleProduct(doubleProduct(twoSum(Imid, -Imin), [Imin, 0]), twoProduct(wmin, wmin));
  const [difference, e] = twoSum(a[0], -b[0]);
  return difference + (e + (a[1] - b[1]));
}

/** Everything that is constant on a trajectory, from moments (kg m2) and the angular velocity at time zero (rad/s). */
class Trajectory {
  constructor(moments, start) {
    const unit = unitOf(moments);
    this.unit = unitOf(start);
    this.moments = moments.map((I) => I / unit);
    this.start = start.map((w) => w / this.unit);
    const [I1, I2, I3] = this.moments;
    this.c = [(I2 - I3) / I1, (I3 - I1) / I2, (I1 - I2) / I3];
    const [least, middle, greatest] = orderOfMoments(this.moments);
    const [Imin, Imid, Imax] = [least, middle, greatest].map((i) => this.moments[i]);
    const [wmin, ws, wmax] = [least, middle, greatest].map((i) => this.start[i]);
    const N = separatrixOffset(Imin, Imid, Imax, wmin, wmax);
    const [bmin, bs, bmax] = [(Imax - Imid) / Imin, (Imax - Imin) / Imid, (Imid - Imin) / Imax];
    const [bc, bd, wc, wd] = N >= 0 ? [bmin, bmax, wmin, wmax] : [bmax, bmin, wmax, wmin];
    const p2 = bc * bs * wd * wd + bc * bd * ws * ws;
    this.p = Math.sqrt(p2); // in units of `unit`
    this.m = p2 > 0 ? Math.min(1, (bd * (bc * ws * ws + bs * wc * wc)) / p2) : 0;
    this.m1 = p2 > 0 ? Math.min(1, (bs * (Math.abs(N) / Imin / Imax)) / p2) : 1;
    this.roles = [middle, N >= 0 ? least : greatest, N >= 0 ? greatest : least];
    this.ladder = this.m1 > 0 ? meanLadder(this.m, this.m1) : null;
  }

  /** Time 2K/p, s, after which the sn and the cn component have changed sign. */
  get flipPeriod() {
    return this.p > 0 ? (2 * completeK(this.m, this.m1)) / this.p / this.unit : Infinity;
  }

  /** Angular velocity, rad/s, at time t, s. */
  at(t) {
    const s = t * this.unit;
    const [sn, cn, dn] = this.ladder ? climb(this.p * s, this.ladder) : separatrixFunctions(this.p * s);
    const [cs, cc, cd] = this.roles.map((i) => this.c[i]);
    const [ws, wc, wd] = this.roles.map((i) => this.start[i]);
    const S = this.p > 0 ? sn / this.p : s;
    const D0 = this.p > 0 ? Math.sqrt(Math.abs(cc * cs)) * (Math.abs(wd) / this.p) : 1;
    const r = Math.max(dn, Math.abs(sn) * D0);
    if (r === 0) return this.start.map((w) => w * this.unit);
    const [cr, dr, sr, xc, xd] = [cn / r, dn / r, (sn * D0) / r, wc / r, wd / r];
    const D = cr * cr + sr * sr;
    const w = [];
    w[this.roles[0]] = (this.unit * (ws * cr * dr + cs * S * xc * xd)) / D;
    w[this.roles[1]] = (this.unit * (xc * cr + cc * S * ws * (xd * dr))) / D;
    w[this.roles[2]] = (this.unit * (xd * dr + cd * S * ws * (xc * cr))) / D;
    return w;
  }

  momentum(t) {
    return this.at(t).map((w, i) => w * this.moments[i]);
  }

  /** What runs along the polhode. */
  tip(t) {
    return this.at(t);
  }

  /** Amplitudes of the sn, cn and dn component, in units of `unit`. */
  get amplitudes() {
    const [cs, cc, cd] = this.roles.map((i) => this.c[i]);
    const [ws, wc, wd] = this.roles.map((i) => this.start[i]);
    const turning = cs !== 0 && cc !== 0;
    const ratio = turning ? Math.sqrt(Math.abs(cc / cs)) : 1;
    const nod = turning ? Math.sqrt(Math.abs(cd / cs)) : 0;
    return [Math.hypot(ws, wc / ratio), Math.hypot(wc, ratio * ws), Math.hypot(wd, nod * ws) * (wd < 0 ? -1 : 1)];
  }

  get isStationary() {
    const [I1, I2, I3] = this.moments;
    const [w1, w2, w3] = this.start;
    return (I2 === I3 || w2 * w3 === 0) && (I3 === I1 || w3 * w1 === 0) && (I1 === I2 || w1 * w2 === 0);
  }

  /** The closed curve of the angular velocity in the body, rad/s, as n + 1 points: sn = sin φ, cn = cos φ. */
  polhode(n = 240) {
    if (this.isStationary) return [this.start.map((w) => w * this.unit)];
    const [As, Ac, Ad] = this.amplitudes;
    return Array.from({ length: n + 1 }, (_, i) => {
      const phi = (2 * Math.PI * i) / n;
      const w = [];
      w[this.roles[0]] = this.unit * As * Math.sin(phi);
      w[this.roles[1]] = this.unit * Ac * Math.cos(phi);
      w[this.roles[2]] = this.unit * Ad * Math.sqrt(Math.cos(phi) ** 2 + this.m1 * Math.sin(phi) ** 2);
      return w;
    });
  }
}

/** The start of a perturbed spin about axis a (1, 2, 3): ω0 (1, ε cos φ, ε sin φ) on the axes a, b, c. */
function perturbedSpin({ axis, omega0, epsilon, phase }) {
  const a = axis - 1;
  const w = [];
  w[a] = omega0;
  w[(a + 1) % 3] = epsilon * omega0 * Math.cos(phase);
  w[(a + 2) % 3] = epsilon * omega0 * Math.sin(phase);
  return w;
}
