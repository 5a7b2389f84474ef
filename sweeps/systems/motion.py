"""Duration, sampling and columns that the motions of all systems share."""

import math
from collections.abc import Mapping

import numpy as np

from sweeps.schema.refusals import DefinitionError, RefusedError, display

MOST_ROTATIONS = 10_000
MOST_STEPPED = 1e6  # rotations: nearly a minute step by step
SAMPLES_PER_ROTATION = 32
LEAST_SAMPLES, MOST_SAMPLES = 400, 100_000
TOLERANCES = (1e-13, 1e-3)
HOUR, DAY = 3600.0, 86_400.0
YEAR = 365.25 * DAY
PARTS = ("scalar part", "vector part along axis 1", "vector part along axis 2", "vector part along axis 3")
LAID = "unit quaternion, scalar first, from the body's axes to axes fixed in space, which are the body's at time 0"


class MotionError(RefusedError):
    """A requested motion is refused; `str()` is the whole message."""


def span(whole: float, rotation: float) -> float:
    """Return the duration (s) of a motion to be shown: a whole period, or four rotations where it is too long."""
    return whole if whole <= MOST_ROTATIONS * rotation else 4 * rotation


def instants(duration: float, samples: int | None, rotation: float) -> np.ndarray:
    """Return times from 0 to `duration`, both included: `samples` of them, or 32 per rotation, 400 to 100,000."""
    if samples is None:
        wanted = SAMPLES_PER_ROTATION * duration / rotation if math.isfinite(duration) else MOST_SAMPLES
        samples = int(min(max(wanted, LEAST_SAMPLES), MOST_SAMPLES)) + 1
    return np.linspace(0.0, duration, samples)


def ascending(times) -> np.ndarray:
    """Return times, s, ascending; refuse others."""
    try:
        is_known = np.asarray(times).dtype.kind not in "mM" and not np.ma.is_masked(times)  # dates have their own unit
        times = np.asarray(times if is_known else (), dtype=np.float64)
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


def time(values: np.ndarray, since: str) -> tuple:
    """Return the coordinate `time`, counted from `since`."""
    return "time", values, {"units": "s", "long_name": f"time from {since}"}


def angular_velocity(axis: int, how: str) -> dict[str, str]:
    """Return the attributes of one component of the angular velocity in the body."""
    return {"units": "rad s-1", "long_name": f"angular velocity about axis {axis} of the body, {how}"}


def as_columns(rates: np.ndarray, attitude: np.ndarray, how: str, suffix: str = "") -> dict[str, tuple]:
    """Return omega1 … omega3 (n, 3) and q0 … q3 (n, 4) over `time`; `how` says in words how they are computed."""
    columns = {f"omega{i}{suffix}": ("time", one, angular_velocity(i, how)) for i, one in enumerate(rates.T, 1)}
    for i, (part, one) in enumerate(zip(PARTS, attitude.T, strict=True)):
        words = {"units": "1", "long_name": f"attitude, {part}, {how}", "comment": LAID}
        columns[f"q{i}{suffix}"] = ("time", one, words)
    return columns


def rotated(q: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """Return vectors (…, 3) along a body's axes turned by attitudes q (…, 4): v + 2 q0 u×v + 2 u×(u×v), u = q[1:]."""
    once = np.cross(q[..., 1:], vectors)
    return vectors + 2.0 * (q[..., :1] * once + np.cross(q[..., 1:], once))


def columns(moments, omega, times, tolerance: float) -> dict[str, tuple]:
    """Return omega1 … omega3 and q0 … q3 over `time`, in closed form and (suffix _direct) by direct integration."""
    from kernels import direct, exact

    moments = np.asarray(moments)
    rotations = np.abs(omega).max() * np.abs(times).max() / (2 * np.pi)
    if rotations > MOST_STEPPED:
        raise MotionError(f"times: the body rotates {rotations:.3g} times; allowed: {MOST_STEPPED:g} times")
    way = exact.rotation(moments, omega, times), exact.attitude(moments, omega, times)
    step = direct.rotation(moments, omega, times, tolerance), direct.attitude(moments, omega, times, tolerance)
    return as_columns(*way, "closed form") | as_columns(*step, "direct integration", "_direct")


def check_finite(columns: Mapping[str, tuple]) -> None:
    """Refuse a motion that doubles cannot hold; name → (dimensions, values, …)."""
    for name, (_, values, *_) in columns.items():
        if not np.isfinite(values).all():
            allowed = "a point whose numbers and their products are within 1e±300"
            raise MotionError(f"motion: {name} is not finite; allowed: {allowed}")


def duration(seconds: float) -> str:
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
