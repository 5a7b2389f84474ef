"""The motion of a rigid body at one point of a map: from the closed form, and step by step beside it."""

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from kernels import exact
from sweeps.systems.bodies.attitude import columns
from sweeps.systems.motion import instants, span, time

if TYPE_CHECKING:
    import xarray as xr


def start(point: Mapping[str, float]) -> tuple[np.ndarray, np.ndarray]:
    """Return moments and angular velocity at time 0 of a point of the rigid body.

    ω_a = ω0, ω_b = ε ω0 cos φ, ω_c = ε ω0 sin φ, with (a, b, c) cyclic and a the spin axis.

    Args:
        point: I1, I2, I3 (kg m2), axis, omega0 (rad s-1), epsilon, phase (rad).

    Returns:
        Moments, shape (3,), kg m2; angular velocity, shape (3,), rad s-1.
    """
    moments = np.array([point[f"I{i}"] for i in (1, 2, 3)], dtype=float)
    spin, nudge, phase = float(point["omega0"]), float(point["epsilon"]), float(point["phase"])
    a = int(point["axis"]) - 1
    omega = np.zeros(3)
    omega[[a, (a + 1) % 3, (a + 2) % 3]] = np.array([1.0, nudge * math.cos(phase), nudge * math.sin(phase)]) * spin
    return moments, omega


def span_of(moments: np.ndarray, omega: np.ndarray, rotation: float) -> float:
    """Return the time of two flips, or two wobble periods, s; four rotations where neither ends in MOST_ROTATIONS."""
    top = exact.set_up(*moments, *omega)
    flips = exact.max_tilt(top, int(np.abs(omega).argmax()) + 1) > 0.5 * math.pi
    return span((1 if flips else 2) * exact.period(top), rotation)


def motion(point: Mapping[str, float], duration: float | None, samples: int | None, tolerance: float) -> "xr.Dataset":
    """Return ω(t) and q(t) of a free rigid body from a point of a map.

    Args:
        point: I1, I2, I3 (kg m2), axis, omega0 (rad s-1), epsilon, phase (rad).
        duration: s; left out, two flips or two turns of the perturbation, or four rotations where that takes over
        10,000.
        samples: how many instants, both ends included; left out, 32 a rotation, 400 to 100,000.
        tolerance: of the direct integration, relative.

    Returns:
        Over `time` (s): omega1 … omega3 (rad s-1) and the attitude q0 … q3 from the closed form, and the same with
        _direct step by step.
    """
    import xarray as xr

    moments, omega = start(point)
    rotation = 2 * math.pi / np.abs(omega).max()
    times = instants(span_of(moments, omega, rotation) if duration is None else duration, samples, rotation)
    return xr.Dataset(columns(moments, omega, times, tolerance), {"time": time(times, "the perturbation")})
