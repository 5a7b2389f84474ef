"""Motion of a body on its orbit by the full equations, in time, with its attitude in space."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.linalg import norm

from sweeps.mechanics import motions
from sweeps.systems.motion import label_columns, multiply, sample_times, time_axis
from sweeps.systems.orbit import equations
from sweeps.systems.orbit.shapes import inertia_ratios

MAX_KEPLER_STEPS = 60  # Newton's method from E = π converges for all orbits; at e = 0.95 it takes a dozen steps
TILT = 0.01  # rad, initial tilt of a motion to be shown; perturbations of maps are too small to be seen
SHOWN_ORBITS = 10  # default number of orbits of a motion


def true_anomaly(mean: np.ndarray, eccentricity: float) -> np.ndarray:
    """Return the true anomaly of mean anomalies from the pericentre, rad, continuous over the orbits."""
    turns = np.floor((mean + np.pi) / (2.0 * np.pi))
    remainder = mean - 2.0 * np.pi * turns
    eccentric = np.copysign(np.pi, remainder)
    for _ in range(MAX_KEPLER_STEPS):
        excess = eccentric - eccentricity * np.sin(eccentric) - remainder
        eccentric = eccentric - excess / (1.0 - eccentricity * np.cos(eccentric))
    beta = eccentricity / (1.0 + math.sqrt(1.0 - eccentricity**2))
    sine, cosine = beta * np.sin(eccentric), beta * np.cos(eccentric)
    return 2.0 * np.pi * turns + eccentric + 2.0 * np.arctan2(sine, 1.0 - cosine)


def follow(parameters: Mapping[str, float], start: np.ndarray, anomalies: np.ndarray, tolerance: float) -> tuple:
    """Return the states x, alpha, beta, y, M1, M2 at true anomalies, shape (n, 6), and their errors.

    Args:
        parameters: eccentricity, asymmetry, I1_over_I3.
        start: the states at the first anomaly, relative to a body at rest in the orbit's frame.
        anomalies: true anomalies, rad, ascending.
        tolerance: relative truncation error.
    """
    model = equations.orbit_model()
    values = [np.array([dict(parameters, p=1.0, pace=1.0)[name]]) for name in model.names]
    states, error, _ = motions.solve(model.moving, values, start[None], anomalies[None], tolerance, np.ones((1, 6)))
    return states[0], error[0]


def rates_and_attitude(states: np.ndarray, anomalies: np.ndarray, parameters: Mapping[str, float]) -> tuple:
    """Return the angular velocity in the body over the mean motion, (n, 3), and quaternions from the body to space.

    Axis 1 of space points to the pericentre, axis 3 along the orbit's normal; for the arguments see :func:`follow`.
    """
    angle, alpha, beta, excess, first, second = states.T
    eccentricity, ratio = parameters["eccentricity"], parameters["I1_over_I3"]
    cosine, sine = np.cos(angle), np.sin(angle)
    momentum = [cosine * first + sine * second, cosine * second - sine * first]
    spin = (1.0 + eccentricity * np.cos(anomalies)) ** 2 + excess
    moments = np.array([[ratio], [ratio + parameters["asymmetry"]], [1.0]])
    rates = np.array([*momentum, spin]) / moments / (1.0 - eccentricity**2) ** 1.5
    attitude = np.array([1.0, 0.0, 0.0, 0.0])
    for axis, rotation in ((3, anomalies), (1, alpha), (2, beta), (3, angle)):
        half = np.zeros((rotation.size, 4))
        half[:, 0], half[:, axis] = np.cos(0.5 * rotation), np.sin(0.5 * rotation)
        attitude = multiply(np.broadcast_to(attitude, half.shape), half)
    return rates.T, attitude / norm(attitude, axis=1, keepdims=True)


def motion_of(point: Mapping[str, Any], duration: float | None, samples: int | None, tolerance: float) -> Any:
    """Return the motion of a point, after a tilt of its reference motion, as a dataset; see `Dynamics.motion`."""
    import xarray as xr

    values = {name: np.array([float(value)]) for name, value in point.items() if isinstance(value, int | float)}
    (ratio,), (asymmetry,) = inertia_ratios(values)
    eccentricity = float(values.get("eccentricity", [0.0])[0])
    parameters = {"eccentricity": eccentricity, "asymmetry": float(asymmetry), "I1_over_I3": float(ratio)}
    _, angle, slope = equations.start_of_motion(values)
    mean_motion = math.sqrt(float(point["mu"]) / float(point["semi_major_axis"])) / float(point["semi_major_axis"])
    orbit = 2.0 * math.pi / mean_motion
    times = sample_times(duration or SHOWN_ORBITS * orbit, samples, orbit)
    anomalies = true_anomaly(mean_motion * times, eccentricity)
    tilt = np.array([0.0, TILT, 0.0, 0.0, 0.0, 0.0])
    start = np.array([angle, 0.0, 0.0, (1.0 + eccentricity) ** 2 * slope, 0.0, 0.0]) + tilt
    states, error = follow(parameters, start, anomalies, tolerance)
    rates, attitude = rates_and_attitude(states, anomalies, parameters)
    columns = label_columns(mean_motion * rates, attitude, "direct integration")
    largest = error[:, :3].max(axis=1)
    columns["angle_error"] = "time", largest, {"units": "rad", "long_name": "error of the angles of the attitude"}
    return xr.Dataset(columns, {"time": time_axis(times, "the pericentre")})
