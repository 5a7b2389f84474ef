"""Free rotations in more digits than doubles have, by methods that the kernels do not use."""

import math

import mpmath as mp
import numpy as np

ORDER = 24


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
