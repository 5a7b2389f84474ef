"""The rate of precession about the figure axis, measured again by SciPy's DOP853 and by its formula."""

import math
from collections.abc import Mapping

import numpy as np
from scipy.integrate import solve_ivp

from sweeps.systems.reintegration import MOST_STEPPED, ROUNDING, spacing
from sweeps.systems.symmetric_top.system import TopIntegration
from sweeps.systems.system import Reference


def precession_by_scipy(point: Mapping[str, float], integration: TopIntegration) -> float:
    """Return the precession rate about the figure axis in rad s-1, by DOP853, from the transverse angle."""
    if integration.samples > MOST_STEPPED:
        return math.nan
    c = point["ratio"] - 1.0
    h = spacing(abs(c), integration.samples_per_rotation)
    times = h * np.arange(integration.samples + 1)
    sense = math.copysign(1.0, point["omega3"])

    def rates(_, w):
        return -c * sense * w[1], c * sense * w[0]

    solution = solve_ivp(rates, (0.0, times[-1]), [1.0, 0.0], "DOP853", times, rtol=1e-13, atol=1e-14)
    angle = np.unwrap(np.arctan2(solution.y[1], solution.y[0]))
    return float(np.polyfit(times, angle, 1)[0]) * abs(point["omega3"])


def precession_in_closed_form(point: Mapping[str, float], integration: TopIntegration) -> float:
    """Return the precession rate about the figure axis in rad s-1: (I3/I1 - 1) ω3."""
    return (point["ratio"] - 1.0) * point["omega3"]


def allowed(point: Mapping[str, float], integration: TopIntegration) -> float:
    """Return the allowed distance of a measured rate from a reference, rad s-1.

    Samples that are wrong by δ, relative to the largest so far, move the slope of an angle by 2δ/h. Both ways may be
    wrong by the tolerance, and the references by `ROUNDING`.
    """
    h = spacing(abs(point["ratio"] - 1.0), integration.samples_per_rotation)
    return 4.0 * (integration.tolerance + ROUNDING) / h * abs(point["omega3"])


WAYS = {"SciPy DOP853": precession_by_scipy, "closed form": precession_in_closed_form}
REFERENCE = Reference("precession_rate", WAYS, allowed)
