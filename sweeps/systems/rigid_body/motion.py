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
from sweeps.systems.motion import attitude_columns, check_finite, check_times, check_tolerance, sample_times, time_axis
from sweeps.systems.rigid_body.system import SpunBody, initial_state, span_of

SPIN = ("axis", "omega0", "epsilon", "phase")
RATES = ("omega1", "omega2", "omega3")
STARTS = f"three angular velocities, or a mapping with {', '.join(SPIN)}, or with {', '.join(RATES)}"


def spin_of(start: Any) -> dict[str, Any]:
    """Return the axis, spin rate and perturbation in a start as `sweeps.motion` takes it; {} for angular velocities."""
    values = _start_values(start)
    if not (values.keys() <= {*SPIN} or values.keys() <= {*RATES}):
        raise DefinitionError(f"start: {display(start)}; allowed: {STARTS}")
    return {name: value for name, value in values.items() if name in SPIN}


def _start_values(start: Any) -> dict[str, Any]:
    if start is None or hasattr(start, "keys"):
        return {} if start is None else dict(start)
    if isinstance(start, list | tuple | np.ndarray) and np.shape(start) == (3,):
        return dict(zip(RATES, start, strict=True))
    raise DefinitionError(f"start: {display(start)}; allowed: {STARTS}")


def integrate_from(
    body: SpunBody, spun: Mapping[str, float], start: Any, times: Any, tolerance: float, samples: int | None = None
) -> Dataset:
    """Return the motion of a free rigid body from any start, in closed form and by direct integration.

    Args:
        body: the body.
        spun: omega0, epsilon and phase of a start about an axis.
        start: initial state, as for `sweeps.motion`.
        times: instants, beginning at the start; or a duration (s, "2 min"); None for one that shows the motion.
        tolerance: relative truncation error of the integration.
        samples: number of instants of a duration; left out, 32 per rotation, from 400 to 100,000.
    """
    import xarray as xr

    check_tolerance(tolerance)
    moments, omega = np.array(body.moments), _omega(body, spun, start)
    rotation = 2 * math.pi / float(np.abs(omega).max())
    if times is None or np.ndim(times) == 0:
        duration = span_of(moments, omega, rotation) if times is None else parse_amount("times", times, "s")
        if not (math.isfinite(duration) and duration > 0):
            raise DefinitionError(f"times: {display(times)}; allowed: instants, or a duration > 0, in s")
        at = sample_times(duration, samples, rotation)
    else:
        at = check_times(times)
    with np.errstate(all="ignore"):
        variables = attitude_columns(moments, omega, at - at[0], tolerance)
    check_finite(variables)
    fixed = {name: ((), value, {"units": "kg m2"}) for name, value in zip(MOMENTS, moments, strict=True)}
    surface = {"outlines": outline.format_outlines({body.name: body.solid.surface})} if body.solid is not None else {}
    return xr.Dataset(variables, {"time": time_axis(at, "the start")} | fixed, {"title": body.name} | surface)


def _omega(body: SpunBody, spun: Mapping[str, float], start: Any) -> np.ndarray:
    start, spin = _start_values(start), spin_of(start)
    if start and not spin:
        omega = np.array([parse_amount(f"start.{name}", start.get(name, 0.0), "rad s-1") for name in RATES])
        if not omega.any():
            raise DefinitionError("start: the body is at rest; allowed: an angular velocity other than 0")
        return omega
    axis = spin.get("axis", body.axis or int(np.argsort(body.moments, kind="stable")[1]) + 1)
    if np.ndim(axis) or axis not in (1, 2, 3):
        raise DefinitionError(f"start.axis: {display(axis)}; allowed: 1, 2 or 3")
    return initial_state(dict(zip(MOMENTS, body.moments, strict=True)) | spun | {"axis": axis})[1]
