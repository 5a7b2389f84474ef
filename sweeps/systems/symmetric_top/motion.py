"""The motion of a symmetric top at one point of a map, in closed form."""

import math
from collections.abc import Mapping

import numpy as np
import xarray as xr

from kernels import exact
from kernels import symmetric_top as top
from sweeps.systems.motion import as_columns, instants, span, time


def motion(point: Mapping[str, float], duration: float | None, samples: int | None, tolerance: float) -> xr.Dataset:
    """Return ω(t) and q(t) of a free symmetric top from a point of a map, in closed form; see `Dynamics.motion`.

    The default duration is two turns of the precession, or four rotations where that takes over 10,000.
    """
    ratio, spin = float(point["ratio"]), float(point["omega3"])
    rate = abs(float(top.precession_rate(ratio, spin)))
    rotation = 2 * math.pi / abs(spin)
    if duration is None:
        duration = span(2 * (2 * math.pi / rate) if rate > 0 else math.inf, rotation)
    times = instants(duration, samples, rotation)
    omega = np.array([abs(spin) * math.tan(math.radians(float(point["half_angle"]))), 0.0, spin])
    followed = exact.rotation((1.0, 1.0, ratio), omega, times), exact.attitude((1.0, 1.0, ratio), omega, times)
    return xr.Dataset(as_columns(*followed, "closed form"), {"time": time(times, "the start")})
