// A motion of the full equations a(q) q̈ = f(q, q̇, t), or x' = f(x, t), which the map's own description gave as trees.

/** A tree as a function of the values of its symbols, which stand in a list where `slots` says. */
function closure(tree, slots) {
  if (typeof tree === "number") return () => tree;
  if (typeof tree === "string") {
    const slot = slots.get(tree);
    return (at) => at[slot];
  }
  const [head, [one, two, ...more]] = [tree[0], tree.slice(1).map((part) => closure(part, slots))];
  if (head === "^") return typeof tree[2] === "number" && tree[2] === 2 ? (at) => one(at) ** 2 : (at) => one(at) ** two(at);
  if (head !== "+" && head !== "*") return (at) => Math[head](one(at));
  if (more.length > 0) return closure([head, [head, ...tree.slice(1, -1)], tree.at(-1)], slots);
  return head === "+" ? (at) => one(at) + two(at) : (at) => one(at) * two(at);
}

/** x with A x = b, by elimination with the largest pivot. */
function solved(A, b) {
  const n = b.length;
  const rows = A.map((row, i) => [...row, b[i]]);
  for (let k = 0; k < n; k++) {
    const best = rows.slice(k).reduce((top, row, i) => (Math.abs(row[k]) > Math.abs(rows[top][k]) ? k + i : top), k);
    [rows[k], rows[best]] = [rows[best], rows[k]];
    for (let i = k + 1; i < n; i++) {
      const factor = rows[i][k] / rows[k][k];
      for (let j = k; j <= n; j++) rows[i][j] -= factor * rows[k][j];
    }
  }
  const x = new Array(n).fill(0);
  for (let i = n - 1; i >= 0; i--) x[i] = (rows[i][n] - rows[i].slice(i + 1, n).reduce((sum, a, j) => sum + a * x[i + 1 + j], 0)) / rows[i][i];
  return x;
}

const ATTITUDE = [0, 1, 2, 3].map((i) => `attitude_${i}`);

/** The equations at one point of the map: its parameters are numbers. */
class Equations {
  constructor(given, place) {
    const { coordinates, shared, a, forces, seen, drawn, period, attitude } = given;
    const moving = [...coordinates.map(({ name }) => name), ...(a.length > 0 ? coordinates.map(({ velocity }) => velocity) : []), ...(attitude ? ATTITUDE : [])];
    const parameters = coordinateNames();
    const slots = new Map([...moving, "t", ...shared.map(([name]) => name), ...seen.map(([name]) => name), ...parameters].map((name, i) => [name, i]));
    const written = (tree) => closure(tree, slots);
    const named = (pairs) => pairs.map(([name, tree]) => [slots.get(name), written(tree)]);
    this.at = new Float64Array(slots.size);
    for (const name of parameters) this.at[slots.get(name)] = coordinateAt(name, place);
    Object.assign(this, { coordinates, time: slots.get("t"), shared: named(shared), seen: named(seen) });
    [this.a, this.forces] = [a.map((row) => row.map(written)), forces.map(written)];
    this.drawn = drawn.map(([kind, label, points]) => ({ kind, label, points: points.map((point) => point.map(written)) }));
    this.rest = moving.map((name) => (theMap.columns[`${name}_equilibrium`] ?? theMap.columns[`${name}_start`])?.at(place) ?? 0);
    this.states = coordinates.length + a.length; // without the attitude
    this.put(0, this.rest);
    this.sizes = coordinates.map(({ size }) => Math.abs(written(size)(this.at)) || 1);
    if (attitude) [this.omega, this.upwards] = attitude.map((vector) => vector.map(written));
    this.period = period === null ? null : written(period)(this.at);
    this.spin = attitude ? Math.hypot(...this.omega.map((w) => w(this.at))) : 0;
  }

  /** Set the states to these values, at time t. */
  put(t, state) {
    const { at } = this;
    at.set(state);
    at[this.time] = t;
    for (const [slot, value] of this.shared) at[slot] = value(at);
  }

  /** d/dt of a state at time t. */
  slope(t, state) {
    this.put(t, state);
    const { at, a, states } = this;
    const forces = this.forces.map((force) => force(at));
    const rates = a.length > 0 ? [...state.slice(a.length, 2 * a.length), ...solved(a.map((row) => row.map((one) => one(at))), forces)] : forces;
    if (this.omega) rates.push(...quaternionProduct(state.slice(states), [0, ...this.omega.map((w) => w(at))]).map((x) => x / 2));
    return rates;
  }

  /** A state completed by the attitude in which what points upwards does. */
  upright(state) {
    if (!this.omega) return state;
    this.put(0, [...state, 1, 0, 0, 0]);
    return [...state, ...uprightOf(directionOf(this.upwards.map((x) => x(this.at))))];
  }

  /** Sizes of all states: velocities change at a rate. */
  sizesAt(rate) {
    return [...this.sizes, ...this.a.map((_, i) => this.sizes[i] * rate)];
  }

  /**
   * The eigenvector of an eigenvalue [real, imaginary], as parts [real, imaginary] of all states, the largest of the
   * coordinates one of its sizes and real: by inverse iteration on the slopes at rest.
   */
  mode([growth, turning]) {
    const { rest, states: n } = this;
    const rate = Math.hypot(growth, turning);
    const sizes = this.sizesAt(rate || 1);
    const still = [...rest.slice(0, n), ...(this.omega ? [1, 0, 0, 0] : [])];
    const columns = sizes.map((size, j) => {
      const [up, down] = [1, -1].map((sign) => this.slope(0, still.map((x, i) => (i === j ? x + sign * 1e-5 * size : x))));
      return sizes.map((other, i) => ((up[i] - down[i]) * 1e5) / 2 / other);
    });
    const scale = Math.max(rate, ...columns.flat().map((x) => Math.abs(x) / n));
    const shift = [growth + 1e-7 * scale, turning];
    const A = Array.from({ length: 2 * n }, (_, i) => Array.from({ length: 2 * n }, (_, j) => {
      const own = i % n === j % n;
      if (i < n === j < n) return columns[j % n][i % n] - (own ? shift[0] : 0);
      return own ? (i < n ? shift[1] : -shift[1]) : 0;
    }));
    let v = Array.from({ length: 2 * n }, (_, i) => 1 + 0.37 * (i % n) - 0.2 * Math.floor(i / n));
    for (let k = 0; k < 4; k++) {
      v = solved(A, v);
      const sizeOf = (i) => Math.hypot(v[i], v[n + i]);
      const top = this.sizes.reduce((best, _, i) => (sizeOf(i) > sizeOf(best) ? i : best), 0);
      const [x, y] = [v[top], v[n + top]];
      const turned = Array.from({ length: n }, (_, i) => [(v[i] * x + v[n + i] * y) / (x * x + y * y), (v[n + i] * x - v[i] * y) / (x * x + y * y)]);
      v = [...turned.map(([real]) => real), ...turned.map(([, imaginary]) => imaginary)];
    }
    return sizes.map((size, i) => [size * v[i], size * (turning === 0 ? 0 : v[n + i])]);
  }

  /** The perturbation that grows most over a period, its largest coordinate one of its sizes, by powers of the monodromy matrix. */
  growing() {
    const { rest, states: n, sizes } = this;
    const whole = this.sizesAt((2 * Math.PI) / this.period);
    const after = (start) => integrated((t, y) => this.slope(t, y), this.upright(start), [0, this.period], 1e-12, whole, () => false).at(-1);
    const base = after(rest.slice(0, n));
    const columns = whole.map((size, j) => after(base.map((_, i) => rest[i] + (i === j ? 1e-5 * size : 0)).slice(0, n)).map((x, i) => (1e5 * (x - base[i])) / whole[i]));
    let v = whole.map((_, i) => 0.6 ** i);
    for (let k = 0; k < 200; k++) {
      v = v.map((_, i) => columns.reduce((sum, column, j) => sum + column[i] * v[j], 0));
      const most = sizes.reduce((best, _, i) => (Math.abs(v[i]) > Math.abs(best) ? v[i] : best), 0);
      v = v.map((x) => x / most);
    }
    return v.map((x, i) => x * whole[i]);
  }

  /** The parts of the picture in a state, or those of one kind: kind, label and points. */
  picture(t, state, only) {
    this.put(t, state);
    const { at } = this;
    for (const [slot, value] of this.seen) at[slot] = value(at);
    const parts = only ? this.drawn.filter(({ kind }) => kind === only) : this.drawn;
    return parts.map(({ kind, label, points }) => ({ kind, label, points: points.map((point) => point.map((x) => x(at))) }));
  }
}

// Dormand and Prince's pair of orders 5 and 4 (J. Comput. Appl. Math. 6 (1980) 19).
const STAGES = [
  [1 / 5], [3 / 40, 9 / 40], [44 / 45, -56 / 15, 32 / 9], [19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729],
  [9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656], [35 / 384, 0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84],
];
const NODES = [1 / 5, 3 / 10, 4 / 5, 8 / 9, 1, 1];
const ERRORS = [71 / 57600, 0, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40];
const MOST_STEPS = 200000;

/** States at given times, from the first on; shorter where the motion runs out of all bounds. */
function integrated(slope, start, times, tolerance, sizes, out) {
  const found = [start];
  let [y, t, h, steps, first] = [start, times[0], (times[1] - times[0]) / 10, 0, slope(times[0], start)];
  const weights = sizes.map((size) => tolerance * size);
  for (const next of times.slice(1)) {
    while (t < next) {
      if (++steps > MOST_STEPS) return found;
      const step = Math.min(h, next - t);
      const k = [first];
      let after = y;
      STAGES.forEach((stage, s) => {
        after = y.map((x, i) => x + step * stage.reduce((sum, b, j) => sum + b * k[j][i], 0));
        k.push(slope(t + NODES[s] * step, after));
      });
      const error = Math.max(...weights.map((weight, i) => Math.abs(step * ERRORS.reduce((sum, e, j) => sum + e * k[j][i], 0)) / weight));
      if (!(error <= 1)) {
        h = step * (Number.isFinite(error) ? Math.max(0.2, 0.9 * error ** -0.2) : 0.2);
        if (!(h > 1e-14 * (times[times.length - 1] - times[0]))) return found;
        continue;
      }
      [y, t, first] = [after, step < next - t ? t + step : next, k[6]];
      h = Math.max(h, step) * Math.min(4, Math.max(1, 0.9 * (error || 1e-4) ** -0.2));
    }
    if (out(y)) return found;
    found.push(y);
  }
  return found;
}
