r"""Orientations of a rigid body in the gravity gradient of a circular orbit: which axis may point down, and librations.

Axis 1 (roll) points along the velocity, 2 (pitch) across the orbit, 3 (yaw) down. With :math:`k_1 = (I_2 - I_3)/I_1`,
:math:`k_3 = (I_2 - I_1)/I_3` and rates in units of the orbit's n, pitch librates at :math:`\sqrt{3 (I_1 - I_3)/I_2}`,
roll and yaw by :math:`\lambda^4 + (1 + 3 k_1 + k_1 k_3)\,\lambda^2 + 4 k_1 k_3 = 0`. Lagrange's region,
:math:`0 < k_3 < k_1`, is a minimum of the energy; DeBra and Delp's, :math:`k_3 < k_1 < 0`, is stable without
dissipation only.

Source: DeBra and Delp, Journal of the Astronautical Sciences 8 (1961) 14; Hughes, Spacecraft Attitude Dynamics (1986),
chapter 9.
"""

import math
from collections.abc import Sequence
from itertools import permutations
from typing import Any

from sweeps.schema.refusals import DefinitionError, display
from sweeps.schema.variables import parse_amount
from sweeps.systems.bodies.inertia import describe_axis
from sweeps.systems.bodies.satellites import inertia_ratios
from sweeps.systems.rigid_body.system import SpunBody

MU_EARTH = 398_600.4418  # km3 s-2, gravitational parameter of the Earth; source: IERS Conventions (2010), table 1.1
EARTH_RADIUS = 6378.137  # km, equatorial radius of the Earth, from which altitudes are counted; source: WGS 84

WORDS = {
    "stable": "stable, also with dissipation",
    "stable_without_loss": "stable without dissipation only (DeBra and Delp's region)",
}


def orbital_rate(orbit: object, gravity: object) -> float:
    """Return the rate of a circular orbit, rad s-1.

    Args:
        orbit: altitude above the Earth, km or text with a unit; with `gravity` the orbit's radius.
        gravity: gravitational parameter of another central body, km3 s-2 or text with a unit; or None.
    """
    radius, parameter = parse_amount("orbit", orbit, "km"), MU_EARTH
    if gravity is None:
        radius = radius + EARTH_RADIUS if radius > 0.0 else 0.0
    else:
        parameter = parse_amount("mu", gravity, "km3 s-2")
    if not (radius > 0.0 and parameter > 0.0):
        raise DefinitionError(
            f"orbit: {display(orbit)}, mu: {display(gravity)}; allowed: positive amounts, in km and km3 s-2"
        )
    return math.sqrt(parameter / radius**3)


def judge_orientation(roll: float, pitch: float, yaw: float) -> tuple[str, list[float]]:
    """Return the verdict on moments about the axes of an orbit, and the squared rates of pitch, roll and yaw over n².

    The verdict is stable, stable_without_loss, unstable or marginal.
    """
    roll_ratio, yaw_ratio = inertia_ratios(roll, pitch, yaw)
    sum_of_squares, product = 1.0 + 3.0 * roll_ratio + roll_ratio * yaw_ratio, 4.0 * roll_ratio * yaw_ratio
    discriminant = sum_of_squares**2 - 4.0 * product
    # the larger square first: the other one is their product over it, without cancellation
    larger = 0.5 * (sum_of_squares + math.copysign(math.sqrt(max(discriminant, 0.0)), sum_of_squares))
    squares = [3.0 * (roll - yaw) / pitch, larger, product / larger if larger else 0.0]
    signs = *squares, discriminant
    if min(signs) < 0.0 or min(signs) == 0.0:
        return ("unstable" if min(signs) < 0.0 else "marginal"), squares
    return ("stable" if yaw_ratio > 0.0 else "stable_without_loss"), squares


def find_orientations(moments: Sequence[float], rate: float) -> list[dict[str, Any]]:
    """Return the orientations that are stable: axes (1, 2 or 3) along, across and down, verdict, and periods in s.

    Args:
        moments: principal moments in any unit.
        rate: of the orbit, rad s-1.
    """
    orientations = []
    for along, across, down in permutations((1, 2, 3)):
        word, squares = judge_orientation(*(moments[axis - 1] for axis in (along, across, down)))
        if word.startswith("stable"):
            pitch, *roll_yaw = (2.0 * math.pi / (rate * math.sqrt(square)) for square in squares)
            periods = {"pitch_period": pitch, "roll_yaw_periods": sorted(roll_yaw)}
            orientations.append({"down": down, "along": along, "across": across, "verdict": word, **periods})
    return sorted(orientations, key=lambda each: each["verdict"])  # the stable one before one without loss


def predict_orientations(
    body: SpunBody, orbit: object, gravity: object
) -> tuple[dict[str, Any], list[tuple[str, str]]]:
    """Return the stable orientations of a body on an orbit, as facts and as rows (orientation, outcome)."""
    rate = orbital_rate(orbit, gravity)
    orientations, rows = find_orientations(body.moments, rate), []
    for each in orientations:
        place = ""
        if body.principal is not None:
            place = f" ({describe_axis(body.principal.axes[each['down'] - 1], body.frame)} or its opposite)"
        pitch, *roll_yaw = (f"{period / 60.0:.4g}" for period in (each["pitch_period"], *each["roll_yaw_periods"]))
        librations = f"librations {pitch} min (pitch), {' and '.join(roll_yaw)} min (roll and yaw)"
        outcome = f"{WORDS[each['verdict']]}; {librations}"
        title = f"axis {each['down']}{place} down, {each['along']} along the path, {each['across']} across"
        rows.append((title, outcome))
    period = 2.0 * math.pi / rate
    facts = {"orbital_rate": rate, "orbital_period": period, "orientations": orientations}
    return facts, rows or [("any axis down", "not stable: two moments are equal, so no orientation is")]
