// A motion followed by its full equations a(q) q̈ + f(q, q̇) = 0, which the map's own description gave as trees.

/** A tree as a function of the values of its symbols. */
function closure(tree) {
  if (typeof tree === "number") return () => tree;
  if (typeof tree === "string") return (at) => at[tree];
  const [head, ...parts] = [tree[0], ...tree.slice(1).map(closure)];
  if (head === "+") return (at) => parts.reduce((sum, part) => sum + part(at), 0);
  if (head === "*") return (at) => parts.reduce((product, part) => product * part(at), 1);
  if (head === "^") return (at) => parts[0](at) ** parts[1](at);
  return (at) => Math[head](parts[0](at));
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

/** The equations at one point of the map: its parameters are numbers. */
class Equations {
  constructor({ coordinates, shared, a, forces }, place) {
    this.coordinates = coordinates;
    this.shared = shared.map(([name, tree]) => [name, closure(tree)]);
    this.a = a.map((row) => row.map(closure));
    this.forces = forces.map(closure);
    this.at = Object.fromEntries(coordinateNames().map((name) => [name, coordinateAt(name, place)]));
    this.rest = coordinates.map(({ name }) => theMap.columns[`${name}_equilibrium`].at(place));
    coordinates.forEach(({ name }, i) => (this.at[name] = this.rest[i]));
    this.sizes = coordinates.map(({ size }) => Math.abs(closure(size)(this.at)) || 1);
  }

  /** a and f at a state (q, q̇). */
  terms(state) {
    const n = this.coordinates.length;
    this.coordinates.forEach(({ name, velocity }, i) => {
      this.at[name] = state[i];
      this.at[velocity] = state[n + i];
    });
    for (const [name, value] of this.shared) this.at[name] = value(this.at);
    return [this.a.map((row) => row.map((one) => one(this.at))), this.forces.map((one) => one(this.at))];
  }

  /** d/dt of (q, q̇). */
  slope(state) {
    const [a, f] = this.terms(state);
    return [...state.slice(f.length), ...solved(a, f.map((x) => -x))];
  }

  /** The shape of the mode whose ω² is given, in units of the sizes, its largest part one: by inverse iteration. */
  shape(square) {
    const n = this.rest.length;
    if (n === 1) return [this.sizes[0]];
    const still = (q) => this.terms([...q, ...q.map(() => 0)]);
    const [a] = still(this.rest);
    const columns = this.sizes.map((size, j) => {
      const [up, down] = [1, -1].map((sign) => still(this.rest.map((x, i) => (i === j ? x + sign * 1e-4 * size : x)))[1]);
      return up.map((x, i) => (x - down[i]) / (2e-4 * size));
    });
    const scale = Math.max(...columns.flatMap((column, j) => [Math.abs(column[j] / a[j][j]), Math.abs(square)]));
    const A = a.map((row, i) => row.map((m, j) => columns[j][i] - (square + 1e-6 * scale) * m));
    let shape = this.sizes.map((size, i) => size * (1 + 0.37 * i));
    for (let k = 0; k < 6; k++) {
      shape = solved(A, a.map((row) => row.reduce((sum, m, j) => sum + m * shape[j], 0)));
      const largest = shape.reduce((top, x, i) => (Math.abs(x / this.sizes[i]) > Math.abs(top) ? x / this.sizes[i] : top), 0);
      shape = shape.map((x) => x / largest);
    }
    return shape;
  }
}

// Dormand and Prince's pair of orders 5 and 4 (J. Comput. Appl. Math. 6 (1980) 19).
const STAGES = [
  [1 / 5], [3 / 40, 9 / 40], [44 / 45, -56 / 15, 32 / 9], [19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729],
  [9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656], [35 / 384, 0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84],
];
const ERRORS = [71 / 57600, 0, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40];
const MOST_STEPS = 200000;

/** States at given times, from the first on; shorter where the motion runs out of all bounds. */
function integrated(slope, start, times, tolerance, sizes, out) {
  const found = [start];
  let [y, t, h, steps] = [start, times[0], (times[1] - times[0]) / 10, 0];
  const weights = sizes.map((size) => tolerance * size);
  for (const next of times.slice(1)) {
    while (t < next) {
      if (++steps > MOST_STEPS) return found;
      const step = Math.min(h, next - t);
      const k = [slope(y)];
      for (const stage of STAGES) k.push(slope(y.map((x, i) => x + step * stage.reduce((sum, b, j) => sum + b * k[j][i], 0))));
      const last = STAGES[STAGES.length - 1];
      const after = y.map((x, i) => x + step * last.reduce((sum, b, j) => sum + b * k[j][i], 0));
      const error = Math.max(...weights.map((weight, i) => Math.abs(step * ERRORS.reduce((sum, e, j) => sum + e * k[j][i], 0)) / weight));
      if (!(error <= 1)) {
        h = step * (Number.isFinite(error) ? Math.max(0.2, 0.9 * error ** -0.2) : 0.2);
        if (!(h > 1e-14 * (times[times.length - 1] - times[0]))) return found;
        continue;
      }
      [y, t] = [after, step < next - t ? t + step : next];
      h = Math.max(h, step) * Math.min(4, Math.max(1, 0.9 * (error || 1e-4) ** -0.2));
    }
    if (out(y)) return found;
    found.push(y);
  }
  return found;
}
