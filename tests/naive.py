"""Slow, obvious twins of the kernels: SciPy integrates, NumPy fits."""

import numpy as np
from scipy.integrate import solve_ivp


def coefficients(I1, I2, I3, axis):
    """Euler coefficients (c_a, c_b, c_c) seen from the spin axis."""
    moments = [I1, I2, I3]
    a, b, c = (np.array([0, 1, 2]) + axis - 1) % 3
    Ia, Ib, Ic = moments[a], moments[b], moments[c]
    return (Ib - Ic) / Ia, (Ic - Ia) / Ib, (Ia - Ib) / Ic


def samples(I1, I2, I3, axis, sign, epsilon, phase, spacing, count):
    """Transverse components over epsilon at count + 1 times, by DOP853 on the scaled equations."""
    ca, cb, cc = coefficients(I1, I2, I3, axis)
    e2 = epsilon * epsilon
    solution = solve_ivp(
        lambda t, w: (ca * e2 * w[1] * w[2], cb * w[2] * w[0], cc * w[0] * w[1]),
        (0.0, spacing * count),
        [sign, np.cos(phase), np.sin(phase)],
        method="DOP853",
        t_eval=spacing * np.arange(count + 1),
        rtol=1e-13,
        atol=1e-14,
    )
    return solution.y.T


def rate_squared(transverse, spacing):
    """Signed rate² and standard error by NumPy's least squares, over the samples up to tenfold growth."""
    size = np.hypot(*transverse.T)
    used = len(size) if (size <= 10 * size[0]).all() else int(np.argmax(size > 10 * size[0]))
    x = transverse[:used]
    second = (x[2:] - 2 * x[1:-1] + x[:-2]).ravel()
    middle = x[1:-1].ravel()
    slope = np.linalg.lstsq(middle[:, None], second, rcond=None)[0][0]
    D = -0.5 * slope
    residual = second - slope * middle
    stderr_D = np.sqrt(residual @ residual / (len(second) - 1) / (middle @ middle)) / 2
    angle = np.arccos(1 - D) if D > 0 else np.arccosh(1 - D)
    derivative = 2 * angle / (np.sin(angle) if D > 0 else np.sinh(angle))
    return np.sign(D) * (angle / spacing) ** 2, derivative * stderr_D / spacing**2, used
