"""The motion at one point of a map, as a Dataset over time: from the closed form, and step by step beside it."""

import math
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import xarray as xr

from sweeps.schema.refusals import RefusedError

FORMATS = (".nc", ".csv")
MOST_ROTATIONS = 10_000
SAMPLES_PER_ROTATION = 32
LEAST_SAMPLES, MOST_SAMPLES = 400, 100_000


class MotionError(RefusedError):
    """What is wrong with a motion that was asked for; `str()` is the message for a person."""


def start(point: Mapping[str, float]) -> tuple[np.ndarray, np.ndarray]:
    """Moments and angular velocity at time 0 of a point of the rigid body.

    ω_a = ω0, ω_b = ε ω0 cos φ, ω_c = ε ω0 sin φ, with (a, b, c) cyclic and a the spin axis.

    Args:
        point: I1, I2, I3 (kg m2), axis, omega0 (rad s-1), epsilon, phase (rad).

    Returns:
        Moments, shape (3,), kg m2; angular velocity, shape (3,), rad s-1.
    """
    moments = np.array([point[f"I{i}"] for i in (1, 2, 3)], dtype=float)
    spin, nudge, phase = float(point["omega0"]), float(point["epsilon"]), float(point["phase"])
    a = int(point["axis"]) - 1
    omega = np.zeros(3)
    omega[[a, (a + 1) % 3, (a + 2) % 3]] = np.array([1.0, nudge * math.cos(phase), nudge * math.sin(phase)]) * spin
    return moments, omega


def _span(point: Mapping[str, float]) -> float:
    """Two flips, or two turns of the nudge, s; four rotations where neither ends within MOST_ROTATIONS."""
    from kernels import exact

    moments, omega = start(point)
    rotation = 2 * math.pi / np.abs(omega).max()
    flips = exact.max_tilt(*moments, *omega, int(point["axis"])) > 0.5 * math.pi
    span = (1 if flips else 2) * exact.period(*moments, *omega)
    return span if span <= MOST_ROTATIONS * rotation else 4 * rotation


def rigid_body(point: Mapping[str, float], duration: float | None, samples: int | None, tolerance: float) -> xr.Dataset:
    """ω(t) of a free rigid body from a point of a map.

    Args:
        point: I1, I2, I3 (kg m2), axis, omega0 (rad s-1), epsilon, phase (rad).
        duration: s; left out, two flips or two turns of the nudge, or four rotations where that takes over 10,000.
        samples: how many instants, both ends included; left out, 32 a rotation, 400 to 100,000.
        tolerance: of the direct integration, relative.

    Returns:
        Over `time` (s): omega1 … omega3 from the closed form, omega1_direct … omega3_direct step by step, rad s-1.
    """
    from kernels import direct, exact

    moments, omega = start(point)
    duration = _span(point) if duration is None else duration
    if samples is None:
        wanted = SAMPLES_PER_ROTATION * duration * np.abs(omega).max() / (2 * math.pi)
        samples = int(min(max(wanted, LEAST_SAMPLES), MOST_SAMPLES)) + 1
    times = np.linspace(0.0, duration, samples)
    closed = exact.rotation(moments, omega, times)
    stepped = direct.rotation(moments, omega, times, tolerance)
    ways = {"": (closed, "closed form"), "_direct": (stepped, "direct integration")}
    columns = {
        f"omega{i + 1}{suffix}": ("time", values[:, i], _attributes(i + 1, how))
        for suffix, (values, how) in ways.items()
        for i in range(3)
    }
    return xr.Dataset(columns, {"time": ("time", times, {"units": "s", "long_name": "time from the nudge"})})


def symmetric_top(point: Mapping[str, float], duration: float | None, samples: int | None) -> xr.Dataset:
    """ω(t) of a free symmetric top from a point of a map (closed form): arguments and result as `rigid_body`'s."""
    from kernels import symmetric_top as top

    ratio, spin = float(point["ratio"]), float(point["omega3"])
    rate = abs(float(top.precession_rate(ratio, spin)))
    rotation = 2 * math.pi / abs(spin)
    if duration is None:
        period = 2 * math.pi / rate if rate > 0 else math.inf
        duration = 2 * period if 2 * period <= MOST_ROTATIONS * rotation else 4 * rotation
    if samples is None:
        samples = int(min(max(SAMPLES_PER_ROTATION * duration / rotation, LEAST_SAMPLES), MOST_SAMPLES)) + 1
    times = np.linspace(0.0, duration, samples)
    omega = np.array([abs(spin) * math.tan(math.radians(float(point["half_angle"]))), 0.0, spin])
    values = top.rotation(ratio, omega, times)
    columns = {f"omega{i + 1}": ("time", values[:, i], _attributes(i + 1, "closed form")) for i in range(3)}
    return xr.Dataset(columns, {"time": ("time", times, {"units": "s", "long_name": "time from the start"})})


def _attributes(axis: int, how: str) -> dict[str, str]:
    return {"units": "rad s-1", "long_name": f"angular velocity about axis {axis} of the body, {how}"}


def of(system: str, point: Mapping[str, float], duration: float | None, samples: int | None, tolerance: float):
    """ω(t) at a point of a map of one of the systems that have one (see `rigid_body`).

    Raises:
        MotionError: for a system that has none, and for a duration or a number of samples out of range.
    """
    if duration is not None and not (math.isfinite(duration) and duration > 0):
        raise MotionError(f"--duration: {duration!r} is out of range; allowed: a finite number of seconds > 0")
    if samples is not None and not 2 <= samples <= 10_000_000:
        raise MotionError(f"--samples: {samples} is out of range; allowed: 2 to 10,000,000")
    if system == "rigid_body":
        return rigid_body(point, duration, samples, tolerance)
    if system == "symmetric_top":
        return symmetric_top(point, duration, samples)
    raise MotionError(f"--trajectory: {system} has no motion to write; allowed: maps of rigid_body and symmetric_top")


def check_format(path: str | Path) -> None:
    """Refuses a name that ends in none of `FORMATS`, before any work."""
    if Path(path).suffix not in FORMATS:
        raise MotionError(f"--trajectory: {str(path)!r} is of no known kind; allowed: a name in {' or '.join(FORMATS)}")


def write(motion: xr.Dataset, path: str | Path) -> None:
    """Writes a motion as netCDF or as CSV (with its units in the headings), whole or not at all."""
    from sweeps.files import replaced
    from sweeps.maps import storage

    check_format(path)
    if Path(path).suffix == ".nc":
        storage.write_part(motion, path, "point --trajectory")
        return
    names = ["time", *motion.data_vars]
    heading = ",".join(f"{name} ({motion[name].attrs['units']})" for name in names)
    with replaced(path) as temporary:
        table = np.column_stack([motion[name].values for name in names])
        np.savetxt(temporary, table, fmt="%.17g", delimiter=",", header=heading, comments="", encoding="utf-8")
