"""Motions for the library and the command line: of a described system, of a free body, and of a point of a map."""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from sweeps.maps import motion as files
from sweeps.schema import units
from sweeps.schema.refusals import DefinitionError, display

if TYPE_CHECKING:
    import xarray as xr

    from sweeps.systems.rigid_body.definition import SpunBody

SPIN = ("axis", "omega0", "epsilon", "phase")
RATES = ("omega1", "omega2", "omega3")
STARTS = f"three angular velocities, or a mapping with {', '.join(SPIN)}, or with {', '.join(RATES)}"
FILMS = (".gif", ".mp4", ".webm")


def motion_of(system: Any, start: Any, times: Any, parameters: Mapping, tolerance: float) -> "xr.Dataset":
    """Return a motion; see `sweeps.motion`."""
    from sweeps.systems import trajectories

    if hasattr(system, "data_vars"):
        return of_point(system, times, tolerance)
    if trajectories.is_described(system) or (isinstance(system, str) and not _is_body(system)):
        return trajectories.trajectories(system, start or {}, [] if times is None else times, parameters, tolerance)
    return of_body(system, start, times, tolerance)


def tolerance_of(row: "xr.Dataset") -> float:
    """Return the tolerance of the integration that made a map, 1e-10 where it states none."""
    from sweeps.reading.definitions import definition_of

    integration = definition_of(row.attrs).get("integration")
    tolerance = integration.get("tolerance") if isinstance(integration, dict) else None
    return tolerance if isinstance(tolerance, float) and 1e-13 <= tolerance <= 1e-3 else 1e-10


def _is_body(text: str) -> bool:
    from sweeps.views.one_body import bodies

    return any(text.strip().lower() in name.lower() for name in bodies("bodies"))


def of_point(row: "xr.Dataset", duration: Any, tolerance: float, samples: int | None = None) -> "xr.Dataset":
    """Return the motion at a point of a map over a duration (s), with the map's provenance."""
    from sweeps import systems

    point = {name: row[name].item() for name in row.coords if row[name].ndim == 0}
    duration = None if duration is None else _quantity("duration", duration, "s")
    moved = files.of(systems.of_map(row), point, duration, samples, tolerance)
    kept = {name: row.attrs.get(name, "") for name in ("title", "source", "Conventions", "kernel_fingerprint")}
    return moved.assign_attrs(kept | {"point": ", ".join(f"{name} = {value}" for name, value in point.items())})


def of_body(
    body: Any, start: Any, times: Any, tolerance: float, definition: str = "bodies", samples: int | None = None
) -> "xr.Dataset":
    """Return the motion of a free rigid body from any start, in closed form and by direct integration.

    Args:
        body: as `sweeps.body` takes it.
        start: as `sweeps.motion` takes it.
        times: instants, the first of which is the start, or a duration (s, "2 min"); None for what shows the motion.
        tolerance: of the direct integration, relative.
        definition: the definition that lists a body by its name.
        samples: number of instants of a duration; left out, 32 a rotation, 400 to 100,000.
    """
    import xarray as xr

    from sweeps.systems import trajectories
    from sweeps.systems.bodies import attitude
    from sweeps.systems.motion import instants, time
    from sweeps.systems.rigid_body import motion
    from sweeps.views.one_body import body_of

    given = dict(start if isinstance(start, Mapping) else zip(RATES, () if start is None else start, strict=False))
    spinning = {name: value for name, value in given.items() if name in SPIN}
    if set(given) - {*SPIN, *RATES} or (spinning and len(spinning) < len(given)):
        raise DefinitionError(f"start: {display(start)}; allowed: {STARTS}")
    found, spun = body_of(body, definition, {name: value for name, value in spinning.items() if name != "axis"})
    moments = np.array(found.moments)
    if len(given) > len(spinning):
        omega = np.array([_quantity(f"start.{name}", given.get(name, 0.0), "rad s-1") for name in RATES])
        if not omega.any():
            raise DefinitionError("start: the body is at rest; allowed: an angular velocity other than 0")
    else:
        axis = spinning.get("axis", found.axis or int(np.argsort(moments, kind="stable")[1]) + 1)
        if axis not in (1, 2, 3):
            raise DefinitionError(f"start.axis: {display(axis)}; allowed: 1, 2 or 3")
        point = dict(zip(("I1", "I2", "I3"), moments, strict=True)) | spun | {"axis": axis}
        _, omega = motion.start(point)
    rotation = 2 * math.pi / float(np.abs(omega).max())
    whole = motion.span_of(moments, omega, rotation)
    if times is None or np.ndim(times) == 0:
        duration = whole if times is None else _quantity("times", times, "s")
        if not (math.isfinite(duration) and duration > 0):
            raise DefinitionError(f"times: {display(times)}; allowed: instants, or a duration > 0, in s")
        at = instants(duration, samples, rotation)
    else:
        at = trajectories.instants(times)
    with np.errstate(all="ignore"):
        columns = attitude.columns(moments, omega, at - at[0], tolerance)
    files.check_finite(columns)
    fixed = {name: ((), value, {"units": "kg m2"}) for name, value in zip(("I1", "I2", "I3"), moments, strict=True)}
    return xr.Dataset(columns, {"time": time(at, "the start")} | fixed, {"title": found.name} | _outline(found))


def _outline(body: "SpunBody") -> dict[str, str]:
    """The surface of a body that is a mesh, as maps carry it."""
    from sweeps.systems.bodies import outline

    return {"outlines": outline.written({body.name: body.solid.surface})} if body.solid is not None else {}


def _quantity(where: str, value: Any, unit: str) -> float:
    """Return a number from a number, or from text with a unit."""
    try:
        found = float(units.number(value, unit))
    except (TypeError, ValueError):
        found = math.nan
    if not math.isfinite(found):
        raise DefinitionError(f"{where}: {display(value)}; allowed: a finite number, in one of {units.allowed(unit)}")
    return found


def write(motion: "xr.Dataset", path: str | Path) -> None:
    """Write a motion as netCDF, CSV, GIF, MP4 or WebM, by the suffix of the file's name."""
    if Path(path).suffix not in FILMS:
        files.write(motion, path)
        return
    from sweeps.figure import style
    from sweeps.systems.rigid_body.presentation import figure_flip
    from sweeps.views import films

    with style.drawn_for(style.ITS_OWN), films.drawn_for(path):
        films.write(figure_flip.film(motion), path)


def check_name(path: str | Path) -> None:
    """Refuse a file name whose suffix says no format, before anything is computed."""
    from sweeps.views import films

    files.check_format(path, (*files.FORMATS, *FILMS))
    if (kind := Path(path).suffix[1:]) in films.KINDS:
        films.refuse_unless_made(kind, ("motion",))
