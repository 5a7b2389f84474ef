"""Trace of a monodromy matrix by SciPy, from equations in body axes, for `verify`."""

import math
from collections.abc import Mapping

import numpy as np

from sweeps.systems.orbit.shapes import inertia_ratios
from sweeps.systems.reintegration import integrate_monodromy


def trace_by_scipy(point: Mapping) -> float:
    """Return the trace of a point's monodromy matrix by SciPy's DOP853; NaN without motion.

    Beletsky's equation and its variation in the plane; out of it, the components of the orbit's normal and of the
    angular velocity along axes 1 and 2, which are rotated after a period by the angle by which the body has turned.
    """
    from sweeps.systems.orbit import equations

    values = {name: np.array([float(value)]) for name, value in point.items() if isinstance(value, int | float)}
    period, start_angle, slope = equations.start_of_motion(values)
    if not math.isfinite(start_angle + slope + period):
        return math.nan
    (ratio,), (asymmetry,) = inertia_ratios(values)
    eccentricity = float(values.get("eccentricity", [0.0])[0])
    roll, yaw = (ratio + asymmetry - 1.0) / ratio, (1.0 - ratio) / (ratio + asymmetry)

    is_planar = point["plane"] == "in_plane"

    def rates(anomaly, state):
        """Return the derivatives of the angle from the radius and of its rate: Beletsky's equation."""
        angle, angle_rate = state
        push = 2.0 * eccentricity * math.sin(anomaly) * (1.0 + angle_rate)
        acceleration = (push - 1.5 * asymmetry * math.sin(2.0 * angle)) / (1.0 + eccentricity * math.cos(anomaly))
        return [angle_rate, acceleration]

    def slopes(anomaly, state):
        """Return the matrix of perturbations in the plane, or out of it."""
        angle, angle_rate = state
        radius, sine, cosine = 1.0 + eccentricity * math.cos(anomaly), math.sin(angle), math.cos(angle)
        if is_planar:
            stiffness, push = 3.0 * asymmetry * math.cos(2.0 * angle), 2.0 * eccentricity * math.sin(anomaly)
            return np.array([[0.0, 1.0], [-stiffness / radius, push / radius]])
        spin, tide = radius**2 * (1.0 + angle_rate), 3.0 * radius**3
        matrix = [
            [0.0, spin, 0.0, -1.0],
            [-spin, 0.0, 1.0, 0.0],
            [-roll * tide * sine * cosine, roll * tide * sine**2, 0.0, roll * spin],
            [yaw * tide * cosine**2, -yaw * tide * sine * cosine, yaw * spin, 0.0],
        ]
        return np.array(matrix) / radius**2

    (angle, _), matrix = integrate_monodromy(
        rates, slopes, np.array([start_angle, slope]), np.eye(2 if is_planar else 4), (0.0, period)
    )
    cosine, sine = math.cos(angle - start_angle), math.sin(angle - start_angle)
    rotation = np.kron(np.eye(2), [[cosine, -sine], [sine, cosine]])
    return float(np.trace(matrix if is_planar else rotation @ matrix))
