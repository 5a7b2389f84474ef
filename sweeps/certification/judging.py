"""Judge a trajectory: its errors against the exact motion, how far the start determines it, and the verdict."""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from functools import cached_property
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from kernels.free import exact
from sweeps.certification import diagnosis, fits, trajectory
from sweeps.certification.columns import ColumnChoice
from sweeps.certification.reference import (
    EARTH_RATE,
    PERTURBED_ROWS,
    AttitudeFrame,
    BodyMotion,
    by_blocks,
    changes_of_integrals,
    conditioning,
    errors,
    exact_motion,
)
from sweeps.schema.datasets import Dataset
from sweeps.schema.refusals import DefinitionError, display
from sweeps.schema.variables import parse_amount
from sweeps.systems.motion import label_columns, time_axis
from sweeps.systems.rigid_body.system import SpunBody

ROUNDING = 1e-14  # rad, error below which it has no growth
GROWTH_POINTS = 40  # number of times in the fit of the error's growth
EXPONENTIAL_PENALTY = 1.44  # factor on the variance that exponential growth leaves, for it has one parameter more
UNITS = {"attitude": "rad", "rates": "relative"}  # column → unit of its errors
LONG_NAMES = {
    "attitude": "angle between the attitude and the exact one",
    "rates": "distance of the angular velocity from the exact one, relative to the first",
}


@dataclass(frozen=True)
class Judgement:
    """Rows, the exact motion that they are compared with, and what follows."""

    rows: trajectory.Trajectory
    motion: BodyMotion
    reference: BodyMotion
    start: str  #: "first_row", "fitted" or "rates_fitted"
    tolerance: float
    errors: dict[str, np.ndarray]  #: of each row, as `sweeps.certification.reference.errors`
    conditioning: dict[str, float]  #: of "attitude", rad, and "rates", relative to the first |w|
    frame: AttitudeFrame
    axes: np.ndarray  #: principal axes, the rows of a rotation matrix, in the body's axes of the file

    @cached_property
    def row_errors(self) -> np.ndarray:
        """Error of attitude or rates, the larger one, of each row."""
        return np.max([*self.errors.values()], axis=0)

    @property
    def worst(self) -> float:
        """The largest error."""
        return float(self.row_errors.max())

    @property
    def bound(self) -> float:
        """The conditioning of attitudes, rad, and of the rates of a file without attitudes."""
        return self.conditioning[next(iter(self.errors))]

    def rebuild(self, q: Rotation | None, w: np.ndarray | None, rows) -> BodyMotion:
        """Return some rows with other attitudes and rates in place of the file's."""
        q = None if q is None else self.frame.in_space(self.rows, q, rows)
        return _in_principal_axes(self.motion.moments, self.axes, self.rows.times[rows], q, w)

    @property
    def is_unit(self) -> bool:
        """True if quaternions or matrices are as long as they should be, within tolerance and resolution."""
        return self.rows.length_error <= max(self.tolerance, 2.0 * self.rows.attitude_resolution)

    @property
    def verdict(self) -> str:
        """One of "pass", "fail" and "ill_conditioned"."""
        if not self.is_unit or self.rows.is_mirrored:
            return "fail"
        if self.worst <= self.tolerance:
            return "pass"
        allowed = {name: max(self.tolerance, 2.0 * self.conditioning[name]) for name in self.errors}
        is_explained = all(error.max() <= allowed[name] for name, error in self.errors.items())
        return "ill_conditioned" if is_explained and self.bound > self.tolerance else "fail"


def certify(
    run: Any, body: SpunBody, tolerance: float, fit_start: bool, frame: str, options: Mapping[str, Any]
) -> Dataset:
    """Return the answer of `sweeps.certify`; see there."""
    allowed = {field.name for field in fields(ColumnChoice)} | {"frame_rate", "frame_axis"}
    if unknown := options.keys() - allowed:
        problem = f"unknown argument {sorted(unknown)[0]!r}"
        raise DefinitionError(f"certify: {problem}; allowed: {', '.join(sorted(allowed))}")
    options = dict(options)
    chosen_frame = _frame(frame, options.pop("frame_rate", None), options.pop("frame_axis", None))
    if not (isinstance(tolerance, int | float) and 0 < tolerance < np.inf):
        raise DefinitionError(f"tolerance: {display(tolerance)}; allowed: a finite number > 0")
    axes = np.eye(3) if body.principal is None else np.array(body.principal.axes)
    rows = trajectory.read(run, ColumnChoice(**options))
    return dataset(judge(rows, body.moments, axes, tolerance, chosen_frame, fit_start))


def _frame(name: str, rate: Any, axis: Any) -> AttitudeFrame:
    """Return the frame of the attitudes; refuse rate and axis of an inertial one."""
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
    rows: trajectory.Trajectory, moments, axes, tolerance: float, frame: AttitudeFrame, fit_start: bool = False
) -> Judgement:
    """Return the judgement of a trajectory of a body.

    Args:
        rows: of `sweeps.certification.trajectory.read`.
        moments: principal moments of inertia in any one unit, (3,).
        axes: principal axes, the rows of a rotation matrix, in the body's axes of the file.
        tolerance: allowed error of the attitude, rad, and of the rates relative to |w| of the first row.
        frame: the frame of the attitudes.
        fit_start: whether the start is fitted to all rows, in place of the first row.
    """
    moments = np.asarray(moments, dtype=np.float64)
    q = None if rows.q is None else frame.in_space(rows, rows.q)
    motion = _in_principal_axes(moments, axes, rows.times, q, rows.rates)
    start, how = _begin(motion, fit_start)
    reference = exact_motion(motion, *start)
    steps = rows.rates_resolution
    steps = np.full(3, 2 * np.spacing(np.linalg.norm(start[1]))) if steps is None else steps
    bounds = conditioning(motion, start, rows.attitude_offset, np.diag(steps) @ axes.T)
    return Judgement(rows, motion, reference, how, float(tolerance), errors(motion, reference), bounds, frame, axes)


def _in_principal_axes(moments, axes, times, q: Rotation | None, w: np.ndarray | None) -> BodyMotion:
    """Return the motion of attitudes in space and rates, both given in the body's axes of the file."""
    if not np.array_equal(axes, np.eye(3)):
        q = None if q is None else q * Rotation.from_matrix(axes.T)
        w = None if w is None else w @ axes.T
    return BodyMotion(moments, times, q, w)


def _begin(motion: BodyMotion, fit_start: bool) -> tuple[tuple[Rotation, np.ndarray], str]:
    """Return attitude and angular velocity at the start, and whether they are those of the first row or fitted."""
    if motion.w is not None and not fit_start:
        return motion.start, "first_row"
    if motion.w is None and not (motion.q[0].inv() * motion.q[1]).magnitude():
        raise DefinitionError("attitude: the first two rows are equal; allowed: a body that rotates")
    names = ("attitude",) * (fit_start and motion.q is not None) + ("rates",)
    fitted = fits.fit(motion, fits.guess_start(motion), names, PERTURBED_ROWS)
    return fitted.start, "fitted" if fit_start else "rates_fitted"


def facts(judgement: Judgement) -> dict[str, Any]:
    """Return verdict, diagnosis, errors and conditioning as plain values; values that a file does not have are None."""
    motion, reference, verdict = judgement.motion, judgement.reference, judgement.verdict
    words = diagnosis.diagnose(judgement)
    values = {
        "verdict": verdict,
        "diagnosis": [each.word for each in words],
        "evidence": [each.evidence for each in words],
        "tolerance": judgement.tolerance,
        "start": judgement.start,
        "rows": len(motion.times),
        "duration_s": float(motion.times[-1]),
    }
    for name, error in judgement.errors.items():
        values[f"{name}_error_max_{UNITS[name]}"] = float(error.max())
        values[f"{name}_error_end_{UNITS[name]}"] = float(error[-1])
        if error.max() > judgement.tolerance:
            first_time = float(motion.times[np.argmax(error > judgement.tolerance)])
            values[f"{name}_error_passes_tolerance_s"] = first_time
    values["conditioning_rad"] = judgement.conditioning.get("attitude")
    values["conditioning_rates_relative"] = judgement.conditioning["rates"]
    values["period_s"] = _period(motion.moments, reference.w[0])
    if motion.w is not None:
        periods = [_period(motion.moments, motion.w[k]) for k in (0, -1)]
        values |= changes_of_integrals(motion)
        values["period_error_relative"] = abs(periods[1] / periods[0] - 1) if np.isfinite(periods).all() else None
    growth = error_growth(motion.times, next(iter(judgement.errors.values())))
    values |= {f"growth_{name}": value for name, value in growth.items()}
    values["moments"] = motion.moments.tolist()
    values["columns"] = [f"{role}={','.join(names)}" for role, names in judgement.rows.names.items()]
    if verdict == "ill_conditioned":
        values["warning"] = (
            f"ill-conditioned: motions that begin within the resolution of the file end up to {judgement.bound:.2g} "
            "apart, more than the tolerance"
        )
    return values


def _period(moments: np.ndarray, w: np.ndarray) -> float:
    """Return the period of the angular velocity in the body, s; infinite for a steady one."""
    return float(exact.period(exact.set_up(*moments, *w)))


def error_growth(times: np.ndarray, error: np.ndarray) -> dict[str, Any]:
    """Return how the largest error so far grows with time t: as a constant, t, t^2 or e^(t/tau), and its coefficient.

    Linear growth is that of a wrong rate, quadratic growth that of a torque or an integrator.
    """
    so_far = np.maximum.accumulate(error)
    at = np.unique(np.searchsorted(times, np.linspace(0.1, 1.0, GROWTH_POINTS) * times[-1]))
    t, logs = times[at], np.log(np.maximum(so_far[at], np.finfo(float).tiny))
    if len(at) < 4 or so_far[-1] < ROUNDING:
        return {"kind": "none"}
    slope = np.polyfit(t, logs, 1)[0]
    shapes = {"constant": 0.0 * t, "linear": np.log(t), "quadratic": 2 * np.log(t), "exponential": slope * t}
    left = {name: np.var(logs - shape) for name, shape in shapes.items()}
    left["exponential"] *= EXPONENTIAL_PENALTY
    kind = min(left, key=lambda name: left[name])
    if kind == "exponential":
        return {"kind": kind, "e_folding_time_s": float(1 / slope), "factor": float(np.exp(logs[-1] - logs[0]))}
    return {"kind": kind, "coefficient": float(np.exp(np.mean(logs - shapes[kind])))}


def dataset(judgement: Judgement) -> Dataset:
    """Return the errors over time and the exact motion in the principal axes; the attributes are those of `facts`."""
    import xarray as xr

    attributes = {name: value for name, value in facts(judgement).items() if value is not None}
    reference = judgement.reference
    q = None if reference.q is None else by_blocks(lambda q: q.as_quat(scalar_first=True), reference.q)
    columns = label_columns(reference.w, q, "exact motion")
    for name, error in judgement.errors.items():
        unit = UNITS[name].replace("relative", "1")
        columns[f"{name}_error"] = "time", error, {"units": unit, "long_name": LONG_NAMES[name]}
    return xr.Dataset(columns, {"time": time_axis(reference.times, "the first row")}, attributes)
