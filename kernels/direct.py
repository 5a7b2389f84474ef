r"""The direct integrator: Euler's equations, step by step, by their Taylor series of order 10.

Each component is a power series in the time within the step. With :math:`a_n` the n-th term of :math:`\omega_a` (the
coefficient times :math:`h^n`) and :math:`k_a = c_a h`, Euler's equations :math:`\dot\omega_a = c_a\omega_b\omega_c`
give every term from the ones before it,

.. math:: a_{n+1} = \frac{k_a}{n+1}\sum_{i=0}^{n} b_i\,c_{n-i} \qquad\text{and cyclic,}

and the new state is the sum of the terms, the smallest first. It is the whole step: 165 multiply-adds in a straight
line, no stage, no table. Every term of a transverse component carries a transverse factor, so truncation and rounding
are relative to the perturbation, however small it is beside the spin.

*Choice of the step.* With :math:`x = \max_i|c_i|\,\omega_0 h`, the first term left out, relative to the perturbation,
is :math:`x^{11}G(A)`: for a perturbation of size A the n-th relative coefficient of the separatrix pulse sech(t) is at
most :math:`\sum_k (A/2)^{2k}(2k+1)^n/n!` (its expansion in exponentials; 1/n! where A is small) and also about
:math:`(2/A)\,[\ln^2(2/A) + \pi^2/4]^{-(n+1)/2}` (its nearest pole). G is the smaller of the two at n = 11. A sample
interval is cut into so many steps that the sum over the run stays below the tolerance.

Source: Jorba and Zou, Experimental Mathematics 14 (2005) 99, for the method; the terms were derived from the
equations above. Not validated: bodies with max|c_i| omega0 h above 1 a step.
"""

import numpy as np
from numba import njit

from kernels.rigid_body import INLINE, OPTIONS, euler_coefficients

ORDER = 10
MOST_STEPS = 10_000

R2, R3, R4, R5, R6, R7, R8, R9, R10 = (1.0 / n for n in range(2, ORDER + 1))


@njit(**INLINE)
def step(a0, b0, c0, ka, kb, kc):
    """One Taylor step of order 10.

    Parameters
    ----------
    a0, b0, c0 : float
        Angular velocity (any unit u).
    ka, kb, kc : float
        Euler coefficients times the step, c_i h (1/u).

    Returns
    -------
    a, b, c : float
        Angular velocity one step later (u).
    """
    a1 = (ka) * (b0 * c0)
    b1 = (kb) * (c0 * a0)
    c1 = (kc) * (a0 * b0)
    a2 = (ka * R2) * (b0 * c1 + b1 * c0)
    b2 = (kb * R2) * (c0 * a1 + c1 * a0)
    c2 = (kc * R2) * (a0 * b1 + a1 * b0)
    a3 = (ka * R3) * (b0 * c2 + b1 * c1 + b2 * c0)
    b3 = (kb * R3) * (c0 * a2 + c1 * a1 + c2 * a0)
    c3 = (kc * R3) * (a0 * b2 + a1 * b1 + a2 * b0)
    a4 = (ka * R4) * (b0 * c3 + b1 * c2 + b2 * c1 + b3 * c0)
    b4 = (kb * R4) * (c0 * a3 + c1 * a2 + c2 * a1 + c3 * a0)
    c4 = (kc * R4) * (a0 * b3 + a1 * b2 + a2 * b1 + a3 * b0)
    a5 = (ka * R5) * (b0 * c4 + b1 * c3 + b2 * c2 + b3 * c1 + b4 * c0)
    b5 = (kb * R5) * (c0 * a4 + c1 * a3 + c2 * a2 + c3 * a1 + c4 * a0)
    c5 = (kc * R5) * (a0 * b4 + a1 * b3 + a2 * b2 + a3 * b1 + a4 * b0)
    a6 = (ka * R6) * (b0 * c5 + b1 * c4 + b2 * c3 + b3 * c2 + b4 * c1 + b5 * c0)
    b6 = (kb * R6) * (c0 * a5 + c1 * a4 + c2 * a3 + c3 * a2 + c4 * a1 + c5 * a0)
    c6 = (kc * R6) * (a0 * b5 + a1 * b4 + a2 * b3 + a3 * b2 + a4 * b1 + a5 * b0)
    a7 = (ka * R7) * (b0 * c6 + b1 * c5 + b2 * c4 + b3 * c3 + b4 * c2 + b5 * c1 + b6 * c0)
    b7 = (kb * R7) * (c0 * a6 + c1 * a5 + c2 * a4 + c3 * a3 + c4 * a2 + c5 * a1 + c6 * a0)
    c7 = (kc * R7) * (a0 * b6 + a1 * b5 + a2 * b4 + a3 * b3 + a4 * b2 + a5 * b1 + a6 * b0)
    a8 = (ka * R8) * (b0 * c7 + b1 * c6 + b2 * c5 + b3 * c4 + b4 * c3 + b5 * c2 + b6 * c1 + b7 * c0)
    b8 = (kb * R8) * (c0 * a7 + c1 * a6 + c2 * a5 + c3 * a4 + c4 * a3 + c5 * a2 + c6 * a1 + c7 * a0)
    c8 = (kc * R8) * (a0 * b7 + a1 * b6 + a2 * b5 + a3 * b4 + a4 * b3 + a5 * b2 + a6 * b1 + a7 * b0)
    a9 = (ka * R9) * (b0 * c8 + b1 * c7 + b2 * c6 + b3 * c5 + b4 * c4 + b5 * c3 + b6 * c2 + b7 * c1 + b8 * c0)
    b9 = (kb * R9) * (c0 * a8 + c1 * a7 + c2 * a6 + c3 * a5 + c4 * a4 + c5 * a3 + c6 * a2 + c7 * a1 + c8 * a0)
    c9 = (kc * R9) * (a0 * b8 + a1 * b7 + a2 * b6 + a3 * b5 + a4 * b4 + a5 * b3 + a6 * b2 + a7 * b1 + a8 * b0)
    a10 = (ka * R10) * (
        b0 * c9 + b1 * c8 + b2 * c7 + b3 * c6 + b4 * c5 + b5 * c4 + b6 * c3 + b7 * c2 + b8 * c1 + b9 * c0
    )
    b10 = (kb * R10) * (
        c0 * a9 + c1 * a8 + c2 * a7 + c3 * a6 + c4 * a5 + c5 * a4 + c6 * a3 + c7 * a2 + c8 * a1 + c9 * a0
    )
    c10 = (kc * R10) * (
        a0 * b9 + a1 * b8 + a2 * b7 + a3 * b6 + a4 * b5 + a5 * b4 + a6 * b3 + a7 * b2 + a8 * b1 + a9 * b0
    )
    a = (((((((((a10 + a9) + a8) + a7) + a6) + a5) + a4) + a3) + a2) + a1) + a0
    b = (((((((((b10 + b9) + b8) + b7) + b6) + b5) + b4) + b3) + b2) + b1) + b0
    c = (((((((((c10 + c9) + c8) + c7) + c6) + c5) + c4) + c3) + c2) + c1) + c0
    return a, b, c


@njit(**OPTIONS)
def truncation(size):
    """G(A): the relative coefficient of the first term left out, for a perturbation of relative size A (0 < A)."""
    n = ORDER + 1.0
    factorial = 1.0
    for i in range(2, ORDER + 2):
        factorial *= i
    series, weight = 0.0, 1.0
    for k in range(12):
        series += weight * (2.0 * k + 1.0) ** n / factorial
        weight *= 0.25 * size * size
    depth = np.arccosh(max(1.0 / size, 1.0))
    pole = 2.0 / size * (depth * depth + 0.25 * np.pi * np.pi) ** (-0.5 * (n + 1.0))
    return min(series, max(pole, 1.0 / factorial))


@njit(**OPTIONS)
def steps_per_sample(x, size, samples, tolerance):
    """Number of steps a sample interval is cut into.

    Parameters
    ----------
    x : float
        max|c_i| times the sample spacing in radians of spin.
    size : float
        Largest relative size A that the perturbation is to be followed to.
    samples : int
        Number of sample intervals over which errors add up.
    tolerance : float
        Relative error allowed at the end, relative to the perturbation.

    Returns
    -------
    int
        Between 1 and MOST_STEPS (which the halving test then shows to be too few).
    """
    # x <= 1/2, so all the terms after the first one left out add less than x/(12 - x) of it
    excess = 1.05 * samples * x ** (ORDER + 1) * truncation(size) / tolerance
    if not excess > 1.0:
        return 1
    return int(min(np.ceil(excess ** (1.0 / ORDER)), MOST_STEPS))


@njit(**OPTIONS)
def _follow(state, k, durations, counts, out):
    """Write the state after each of the given durations (in units of 1/spin), counts[i] steps each, into out."""
    a, b, c = state
    for i in range(durations.size):
        h = durations[i] / counts[i]
        for _ in range(counts[i]):
            a, b, c = step(a, b, c, k[0] * h, k[1] * h, k[2] * h)
        out[i, 0], out[i, 1], out[i, 2] = a, b, c


def _three(values, name):
    """Check a triple of finite numbers and return it as an array."""
    values = np.asarray(values, dtype=np.float64)
    if values.shape != (3,) or not np.isfinite(values).all():
        raise ValueError(f"{name} must be three finite numbers, not {values!r}")
    return values


def rotation(moments, omega_start, times, tolerance=1e-10):
    r"""Angular velocity of one free body at given times, by the direct integrator.

    Parameters
    ----------
    moments : array_like, shape (3,)
        Principal moments of inertia I1, I2, I3 > 0 in a common unit (kg m2).
    omega_start : array_like, shape (3,)
        Angular velocity in the body's principal axes at time 0, in rad s-1.
    times : array_like, shape (n,)
        Times in s, in any order and of either sign.
    tolerance : float
        Relative error allowed in each component's perturbation at the last time, 1e-13 or more.

    Returns
    -------
    numpy.ndarray, shape (n, 3)
        Angular velocity in rad s-1.

    Raises
    ------
    ValueError
        If a moment is not positive, a number is not finite, a shape is wrong, or the tolerance is out of range.

    Notes
    -----
    Steps are chosen for motion of any amplitude, so this costs more a rotation than a survey's point does. On motion
    that flips, the time between flips is as sensitive to rounding as the body itself is.
    """
    moments, omega = _three(moments, "moments"), _three(omega_start, "omega_start")
    times = np.asarray(times, dtype=np.float64)
    if not (moments > 0).all():
        raise ValueError(f"moments must be positive, not {moments!r}")
    if times.ndim != 1 or not np.isfinite(times).all():
        raise ValueError("times must be a one-dimensional array of finite numbers")
    if not 1e-13 <= tolerance < 1:
        raise ValueError(f"tolerance must lie in [1e-13, 1), not {tolerance!r}")
    spin = np.abs(omega).max()
    if spin == 0 or times.size == 0:
        return np.broadcast_to(omega, (times.size, 3)).copy()
    out = np.empty((times.size, 3))
    coefficients = np.array(euler_coefficients(*moments))
    for forward in (True, False):
        chosen = np.flatnonzero(times >= 0 if forward else times < 0)
        chosen = chosen[np.argsort(np.abs(times[chosen]), kind="stable")]
        durations = np.diff(times[chosen], prepend=0.0) * spin
        counts = _counts(np.abs(durations) * np.abs(coefficients).max(), tolerance)
        part = np.empty((chosen.size, 3))
        _follow(tuple(omega / spin), coefficients, durations, counts, part)
        out[chosen] = part * spin
    return out


def _counts(x, tolerance):
    """Steps for each interval of length x (radians of spin times max|c_i|), so that a whole run keeps the tolerance."""
    total = max(x.sum(), 1.0)
    rate = (total * truncation(1.0) / tolerance) ** (1.0 / ORDER)
    return np.maximum(np.ceil(x * max(rate, 1.0)), 1).astype(np.int64)
