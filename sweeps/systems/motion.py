"""What the motions of all systems share: how long they are, how finely they are told, and their attributes."""

import math

import numpy as np

MOST_ROTATIONS = 10_000
SAMPLES_PER_ROTATION = 32
LEAST_SAMPLES, MOST_SAMPLES = 400, 100_000


def span(whole: float, rotation: float) -> float:
    """Return the duration (s) of a motion to be shown: a whole period, or four rotations where it is too long."""
    return whole if whole <= MOST_ROTATIONS * rotation else 4 * rotation


def instants(duration: float, samples: int | None, rotation: float) -> np.ndarray:
    """Return times from 0 to `duration`, both included: `samples` of them, or 32 per rotation, 400 to 100,000."""
    if samples is None:
        wanted = SAMPLES_PER_ROTATION * duration / rotation if math.isfinite(duration) else MOST_SAMPLES
        samples = int(min(max(wanted, LEAST_SAMPLES), MOST_SAMPLES)) + 1
    return np.linspace(0.0, duration, samples)


def time(values: np.ndarray, since: str) -> tuple:
    """Return the coordinate `time`, counted from `since`."""
    return "time", values, {"units": "s", "long_name": f"time from {since}"}


def angular_velocity(axis: int, how: str) -> dict[str, str]:
    """Return the attributes of one component of the angular velocity in the body."""
    return {"units": "rad s-1", "long_name": f"angular velocity about axis {axis} of the body, {how}"}
