"""Ω² of a perturbed rotation, measured again by SciPy's DOP853 and by Jacobi's functions."""

import math
from collections.abc import Mapping

import numpy as np
from scipy.integrate import solve_ivp

from kernels import exact
from sweeps.systems.reintegration import MOST_STEPPED, ROUNDING, WINDOW, coefficients, spacing, squared_rate
from sweeps.systems.system import Reference

MOST_SOLVED = 1_000_000  # samples of one run that are made again in closed form


def _seen_from_axis(point: Mapping[str, float]) -> np.ndarray:
    return np.roll([point["I1"], point["I2"], point["I3"]], 1 - int(point["axis"]))


def _spacing(point, integration) -> float:
    return spacing(np.abs(coefficients(_seen_from_axis(point))).max(), integration.samples_per_rotation)


def _times(point, integration) -> np.ndarray:
    return _spacing(point, integration) * np.arange(integration.samples + 1)


def rotation_by_scipy(point: Mapping[str, float], integration) -> float:
    """Return Ω² of a perturbed rotation in s-2, by DOP853; NaN for runs of more than `MOST_STEPPED` samples."""
    if integration.samples > MOST_STEPPED:
        return math.nan
    ca, cb, cc = coefficients(_seen_from_axis(point))
    times, e2 = _times(point, integration), point["epsilon"] ** 2
    start = [math.copysign(1.0, point["omega0"]), math.cos(point["phase"]), math.sin(point["phase"])]

    def rates(_, w):
        return ca * e2 * w[1] * w[2], cb * w[2] * w[0], cc * w[0] * w[1]

    def grown(_, w):
        return math.hypot(w[1], w[2]) - 2.0 * WINDOW

    grown.terminal = True
    accuracy = {"rtol": 1e-13, "atol": 1e-14}
    solution = solve_ivp(rates, (0.0, times[-1]), start, "DOP853", times, events=grown, **accuracy)
    return squared_rate(solution.y[1:].T, times[1], solution.y[0]) * point["omega0"] ** 2


def rotation_in_closed_form(point: Mapping[str, float], integration) -> float:
    """Return Ω² of a perturbed rotation in s-2, by Jacobi's functions; NaN for too many samples."""
    if integration.samples > MOST_SOLVED:
        return math.nan
    epsilon, phase, axis = point["epsilon"], point["phase"], int(point["axis"])
    start = [math.copysign(1.0, point["omega0"]), epsilon * math.cos(phase), epsilon * math.sin(phase)]
    moments, times = _seen_from_axis(point), _times(point, integration)
    omega = exact.rotation(np.roll(moments, axis - 1), np.roll(start, axis - 1), times)
    seen = np.roll(omega, 1 - axis, axis=1)
    return squared_rate(seen[:, 1:] / epsilon, times[1], seen[:, 0]) * point["omega0"] ** 2


def allowed(point: Mapping[str, float], integration) -> float:
    """Return the allowed distance of a measured Ω² from a reference, s-2.

    Samples that are wrong by δ, relative to the largest so far, move D by 2δ, hence Ω² by 4δ/h². Both ways may be wrong
    by the tolerance, and the references by `ROUNDING`.
    """
    h = _spacing(point, integration)
    return 8.0 * (integration.tolerance + ROUNDING) / h**2 * point["omega0"] ** 2


WAYS = {"SciPy DOP853": rotation_by_scipy, "closed form": rotation_in_closed_form}
REFERENCE = Reference("omega_squared", WAYS, allowed)
