"""Trace of a monodromy matrix by SciPy, from equations in body axes, for `verify`."""

import math
from collections.abc import Mapping

import numpy as np

from sweeps.systems.orbit.shapes import inertia_ratios


def trace_by_scipy(point: Mapping) -> float:
    """Return the trace of a point's monodromy matrix by SciPy's DOP853; NaN without motion.

    Beletsky's equation and its variation in the plane; out of it, the components of the orbit's normal and of the
    angular velocity along axes 1 and 2, which are rotated after a period by the angle by which the body has turned.
    """
    from scipy.integrate import solve_ivp

    from sweeps.systems.orbit import equations

    values = {name: np.array([float(value)]) for name, value in point.items() if isinstance(value, int | float)}
    period, start_angle, slope = equations.start_of_motion(values)
    if not math.isfinite(start_angle + slope + period):
        return math.nan
    (ratio,), (asymmetry,) = inertia_ratios(values)
    eccentricity = float(values.get("eccentricity", [0.0])[0])
    roll, yaw = (ratio + asymmetry - 1.0) / ratio, (1.0 - ratio) / (ratio + asymmetry)

    def rates(anomaly, state):
        """Return the derivatives of angle, its rate, two planar and four further perturbations of each direction."""
        angle, angle_rate, planar, tilts = state[0], state[1], state[2:6].reshape(2, 2), state[6:].reshape(4, 4)
        radius, sine, cosine = 1.0 + eccentricity * math.cos(anomaly), math.sin(angle), math.cos(angle)
        push, spin, tide = 2.0 * eccentricity * math.sin(anomaly), radius**2 * (1.0 + angle_rate), 3.0 * radius**3
        acceleration = (push * (1.0 + angle_rate) - 3.0 * asymmetry * sine * cosine) / radius
        variation = (push * planar[1] - 3.0 * asymmetry * math.cos(2.0 * angle) * planar[0]) / radius
        matrix = [
            [0.0, spin, 0.0, -1.0],
            [-spin, 0.0, 1.0, 0.0],
            [-roll * tide * sine * cosine, roll * tide * sine**2, 0.0, roll * spin],
            [yaw * tide * cosine**2, -yaw * tide * sine * cosine, yaw * spin, 0.0],
        ]
        return np.concatenate([[angle_rate, acceleration], planar[1], variation, (matrix @ tilts).ravel() / radius**2])

    start = np.concatenate([[start_angle, slope], np.eye(2).ravel(), np.eye(4).ravel()])
    end = solve_ivp(rates, (0.0, period), start, "DOP853", rtol=1e-13, atol=1e-14).y[:, -1]
    if point["plane"] == "in_plane":
        return float(end[2] + end[5])
    cosine, sine = math.cos(end[0] - start_angle), math.sin(end[0] - start_angle)
    rotation = np.kron(np.eye(2), [[cosine, -sine], [sine, cosine]])
    return float(np.trace(rotation @ end[6:].reshape(4, 4)))
