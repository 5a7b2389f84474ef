"""The motion at one point of a map, computed by its system and written to a file."""

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from sweeps import systems
from sweeps.process.files import replace_output
from sweeps.reading import attitude_files
from sweeps.reading.definitions import definition_of
from sweeps.schema.variables import parse_amount
from sweeps.shards.mapfile import write_part
from sweeps.systems.motion import MotionError, check_finite

FORMATS = (".nc", ".csv", ".aem")


def check_length(duration: float | None, samples: int | None) -> None:
    """Refuse a duration (s) or a number of samples that no motion can have."""
    if duration is not None and not (math.isfinite(duration) and duration > 0):
        raise MotionError(f"duration: {duration!r} is out of range; allowed: a finite number of seconds > 0")
    if samples is not None and not 2 <= samples <= 10_000_000:
        raise MotionError(f"samples: {samples} is out of range; allowed: 2 to 10,000,000")


def point_motion(row: xr.Dataset, duration: Any, tolerance: float, samples: int | None = None) -> xr.Dataset:
    """Return the motion at a point of a map, with the map's provenance.

    Args:
        row: the point, of `sweeps.point`.
        duration: s, a number or text with a unit; None for the system's default.
        tolerance: of the integration.
        samples: number of samples; None for the system's default.

    Raises:
        MotionError: if the system has no motion at its points, or it is not finite.
    """
    system, point = systems.of_map(row), {name: row[name].item() for name in row.coords if row[name].ndim == 0}
    duration = None if duration is None else parse_amount("duration", duration, "s")
    check_length(duration, samples)
    with np.errstate(all="ignore"):
        motion = system.motion(point, duration, samples, tolerance)
    if motion is None:
        allowed = " and ".join(systems.systems_with_motion())
        raise MotionError(f"motion: {system.name} has none at its points; allowed: maps of {allowed}")
    check_finite({str(name): (variable.dims, variable.values) for name, variable in motion.variables.items()})
    provenance = {name: row.attrs.get(name, "") for name in ("title", "source", "Conventions", "kernel_fingerprint")}
    return motion.assign_attrs(provenance | {"point": ", ".join(f"{name} = {value}" for name, value in point.items())})


def map_tolerance(row: xr.Dataset) -> float:
    """Return the tolerance of the integration that made a map, 1e-10 if it has none."""
    integration = definition_of(row.attrs).get("integration")
    tolerance = integration.get("tolerance") if isinstance(integration, dict) else None
    return tolerance if isinstance(tolerance, float) and 1e-13 <= tolerance <= 1e-3 else 1e-10


def check_format(path: str | Path, formats: tuple[str, ...] = FORMATS) -> None:
    """Refuse a file name that does not end in one of the suffixes `formats`."""
    if Path(path).suffix not in formats:
        raise MotionError(f"{str(path)!r} has an unknown format; allowed: a name ending in {' or '.join(formats)}")


def write_motion(motion: xr.Dataset, path: str | Path) -> None:
    """Write a motion as netCDF, CSV (with its units in the headings) or CCSDS AEM, complete or not at all."""
    check_format(path)
    if Path(path).suffix == ".nc":
        write_part(motion, path, "motion")
        return
    if Path(path).suffix == ".aem":
        lines = _attitude_message(motion)
        with replace_output(path) as temporary, open(temporary, "w", encoding="ascii") as file:
            file.writelines(f"{line}\n" for line in lines)
        return
    names = ["time", *(name for name in motion.data_vars if motion[name].dims == ("time",))]
    heading = ",".join(f"{name} ({motion[name].attrs['units']})" for name in names)
    with replace_output(path) as temporary:
        table = np.column_stack([motion[name].values for name in names])
        np.savetxt(temporary, table, fmt="%.17g", delimiter=",", header=heading, comments="", encoding="utf-8")


def _attitude_message(motion: xr.Dataset) -> Iterator[str]:
    """Return the lines of an attitude ephemeris message of the motion of a free body, its scalars as comments."""
    if missing := {"q0", "omega1"} - {*motion.data_vars}:
        allowed = "attitude and angular velocity of a body; of other motions .nc and .csv"
        raise MotionError(f"motion: has no {' and no '.join(sorted(missing))} for a .aem file; allowed: {allowed}")
    if motion.time[-1] >= attitude_files.LAST_SECOND:
        allowed = f"a duration below {attitude_files.LAST_SECOND:.3g} s, up to the year 9999"
        raise MotionError(f"motion: ends after {motion.time[-1].item():g} s; allowed in a .aem file: {allowed}")
    rates = np.column_stack([motion[f"omega{i}"] for i in (1, 2, 3)])
    rates = rates if motion["omega1"].attrs["units"] == "deg s-1" else np.degrees(rates)
    scalars = [(name, float(x), x.attrs["units"]) for name, x in motion.variables.items() if not x.ndim]
    frame = motion.attrs.get("frame", "principal axes of the body")
    axes = f"SC_BODY_1: {frame}; EME2000: inertial axes" + ", those of the body at the start" * bool(motion.q0[0] == 1)
    comments = [axes, *(f"{name} = {value:.17g} {unit}" for name, value, unit in scalars)]
    title = motion.attrs.get("title", "").encode("ascii", "replace").decode() or "BODY"
    q = np.column_stack([motion[f"q{i}"] for i in range(4)])
    return attitude_files.message_lines(title, motion["time"].values, q, rates, comments)
