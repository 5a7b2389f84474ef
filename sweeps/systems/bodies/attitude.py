"""Angular velocity and attitude over time, as every system with a body in space writes them."""

import numpy as np

from kernels import direct, exact
from sweeps.systems.motion import MOST_STEPPED, MotionError, angular_velocity

PARTS = ("scalar part", "vector part along axis 1", "vector part along axis 2", "vector part along axis 3")
LAID = "unit quaternion, scalar first, from the body's axes to axes fixed in space, which are the body's at time 0"


def described(rates: np.ndarray, attitude: np.ndarray, how: str, suffix: str = "") -> dict[str, tuple]:
    """Return omega1 … omega3 (n, 3) and q0 … q3 (n, 4) over `time`; `how` says in words how they are computed."""
    columns = {f"omega{i}{suffix}": ("time", one, angular_velocity(i, how)) for i, one in enumerate(rates.T, 1)}
    for i, (part, one) in enumerate(zip(PARTS, attitude.T, strict=True)):
        words = {"units": "1", "long_name": f"attitude, {part}, {how}", "comment": LAID}
        columns[f"q{i}{suffix}"] = ("time", one, words)
    return columns


def rotated(q: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """Return vectors (…, 3) along a body's axes turned by attitudes q (…, 4): v + 2 q0 u×v + 2 u×(u×v), u = q[1:]."""
    once = np.cross(q[..., 1:], vectors)
    return vectors + 2.0 * (q[..., :1] * once + np.cross(q[..., 1:], once))


def columns(moments, omega, times, tolerance: float) -> dict[str, tuple]:
    """Return omega1 … omega3 and q0 … q3 over `time`, in closed form and (suffix _direct) by direct integration."""
    moments = np.asarray(moments)
    rotations = np.abs(omega).max() * np.abs(times).max() / (2 * np.pi)
    if rotations > MOST_STEPPED:
        raise MotionError(f"times: the body rotates {rotations:.3g} times; allowed: {MOST_STEPPED:g} times")
    way = exact.rotation(moments, omega, times), exact.attitude(moments, omega, times)
    step = direct.rotation(moments, omega, times, tolerance), direct.attitude(moments, omega, times, tolerance)
    return described(*way, "closed form") | described(*step, "direct integration", "_direct")
