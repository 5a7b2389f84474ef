"""The motion of one throw: angular velocity and attitude."""

import math
from collections.abc import Mapping

import numpy as np
import xarray as xr

from kernels import twist
from sweeps.systems.bodies.attitude import motion_of


def start(point: Mapping[str, float]) -> tuple[np.ndarray, np.ndarray]:
    """Return moments (ascending, kg m2) and angular velocity at time 0 (rad s-1) of a point: L = I2 omega0."""
    moments = np.sort([float(point[f"I{i}"]) for i in (1, 2, 3)])
    unit = moments / moments[1]
    omega = np.array(twist.start(*unit, float(point["chi"]), float(point["theta"])))
    return moments, omega * float(point["omega0"])


def motion(point: Mapping[str, float], duration: float | None, samples: int | None, tolerance: float) -> xr.Dataset:
    """Return ω(t) and q(t) of a throw; the default duration is two revolutions of the handle about L."""
    moments, omega = start(point)
    rotation = 2 * math.pi / float(point["omega0"])
    return motion_of(moments, omega, 2 * rotation if duration is None else duration, samples, tolerance, rotation)
