r"""Points measured again by others: SciPy's DOP853 and the closed form, each fitted by NumPy's least squares.

Nothing here shares code with the integrators and the estimator of a sweep, so agreement is evidence. Runs are made in
radians of spin and in units of the nudge, as the sweep's are.
"""

import math
from collections.abc import Callable, Mapping

import numpy as np
from scipy.integrate import solve_ivp

from kernels import exact
from sweeps.systems.symmetric_top.definition import TopIntegration

WINDOW = 10.0  # samples count until the transverse size exceeds this many times its start
MOST_STEPPED, MOST_SOLVED = 20_000, 1_000_000  # samples of one run that are made again step by step, and in closed form
RADIANS = 0.5  # that no motion may turn by between two samples

Reference = Callable[[Mapping[str, float], object], float]


def coefficients(moments: np.ndarray) -> np.ndarray:
    """Euler coefficients (I_j - I_k)/I_i of moments in cyclic order; dimensionless."""
    return (np.roll(moments, -1) - np.roll(moments, -2)) / moments


def spacing(bound: float, samples_per_rotation: int) -> float:
    """Time between two samples in radians of spin, for a bound on every possible rate in units of the spin."""
    return min(2.0 * math.pi / samples_per_rotation, RADIANS / max(1.0, bound))


def signed_rate(transverse: np.ndarray, h: float) -> float:
    """Signed rate² of samples, shape (n, 2), `h` apart, up to tenfold growth; in units of 1/h².

    The recurrence ε(t+h) - 2ε(t) + ε(t-h) = -2D ε(t) holds for every linear motion of second order; D = 1 - cos Ωh.
    """
    size = np.hypot(*transverse.T)
    beyond = np.flatnonzero(size > WINDOW * size[0])
    x = transverse[: beyond[0]] if beyond.size else transverse
    if len(x) < 4:
        return math.nan
    second = ((x[2:] - x[1:-1]) - (x[1:-1] - x[:-2])).ravel()
    D = -0.5 * float(np.linalg.lstsq(x[1:-1].reshape(-1, 1), second, rcond=None)[0][0])
    half = math.sqrt(abs(D) / 2.0)
    angle = 2.0 * (math.asin(min(half, 1.0)) if D > 0 else math.asinh(half))
    return math.copysign((angle / h) ** 2, D)


def _seen_from_axis(point: Mapping[str, float]) -> np.ndarray:
    return np.roll([point["I1"], point["I2"], point["I3"]], 1 - int(point["axis"]))


def _times(point, integration) -> np.ndarray:
    bound = np.abs(coefficients(_seen_from_axis(point))).max()
    return spacing(bound, integration.samples_per_rotation) * np.arange(integration.samples + 1)


def rotation_by_scipy(point: Mapping[str, float], integration) -> float:
    """Ω² of a nudged rotation in s-2, by DOP853; NaN for runs of more than `MOST_STEPPED` samples."""
    if integration.samples > MOST_STEPPED:
        return math.nan
    ca, cb, cc = coefficients(_seen_from_axis(point))
    times, e2 = _times(point, integration), point["epsilon"] ** 2
    start = [math.copysign(1.0, point["omega0"]), math.cos(point["phase"]), math.sin(point["phase"])]

    def grown(t, w):
        return math.hypot(w[1], w[2]) - 2.0 * WINDOW

    grown.terminal = True
    solution = solve_ivp(
        lambda t, w: (ca * e2 * w[1] * w[2], cb * w[2] * w[0], cc * w[0] * w[1]),
        (0.0, times[-1]),
        start,
        method="DOP853",
        t_eval=times,
        events=grown,
        rtol=1e-13,
        atol=1e-14,
    )
    return signed_rate(solution.y[1:].T, times[1]) * point["omega0"] ** 2


def rotation_in_closed_form(point: Mapping[str, float], integration) -> float:
    """Ω² of a nudged rotation in s-2, by Jacobi's functions; NaN for runs of more than `MOST_SOLVED` samples."""
    if integration.samples > MOST_SOLVED:
        return math.nan
    epsilon, phase, axis = point["epsilon"], point["phase"], int(point["axis"])
    start = [math.copysign(1.0, point["omega0"]), epsilon * math.cos(phase), epsilon * math.sin(phase)]
    moments, times = _seen_from_axis(point), _times(point, integration)
    omega = exact.rotation(np.roll(moments, axis - 1), np.roll(start, axis - 1), times)
    transverse = np.roll(omega, 1 - axis, axis=1)[:, 1:] / epsilon
    return signed_rate(transverse, times[1]) * point["omega0"] ** 2


def precession_by_scipy(point: Mapping[str, float], integration: TopIntegration) -> float:
    """Rate of the precession about the figure axis in rad s-1, by DOP853: slope of the transverse part's angle."""
    if integration.samples > MOST_STEPPED:
        return math.nan
    c = point["ratio"] - 1.0
    h = spacing(abs(c), integration.samples_per_rotation)
    times = h * np.arange(integration.samples + 1)
    sense = math.copysign(1.0, point["omega3"])
    solution = solve_ivp(
        lambda t, w: (-c * sense * w[1], c * sense * w[0]),
        (0.0, times[-1]),
        [1.0, 0.0],
        method="DOP853",
        t_eval=times,
        rtol=1e-13,
        atol=1e-14,
    )
    angle = np.unwrap(np.arctan2(solution.y[1], solution.y[0]))
    return float(np.polyfit(times, angle, 1)[0]) * abs(point["omega3"])


def precession_in_closed_form(point: Mapping[str, float], integration: TopIntegration) -> float:
    """Rate of the precession about the figure axis in rad s-1: (I3/I1 - 1) ω3."""
    return (point["ratio"] - 1.0) * point["omega3"]


def allowed(point: Mapping[str, float], system: str, integration) -> float:
    """How far a measured value may lie from a reference.

    Samples that are wrong by δ, relative to the largest so far, move D by 2δ, hence Ω² by 4δ/h² and the slope of an
    angle by 2δ/h. Both ways may be wrong by the tolerance, and the references by 1e-12.
    """
    wrong = integration.tolerance + 1e-12
    if system == "rigid_body":
        h = float(_times(point, integration)[1])
        return 8.0 * wrong / h**2 * point["omega0"] ** 2
    h = spacing(abs(point["ratio"] - 1.0), integration.samples_per_rotation)
    return 4.0 * wrong / h * abs(point["omega3"])


REFERENCES: dict[str, tuple[str, dict[str, Reference]]] = {
    "rigid_body": ("omega_squared", {"SciPy DOP853": rotation_by_scipy, "closed form": rotation_in_closed_form}),
    "symmetric_top": (
        "precession_rate",
        {"SciPy DOP853": precession_by_scipy, "closed form": precession_in_closed_form},
    ),
}
