"""The trace of a pumped body's monodromy matrix, found again by SciPy's DOP853."""

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from scipy.integrate import solve_ivp

from sweeps.systems.periodic.references import MOST_TURNS, compared
from sweeps.systems.pumped_body.system import moments_at
from sweeps.systems.system import Reference

if TYPE_CHECKING:
    from sweeps.systems.pumped_body.system import PumpedBody


def trace_by_scipy(point: Mapping[str, float], inverse: bool) -> float:
    """Return the trace by DOP853 on the linear equations; NaN where a period is too long."""
    axis, nu = int(point["axis"]), point["frequency"]
    L, period = point["omega0"] * point[f"I{axis}"], 2.0 * math.pi / nu

    def along(t):
        moments = moments_at(point, nu * t, inverse)
        return [L / moments[(axis + k - 1) % 3] for k in range(3)]

    def rates(t, y):
        a, b, c = along(t)
        return [-(c - a) * y[1], (b - a) * y[0], -(c - a) * y[3], (b - a) * y[2]]

    if max(abs(rate) for t in np.linspace(0.0, period, 9) for rate in along(t)) * period > MOST_TURNS:
        return math.nan
    y = solve_ivp(rates, (0.0, period), [1.0, 0.0, 0.0, 1.0], "DOP853", rtol=1e-13, atol=1e-15).y[:, -1]
    return float(y[0] + y[3])


def reference(system: "PumpedBody") -> Reference:
    """Return what `verify` measures again."""
    return compared(lambda point: trace_by_scipy(point, system.inverse))
