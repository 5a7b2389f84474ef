"""The time of a throw's turn, found again by SciPy's DOP853 and by the closed form of the attitude."""

import math
from collections.abc import Mapping

import numpy as np
from scipy.integrate import solve_ivp

from kernels import twist
from sweeps.systems.bodies.body import Once
from sweeps.systems.reintegration import ROUNDING, coefficients
from sweeps.systems.system import Reference
from sweeps.systems.twist.system import SYSTEM

GROWN = 100.0  # by which the steps' errors grow about the middle axis


def turn_by_scipy(point: Mapping[str, float], integration: Once) -> float:
    """Return the time of one revolution of the handle about L in s, by DOP853; NaN along the handle."""
    moments, omega = SYSTEM.start({**point, "omega0": 1.0})
    c, L, until = coefficients(moments), float(np.linalg.norm(moments * omega)), 2.1 * math.pi * moments[2] / moments[1]
    if not omega[1:].any():
        return math.nan

    def rates(_, y):
        w, across = y[:3], (moments[1] * y[1]) ** 2 + (moments[2] * y[2]) ** 2
        turning = L * (moments[1] * y[1] ** 2 + moments[2] * y[2] ** 2) / across
        return [c[0] * w[1] * w[2], c[1] * w[2] * w[0], c[2] * w[0] * w[1], turning]

    def around(_, y):
        return y[3] - 2.0 * math.pi

    around.terminal = True
    run = solve_ivp(rates, (0, until), [*omega, 0.0], "DOP853", events=around, rtol=1e-13, atol=1e-15)
    return float(run.t_events[0][-1]) / float(point["omega0"])


def turn_in_closed_form(point: Mapping[str, float], integration: Once) -> float:
    """Return the time of a revolution in s, from the closed form of the attitude; NaN along the handle."""
    return float(twist.survey(point, integration.tolerance, False)["time_of_turn_exact"][0])


def allowed(point: Mapping[str, float], integration: Once) -> float:
    """Return the allowed distance of a measured time from a reference, s."""
    return GROWN * (integration.tolerance + ROUNDING) * turn_in_closed_form(point, integration)


REFERENCE = Reference("time_of_turn", {"SciPy DOP853": turn_by_scipy, "closed form": turn_in_closed_form}, allowed)
