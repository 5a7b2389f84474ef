r"""The free asymmetric top in closed form, any body, any start, any time; and the exact step.

**Equations.**  Principal moments ``I_1, I_2, I_3`` (kg m2), angular velocity in the body ``w_i`` (rad/s),
(i, j, k) cyclic, ``c_i = (I_j - I_k)/I_i``::

    dw_i/dt = c_i w_j w_k

**One variable.**  ``X_i = c_j c_k w_i^2`` obeys ``dX_i/dt = 2 c_1 c_2 c_3 w_1 w_2 w_3``, the same for all three:
the differences of the X are constants of the motion, and everything follows from their order.  The middle
axis has ``c_j c_k >= 0``, the extreme axes ``<= 0``.  Name the axes s (greatest X, always the middle axis),
c (middle X) and d (least X), and write::

    p^2    = X_s - X_d = |c_c c_s| w_d^2 + |c_c c_d| w_s^2
    m p^2  = X_s - X_c = |c_c c_d| w_s^2 + |c_s c_d| w_c^2
    m1 p^2 = X_c - X_d = |c_c c_s| w_d^2 - |c_s c_d| w_c^2,      m1 = 1 - m

Then ``w_s = A_s sn u, w_c = A_c cn u, w_d = A_d dn u`` with ``u = p t + u0`` and parameter m, because
``sn' = cn dn, cn' = -sn dn, dn' = -m sn cn`` turn the equations of motion into::

    p A_s = c_s A_c A_d,    -p A_c = c_c A_s A_d,    -m p A_d = c_d A_s A_c

and their products give ``p^2 = -c_c c_s A_d^2``, ``m p^2 = c_c c_d A_s^2`` and ``A_c^2 = -(c_c/c_s) A_s^2``.
In the usual words, d is the axis of greatest moment where ``L^2 > 2 E I_mid`` and of least moment where
``L^2 < 2 E I_mid``; with ``I_min <= I_mid <= I_max``::

    N  = L^2 - 2 E I_mid = I_max (I_max - I_mid) w_max^2 - I_min (I_mid - I_min) w_min^2
    m1 = |c_mid| |N|/(I_min I_max p^2)

N alone is a difference of unequal terms.  It is formed in double-double with the differences of the moments exact,
so m1 has its full relative precision however near the separatrix (m1 = 0) the motion is.

**Any time.**  The addition theorems with the amplitudes eliminated by the three relations above, where sn, cn
and dn are those of ``p t`` and ``S = sn/p``::

    D      = cn^2 + sn^2 D0^2,               D0 = sqrt|c_c c_s| |w_d|/p
    w_s(t) = (w_s cn dn + c_s S w_c w_d)/D
    w_c(t) = (w_c cn    + c_c S w_s w_d dn)/D
    w_d(t) = (w_d dn    + c_d S w_s w_c cn)/D

D is ``1 - m sn^2 sn0^2`` as a sum of squares (D0 = dn u0).  There is no starting phase, and no small component
is ever the difference of large terms, for no term over D exceeds its component's amplitude: a perturbation
keeps its relative digits, about the middle axis too.  Where p = 0 (nothing turns, or the secular drift of a
symmetric top spinning about a transverse axis) ``S = t``.

**The exact step.**  Subtract the addition theorems at ``v + delta`` and ``v - delta``, ``delta = p h/2``; their
denominator cancels against that of ``w_j(t+h) w_k(t) + w_j(t) w_k(t+h)``::

    w_i(t+h) - w_i(t) = q_i [w_j(t+h) w_k(t) + w_j(t) w_k(t+h)],     q_i = g_i c_i h/2
    g_s = sn/(delta cn dn),   g_c = sn dn/(delta cn),   g_d = sn cn/(delta dn)

with sn, cn and dn those of delta.  This is linear in w(t+h); with ``A_i = q_j q_k w_i^2`` and
``Q = q_1 q_2 q_3 w_1 w_2 w_3`` Cramer's rule gives::

    w_i(t+h) = w_i + 2 [w_i (A_j + A_k) + q_i w_j w_k (1 + A_i)]/(1 - A_1 - A_2 - A_3 - 2 Q)

With g = 1 it is the Hirota-Kimura discretisation, of order two; with g as above it is exact for delta < K.
Each step rounds the state, which moves it to a neighbouring trajectory: over n steps the phase is off by some
``1e-16 n^(3/2) p h/m1`` at most.

**Scales.**  Moments enter through ratios only.  Moments and angular velocity are each divided by the power of
two next above the largest, which is exact: common scales of moments from 1e-300 to 1e300 and of angular velocity
from 1e-300 to 1e300 neither overflow nor underflow.  Perturbations below 1e-150 of the spin still grow and turn
as they should, but m1, of the order of their square, has underflowed, and the return after a flip is lost.

Sources: Landau and Lifshitz, Mechanics, section 37 (equations 37.17-37.20 are not used); DLMF 22.6 and 22.8;
Hirota and Kimura, J. Phys. Soc. Jpn 69 (2000) 627.
"""

import math
from importlib import import_module

import numpy as np

from kernels.compile.jit import INLINE, OPTIONS, njit
from kernels.compile.llvm_formulas import formula
from kernels.free.elliptic import K, climb, jacobi_short, ladder
from kernels.free.elliptic_constants import (
    advance_by_role,
    axis_value,
    by_axis,
    check_motion,
    is_stationary,
    set_up,
    set_up_near_one,
)


@njit(**OPTIONS)
def fill_rotation(moments, start, times, out):
    """Fill angular velocities; constants are computed once.

    Args:
        moments (numpy.ndarray, shape (3,)): Principal moments, kg m2.
        start (numpy.ndarray, shape (3,)): Angular velocity at time zero, rad/s.
        times (numpy.ndarray, shape (n,)): Times, s.
        out (numpy.ndarray, shape (n, 3)): Written: angular velocity, rad/s.
    """
    p, m, m1, axes, c, w, unit = set_up(moments[0], moments[1], moments[2], start[0], start[1], start[2])
    means = ladder(m, m1)
    for i in range(times.shape[0]):
        t = times[i] * unit
        sn, cn, dn = climb(p * t, means)
        x1, x2, x3 = by_axis(axes, *advance_by_role(w, c, p, t, sn, cn, dn))
        out[i, 0], out[i, 1], out[i, 2] = x1 * unit, x2 * unit, x3 * unit


def rotation(moments, omega_start, times):
    """Return the angular velocity of a free rigid body in its principal axes, in closed form.

    Solves ``I_i dw_i/dt = (I_j - I_k) w_j w_k``, (i, j, k) cyclic, by Jacobi's elliptic functions.

    Args:
        moments (array_like, shape (3,)): Principal moments of inertia, kg m2, finite and > 0.  The triangle inequality
            is not required.
        omega_start (array_like, shape (3,)): Angular velocity at time zero, rad/s, finite.
        times (array_like, shape (n,)): Times, s, in any order and of any sign.

    Returns:
        numpy.ndarray, shape (n, 3): Angular velocity, rad/s.  Error at most ``1e-15 (1 + |w| |t| + p |t|) max|w|``, or
            a few roundings of the inputs times the solution's sensitivity to them where that is more.  Each transverse
            component of a perturbed spin is right relative to the transverse size.

    Raises:
        ValueError: If a shape or a value is not as stated.
    """
    moments, start, times = check_motion(moments, omega_start, times)
    out = np.empty((times.size, 3))
    fill_rotation(moments, start, times, out)
    return out


@formula
def step_coefficients(c, p, h, sn, cn, dn):
    """Return ``q = g c h/2`` of the exact step, s, by role.

    ``q_s = c_s S/(cn dn), q_c = c_c S dn/cn, q_d = c_d S cn/dn`` with ``S = sn/p``, or h/2 if p = 0.

    Args:
        `c` (tuple of 3 floats): Euler coefficients by role (s, c, d).
        `p` (float): Rate p, rad/s.
        `h` (float): Length of the step, s.
        `sn`, `cn`, `dn` (float): Elliptic functions of p h/2.
    """
    c_s, c_c, c_d = c
    S = sn / p if p > 0.0 else h / 2
    return c_s * S / (cn * dn), c_c * S * dn / cn, c_d * S * cn / dn


@njit(**INLINE)
def short_step_constants(moments, omega, h):
    """Return the coefficients ``q1, q2, q3`` (s) of a step of length h (s), ``p |h| <= 1``, for :func:`step`.

    There is neither branch nor loop, for loops over lanes.

    Args:
        moments (tuple of 3 floats): Principal moments, the largest between 1e-50 and 1e50.
        omega (tuple of 3 floats): Angular velocity, rad/s, its largest component between 1e-50 and 1e50.
        `h` (float): Length of the step, s.
    """
    top = set_up_near_one(*moments, *omega)
    sn, cn, dn = jacobi_short(0.5 * top.p * h, top.m)
    return by_axis(top.axes, *step_coefficients(top.c, top.p, h, sn, cn, dn))


@formula
def step(w1, w2, w3, q1, q2, q3):
    """Return ``w_i + 2 [w_i (A_j + A_k) + q_i w_j w_k (1 + A_i)]/(1 - A_1 - A_2 - A_3 - 2 Q)``, one exact step.

    ``A_i = q_j q_k w_i^2``, ``Q = q_1 q_2 q_3 w_1 w_2 w_3``: some 40 operations and one division, straight through.  A
    loop over lanes that calls it compiles to packed code.

    Args:
        `w1`, `w2`, `w3` (float): Angular velocity before the step, rad/s.
        `q1`, `q2`, `q3` (float): Coefficients of :func:`short_step_constants`, s.
    """
    q12, q13 = q1 * w2, q1 * w3
    q21, q23 = q2 * w1, q2 * w3
    q31, q32 = q3 * w1, q3 * w2
    A1, A2, A3 = q21 * q31, q12 * q32, q13 * q23
    r = 2 / (1 - (A1 + A2 + A3) - 2 * (q12 * q23 * q31))
    return (
        w1 + r * (w1 * (A2 + A3) + q12 * w3 * (1 + A1)),
        w2 + r * (w2 * (A1 + A3) + q21 * w3 * (1 + A2)),
        w3 + r * (w3 * (A1 + A2) + q31 * w2 * (1 + A3)),
    )


@njit(**OPTIONS)
def amplitudes(top):
    """Return ``(A_s, A_c, A_d)`` in ``top.unit``, ``A_c >= 0``, A_d of the sign of w_d, A_s of that of c_s A_d.

    ``A_s^2 = w_s^2 + |c_s/c_c| w_c^2``, ``A_c^2 = w_c^2 + |c_c/c_s| w_s^2``, ``A_d^2 = w_d^2 + |c_d/c_s| w_s^2``.
    For a sphere, with the ratios 0/0, ``|c_c/c_s|`` counts as one.
    """
    c_s, c_c, c_d = top.c
    w_s, w_c, w_d = top.w
    has_ratios = (c_s != 0.0) & (c_c != 0.0)
    ratio = math.sqrt(abs(c_c / c_s)) if has_ratios else 1.0
    ratio_d = math.sqrt(abs(c_d / c_s)) if has_ratios else 0.0
    A_d = math.copysign(math.hypot(w_d, ratio_d * w_s), w_d)
    A_s = math.copysign(math.hypot(w_s, w_c / ratio), c_s * A_d)
    return A_s, math.hypot(w_c, ratio * w_s), A_d


@njit(**OPTIONS)
def frequency(top):
    """Return the angular frequency ``pi p/(2 K)``, rad/s, of the motion of the angular velocity in the body.

    About a stable axis it tends to sqrt(Omega^2) as the perturbation does to zero, and has that value at zero.
    Zero on the separatrix, for an exact spin about the middle axis, and where p = 0 (a sphere; a symmetric top
    spinning about a transverse axis).
    """
    return 0.5 * math.pi / K(top.m, top.m1) * (top.p * top.unit)


@njit(**OPTIONS)
def flip_period(top):
    """Return the time ``2 K/p``, s, after which the sn and the cn component have changed sign.

    For a start about the middle axis, the time between two flips of the spin; for one about a stable axis, half
    a turn of the perturbation.  Infinite, never NaN, where ``frequency`` is zero: on the separatrix, for an exact
    spin about the middle axis, and where p = 0.
    """
    p = top.p * top.unit
    return 2.0 * K(top.m, top.m1) / p if p > 0.0 else np.inf


@njit(**OPTIONS)
def period(top):
    """Return the period ``4 K/p``, s, of the angular velocity in the body; infinite where ``frequency`` is zero.

    On a symmetric top this is the turn about its own axis.
    """
    return 2.0 * flip_period(top)


@njit(**OPTIONS)
def max_tilt(top, axis):
    """Return the largest angle (rad, 0 to pi) between the angular velocity and the end of an axis (1, 2 or 3).

    That end is the positive one where ``w_axis >= 0``, else the negative one.  ``tan^2`` of the angle is a ratio
    of two linear functions of X (module's docstring), so its extremes stand at sn = 0 and at cn = 0.  On the
    separatrix it is a limit; where nothing moves, the angle itself, and 0 where nothing turns.
    """
    if is_stationary(top.c, top.w):
        w1, w2, w3 = by_axis(top.axes, *top.w)
        across = axis_value(axis, math.hypot(w2, w3), math.hypot(w3, w1), math.hypot(w1, w2))
        return math.atan2(across, abs(axis_value(axis, w1, w2, w3)))
    sn_axis, cn_axis, _ = top.axes
    A_s, A_c, A_d = amplitudes(top)
    A_s, near, far = abs(A_s), math.sqrt(top.m1) * abs(A_d), abs(A_d)
    if axis == sn_axis:
        return math.pi - math.atan2(near, A_s)
    if axis == cn_axis:
        return math.pi - math.atan2(far, A_c) if top.m1 > 0.0 else 0.5 * math.pi
    return max(math.atan2(A_c, far), math.atan2(A_s, near))


def polhode(moments, omega_start, n):
    r"""Return the closed curve that the angular velocity traces in the body, from its start and in its own direction.

    The polhode is the intersection of the ellipsoids ``2 E = I_1 w_1^2 + I_2 w_2^2 + I_3 w_3^2`` and
    ``L^2 = (I_1 w_1)^2 + (I_2 w_2)^2 + (I_3 w_3)^2``, as far as the motion reaches.  With the roles and amplitudes of
    the closed form and ``phi = am u``, the amplitude of the elliptic functions::

        w_s = A_s sin phi,    w_c = A_c cos phi,    w_d = A_d sqrt(m1 + m cos^2 phi)

    Points are at equal steps of phi: seen along the encircled axis d, the curve is an ellipse and phi its
    eccentric angle.  Equal steps of time would crowd at the middle axis near the separatrix.

    On the separatrix (m1 = 0) half a curve, between the ends of the middle axis, takes infinite time.
    The result is then a whole branch, the plane ellipse ``w_c/A_c = +-w_d/A_d`` that contains that half: the second
    half is the motion of the opposite signs of w_c and w_d, and the two branches cross in the ends of the middle axis.

    Args:
        moments (array_like, shape (3,)): Principal moments of inertia, kg m2, finite and > 0.
        omega_start (array_like, shape (3,)): Angular velocity anywhere on the curve, rad/s, finite.
        `n` (int): Number of points, at least 2.

    Returns:
        numpy.ndarray, shape (n, 3): Angular velocity, rad/s; the first and the last point are the start.  If the
            angular velocity is constant (a sphere, a principal spin, a symmetric top spinning about a transverse axis),
            every point is the start.  Each
            point is on both ellipsoids to some ten roundings, and each component right relative to its own amplitude.

    Raises:
        ValueError: If a shape or a value is not as stated.

    Source: Landau and Lifshitz, Mechanics, section 37; the polhode is Poinsot's (1834).
    """
    moments, start, _ = check_motion(moments, omega_start)
    if isinstance(n, bool) or not isinstance(n, int | np.integer) or n < 2:
        raise ValueError(f"n must be a whole number, at least 2, not {n!r}")
    out, top = np.tile(start, (n, 1)), set_up(*moments, *start)
    if is_stationary(top.c, top.w):
        return out
    s, c, d = (axis - 1 for axis in top.axes)
    A_s, A_c, A_d = amplitudes(top)
    w_s, w_c, _ = top.w
    begin = math.atan2(w_s / A_s if A_s else 0.0, w_c / A_c if A_c else 1.0)
    phi = begin + np.linspace(0.0, 2.0 * math.pi, n)
    dn = np.sqrt(top.m1 + top.m * np.cos(phi) ** 2) if top.m1 > 0.0 else math.copysign(1.0, w_c) * np.cos(phi)
    out[:, s], out[:, c], out[:, d] = A_s * np.sin(phi), A_c * np.cos(phi), A_d * dn
    out *= top.unit
    out[0] = out[-1] = start
    return out


def attitude(moments, omega_start, times):
    """Return the attitude of a free rigid body since its start, in closed form, any body, any start, any time.

    Solves ``q' = q (0, w)/2`` with Euler's equations (:mod:`kernels.free.attitude`).

    Args:
        moments (array_like, shape (3,)): Principal moments of inertia, kg m2, finite and > 0.
        omega_start (array_like, shape (3,)): Angular velocity in the body at time zero, rad/s, finite.
        times (array_like, shape (n,)): Times, s, in any order and of any sign.

    Returns:
        numpy.ndarray, shape (n, 4): Unit quaternions, scalar first, that rotate vectors from body axes to space axes; q
            and -q are one attitude, and the sign follows the motion from the start. Error at most ``1e-14 + 4e-16 x``
            the radians turned, or a few roundings of the inputs times the attitude's sensitivity to them where that is
            more.

    Raises:
        ValueError: If a shape or a value is not as stated.
    """
    moments, start, times = check_motion(moments, omega_start, times)
    if not start.any():
        raise ValueError("omega_start must not be zero: nothing turns")
    out = np.empty((times.size, 4))
    # imported here, so that kernels that import this module do not depend on its source
    import_module("kernels.free.attitude").fill_attitude(moments, start, times, out)
    return out
