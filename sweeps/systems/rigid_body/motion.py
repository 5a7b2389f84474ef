"""Motion of a rigid body from any start, in closed form and by direct integration."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from sweeps.schema.datasets import Dataset
from sweeps.schema.refusals import DefinitionError, display
from sweeps.schema.variables import parse_amount
from sweeps.systems.bodies import outline
from sweeps.systems.bodies.variables import MOMENTS
from sweeps.systems.motion import (
    PRINCIPAL,
    UNROTATED,
    BodyFrame,
    attitude_columns,
    check_finite,
    check_times,
    check_tolerance,
    sample_times,
    time_axis,
)
from sweeps.systems.rigid_body.system import SpunBody, initial_state, span_of

SPIN = ("axis", "omega0", "epsilon", "phase")
RATES = ("omega1", "omega2", "omega3")
FRAMES = {"body": "principal axes of the body"}
FRAMES |= {owner: f"axes of the {owner}" for owner in ("tensor", "mesh", "file")}
STARTS = f"three angular velocities, or a mapping with {', '.join(SPIN)}, or with {', '.join(RATES)}, and attitude"
MAX_NORM_ERROR = 1e-3  # largest distance of a quaternion's norm from 1: three decimals are enough


def spin_of(start: Any) -> dict[str, Any]:
    """Return the axis, spin rate and perturbation in a start as `sweeps.motion` takes it; {} for angular velocities."""
    values = _start_values(start)
    if not (values.keys() <= {*SPIN} or values.keys() <= {*RATES}):
        raise DefinitionError(f"start: {display(start)}; allowed: {STARTS}")
    return {name: value for name, value in values.items() if name in SPIN}


def _start_values(start: Any) -> dict[str, Any]:
    """Return the values of a start but for the attitude."""
    if start is None or hasattr(start, "keys"):
        return {} if start is None else {name: value for name, value in dict(start).items() if name != "attitude"}
    if isinstance(start, list | tuple | np.ndarray) and np.shape(start) == (3,):
        return dict(zip(RATES, start, strict=True))
    raise DefinitionError(f"start: {display(start)}; allowed: {STARTS}")


def _start_attitude(start: Any) -> tuple[float, float, float, float]:
    """Return the unit quaternion of a start, from the body's axes to space; that of no rotation if it has none."""
    value = start.get("attitude") if hasattr(start, "get") else None
    if value is None:
        return UNROTATED
    parts = [parse_amount("start.attitude", part, "1") for part in (value if np.ndim(value) == 1 else ())]
    norm = math.hypot(*parts)
    if len(parts) != 4 or not abs(norm - 1.0) <= MAX_NORM_ERROR:
        allowed = "four numbers, a unit quaternion, scalar first, from the body's axes to space"
        raise DefinitionError(f"start.attitude: {display(value)}; allowed: {allowed}")
    return tuple(part / norm for part in parts)


def frame_of(body: SpunBody) -> BodyFrame:
    """Return the axes in which the body's vectors are given: those of its tensor or mesh, or its principal axes."""
    return PRINCIPAL if body.principal is None else BodyFrame(body.frame, np.array(body.principal.axes))


def integrate_from(
    body: SpunBody, spun: Mapping[str, float], start: Any, times: Any, tolerance: float, samples: int | None = None
) -> Dataset:
    """Return the motion of a free rigid body from any start, in closed form and by direct integration.

    Args:
        body: the body; angular velocity and attitude are in the axes of its tensor or mesh if it has one, otherwise in
            its principal axes.
        spun: omega0, epsilon and phase of a start about an axis.
        start: initial state, as for `sweeps.motion`.
        times: instants, beginning at the start; or a duration (s, "2 min"); None for a duration that shows the motion.
        tolerance: relative truncation error of the integration.
        samples: number of instants of a duration; left out, 32 per rotation, from 400 to 100,000.
    """
    import xarray as xr

    check_tolerance(tolerance)
    moments, frame = np.array(body.moments), frame_of(body)._replace(start=_start_attitude(start))
    omega = _omega(body, spun, start)
    rotation = 2 * math.pi / float(np.abs(omega).max())
    if times is None or np.ndim(times) == 0:
        duration = span_of(moments, omega, rotation) if times is None else parse_amount("times", times, "s")
        if not (math.isfinite(duration) and duration > 0):
            raise DefinitionError(f"times: {display(times)}; allowed: instants, or a duration > 0, in s")
        at = sample_times(duration, samples, rotation)
    else:
        at = check_times(times)
    with np.errstate(all="ignore"):
        variables = attitude_columns(moments, omega, at - at[0], tolerance, frame)
    check_finite(variables)
    body_variables = {name: ((), value, {"units": "kg m2"}) for name, value in zip(MOMENTS, moments, strict=True)}
    surface = {"outlines": outline.format_outlines({body.name: body.solid.surface})} if body.solid is not None else {}
    words = {"long_name": f"principal axes, a row each, in the axes of the {frame.name}"}
    body_variables["principal_axes"] = (("principal_axis", "component"), frame.principal_axes, words)
    attributes = {"title": body.name, "frame": FRAMES[frame.name]} | surface
    return xr.Dataset(variables, {"time": time_axis(at, "the start")} | body_variables, attributes)


def _omega(body: SpunBody, spun: Mapping[str, float], start: Any) -> np.ndarray:
    """Return the angular velocity at the start in the principal axes, rad/s."""
    start, spin = _start_values(start), spin_of(start)
    if start and not spin:
        omega = np.array([parse_amount(f"start.{name}", start.get(name, 0.0), "rad s-1") for name in RATES])
        if not omega.any():
            raise DefinitionError("start: the body is at rest; allowed: an angular velocity other than 0")
        return frame_of(body).principal_axes @ omega
    axis = spin.get("axis", body.axis or int(np.argsort(body.moments, kind="stable")[1]) + 1)
    if np.ndim(axis) or axis not in (1, 2, 3):
        raise DefinitionError(f"start.axis: {display(axis)}; allowed: 1, 2 or 3")
    return initial_state({**dict(zip(MOMENTS, body.moments, strict=True)), **spun, "axis": axis})[1]
