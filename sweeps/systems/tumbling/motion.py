"""The motion of one tumbling body: angular velocity and attitude."""

import math
from collections.abc import Mapping

import numpy as np
import xarray as xr

from kernels import exact, tumbling
from sweeps.systems.bodies.attitude import motion_of
from sweeps.systems.motion import span


def start(point: Mapping[str, float]) -> tuple[np.ndarray, np.ndarray]:
    """Return moments (ascending, kg m2) and angular velocity at time 0 (rad s-1) of a point: L = I3 omega0, w2 = 0."""
    moments = np.sort([float(point[f"I{i}"]) for i in (1, 2, 3)])
    omega = np.array(tumbling.start(*(moments / moments[2]), float(point["energy"])))
    return moments, omega * float(point["omega0"])


def motion(point: Mapping[str, float], duration: float | None, samples: int | None, tolerance: float) -> xr.Dataset:
    """Return ω(t) and q(t) of a tumbling body; the default duration is two periods of ω in the body."""
    moments, omega = start(point)
    rotation = 2 * math.pi / float(point["omega0"])
    whole = span(2 * exact.period(exact.set_up(*moments, *omega)), rotation)
    return motion_of(moments, omega, whole if duration is None else duration, samples, tolerance, rotation)
