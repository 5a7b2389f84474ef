r"""Direct integrator of Euler's equations, by their Taylor series of order 8, 10 or 12.

Each component is a power series in the time within the step. With :math:`a_n` the n-th term of :math:`\omega_a` (the
coefficient times :math:`h^n`) and :math:`k_a = c_a h`, Euler's equations :math:`\dot\omega_a = c_a\omega_b\omega_c`
give every term from the terms before it,

.. math:: a_{n+1} = \frac{k_a}{n+1}\sum_{i=0}^{n} b_i\,c_{n-i} \qquad\text{and cyclic,}

and the new state is the sum of the terms, the largest last. It is the whole step: 108, 165 or 234 multiply-adds in a
straight line, no stage, no table. Every term of a transverse component carries a transverse factor, so truncation and
rounding are relative to the perturbation, however small it is compared with the spin.

*Near the axis.* The product of two transverse components of size A keeps the spin's n-th term within
:math:`A^2(2x)^n/(2\,n!)`, where x bounds the rates times h. So a small perturbation needs few of them: the near step
sums the spin to its 7th term, uses the first four in the transverse series, and saves half the
multiply-adds. Its truncation of the perturbation over a run of n steps, :math:`n A^2(2x)^6/(4\cdot 6!)` by the
coupling and :math:`\frac{n^2}{2}x\,A^2(2x)^8/(2\cdot 8!)` by the drift of the spin, must be a small fraction of the
tolerance; otherwise every term is used. The nearest step is shorter still: it sums the spin to its 5th term and uses
two, with the truncation :math:`n A^2(2x)^4/(4\cdot 4!)` and :math:`\frac{n^2}{2}x\,A^2(2x)^6/(2\cdot 6!)`.

*Choice of the step.* With :math:`x = \max_i|c_i|\,\omega_0 h`, the first term left out at order N, relative to the
perturbation, is :math:`x^{N+1}G_N(A)`: for a perturbation of size A the n-th relative coefficient of the separatrix
pulse sech(t) is at most :math:`\sum_k (A/2)^{2k}(2k+1)^n/n!` (its expansion in exponentials; 1/n! if A is small)
and also about :math:`(2/A)\,[\ln^2(2/A) + \pi^2/4]^{-(n+1)/2}` (its nearest pole). G is the smaller of the two at
n = N + 1. A sample interval is divided into steps such that the sum over the run stays below the tolerance, by the
order that needs the fewest multiply-adds.

Source: Jorba and Zou, Experimental Mathematics 14 (2005) 99, for the method; the terms were derived from the
equations above. Not validated: bodies with max|c_i| omega0 h above 1 a step.
"""

import math

import numpy as np

from kernels.compile.jit import INNER, OPTIONS, njit
from kernels.compile.llvm_formulas import formula
from kernels.free.rigid_body import euler_coefficients
from kernels.free.taylor import ORDERS, turn_12

MAX_STEPS = 10_000  # largest number of steps per sample interval
MAX_NEAR_SHARE = 0.15  # largest truncation of a step near the axis, as a fraction of the tolerance


@njit(**OPTIONS)
def truncation(size, order):
    """Return G_N(A), the relative coefficient of the first omitted term, for the order N and a ``size`` A > 0."""
    n = order + 1.0
    factorial = 1.0
    for i in range(2, order + 2):
        factorial *= i
    series, weight = 0.0, 1.0
    for k in range(12):
        series += weight * (2.0 * k + 1.0) ** n / factorial
        weight *= 0.25 * size * size
    depth = math.acosh(max(1.0 / size, 1.0))
    pole = 2.0 / size * (depth * depth + 0.25 * math.pi * math.pi) ** (-0.5 * (n + 1.0))
    return min(series, max(pole, 1.0 / factorial))


@formula
def near_truncation(x, size, samples):
    """Return the truncation of a perturbation by near steps over a run, relative to it; one step per sample.

    For x up to 0.6 the terms after the first omitted terms add less than a fifth of them.

    Args:
        x, size, samples: As in :func:`choose_steps`.
    """
    z = 4.0 * x * x
    coupling = samples * z * z * z / 2880.0
    spin = 0.5 * samples * samples * x * (z * z) * (z * z) / 80640.0
    return 1.2 * size * size * (coupling + spin)


@formula
def nearest_truncation(x, size, samples):
    """Return the truncation of a perturbation by the nearest steps, as :func:`near_truncation`; for x up to 1/2.

    Args:
        x, size, samples: As in :func:`choose_steps`.
    """
    z = 4.0 * x * x
    coupling = samples * z * z / 96.0
    spin = 0.5 * samples * samples * x * (z * z * z) / 1440.0
    return 1.2 * size * size * (coupling + spin)


@njit(**OPTIONS)
def is_near(x, size, samples, tolerance):
    """Return True if the near step's truncation is below MAX_NEAR_SHARE of the tolerance.

    Args:
        x, size, samples, tolerance: As in :func:`choose_steps`.
    """
    return (x <= 0.6) & (near_truncation(x, size, samples) <= MAX_NEAR_SHARE * tolerance)


@njit(**OPTIONS)
def is_nearest(x, size, samples, tolerance):
    """Return True if the nearest step's truncation is below MAX_NEAR_SHARE of the tolerance.

    Args:
        x, size, samples, tolerance: As in :func:`choose_steps`.
    """
    return (x <= 0.5) & (nearest_truncation(x, size, samples) <= MAX_NEAR_SHARE * tolerance)


@njit(**OPTIONS)
def choose_steps(x, size, coefficients, samples, tolerance):
    """Return the step with the least work within the tolerance: its number in `taylor.STEPS`, and steps per sample.

    Order i has three steps: 3 i with all terms, 3 i + 1 (near) and 3 i + 2 (nearest), cheaper ones for short steps and
    small perturbations, with fewer of the spin's higher terms. At most MAX_STEPS; if these are too few, the certificate
    shows it.

    Args:
        `x` (float): max|c_i| times the sample spacing in radians of spin.
        size (float): Largest size of the perturbation in the run, relative to the spin.
        coefficients (tuple of 3 floats): :func:`truncation` at each of ORDERS, for that size.
        samples (int): Number of sample intervals over which errors add up.
        tolerance (float): Relative error allowed at the end, relative to the perturbation.
    """
    near = is_near(x, size, samples, tolerance)
    # x <= 1/2, so all terms after the first omitted one add less than x/(10 - x) of it
    share = 1.06 * samples / (tolerance * (1.0 - MAX_NEAR_SHARE) if near else tolerance)
    power = x * x * x
    power *= power * power  # x to the ninth; two more for every order
    i, steps = _one_step(share * power, x * x, coefficients)
    if steps == 0:
        i, steps = _several_steps(share * power, x * x, coefficients)
    if near and is_nearest(x, size, samples, tolerance):
        return 3 * i + 2, steps
    return 3 * i + (1 if near else 0), steps


@njit(**INNER)
def _one_step(excess, square, coefficients):
    """Return the index in ORDERS of the lowest order with which one step suffices, and 1; else 0, 0."""
    for i in range(3):
        if not excess * coefficients[i] > 1.0:
            return i, 1
        excess *= square
    return 0, 0


@njit(**INNER)
def _several_steps(excess, square, coefficients):
    """Return the index in ORDERS and the number of steps with the least work; excess: order 8's over the tolerance."""
    best_order, fewest, least_work = 0, 1, math.inf
    for i in range(3):
        order = ORDERS[i]
        steps = min(np.ceil((excess * coefficients[i]) ** (1.0 / order)), float(MAX_STEPS))
        work = steps * (order * (order + 1) + 40.0)  # 40: loads, stores and the sum of the terms
        if work < least_work:
            best_order, fewest, least_work = i, int(steps), work
        excess *= square
    return best_order, fewest


@njit(**OPTIONS)
def _take_steps(state, k, durations, counts, out):
    """Write state and attitude (w, x, y, z) after each of the durations (in 1/spin), of counts[i] steps, to out."""
    a, b, c = state
    w, x, y, z = 1.0, 0.0, 0.0, 0.0
    for i in range(durations.size):
        h = durations[i] / counts[i]
        for _ in range(counts[i]):
            a, b, c, w, x, y, z = turn_12(a, b, c, w, x, y, z, k[0] * h, k[1] * h, k[2] * h, 0.5 * h)
        size = math.sqrt(w * w + x * x + y * y + z * z)
        out[i, 0], out[i, 1], out[i, 2] = a, b, c
        out[i, 3], out[i, 4], out[i, 5], out[i, 6] = w / size, x / size, y / size, z / size


def rotation(moments, omega_start, times, tolerance=1e-10):
    r"""Return the angular velocity of one free body at given times, by the direct integrator.

    Steps are chosen for motion of any amplitude, so a rotation takes longer than in a survey. If the motion flips, the
    time between flips is as sensitive to rounding as the body's motion.

    Args:
        moments (array_like, shape (3,)): Principal moments of inertia I1, I2, I3 > 0 in a common unit (kg m2).
        omega_start (array_like, shape (3,)): Angular velocity in the body's principal axes at time 0, in rad s-1.
        times (array_like, shape (n,)): Times in s, in any order and of either sign.
        tolerance (float): Relative error allowed in each component's perturbation at the last time, 1e-13 or more.

    Returns:
        numpy.ndarray, shape (n, 3): Angular velocity in rad s-1.

    Raises:
        ValueError: If a moment is not positive, a number is not finite, a shape is wrong, or the tolerance is out of
            range.
    """
    return _integrate_motion(moments, omega_start, times, tolerance, False)[:, :3].copy()


def attitude(moments, omega_start, times, tolerance=1e-10):
    """Return the attitude of one free body since its start at given times, by the direct integrator.

    Quaternions are integrated by the same Taylor series as the angular velocity (:mod:`kernels.free.taylor`).

    Args:
        moments, omega_start, times: As in :func:`rotation`; omega_start must not be zero.
        tolerance (float): Error of the attitude allowed at the last time, rad, 1e-13 or more.

    Returns:
        numpy.ndarray, shape (n, 4): Unit quaternions, scalar first, from body axes to space axes.

    Raises:
        ValueError: As in :func:`rotation`.
    """
    if not np.any(omega_start):
        raise ValueError("omega_start must not be zero: nothing turns")
    return _integrate_motion(moments, omega_start, times, tolerance, True)[:, 3:].copy()


def _integrate_motion(moments, omega_start, times, tolerance, with_attitude):
    """Return angular velocity and attitude, shape (n, 7); with_attitude: the tolerance is that of the attitude."""
    moments, omega, times = (np.asarray(x, dtype=np.float64, order="C") for x in (moments, omega_start, times))
    for name, values in (("moments", moments), ("omega_start", omega)):
        if values.shape != (3,) or not np.isfinite(values).all():
            raise ValueError(f"{name} must be three finite numbers, not {values!r}")
    if times.ndim != 1 or not np.isfinite(times).all():
        raise ValueError("times must be a one-dimensional array of finite numbers")
    if not (moments > 0).all():
        raise ValueError(f"moments must be positive, not {moments!r}")
    if not 1e-13 <= tolerance < 1:
        raise ValueError(f"tolerance must lie in [1e-13, 1), not {tolerance!r}")
    spin, out = np.abs(omega).max(), np.empty((times.size, 7))
    if spin == 0:
        out[:] = 0.0
        return out
    coefficients = np.array(euler_coefficients(*moments))
    bound = np.abs(coefficients).max()
    bound = max(1.0, bound) * np.linalg.norm(omega / spin) if with_attitude else bound
    for forward in (True, False):  # positive times, then negative times, each by increasing size
        order = np.flatnonzero(times >= 0 if forward else times < 0)
        order = order[np.argsort(np.abs(times[order]), kind="stable")]
        durations, one_way = np.diff(times[order], prepend=0.0) * spin, np.empty((order.size, 7))
        _take_steps(
            tuple(omega / spin),
            coefficients,
            durations,
            _steps_per_interval(np.abs(durations) * bound, tolerance),
            one_way,
        )
        out[order] = one_way
    out[:, :3] *= spin
    return out


def _steps_per_interval(x, tolerance):
    """Return steps for each interval of x radians of spin times max|c_i|, so that a whole run keeps the tolerance."""
    total = max(x.sum(), 1.0)
    rate = (total * truncation(1.0, 12) / tolerance) ** (1.0 / 12)
    return np.maximum(np.ceil(x * max(rate, 1.0)), 1).astype(np.int64)
