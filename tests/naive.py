"""Slow, obvious twins of the kernels: NumPy fits, mpmath and fractions compute."""

import math
from fractions import Fraction

import mpmath
import numpy as np
from numba import config

from kernels.estimator import measure
from kernels.free import elliptic

FEWER = 40 if config.DISABLE_JIT else 1  # lanes in plain Python are slow


def bodies(count, seed=1, **given):
    """Random points of bodies that can exist, every axis and both senses of spin; fewer in plain Python."""
    rng = np.random.default_rng(seed)
    masses = rng.uniform(0.0, 1.0, (3, max(count // FEWER, 32)))  # second moments of mass: any triple can exist
    moments = masses.sum(axis=0) - masses
    n = masses.shape[1]
    points = dict(zip(("I1", "I2", "I3"), moments, strict=True))
    points |= {"axis": rng.integers(1, 4, n), "omega0": rng.choice([-1, 1], n) * rng.uniform(0.5, 20.0, n)}
    points |= {"epsilon": np.full(n, 1e-6), "phase": rng.uniform(0, 2 * np.pi, n)}
    return points | {name: np.broadcast_to(value, n) for name, value in given.items()}


def jacobi(u, m, m1):
    """Jacobi's sn, cn and dn as the closed forms find them: by a ladder of means; hyperbolic functions at m1 = 0."""
    return elliptic.climb(u, elliptic.ladder(m, m1))


def coefficients(I1, I2, I3, axis):
    """Euler coefficients (c_a, c_b, c_c) in the order of the spin axis."""
    moments = [I1, I2, I3]
    a, b, c = (np.array([0, 1, 2]) + axis - 1) % 3
    Ia, Ib, Ic = moments[a], moments[b], moments[c]
    return (Ib - Ic) / Ia, (Ic - Ia) / Ib, (Ia - Ib) / Ic


def rate_squared(transverse, spacing):
    """Signed rate² and standard error by NumPy's least squares, over the samples up to tenfold growth."""
    size = np.hypot(*transverse.T)
    num_samples = len(size) if (size <= 10 * size[0]).all() else int(np.argmax(size > 10 * size[0]))
    x = transverse[:num_samples]
    second = (x[2:] - 2 * x[1:-1] + x[:-2]).ravel()
    middle = x[1:-1].ravel()
    slope = np.linalg.lstsq(middle[:, None], second, rcond=None)[0][0]
    D = -0.5 * slope
    residual = second - slope * middle
    stderr_D = np.sqrt(residual @ residual / (len(second) - 1) / (middle @ middle)) / 2
    angle = np.arccos(1 - D) if D > 0 else np.arccosh(1 - D)
    derivative = 2 * angle / (np.sin(angle) if D > 0 else np.sinh(angle))
    return np.sign(D) * (angle / spacing) ** 2, derivative * stderr_D / spacing**2, num_samples


def seen_from(axis, x1, x2, x3):
    """The three values in the order (a, b, c) of a spin axis, by walking round the axes."""
    values = {1: x1, 2: x2, 3: x3}
    next_axis = {1: 2, 2: 3, 3: 1}
    b = next_axis[axis]
    return values[axis], values[b], values[next_axis[b]]


def fractions(*values):
    """The same numbers without any rounding to come."""
    return tuple(Fraction(float(x)) for x in values)


def taylor_terms(start, k, order):
    """Terms 0 to order of the power series of a rotation in one step, by Cauchy products; k_i = c_i h."""
    terms = [[x] for x in start]
    for n in range(order):
        products = []
        for i in range(3):
            j, l = (i + 1) % 3, (i + 2) % 3  # noqa: E741
            products.append(sum(terms[j][m] * terms[l][n - m] for m in range(n + 1)))
        for i in range(3):
            terms[i].append(k[i] * products[i] / (n + 1))
    return terms


def truncation(size, order):
    """G(A) of the direct integrator's step control, from the two bounds in its module's docstring."""
    n = order + 1
    with mpmath.workdps(30):
        A = mpmath.mpf(size)
        series = mpmath.fsum((A / 2) ** (2 * k) * mpmath.mpf(2 * k + 1) ** n / mpmath.factorial(n) for k in range(12))
        depth = mpmath.acosh(1 / A) if A < 1 else mpmath.mpf(0)
        pole = 2 / A * (depth**2 + mpmath.pi**2 / 4) ** (-mpmath.mpf(n + 1) / 2)
        return float(min(series, max(pole, 1 / mpmath.factorial(n))))


def growing_share(cb, cc, omega0, phase):
    """Share of a start on the growing eigenvector, sizes taken in omega_b/sqrt|c_b| and omega_c/sqrt|c_c|."""
    with mpmath.workdps(30):
        cb, cc, omega0, phase = (mpmath.mpf(float(x)) for x in (cb, cc, omega0, phase))
        values, vectors = mpmath.eig(omega0 * mpmath.matrix([[0, cb], [cc, 0]]))
        weights = mpmath.lu_solve(vectors, mpmath.matrix([mpmath.cos(phase), mpmath.sin(phase)]))
        sizes = [
            abs(weights[i]) ** 2 * (abs(vectors[0, i]) ** 2 / abs(cb) + abs(vectors[1, i]) ** 2 / abs(cc))
            for i in (0, 1)
        ]
        grows = 0 if mpmath.re(values[0]) > 0 else 1
        return float(sizes[grows] / (sizes[0] + sizes[1]))


def rate_squared_of(D, spacing):
    """Signed rate² and its derivative by D from arccos(1 - D) and arcosh(1 - D), 50 digits."""
    with mpmath.workdps(50):
        D, h = mpmath.mpf(float(D)), mpmath.mpf(float(spacing))
        if D == 0:
            return 0.0, float(2 / h**2)
        angle = mpmath.acos(1 - D) if D > 0 else mpmath.acosh(1 - D)
        rise = mpmath.sin(angle) if D > 0 else mpmath.sinh(angle)
        return float(mpmath.sign(D) * (angle / h) ** 2), float(2 * angle / rise / h**2)


def estimate(guess, sums, triples, spacing):
    """The signed rate² and its standard error from the sums of ``measure.residual_sums`` over so many triples."""
    sum_rx, sum_rr, sum_xx = sums
    value, slope = measure.rate_squared(guess - 0.5 * sum_rx / sum_xx, spacing)
    scatter = max(sum_rr - sum_rx * sum_rx / sum_xx, 0.0)
    return value, slope * math.sqrt(scatter / ((2.0 * triples - 1.0) * 4.0 * sum_xx))


def signed_rate(samples, spacing):
    """The signed rate² of one perturbation and its standard error, from all samples, by the formulas of the kernels."""
    x = [tuple(sample) for sample in np.asarray(samples, dtype=np.float64).tolist()]
    triples = list(zip(x[2:], x[1:], x, strict=False))
    guess = measure.first_guess(*triples[0])
    return estimate(
        guess, np.sum([measure.residual_sums(*triple, guess) for triple in triples], axis=0), len(triples), spacing
    )
