"""Duration, sampling and columns that the motions of all systems share."""

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from sweeps.schema.refusals import DefinitionError, RefusedError, display

MAX_ROTATIONS = 10_000  # longest period that is shown whole, in rotations; longer periods cost seconds and look solid
MAX_DIRECT_ROTATIONS = 1e6  # longest direct integration, in rotations: it takes nearly a minute
SAMPLES_PER_ROTATION = 32
MIN_SAMPLES, MAX_SAMPLES = 400, 100_000  # bounds on the number of instants of a motion, if the user gives none
TOLERANCES = (1e-13, 1e-3)
HOUR, DAY = 3600.0, 86_400.0
YEAR = 365.25 * DAY
QUATERNION_PARTS = ("scalar part", "vector part along axis 1", "vector part along axis 2", "vector part along axis 3")
ATTITUDE_CONVENTION = "unit quaternion, scalar first, from the body's axes to axes fixed in space"
UNROTATED = (1.0, 0.0, 0.0, 0.0)  # quaternion of no rotation


class MotionError(RefusedError):
    """A requested motion is refused; `str()` is the whole message."""


class BodyFrame(NamedTuple):
    """Axes of the body in which a motion is given, and the attitude of these axes at time 0."""

    name: str = "body"  #: owner of the axes: "body" for the principal axes, "tensor" or "mesh"
    principal_axes: np.ndarray = np.eye(3)  #: rotation matrix: row i is principal axis i in these axes
    start: tuple[float, float, float, float] = UNROTATED  #: unit quaternion at time 0, from these axes to space


PRINCIPAL = BodyFrame()


def motion_span(period: float, rotation: float) -> float:
    """Return the duration of a motion to be shown, s: a whole period, or four rotations if it is too long."""
    return period if period <= MAX_ROTATIONS * rotation else 4 * rotation


def sample_times(duration: float, samples: int | None, rotation: float) -> np.ndarray:
    """Return times from 0 to `duration`, both included: `samples` of them, or 32 per rotation, 400 to 100,000."""
    if samples is None:
        num_intervals = SAMPLES_PER_ROTATION * duration / rotation if math.isfinite(duration) else MAX_SAMPLES
        samples = int(min(max(num_intervals, MIN_SAMPLES), MAX_SAMPLES)) + 1
    return np.linspace(0.0, duration, samples)


def check_times(times) -> np.ndarray:
    """Return times, s, ascending; refuse all further values."""
    try:
        is_number = np.asarray(times).dtype.kind not in "mM" and not np.ma.is_masked(times)  # dates have their own unit
        times = np.asarray(times if is_number else (), dtype=np.float64)
    except (TypeError, ValueError):
        times = np.empty(0)
    if times.ndim != 1 or times.size < 2 or not np.isfinite(times).all() or not (np.diff(times) > 0).all():
        raise DefinitionError("times: allowed: two finite numbers at least, each larger than the one before, in s")
    return times


def check_tolerance(tolerance) -> None:
    """Refuse a tolerance that is no number within TOLERANCES."""
    is_number = isinstance(tolerance, int | float) and not isinstance(tolerance, bool)
    if not is_number or not TOLERANCES[0] <= tolerance <= TOLERANCES[1]:
        raise DefinitionError(f"tolerance: {display(tolerance)}; allowed: {TOLERANCES[0]:g} to {TOLERANCES[1]:g}")


def time_axis(values: np.ndarray, since: str) -> tuple:
    """Return the coordinate `time`, counted from `since`."""
    return "time", values, {"units": "s", "long_name": f"time from {since}"}


def angular_velocity(axis: int, how: str, frame: BodyFrame = PRINCIPAL) -> dict[str, str]:
    """Return the attributes of one component of the angular velocity in the body."""
    return {"units": "rad s-1", "long_name": f"angular velocity about axis {axis} of the {frame.name}, {how}"}


def label_columns(
    rates: np.ndarray, attitude: np.ndarray | None, how: str, suffix: str = "", frame: BodyFrame = PRINCIPAL
) -> dict[str, tuple]:
    """Return the columns omega1 … omega3 and q0 … q3 over `time`.

    Args:
        rates: angular velocity in the principal axes, rad/s, shape (n, 3).
        attitude: unit quaternions from the principal axes to those at time 0, shape (n, 4); None for none.
        how: words for the method of computation.
        suffix: end of the columns' names.
        frame: axes of the columns. A vector v of principal components has the components Rᵀ v there, with R the
            principal axes, and so has the vector part of a rotation's quaternion.
    """
    if frame is not PRINCIPAL:
        rates = rates @ frame.principal_axes
    columns = {
        f"omega{i}{suffix}": ("time", values, angular_velocity(i, how, frame)) for i, values in enumerate(rates.T, 1)
    }
    if attitude is None:
        return columns
    if frame is not PRINCIPAL:
        vector_parts = attitude[:, 1:] @ frame.principal_axes
        attitude = multiply(np.array(frame.start), np.column_stack([attitude[:, 0], vector_parts]))
    convention = ATTITUDE_CONVENTION.replace("body's", f"{frame.name}'s")
    if frame.start == UNROTATED:
        convention += f", which are the {frame.name}'s at time 0"
    for i, (part_name, values) in enumerate(zip(QUATERNION_PARTS, attitude.T, strict=True)):
        words = {"units": "1", "long_name": f"attitude, {part_name}, {how}", "comment": convention}
        columns[f"q{i}{suffix}"] = ("time", values, words)
    return columns


def multiply(p: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Return the products p q of quaternions, scalar first, (…, 4): p0 q0 − p·q, p0 q + q0 p + p × q."""
    p0, p1, p2, p3 = np.moveaxis(p, -1, 0)
    q0, q1, q2, q3 = np.moveaxis(q, -1, 0)
    return np.stack(
        [
            p0 * q0 - p1 * q1 - p2 * q2 - p3 * q3,
            p0 * q1 + p1 * q0 + p2 * q3 - p3 * q2,
            p0 * q2 - p1 * q3 + p2 * q0 + p3 * q1,
            p0 * q3 + p1 * q2 - p2 * q1 + p3 * q0,
        ],
        axis=-1,
    )


def rotate_vectors(q: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """Return vectors (…, 3) of a body rotated by attitudes q (…, 4): v + 2 q0 u×v + 2 u×(u×v), u = q[1:]."""
    cross = np.cross(q[..., 1:], vectors)
    return vectors + 2.0 * (q[..., :1] * cross + np.cross(q[..., 1:], cross))


def attitude_columns(moments, omega, times, tolerance: float, frame: BodyFrame = PRINCIPAL) -> dict[str, tuple]:
    """Return omega1 … omega3 and q0 … q3 over `time`, in closed form and (suffix _direct) by direct integration.

    Args:
        moments: principal moments of inertia, shape (3,).
        omega: angular velocity at time 0 in the principal axes, rad/s, shape (3,).
        times: instants, s, shape (n,).
        tolerance: relative truncation error of the direct integration.
        frame: axes of the columns.
    """
    from kernels.free import direct, exact

    moments = np.asarray(moments)
    rotations = np.abs(omega).max() * np.abs(times).max() / (2 * np.pi)
    if rotations > MAX_DIRECT_ROTATIONS:
        raise MotionError(f"times: the body rotates {rotations:.3g} times; allowed: {MAX_DIRECT_ROTATIONS:g} times")
    closed = exact.rotation(moments, omega, times), exact.attitude(moments, omega, times)
    direct_way = direct.rotation(moments, omega, times, tolerance), direct.attitude(moments, omega, times, tolerance)
    return label_columns(*closed, "closed form", "", frame) | label_columns(
        *direct_way, "direct integration", "_direct", frame
    )


def check_finite(columns: Mapping[str, tuple]) -> None:
    """Refuse a motion with a value that is not finite; `columns` is name → (dimensions, values, …)."""
    for name, (_, values, *_) in columns.items():
        if not np.isfinite(values).all():
            allowed = "a point whose numbers and their products are within 1e±300"
            raise MotionError(f"motion: {name} is not finite; allowed: {allowed}")


def format_span(seconds: float) -> str:
    """Return a time span in a suitable unit: "0.853 s", "7.29 hours", "303.7 days", "never"."""
    if math.isinf(seconds):
        return "never"
    if seconds < 2 * HOUR:
        return f"{seconds:.4g} s"
    if seconds < 2 * DAY:
        return f"{seconds / HOUR:.4g} hours"
    days = seconds / DAY
    text = f"{days:,.0f} days" if 1000 <= days < 1e7 else f"{days:.4g} days"
    return text if days < 1000 else f"{text} ({seconds / YEAR:.4g} years)"
