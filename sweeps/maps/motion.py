"""The motion at one point of a map, as its system computes it, into a file."""

import math
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import xarray as xr

from sweeps import systems
from sweeps.maps import parts
from sweeps.process.files import replaced
from sweeps.schema.refusals import RefusedError

FORMATS = (".nc", ".csv")


class MotionError(RefusedError):
    """What is wrong with a motion that was asked for; `str()` is the message for a person."""


def of(
    system: systems.Dynamics, point: Mapping[str, float], duration: float | None, samples: int | None, tolerance: float
) -> xr.Dataset:
    """Return the motion at a point of a map (see `sweeps.systems.Dynamics.motion`).

    Raises:
        MotionError: for a system that has none, for a duration or a number of samples out of range, and for a motion
            that doubles cannot hold.
    """
    if duration is not None and not (math.isfinite(duration) and duration > 0):
        raise MotionError(f"duration: {duration!r} is out of range; allowed: a finite number of seconds > 0")
    if samples is not None and not 2 <= samples <= 10_000_000:
        raise MotionError(f"samples: {samples} is out of range; allowed: 2 to 10,000,000")
    with np.errstate(all="ignore"):
        found = system.motion(point, duration, samples, tolerance)
    if found is None:
        allowed = f"maps of {' and '.join(systems.moving())}"
        raise MotionError(f"motion: {system.name} has none at its points; allowed: {allowed}")
    check_finite({name: (one.dims, one.values) for name, one in found.variables.items()})
    return found


def check_finite(columns: Mapping[str, tuple]) -> None:
    """Refuse a motion that doubles cannot hold; name → (dimensions, values, …)."""
    for name, (_, values, *_) in columns.items():
        if not np.isfinite(values).all():
            allowed = "a point whose numbers and their products are within 1e±300"
            raise MotionError(f"motion: {name} is not finite; allowed: {allowed}")


def check_format(path: str | Path, formats: tuple[str, ...] = FORMATS) -> None:
    """Refuse a file name that ends in none of some suffixes."""
    if Path(path).suffix not in formats:
        raise MotionError(f"{str(path)!r} has an unknown format; allowed: a name ending in {' or '.join(formats)}")


def write(motion: xr.Dataset, path: str | Path) -> None:
    """Write a motion as netCDF or as CSV (with its units in the headings), complete or not at all."""
    check_format(path)
    if Path(path).suffix == ".nc":
        parts.write_part(motion, path, "motion")
        return
    names = ["time", *(name for name in motion.data_vars if motion[name].dims == ("time",))]
    heading = ",".join(f"{name} ({motion[name].attrs['units']})" for name in names)
    with replaced(path) as temporary:
        table = np.column_stack([motion[name].values for name in names])
        np.savetxt(temporary, table, fmt="%.17g", delimiter=",", header=heading, comments="", encoding="utf-8")
