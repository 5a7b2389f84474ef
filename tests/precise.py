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
