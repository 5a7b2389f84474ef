"""Constants of a free rotation and its addition theorems, in scalars, for the closed forms.

Equations, symbols, scales and sources: :mod:`kernels.free.exact`, which computes rotations from them, and
:mod:`kernels.free.attitude`, which computes attitudes.
"""

import math
from typing import NamedTuple

import numpy as np

from kernels.compile.jit import INLINE, OPTIONS, njit
from kernels.compile.llvm_formulas import formula
from kernels.free.elliptic import double_product, two_product, two_sum


@njit(**INLINE)
def unit_of(x1, x2, x3):
    """Return the power of two next above max(|`x1`|, |`x2`|, |`x3`|), 2^-1022 to 2^1023; 1 if all are zero."""
    largest = max(abs(x1), abs(x2), abs(x3))
    exponent = np.float64(largest).view(np.int64) >> 52  # as stored: of 1 it is 1023
    unit = np.int64(min(exponent + 1, 2046) << 52).view(np.float64)
    return unit if largest != 0.0 else 1.0


@njit(**INLINE)
def scaled(x1, x2, x3):
    """Return `x1`, `x2`, `x3` in units of their :func:`unit_of`, and this unit."""
    unit = unit_of(x1, x2, x3)
    return x1 / unit, x2 / unit, x3 / unit, unit


@formula
def coefficients(I1, I2, I3):
    """Return ``c_i = (I_j - I_k)/I_i`` of Euler's equations, dimensionless, for moments `I1`, `I2`, `I3`."""
    return (I2 - I3) / I1, (I3 - I1) / I2, (I1 - I2) / I3


@njit(**INLINE)
def axis_value(axis, x1, x2, x3):
    """Return the value of ``axis`` (1, 2 or 3) from those of the three axes, `x1`, `x2`, `x3`."""
    return x1 if axis == 1 else (x2 if axis == 2 else x3)


@njit(**INLINE)
def by_role(sn_axis, cn_axis, dn_axis, x1, x2, x3):
    """Return the values `x1`, `x2`, `x3` of the axes 1, 2, 3 in the order of sn_axis, cn_axis, dn_axis."""
    return axis_value(sn_axis, x1, x2, x3), axis_value(cn_axis, x1, x2, x3), axis_value(dn_axis, x1, x2, x3)


@njit(**INLINE)
def inertia_order(I1, I2, I3):
    """Return the axes (1, 2, 3) of the least, the middle and the greatest of I1, I2, I3, all different."""
    greatest = 1 if (I1 >= I2) & (I1 >= I3) else (2 if I2 >= I3 else 3)
    smallest = 3 if (I3 <= I1) & (I3 <= I2) else (2 if I2 <= I1 else 1)
    return smallest, 6 - smallest - greatest, greatest


@njit(**INLINE)
def separatrix_offset(I_min, I_mid, I_max, w_min, w_max):
    """Return ``I_max (I_max - I_mid) w_max^2 - I_min (I_mid - I_min) w_min^2 = L^2 - 2 E I_mid``, one double.

    It is computed in double-double: error 1e-30 of the greater term.
    """
    gap, e = two_sum(I_max, -I_mid)
    ah, al = double_product(gap, e, I_max, 0.0)
    bh, bl = two_product(w_max, w_max)
    ah, al = double_product(ah, al, bh, bl)
    gap, e = two_sum(I_mid, -I_min)
    bh, bl = double_product(gap, e, I_min, 0.0)
    wh, wl = two_product(w_min, w_min)
    bh, bl = double_product(bh, bl, wh, wl)
    difference, e = two_sum(ah, -bh)
    return difference + (e + (al - bl))


@njit(**INLINE)
def constants(I1, I2, I3, w1, w2, w3):
    """Return p, m, m1 and axes of a trajectory as :class:`Motion` has them, straight-line code for loops over lanes.

    Args:
        `I1`, `I2`, `I3`, `w1`, `w2`, `w3` (float): Moments and angular velocity near one, the largest between 1e-50 and
            1e50; p is in the unit of w.
    """
    smallest, sn_axis, greatest = inertia_order(I1, I2, I3)
    I_min, I_mid, I_max = by_role(smallest, sn_axis, greatest, I1, I2, I3)
    w_min, w_s, w_max = by_role(smallest, sn_axis, greatest, w1, w2, w3)
    N = separatrix_offset(I_min, I_mid, I_max, w_min, w_max)
    b_min, b_s, b_max = (I_max - I_mid) / I_min, (I_max - I_min) / I_mid, (I_mid - I_min) / I_max
    above = N >= 0.0
    b_c, b_d = (b_min, b_max) if above else (b_max, b_min)
    w_c, w_d = (w_min, w_max) if above else (w_max, w_min)
    p2 = b_c * b_s * (w_d * w_d) + b_c * b_d * (w_s * w_s)
    safe = p2 if p2 > 0.0 else 1.0
    m = min(1.0, b_d * (b_c * (w_s * w_s) + b_s * (w_c * w_c)) / safe) if p2 > 0.0 else 0.0
    m1 = min(1.0, b_s * ((abs(N) / I_min) / I_max) / safe) if p2 > 0.0 else 1.0
    return math.sqrt(p2), m, m1, sn_axis, (smallest if above else greatest), (greatest if above else smallest)


@njit(**INLINE)
def by_axis(axes, x_s, x_c, x_d):
    """Return the values `x_s`, `x_c`, `x_d` of the roles sn, cn, dn, on ``axes``, in the order of the axes 1, 2, 3."""
    sn_axis, cn_axis, _ = axes
    x1 = x_s if sn_axis == 1 else (x_c if cn_axis == 1 else x_d)
    x2 = x_s if sn_axis == 2 else (x_c if cn_axis == 2 else x_d)
    x3 = x_s if sn_axis == 3 else (x_c if cn_axis == 3 else x_d)
    return x1, x2, x3


class Motion(NamedTuple):
    """One trajectory, set up by :func:`set_up`: every closed form here starts from it."""

    p: float  #: elliptic frequency: the arguments of sn, cn and dn advance by p t
    m: float  #: parameter, and m1 = 1 - m, each with its own relative precision; m = 0 if p = 0
    m1: float
    axes: tuple  #: axes of sn (intermediate), cn, and dn (encircled by the polhode)
    c: tuple  #: Euler coefficients in the order of these roles
    w: tuple  #: angular velocity at the start, likewise
    unit: float  #: unit of p and w, rad/s: a power of two


@njit(**INLINE)
def set_up_near_one(I1, I2, I3, w1, w2, w3):
    """Return :func:`set_up` for `I1`, `I2`, `I3`, `w1`, `w2`, `w3` near one, as in :func:`constants`, in the unit 1."""
    p, m, m1, sn_axis, cn_axis, dn_axis = constants(I1, I2, I3, w1, w2, w3)
    c1, c2, c3 = coefficients(I1, I2, I3)
    c = by_role(sn_axis, cn_axis, dn_axis, c1, c2, c3)
    w = by_role(sn_axis, cn_axis, dn_axis, w1, w2, w3)
    return Motion(p, m, m1, (sn_axis, cn_axis, dn_axis), c, w, 1.0)


@njit(**OPTIONS)
def set_up(I1, I2, I3, w1, w2, w3):
    """Return the :class:`Motion` of a body.

    Args:
        `I1`, `I2`, `I3` (float): Principal moments of inertia > 0, kg m2.
        `w1`, `w2`, `w3` (float): Angular velocity at the start, rad/s.
    """
    I1, I2, I3, _ = scaled(I1, I2, I3)
    w1, w2, w3, unit = scaled(w1, w2, w3)
    p, m, m1, axes, c, w, _ = set_up_near_one(I1, I2, I3, w1, w2, w3)
    return Motion(p, m, m1, axes, c, w, unit)


@njit(**INLINE)
def advance_by_role(w, c, p, t, sn, cn, dn):
    """Return the components of the angular velocity by role, a time t later, by the addition theorems.

    Numerators and D are divided by the square of ``r = max(dn, |sn| D0)``, so that neither underflows near
    the separatrix, where cn and dn get as small as sqrt(m1).

    Args:
        `w`, `c` (tuple of 3 float): Components at the start, and Euler coefficients, by role.
        `p`, `t` (float): Elliptic frequency, and time.
        `sn`, `cn`, `dn` (float): Jacobi's functions of p t.
    """
    w_s, w_c, w_d = w
    c_s, c_c, c_d = c
    S = sn / p if p > 0.0 else t
    D0 = math.sqrt(abs(c_c * c_s)) * (abs(w_d) / p) if p > 0.0 else 1.0
    r = max(dn, abs(sn) * D0)
    if r == 0.0:  # an exact spin about the middle axis, when cn and dn have underflowed
        return w_s, w_c, w_d
    cr, dr, sr = cn / r, dn / r, sn * D0 / r
    x_c, x_d = w_c / r, w_d / r
    D = cr * cr + sr * sr
    return (
        (w_s * cr * dr + c_s * S * x_c * x_d) / D,
        (x_c * cr + c_c * S * w_s * (x_d * dr)) / D,
        (x_d * dr + c_d * S * w_s * (x_c * cr)) / D,
    )


@njit(**OPTIONS)
def is_stationary(c, w):
    """Return whether every ``dw_i/dt = c_i w_j w_k`` is exactly zero, the axes in any one order."""
    return (
        ((c[0] == 0.0) | (w[1] == 0.0) | (w[2] == 0.0))
        & ((c[1] == 0.0) | (w[2] == 0.0) | (w[0] == 0.0))
        & ((c[2] == 0.0) | (w[0] == 0.0) | (w[1] == 0.0))
    )


def check_motion(moments, omega_start, times=()):
    """Return the arguments of a closed form as arrays.

    Args:
        moments, omega_start, times (array_like): As in :func:`kernels.free.exact.rotation`.

    Raises:
        ValueError: If a shape is wrong, a number is not finite, or a moment is not positive.
    """
    moments, start, times = (np.asarray(x, dtype=np.float64, order="C") for x in (moments, omega_start, times))
    if moments.shape != (3,) or not (np.isfinite(moments).all() and (moments > 0.0).all()):
        raise ValueError(f"moments must be three finite numbers above zero, not {moments}")
    if start.shape != (3,) or not np.isfinite(start).all():
        raise ValueError(f"omega_start must be three finite numbers, not {start}")
    if times.ndim != 1 or not np.isfinite(times).all():
        raise ValueError("times must be a one-dimensional array of finite numbers")
    return moments, start, times
