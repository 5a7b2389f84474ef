r"""Sampling and least squares of the reference measurements of `verify`.

Nothing here shares code with the integrators and the estimator of a sweep, so agreement is evidence. Runs are made in
radians of spin and in units of the perturbation, as the sweep's are.
"""

import math
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from sweeps.mechanics.equations import Equations

MAX_GROWTH = 10.0  # the window of samples ends when the transverse size exceeds this many times its start
MAX_SPIN_CHANGE, MIN_WINDOW_SAMPLES = 1 / 32, 7  # it also ends at this relative change of the spin, after 7 samples
MAX_STEPPED_SAMPLES = 20_000  # longest run that is integrated again; longer runs would take seconds each
MAX_SAMPLE_ANGLE = 0.5  # rad, largest phase advance of any motion between two samples
ROUNDING_ERROR = 1e-12  # relative rounding error of the reference values
DOP853_TOLERANCES = {"rtol": 1e-13, "atol": 1e-15}  # tolerances for monodromy matrices, near rounding


def euler_coefficients(moments: np.ndarray) -> np.ndarray:
    """Return the Euler coefficients (I_j - I_k)/I_i of moments in cyclic order; dimensionless."""
    return (np.roll(moments, -1) - np.roll(moments, -2)) / moments


def rates_of(equations: "Equations") -> Callable:
    """Return (parameters, time, states) → rates of a description's equations, which SymPy writes for NumPy.

    States may be complex: a complex step differentiates the rates.
    """
    import sympy as sp

    arguments = (*equations.parameters, *equations.states, equations.system.time)
    expressions = (list(equations.f), equations.a if equations.v else 0)
    forces, mass = (sp.lambdify(arguments, e, ["scipy", "numpy"]) for e in expressions)

    def rates(parameters, t, x):
        """Return the time derivative of the states x; the mass matrix gives the accelerations."""
        f = np.array([complex(y) for y in forces(*parameters, *x, t)])
        if equations.v:
            f[equations.m :] = np.linalg.solve(np.array(mass(*parameters, *x, t), dtype=complex), f[equations.m :])
        return f if np.iscomplexobj(x) else f.real

    return rates


def integrate_monodromy(
    rates: Callable, slopes: Callable, start: np.ndarray, matrix: np.ndarray, times: tuple[float, float]
) -> tuple[np.ndarray, np.ndarray]:
    """Return the state and the matrix of its perturbations after a time, by SciPy's DOP853.

    Args:
        rates: (time, state) → derivatives of the state.
        slopes: (time, state) → matrix A of the perturbations, X' = A X.
        start: state at first, shape (m,); () for perturbations of rest.
        matrix: the perturbations X at first, shape (n, n).
        times: begin and end.
    """
    from scipy.integrate import solve_ivp

    count = len(start)

    def all_rates(time, values):
        """Return the derivatives of the state and of its perturbations."""
        state, perturbations = values[:count], values[count:].reshape(matrix.shape)
        return np.concatenate([rates(time, state), (slopes(time, state) @ perturbations).ravel()])

    end = solve_ivp(all_rates, times, np.concatenate([start, matrix.ravel()]), "DOP853", **DOP853_TOLERANCES).y[:, -1]
    return end[:count], end[count:].reshape(matrix.shape)


def sample_spacing(bound: float, samples_per_rotation: int) -> float:
    """Return the time between samples in radians of spin, from a bound on every possible rate over the spin rate."""
    return min(2.0 * math.pi / samples_per_rotation, MAX_SAMPLE_ANGLE / max(1.0, bound))


def squared_rate(transverse: np.ndarray, h: float, spin: np.ndarray | None = None) -> float:
    """Return the signed rate² of samples, shape (n, 2), `h` apart, up to tenfold growth; in units of 1/h².

    The recurrence ε(t+h) - 2ε(t) + ε(t-h) = -2D ε(t) holds for every linear motion of second order; D = 1 - cos Ωh.

    Args:
        transverse: components perpendicular to the spin axis, shape (n, 2).
        h: time between samples.
        spin: component along the spin axis in units of its start, shape (n,); the window ends if it changes.
    """
    size = np.hypot(*transverse.T)
    is_outside = size > MAX_GROWTH * size[0]
    if spin is not None:
        is_outside[MIN_WINDOW_SAMPLES:] |= (np.abs(np.abs(spin) - 1.0) > MAX_SPIN_CHANGE)[MIN_WINDOW_SAMPLES:]
    outside = np.flatnonzero(is_outside)
    x = transverse[: outside[0]] if outside.size else transverse
    if len(x) < 4:
        return math.nan
    second = ((x[2:] - x[1:-1]) - (x[1:-1] - x[:-2])).ravel()
    D = -0.5 * float(np.linalg.lstsq(x[1:-1].reshape(-1, 1), second, rcond=None)[0][0])
    half = math.sqrt(abs(D) / 2.0)
    angle = 2.0 * (math.asin(min(half, 1.0)) if D > 0 else math.asinh(half))
    return math.copysign((angle / h) ** 2, D)
