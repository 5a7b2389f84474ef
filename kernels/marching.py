"""Attitudes at equal spacings by exact steps, begun anew from the closed form before rounding has grown.

The exact step (:mod:`kernels.attitude`, :mod:`kernels.exact`) knows its own state only. Each rounding moves it to a
neighbouring trajectory: by half a unit in the last place a step, all in one sense where a component hardly changes.
Along the unstable axis the distance grows as e^{pt} besides, and a motion that comes back from there, or on the
separatrix never does, is lost after some 35/p. The closed form is decided by the start alone and loses nothing. So the
steps begin anew from it, every 64 of them, and where m1 is below NEAR before 2/p has gone by.
"""

import numpy as np

from kernels import attitude, exact, solution
from kernels.elliptic import RUNGS
from kernels.jit import OPTIONS, njit

MOST = 64  # steps between two beginnings
NEAR, APART = 1e-3, 2.0  # m1 below which rounding grows, and p t between two beginnings then


@njit(**OPTIONS)
def fill(moments, start, h, out):
    """Fill ``out`` (n, 4) with the attitude at 0, h, 2h … of a start that is not steady, from (1, 0, 0, 0) on."""
    top = attitude.prepare(moments, start, np.empty((2, RUNGS)), np.empty((2, RUNGS)))
    d, f = top.frame.d, top.frame.turned
    I1, I2, I3, _ = solution.scaled(moments[0], moments[1], moments[2])
    w1, w2, w3, unit = solution.scaled(start[0], start[1], start[2])
    own, omega = (I1, I2, I3), (w1, w2, w3)
    steps = attitude.short_step_constants(own, omega, h * unit)
    q = attitude.oriented(d, *exact.short_step_constants(own, omega, h * unit))
    s_d, s_j, s_k = attitude.of_direction(q, steps.g)
    p, m1 = top.motion.p, top.motion.m1
    every = MOST if m1 >= NEAR else max(1, int(min(float(MOST), APART / abs(p * (h * unit)))))
    m, R, size = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0), 0.0
    for i in range(out.shape[0]):
        if i % every == 0:
            (q0, q1, q2, q3), (m1_, m2_, m3_) = attitude.at(i * h, top)
            m_d, m_j, m_k = attitude.oriented(d, f * m1_, f * m2_, f * m3_)
            qd, qj, qk = attitude.oriented(d, f * q1, f * q2, f * q3)
            m_j, qj = f * m_j, f * qj
            P = 1.0 + m_d
            m, R = (m_d, m_j, m_k), attitude.product((q0, qd, qj, qk), (P, 0.0, -m_k, m_j))
            size = 0.5 / P
        else:
            R = attitude.step(m, R, size, steps.x, steps.y)
            m = exact.step(*m, s_d, s_j, s_k)
            q0, qd, qj, qk, size = attitude.land(m, R)
            q1, q2, q3 = attitude.by_axis(d, f * qd, qj, f * qk)
        out[i, 0], out[i, 1], out[i, 2], out[i, 3] = q0, q1, q2, q3


def attitudes(moments, omega_start, spacing, n):
    """Return the attitude of a free rigid body at n equally spaced times, by exact steps.

    Args:
        moments (array_like, shape (3,)): Principal moments of inertia, kg m2, finite and > 0.
        omega_start (array_like, shape (3,)): Angular velocity at time zero, rad/s, finite, not zero and not steady
            (about a principal axis, or of a sphere).
        spacing (float): Seconds between two times; the elliptic frequency p of :mod:`kernels.exact` times it is at most
            1.
        n (int): Number of times, the first of which is 0.

    Returns:
        numpy.ndarray, shape (n, 4): Unit quaternions, body to space, scalar first; within 2e-15 of the radians turned
            and 1e-14 of :func:`kernels.exact.attitude`.

    Raises:
        ValueError: If a value is none of these.
    """
    moments, start = solution.checked(moments, omega_start)
    if solution.is_stationary(solution.coefficients(*moments), start):
        raise ValueError("omega_start must turn: a steady spin needs no steps")
    top = exact.set_up(*moments, *start)
    p = top.p * top.unit
    if not (np.isfinite(spacing) and spacing != 0.0 and p * abs(spacing) <= 1.0):
        raise ValueError(f"spacing must be at most {1.0 / p if p > 0.0 else np.inf:.3g} s in size and not 0: {spacing}")
    out = np.empty((n, 4))
    fill(moments, start, float(spacing), out)
    return out
