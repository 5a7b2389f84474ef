"""Free rotations in more digits than doubles have, by methods that the kernels do not use."""

import math
from fractions import Fraction
from operator import mul

import mpmath as mp
import numpy as np

ORDER = 24
BITS = 220  # number of binary digits behind the point in :func:`taylor`


def taylor(moments, start, times, order=44, with_attitude=False):
    """Return w at times in sequence, and the quaternion since the start, by Taylor series in fixed point.

    Euler's equations and q' = q (0, w)/2 in integers: order 64 gives 48 digits, 44 some 32, 26 some 20. Moments, start
    and times are doubles or numbers of mpmath. Rows are lists of numbers of mpmath: w, then (with_attitude) q, scalar
    first.
    """
    I1, I2, I3 = map(_fraction, moments)
    c = [(I2 - I3) / I1, (I3 - I1) / I2, (I1 - I2) / I3]
    size = max(abs(_fraction(x)) for x in start)
    state = [int(_fraction(x) / size * 2**BITS) for x in start] + [2**BITS, 0, 0, 0][: 4 * with_attitude]
    scales = [int(x * 2**BITS) for x in c] + [2 ** (BITS - 1)] * 4
    longest = Fraction(1, 8) / max(Fraction(1, 10), *(abs(x) for x in c))
    unit = mp.mpf(size.numerator) / size.denominator / mp.mpf(2) ** BITS
    rows, now = [], Fraction(0)
    for time in times:
        gap = _fraction(time) * size - now
        steps = math.ceil(abs(gap) / longest)
        for _ in range(steps):
            state = _taylor_step(state, scales, int(gap / steps * 2**BITS), order)
        now += gap
        rows.append([x * unit for x in state[:3]] + [mp.mpf(x) / mp.mpf(2) ** BITS for x in state[3:]])
    return rows


def _fraction(x):
    """Return a number of mpmath, or a double, as a fraction."""
    sign, mantissa, exponent, _ = mp.mpf(x)._mpf_
    return Fraction(-mantissa if sign else mantissa) * Fraction(2) ** exponent


# The derivatives of w (components 0 to 2) and q (3 to 6) are sums of products: sign, and numbers of both components.
PRODUCTS = (
    *(((1, 1, 2),), ((1, 2, 0),), ((1, 0, 1),)),
    *(((-1, 4, 0), (-1, 5, 1), (-1, 6, 2)), ((1, 3, 0), (1, 5, 2), (-1, 6, 1))),
    *(((1, 3, 1), (1, 6, 0), (-1, 4, 2)), ((1, 3, 2), (1, 4, 1), (-1, 5, 0))),
)


def _taylor_step(state, scales, h, order):
    """Return the state after a step of length h, all in fixed point."""
    terms = [[x] for x in state]
    for n in range(order):
        for i, products in enumerate(PRODUCTS[: len(state)]):
            total = sum(sign * sum(map(mul, terms[j][: n + 1], terms[k][n::-1])) for sign, j, k in products)
            terms[i].append((scales[i] * (total >> BITS) >> BITS) // (n + 1))
    totals = [0] * len(state)
    for n in range(order, -1, -1):
        totals = [x[n] + (total * h >> BITS) for x, total in zip(terms, totals, strict=True)]
    return totals


class Textbook:
    """A free rotation in the textbook's terms, L^2, 2E and a starting phase, in numbers of mpmath.

    For an asymmetric top off the separatrix; called with a time, it returns w. Source: Landau and Lifshitz, Mechanics,
    section 37.
    """

    def __init__(self, moments, start):
        I, w = [mp.mpf(x) for x in moments], [mp.mpf(x) for x in start]  # noqa: E741
        L2, E2 = sum((a * b) ** 2 for a, b in zip(I, w, strict=True)), sum(a * b**2 for a, b in zip(I, w, strict=True))
        low, s, high = sorted(range(3), key=lambda i: I[i])
        c, d = (low, high) if E2 * I[s] < L2 else (high, low)
        product = (I[d] - I[s]) * (L2 - E2 * I[c])
        self.moments, self.start, self.L, self.roles = I, w, mp.sqrt(L2), (s, c, d)
        self.p = mp.sqrt(product / (I[0] * I[1] * I[2]))
        self.m = (I[s] - I[c]) * (E2 * I[d] - L2) / product
        self.m1 = (I[d] - I[c]) * (L2 - E2 * I[s]) / product
        self.K = mp.ellipk(self.m)
        A_s = mp.sqrt((E2 * I[d] - L2) / (I[s] * (I[d] - I[s])))
        A_c = mp.sqrt((E2 * I[d] - L2) / (I[c] * (I[d] - I[c])))
        A_d = mp.sqrt((L2 - E2 * I[c]) / (I[d] * (I[d] - I[c]))) * (-1 if w[d] < 0 else 1)
        # The sn component must rise at cn = 1, by Euler's equation
        rises = (I[(s + 1) % 3] - I[(s + 2) % 3]) * A_d > 0
        self.amplitudes = A_s if rises else -A_s, A_c, A_d
        self.u0 = self._phase(w[s] / self.amplitudes[0], w[c] / A_c)

    def _phase(self, sn, cn):
        u0 = sn * mp.elliprf(cn**2, cn**2 + self.m1 * sn**2, 1)
        return u0 if cn >= 0 else mp.sign(sn) * 2 * self.K - u0

    def __call__(self, t):
        u = self.p * mp.mpf(t) + self.u0
        components = [None] * 3
        for axis, amplitude, name in zip(self.roles, self.amplitudes, ("sn", "cn", "dn"), strict=True):
            components[axis] = amplitude * mp.ellipfun(name, u, m=self.m)
        return components


def sensitivity(solution, moments, start, t):
    """Return the sum over all seven inputs x of |x df/dx| for each component f of a solution(moments, start, t).

    One rounding of each input moves a component by 2^-53 of it.
    """
    inputs, small = [mp.mpf(float(x)) for x in (*moments, *start, t)], mp.mpf(10) ** -20
    base, total = solution(inputs[:3], inputs[3:6], inputs[6]), None
    for i in range(7):
        changed = [x * (1 + small) if k == i else x for k, x in enumerate(inputs)]
        values = solution(changed[:3], changed[3:6], changed[6])
        changes = [abs(a - b) / small for a, b in zip(values, base, strict=True)]
        total = changes if total is None else [a + b for a, b in zip(total, changes, strict=True)]
    return total


def legendre(three, T2, L):
    """Return P_psi, P_phi of the long axis and of the encircled one, and if the mode is SAM; None if there are none.

    By Legendre's complete integrals, of ascending moments, twice the energy and L in numbers of mpmath.
    """
    I1, I2, I3 = three
    short = L**2 > T2 * I2
    d, c = (I3, I1) if short else (I1, I3)
    product = (d - I2) * (L**2 - T2 * c)
    if not product > 0 or L**2 == T2 * I2 or T2 * d == L**2 or not T2 * I1 <= L**2 <= T2 * I3:
        return None
    p, m = mp.sqrt(product / (I1 * I2 * I3)), (I2 - c) * (T2 * d - L**2) / product
    K = mp.ellipk(m)
    P = 4 * K / p
    f = L / (2 * mp.pi * d) * (1 + (d / c - 1) * mp.ellippi(-d * (I2 - c) / (c * (d - I2)), m) / K)
    return P, (1 / (f - 1 / P) if short else 1 / f), 1 / f, short


def turns(I1, I2, I3, chi, theta, digits=None):
    """Return the twist (rad) and the time of the turn (I_mid/L) of throws, shape (2, n), by Taylor series.

    They are series of L's direction, phi and chi: both angles are integrals, so that no turn of them is counted. In
    long doubles, or in mpmath's numbers of so many digits (mp.dps must be more).
    """
    real = np.longdouble if digits is None else mp.mpf
    lift = (lambda x: np.asarray(x, np.longdouble)) if digits is None else np.vectorize(mp.mpf, otypes=[object])
    sin, cos = (np.sin, np.cos) if digits is None else (np.frompyfunc(f, 1, 1) for f in (mp.sin, mp.cos))
    angle_of_turn = 8 * (np.arctan(real(1)) if digits is None else mp.atan(1))
    precision = float(np.finfo(np.longdouble).eps) if digits is None else 10.0**-digits
    n1, n2, n3 = lift(np.sort([I1, I2, I3], axis=0))
    chi, tilt = lift(chi), lift(theta)
    along = np.where(np.asarray(theta) == 0.5 * math.pi, lift(0.0), cos(tilt))
    zero = lift(np.zeros(tilt.size))
    y = np.stack([along, sin(tilt) * cos(chi), sin(tilt) * sin(chi), zero, zero, zero])
    # m_1' = k_1 m_2 m_3; phi' = (m_2^2 + g m_3^2)/q, chi' = -m_1 (e_2 m_2^2 + e_3 m_3^2)/q, q = m_2^2 + m_3^2
    constants = np.stack([n2 / n3 - 1, n2 / n1 - n2 / n3, 1 - n2 / n1, n2 / n3, n2 / n1 - 1, n2 / n1 - n2 / n3])
    out = np.full((2, tilt.size), np.nan, dtype=y.dtype)
    alive = np.arange(tilt.size)
    while alive.size:
        k1, k2, k3, g, e2, e3 = constants[:, alive]
        T = np.zeros((5, ORDER + 1, alive.size), dtype=y.dtype) + real(0)
        q, e, P, X = (np.zeros((ORDER, alive.size), dtype=y.dtype) + real(0) for _ in range(4))
        T[:, 0] = y[:5, alive]
        m1, m2, m3 = T[:3]
        for k in range(ORDER):
            up, down = slice(0, k + 1), slice(k, None, -1)
            s2, s3 = (m2[up] * m2[down]).sum(axis=0), (m3[up] * m3[down]).sum(axis=0)
            q[k], e[k] = s2 + s3, e2 * s2 + e3 * s3
            P[k] = (s2 + g * s3 - (P[:k] * q[k:0:-1]).sum(axis=0)) / q[0]
            X[k] = (-(m1[up] * e[down]).sum(axis=0) - (X[:k] * q[k:0:-1]).sum(axis=0)) / q[0]
            m1[k + 1] = k1 * (m2[up] * m3[down]).sum(axis=0) / (k + 1)
            m2[k + 1] = k2 * (m3[up] * m1[down]).sum(axis=0) / (k + 1)
            m3[k + 1] = k3 * (m1[up] * m2[down]).sum(axis=0) / (k + 1)
            T[3, k + 1], T[4, k + 1] = P[k] / (k + 1), X[k] / (k + 1)
        sizes = np.maximum(np.abs(T[:, -2:].astype(float)).max(axis=0), 1e-300)
        h = lift(0.8 * np.minimum(*((precision / sizes[i]) ** (1 / (ORDER - 1 + i)) for i in (0, 1))))
        new = _at(T, h)
        is_over = new[3] >= angle_of_turn
        t = h
        if is_over.any():
            for _ in range(8):
                t = t - np.where(is_over, (_at(T[3], t) - angle_of_turn) / _at(P, t), real(0))
            new = _at(T, t)
        y[:5, alive], y[5, alive] = new, y[5, alive] + t
        out[:, alive[is_over]] = y[4:, alive[is_over]]
        alive = alive[~is_over]
    return out


def _at(series, t):
    """Value of a power series along the last axis but one."""
    total = series[..., -1, :]
    for k in range(series.shape[-2] - 2, -1, -1):
        total = total * t + series[..., k, :]
    return total


def extrapolate(rates, state, span, steps, columns=9):
    """Return the state after a span of time, by Gragg, Bulirsch and Stoer's extrapolation in long doubles.

    Args:
        rates: (times (points,), states (n, points)) → their derivatives.
        state: at the time 0, shape (n, points).
        span: shape (points,).
        steps: so many equal steps of the order 2 `columns`.
    """
    y, h = np.asarray(state, np.longdouble), np.asarray(span, np.longdouble) / steps
    counts = [np.longdouble(2 * k) for k in range(1, columns + 1)]
    for step in range(steps):
        table = []
        for j, count in enumerate(counts):
            part = h / count
            before, here = y, y + part * rates(step * h, y)
            for k in range(1, int(count)):
                before, here = here, before + 2 * part * rates(step * h + k * part, here)
            row = [(before + here + part * rates((step + 1) * h, here)) / 2]
            for m in range(j):
                row.append(row[m] + (row[m] - table[m]) / ((count / counts[j - m - 1]) ** 2 - 1))
            table = row
        y = table[-1]
    return y


def orbit_monodromy(parameters, rate, span, steps):
    """Return matrices of planar perturbations and of tilts over a span of true anomaly, and (δ, δ') at its end.

    From δ = 0, in body axes: components of the orbit's normal and of the angular velocity, rotated at the end by the
    angle by which the body has turned.

    Args:
        parameters: I1/I3, (I2 - I1)/I3 and eccentricity, each (points,).
        rate: δ' at the start, (points,).
        span: rad, (points,).
        steps: of :func:`extrapolate`.
    """
    A, D, e = (np.asarray(x, np.longdouble) for x in parameters)
    roll, yaw, n = (A + D - 1) / A, (1 - A) / (A + D), A.size

    def rates(f, state):
        (angle, turn), planar, (g1, g2, w1, w2) = state[:2], state[2:6].reshape(2, 2, n), state[6:].reshape(4, 4, n)
        radius, s, c, push = 1 + e * np.cos(f), np.sin(angle), np.cos(angle), 2 * e * np.sin(f)
        spin, tide, u3 = radius**2 * (1 + turn), 3 * radius**3, s * g2 - c * g1
        planar_rates = [turn, (push * (1 + turn) - 3 * D * s * c) / radius, *planar[1]]
        planar_rates += [*(push * planar[1] - 3 * D * (c * c - s * s) * planar[0]) / radius]
        tilts = [spin * g2 - w2, w1 - spin * g1]
        tilts += [roll * (tide * s * u3 + spin * w2), yaw * (spin * w1 - tide * c * u3)]
        return np.concatenate([planar_rates, *(tilts / radius**2)])

    start = np.zeros((22, n), np.longdouble)
    start[1], start[[2, 5]], start[6::5] = rate, 1, 1
    end = extrapolate(rates, start, span, steps)
    (g1, g2, w1, w2), c, s = end[6:].reshape(4, 4, n), np.cos(end[0]), np.sin(end[0])
    return (
        end[2:6].reshape(2, 2, n),
        np.stack([c * g1 - s * g2, s * g1 + c * g2, c * w1 - s * w2, s * w1 + c * w2]),
        end,
    )
