"""The period of a tumbling body's angular velocity, found again by SciPy's DOP853 and by the closed form."""

import math
from collections.abc import Mapping

import numpy as np
from scipy.integrate import solve_ivp

from kernels import exact
from sweeps.systems.bodies.body import Once
from sweeps.systems.reintegration import ROUNDING, coefficients
from sweeps.systems.system import Reference
from sweeps.systems.tumbling.system import SYSTEM

GROWN = 100.0  # by which the steps' errors grow in a period


def period_by_scipy(point: Mapping[str, float], integration: Once) -> float:
    """Return the period of ω of a tumbling body in s, by DOP853; NaN beyond a hundred turns or without one."""
    moments, omega = SYSTEM.start({**point, "omega0": 1.0})
    c, whole = coefficients(moments), exact.period(exact.set_up(*moments, *omega))
    if not whole < 200.0 * math.pi or moments[2] < float(point["energy"]) * moments[0]:
        return math.nan

    def middle(t, y):
        return y[1]

    middle.direction = math.copysign(1.0, c[1] * omega[2] * omega[0])
    rates = lambda t, w: [c[i] * w[i - 2] * w[i - 1] for i in range(3)]  # noqa: E731
    run = solve_ivp(rates, (0, 1.2 * whole), omega, "DOP853", events=middle, rtol=1e-13, atol=1e-15)
    ends = run.t_events[0][run.t_events[0] > 0.5 * whole]
    return float(ends[0]) / float(point["omega0"]) if ends.size else math.nan


def period_in_closed_form(point: Mapping[str, float], integration: Once) -> float:
    """Return the period of ω of a tumbling body in s, 4 K/p; NaN without one."""
    moments, omega = SYSTEM.start(point)
    impossible = moments[2] < float(point["energy"]) * moments[0]
    whole = exact.period(exact.set_up(*moments, *omega))
    return whole if math.isfinite(whole) and not impossible else math.nan


def allowed(point: Mapping[str, float], integration: Once) -> float:
    """Return the allowed distance of a measured period from a reference, s."""
    moments = np.sort([point["I1"], point["I2"], point["I3"]])
    near = max(abs(1.0 - point["energy"] * moments[1] / moments[2]), ROUNDING)
    return (GROWN * (integration.tolerance + ROUNDING) + ROUNDING / near) * period_in_closed_form(point, integration)


REFERENCE = Reference("period_psi", {"SciPy DOP853": period_by_scipy, "closed form": period_in_closed_form}, allowed)
