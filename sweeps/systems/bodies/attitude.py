"""Angular velocity and attitude over time, as every system with a body in space writes them."""

from typing import TYPE_CHECKING

import numpy as np

from kernels import direct, exact
from sweeps.systems.motion import angular_velocity, instants, time

if TYPE_CHECKING:
    import xarray as xr

PARTS = ("scalar part", "vector part along axis 1", "vector part along axis 2", "vector part along axis 3")
LAID = "unit quaternion, scalar first, from the body's axes to axes fixed in space, which are the body's at time 0"


def quaternion(part: int, how: str) -> dict[str, str]:
    """Return the attributes of one component (0 to 3) of the attitude."""
    return {"units": "1", "long_name": f"attitude, {PARTS[part]}, {how}", "comment": LAID}


def rotated(q: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """Return vectors (…, 3) along a body's axes turned by attitudes q (…, 4): v + 2 q0 u×v + 2 u×(u×v), u = q[1:]."""
    once = np.cross(q[..., 1:], vectors)
    return vectors + 2.0 * (q[..., :1] * once + np.cross(q[..., 1:], once))


def columns(moments, omega, times, tolerance: float) -> dict[str, tuple]:
    """Return omega1 … omega3 and q0 … q3 over `time`, in closed form and (suffix _direct) by direct integration."""
    columns_of_motion = {}
    for suffix, way, how in (("", (exact,), "closed form"), ("_direct", (direct, tolerance), "direct integration")):
        rates, attitude = (f(moments, omega, times, *way[1:]) for f in (way[0].rotation, way[0].attitude))
        for i in range(3):
            columns_of_motion[f"omega{i + 1}{suffix}"] = ("time", rates[:, i], angular_velocity(i + 1, how))
        for i in range(4):
            columns_of_motion[f"q{i}{suffix}"] = ("time", attitude[:, i], quaternion(i, how))
    return columns_of_motion


def motion_of(moments, omega, duration: float, samples: int | None, tolerance: float, rotation: float) -> "xr.Dataset":
    """Return the motion over `duration` (s), with 32 samples per `rotation` (s) unless their number is given."""
    import xarray as xr

    times = instants(duration, samples, rotation)
    return xr.Dataset(columns(np.asarray(moments), omega, times, tolerance), {"time": time(times, "the start")})
