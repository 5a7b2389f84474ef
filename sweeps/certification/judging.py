"""Judge a trajectory: its errors against the exact motion, how far the start determines it, and the verdict."""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from kernels.free import exact
from sweeps.certification import diagnosis, fits, trajectory
from sweeps.certification.columns import ColumnChoice
from sweeps.certification.reference import (
    EARTH_RATE,
    PERTURBED_ROWS,
    AttitudeFrame,
    BodyMotion,
    conditioning,
    errors,
    exact_motion,
    in_principal_axes,
)
from sweeps.certification.trajectory import by_blocks
from sweeps.schema.datasets import Dataset
from sweeps.schema.refusals import DefinitionError, display
from sweeps.schema.variables import parse_amount
from sweeps.systems.motion import label_columns, rotate_vectors, time_axis
from sweeps.systems.rigid_body.system import SpunBody

VERDICTS = ("pass", "fail", "ill_conditioned")
ROUNDING = 1e-14  # rad, error below which it has no growth
GROWTH_POINTS = 40  # number of times in the fit of the error's growth


@dataclass(frozen=True)
class Judgement:
    """Rows, the exact motion that they are compared with, and what follows."""

    rows: trajectory.Trajectory
    motion: BodyMotion
    reference: BodyMotion
    start: str  #: "first_row", "fitted" or "rates_fitted"
    tolerance: float
    attitude_errors: np.ndarray | None  #: rad, (n,)
    rates_errors: np.ndarray | None  #: relative to |w| at the start, (n,)
    conditioning_rad: float | None
    conditioning_rates: float
    frame: AttitudeFrame
    axes: np.ndarray | None  #: principal axes in the body's axes of the file

    @property
    def all_errors(self) -> np.ndarray:
        """Error of attitude or rates, the larger one, of each row."""
        return np.max([each for each in (self.attitude_errors, self.rates_errors) if each is not None], axis=0)

    @property
    def worst(self) -> float:
        """The largest error."""
        return float(self.all_errors.max())

    def rebuilt(self, q: np.ndarray | None, w: np.ndarray | None, rows: np.ndarray) -> BodyMotion:
        """Return some rows with other attitudes and rates in place of the file's."""
        q = None if q is None else self.frame.in_space(self.rows, q, rows)
        return in_principal_axes(q, w, self.rows.times[rows], self.motion.moments, self.axes)

    @property
    def is_unit(self) -> bool:
        """True if quaternions or matrices are as long as they should be, within tolerance and resolution."""
        return self.rows.length_error <= max(self.tolerance, 2.0 * self.rows.attitude_resolution)

    @property
    def verdict(self) -> str:
        """One of VERDICTS."""
        pairs = [(self.attitude_errors, self.conditioning_rad), (self.rates_errors, self.conditioning_rates)]
        worst = [(float(each.max()), bound) for each, bound in pairs if each is not None]
        if not self.is_unit or self.rows.is_mirrored:
            return "fail"
        if all(error <= self.tolerance for error, _ in worst):
            return "pass"
        is_explained = all(error <= max(self.tolerance, 2.0 * bound) for error, bound in worst)
        return "ill_conditioned" if is_explained and worst[0][1] > self.tolerance else "fail"


def certify(
    run: Any, body: SpunBody, tolerance: float, fit_start: bool, frame: str, options: Mapping[str, Any]
) -> Dataset:
    """Return the answer of `sweeps.certify`; see there."""
    allowed = {field.name for field in fields(ColumnChoice)} | {"frame_rate", "frame_axis"}
    if unknown := options.keys() - allowed:
        raise DefinitionError(
            f"certify: unknown argument {sorted(unknown)[0]!r}; allowed: {', '.join(sorted(allowed))}"
        )
    options = dict(options)
    rate, axis = options.pop("frame_rate", None), options.pop("frame_axis", None)
    axes = None if body.principal is None else np.array(body.principal.axes)
    return dataset(
        judge(run, body.moments, axes, tolerance, ColumnChoice(**options), _frame(frame, rate, axis), fit_start)
    )


def _frame(name: str, rate: Any, axis: Any) -> AttitudeFrame:
    if name not in ("inertial", "local"):
        raise DefinitionError(f"frame: {display(name)}; allowed: inertial, local")
    if name == "inertial":
        if rate is not None or axis is not None:
            raise DefinitionError("frame_rate, frame_axis: are of a local frame; allowed: with frame local")
        return AttitudeFrame()
    rate = EARTH_RATE if rate is None else parse_amount("frame_rate", rate, "rad s-1")
    if axis is None:
        return AttitudeFrame(rate)
    axis = np.asarray(axis, dtype=np.float64)
    if axis.shape != (3,) or not np.isfinite(axis).all() or not axis.any():
        raise DefinitionError("frame_axis: allowed: three finite numbers, not all 0")
    return AttitudeFrame(rate, tuple(axis / np.linalg.norm(axis)))


def judge(
    run: Any, moments, axes, tolerance: float, choice: ColumnChoice, frame: AttitudeFrame, fit_start: bool = False
) -> Judgement:
    """Return the judgement of a trajectory of a body, in a file or in memory.

    Args:
        run: see `sweeps.certification.trajectory.read`.
        moments: principal moments of inertia in any one unit, (3,).
        axes: principal axes, the rows of a rotation matrix, in the body's axes of the file; None for these themselves.
        tolerance: allowed error of the attitude, rad, and of the rates relative to |w| of the first row.
        choice: the meaning of columns.
        frame: the frame of the attitudes.
        fit_start: whether the start is fitted to all rows, in place of the first row.
    """
    if not (isinstance(tolerance, int | float) and 0 < tolerance < np.inf):
        raise DefinitionError(f"tolerance: {display(tolerance)}; allowed: a finite number > 0")
    rows = trajectory.read(run, choice)
    q = None if rows.q is None else frame.in_space(rows, rows.q)
    motion = in_principal_axes(q, rows.rates, rows.times, moments, axes)
    start, how = begin(motion, fit_start)
    reference = exact_motion(motion, *start)
    steps = np.diag(
        np.where(np.isnan(rows.rates_resolution), 2 * np.spacing(np.linalg.norm(start[1])), rows.rates_resolution)
    )
    steps = steps if axes is None else steps @ np.asarray(axes).T
    bounds = conditioning(motion, start, rows.attitude_offset, steps)
    return Judgement(rows, motion, reference, how, float(tolerance), *errors(motion, reference), *bounds, frame, axes)


def begin(motion: BodyMotion, fit_start: bool = False) -> tuple[tuple[np.ndarray, np.ndarray], str]:
    """Return attitude and angular velocity at the start, and whether they are those of the first row or fitted."""
    if motion.w is not None and not fit_start:
        return motion.start, "first_row"
    guess = motion.start if motion.w is not None else (motion.q[0], fits.first_rates(motion))
    if motion.w is None and np.array_equal(motion.q[0], motion.q[1]):
        raise DefinitionError("attitude: the first two rows are equal; allowed: a body that rotates")
    names = ("attitude",) * (fit_start and motion.q is not None) + ("rates",)
    fitted = fits.fit(motion, fits.Fit(guess, motion.moments), names, PERTURBED_ROWS)
    return fitted.start, "fitted" if fit_start else "rates_fitted"


def facts(judgement: Judgement) -> dict[str, Any]:
    """Return verdict, diagnosis, errors and conditioning as plain values; what a file does not have is left out."""
    motion, reference, verdict = judgement.motion, judgement.reference, judgement.verdict
    words = diagnosis.diagnose(judgement)
    values = {
        "verdict": verdict,
        "diagnosis": [each.word for each in words],
        "evidence": [each.evidence for each in words],
    }
    values |= {"tolerance": judgement.tolerance, "start": judgement.start, "rows": len(motion.times)}
    values |= {"duration_s": float(motion.times[-1])}
    if judgement.attitude_errors is not None:
        values |= _of_column("attitude_error", judgement.attitude_errors, "rad", motion.times, judgement.tolerance)
        values["conditioning_rad"] = judgement.conditioning_rad
    if judgement.rates_errors is not None:
        values |= _of_column("rates_error", judgement.rates_errors, "relative", motion.times, judgement.tolerance)
        values |= _of_integrals(motion)
    values |= {
        "conditioning_rates_relative": judgement.conditioning_rates,
        "period_s": _period(motion.moments, reference.w[0]),
    }
    worst = judgement.rates_errors if judgement.attitude_errors is None else judgement.attitude_errors
    values |= {f"growth_{name}": value for name, value in growth(motion.times, worst).items()}
    values["moments"] = motion.moments.tolist()
    values["columns"] = [f"{role}={','.join(names)}" for role, names in judgement.rows.names.items()]
    if verdict == "ill_conditioned":
        values["warning"] = (
            f"ill-conditioned: motions that begin within the resolution of the file end up to "
            f"{values.get('conditioning_rad') or judgement.conditioning_rates:.2g} apart, more than the tolerance"
        )
    return values


def _of_column(name: str, error: np.ndarray, unit: str, times: np.ndarray, tolerance: float) -> dict[str, float]:
    """Return the largest error, that of the last row, and the time (s) of the first row beyond the tolerance."""
    first_time = (
        {} if error.max() <= tolerance else {f"{name}_passes_tolerance_s": float(times[np.argmax(error > tolerance)])}
    )
    return {f"{name}_max_{unit}": float(error.max()), f"{name}_end_{unit}": float(error[-1])} | first_time


def _of_integrals(motion: BodyMotion) -> dict[str, float]:
    """Return the largest changes of 2T, of the size and (with attitudes) the direction of L, and of the period."""
    moments = motion.moments
    twice_energy = by_blocks(lambda w: np.einsum("ij,ij->i", w, w * moments), motion.w)
    size = by_blocks(lambda w: np.linalg.norm(w * moments, axis=1), motion.w)
    period, last = (_period(moments, w) for w in (motion.w[0], motion.w[-1]))
    values = {
        "energy_error_relative": float(np.abs(twice_energy / twice_energy[0] - 1).max()),
        "momentum_size_error_relative": float(np.abs(size / size[0] - 1).max()),
        "period_error_relative": abs(last / period - 1) if np.isfinite([period, last]).all() else None,
    }
    if motion.q is not None:
        first = rotate_vectors(motion.q[:1], motion.w[:1] * moments)[0] / size[0]

        def momentum_angle(q: np.ndarray, w: np.ndarray) -> np.ndarray:
            in_space = rotate_vectors(q, w * moments)
            return np.arctan2(np.linalg.norm(np.cross(in_space, first), axis=1), in_space @ first)

        values["momentum_direction_error_rad"] = float(by_blocks(momentum_angle, motion.q, motion.w).max())
    return values


def _period(moments: np.ndarray, w: np.ndarray) -> float | None:
    """Return the period of the angular velocity in the body, s; infinite for a steady one."""
    return float(exact.period(exact.set_up(*moments, *w)))


def growth(times: np.ndarray, error: np.ndarray) -> dict[str, Any]:
    """Return how the largest error so far grows with time t: as a constant, t, t^2 or e^(t/tau), and its coefficient.

    Linear growth is that of a wrong rate, quadratic growth that of a torque or an integrator.
    """
    so_far = np.maximum.accumulate(error)
    at = np.unique(np.searchsorted(times, np.linspace(0.1, 1.0, GROWTH_POINTS) * times[-1]))
    t, logs = times[at], np.log(np.maximum(so_far[at], np.finfo(float).tiny))
    if len(at) < 4 or so_far[-1] < ROUNDING:
        return {"kind": "none"}
    slope, offset = np.polyfit(t, logs, 1)
    models = {
        "constant": logs - logs.mean(),
        "linear": logs - np.log(t) - (logs - np.log(t)).mean(),
        "quadratic": logs - 2 * np.log(t) - (logs - 2 * np.log(t)).mean(),
        "exponential": (logs - slope * t - offset) * 1.2,  # one parameter more
    }
    kind = min(models, key=lambda name: float(np.square(models[name]).sum()))
    if kind == "exponential":
        return {"kind": kind, "e_folding_time_s": float(1 / slope), "factor": float(so_far[-1] / so_far[at[0]])}
    power = ("constant", "linear", "quadratic").index(kind)
    return {"kind": kind, "coefficient": float(np.exp((logs - power * np.log(t)).mean()))}


def dataset(judgement: Judgement) -> Dataset:
    """Return the errors over time and the exact motion in the principal axes; the attributes are those of `facts`."""
    import xarray as xr

    reference, columns = (
        judgement.reference,
        label_columns(judgement.reference.w, judgement.reference.q, "exact motion"),
    )
    long_name = "angle between the attitude and the exact one"
    columns["attitude_error"] = "time", judgement.attitude_errors, {"units": "rad", "long_name": long_name}
    long_name = "distance of the angular velocity from the exact one, relative to the first"
    columns["rates_error"] = "time", judgement.rates_errors, {"units": "1", "long_name": long_name}
    columns = {name: column for name, column in columns.items() if column[1] is not None}
    attributes = {name: value for name, value in facts(judgement).items() if value is not None}
    return xr.Dataset(columns, {"time": time_axis(reference.times, "the first row")}, attributes)
