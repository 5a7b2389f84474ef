// Jacobi's elliptic functions and the complete integral K, in double precision.
//
// Every function takes the parameter m and its complement m1 = 1 − m: near the separatrix m rounds to one while m1
// keeps all its digits. Gauss' transformation (DLMF 22.7.2-4) in Bulirsch's arrangement.

const SPLITTER = 134217729; // 2^27 + 1 cuts a double into two halves of 26 bits
const SETTLED = 1e-15; // of a mean: the next step would be rounding

/** x + y = s + e exactly. */
function twoSum(x, y) {
  const s = x + y;
  const t = s - x;
  return [s, x - (s - t) + (y - t)];
}

/** x y = r + e exactly (Dekker 1971). */
function twoProduct(x, y) {
  const r = x * y;
  let t = SPLITTER * x;
  const xh = t - (t - x);
  const xl = x - xh;
  t = SPLITTER * y;
  const yh = t - (t - y);
  const yl = y - yh;
  return [r, xh * yh - r + xh * yl + xl * yh + xl * yl];
}

function doubleProduct([xh, xl], [yh, yl]) {
  const [r, e] = twoProduct(xh, yh);
  return twoSum(r, e + (xh * yl + xl * yh));
}

/** Arithmetic and geometric means a_n, b_n, for m1 > 0. */
function meanLadder(m, m1) {
  const [as, bs] = [[1], [Math.sqrt(m <= 0.5 ? 1 - m : m1)]];
  while (Math.abs(as.at(-1) - bs.at(-1)) > SETTLED * as.at(-1)) {
    const [a, b] = [as.at(-1), bs.at(-1)];
    as.push(0.5 * (a + b));
    bs.push(Math.sqrt(a * b));
  }
  return { m, as, bs };
}

/** [sn, cn, dn] of u from a finished ladder. */
function climb(u, { m, as, bs }) {
  if (Math.abs(u) < 1e-8) return [u, 1 - 0.5 * u * u, 1 - 0.5 * m * u * u];
  const phi = u * as.at(-1);
  const [sine, cosine] = [Math.sin(phi), Math.cos(phi)];
  if (sine === 0) return [0, Math.sign(cosine), 1];
  let C = as.at(-1) * (cosine / sine);
  let dn = 1;
  for (let i = as.length - 1; i > 0; i--) {
    const q = (C * C) / as[i];
    C *= dn;
    dn = (q + bs[i - 1]) / (q + as[i - 1]);
  }
  const sn = Math.sign(sine) / Math.sqrt(1 + C * C);
  return [sn, C * sn, dn];
}

/** [sn, cn, dn] at m = 1: tanh u, sech u, sech u. */
function separatrixFunctions(u) {
  const e = Math.exp(-Math.abs(u));
  const sech = (2 * e) / (1 + e * e);
  return [Math.tanh(u), sech, sech];
}

function jacobi(u, m, m1) {
  return m1 <= 0 ? separatrixFunctions(u) : climb(u, meanLadder(m, m1));
}

/** K = π/(2 agm(1, √m1)), infinite at m1 = 0. */
function completeK(m, m1) {
  return m1 <= 0 ? Infinity : (0.5 * Math.PI) / meanLadder(m, m1).as.at(-1);
}
