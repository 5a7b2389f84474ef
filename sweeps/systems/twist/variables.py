"""What a map of twists holds: its variables, its coordinates, and the parameters that they vary."""

import math
from typing import Annotated

from kernels import statuses
from sweeps.schema.quantities import Parameter, Quantity
from sweeps.schema.values import MAX_SPIN_RATE, MIN_SPIN_RATE, Moment, Phase, number
from sweeps.schema.variables import Role, Variable, table
from sweeps.systems.rigid_body.variables import layout_of_bodies

MOMENTS = ("I1", "I2", "I3")
ARGUMENTS = (*MOMENTS, "chi", "theta", "omega0")
STATUSES = statuses.STATUSES[: statuses.NON_FINITE + 1]
ENDS = ("undetermined", "same_side", "reversed")

_MISSING = "missing where L lies along the handle, which then has no azimuth"
_ERROR = "three times the difference of two runs of unequal steps, and what rounding grows to"

EXACT = table(
    Variable("twist_exact", "rad", "signed change of chi in one turn of the handle about L, closed form"),
    Variable("time_of_turn_exact", "s", "time in which the handle comes round L once, closed form"),
    Variable(
        "twist_defect_theory",
        "rad",
        "what the twist lacks of half a turn on the separatrix, where chi starts and ends equally far from it",
        comment="twice eps of artanh(sqrt(a) cos(eps)/sqrt(a + b sin(eps)^2)) = growth (pi + arcsin(cos(eps) "
        "sqrt(b/(a + b)))), a = I2/I1 - 1, b = 1 - I2/I3; falls with exp(-pi growth)",
    ),
    Variable("growth", "1", "growth rate about the middle axis in units of the spin, linear theory: sqrt(a b)"),
    Variable(
        "triangle_margin",
        "1",
        "least of (Ib + Ic - Ia)/(I1 + I2 + I3) over the axes; negative where no body can exist",
        "f4",
        role=Role.EXISTENCE,
    ),
)

MEASURED = table(
    Variable(
        "twist",
        "rad",
        "signed change of chi in one turn of the handle about L, measured",
        comment=_MISSING,
        exact="twist_exact",
        error="twist_error",
    ),
    Variable("twist_error", "rad", "error of the measured twist", comment=_ERROR),
    Variable(
        "twist_defect",
        "rad",
        "what the measured twist lacks of half a turn: pi - abs(twist)",
    ),
    Variable(
        "time_of_turn",
        "s",
        "time in which the handle comes round L once, measured",
        comment=_MISSING,
        exact="time_of_turn_exact",
        error="time_of_turn_error",
    ),
    Variable("time_of_turn_error", "s", "error of the measured time of the turn", comment=_ERROR),
    Variable("ends_reversed", None, "which side L is on after the turn", "i1", ENDS, first_flag=-1, role=Role.HEADLINE),
    Variable("status", None, "whether the measurement can be trusted", "i1", STATUSES, role=Role.STATUS),
)

VARIABLES = MEASURED | EXACT

Tilt = Annotated[float, number(lambda x: 0 <= x <= math.pi, "a number from 0 to pi, in rad")]
Spin = Annotated[
    float, number(lambda x: MIN_SPIN_RATE <= x <= MAX_SPIN_RATE, "a number with 1e-150 ≤ omega0 ≤ 1e150 in rad s-1")
]
MOMENT = Quantity("moment", "kg m2", "finite, > 0", Moment)

PARAMETERS = (
    *(
        Parameter(f"I{i}", MOMENT, f"principal moment of inertia {i}", description=f"moment of inertia {i}, kg m2, > 0")
        for i in (1, 2, 3)
    ),
    Parameter(
        "chi",
        Quantity("side", "rad", "finite", Phase),
        "where L lies about the handle at the start: atan2(L3, L2), axes in ascending moments",
        required=True,
    ),
    Parameter(
        "theta", Quantity("tilt", "rad", "0 to pi", Tilt), "angle of L to the handle at the start", 0.5 * math.pi
    ),
    Parameter(
        "omega0",
        Quantity("spin rate", "rad s-1", "1e-150 ≤ omega0 ≤ 1e150", Spin),
        "spin rate about the middle axis that has this L: L/I2",
        1.0,
    ),
)

LAYOUT = layout_of_bodies(PARAMETERS, VARIABLES, tuple(EXACT))
COORDINATES = LAYOUT.coordinates
