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

_MISSING = "missing where L is parallel to the handle"
_ERROR = "three times the difference of two runs with different steps, and the effect of rounding"

EXACT = table(
    Variable("twist_exact", "rad", "twist per revolution of the handle about L (signed change of chi), closed form"),
    Variable("time_of_turn_exact", "s", "time of one revolution of the handle about L, closed form"),
    Variable(
        "twist_defect_theory",
        "rad",
        "shortfall of the twist from a half turn on the separatrix, symmetric start and end",
        comment="2 eps with artanh(sqrt(a) cos(eps)/sqrt(a + b sin(eps)^2)) = growth (pi + arcsin(cos(eps) "
        "sqrt(b/(a + b)))), a = I2/I1 - 1, b = 1 - I2/I3; falls with exp(-pi growth)",
    ),
    Variable("growth", "1", "growth rate about the intermediate axis over the spin rate, linear theory: sqrt(a b)"),
    Variable(
        "triangle_margin",
        "1",
        "least of (Ib + Ic - Ia)/(I1 + I2 + I3) over the axes; negative where physically impossible",
        "f4",
        role=Role.EXISTENCE,
    ),
)

MEASURED = table(
    Variable(
        "twist",
        "rad",
        "twist per revolution of the handle about L (signed change of chi), measured",
        comment=_MISSING,
        exact="twist_exact",
        error="twist_error",
    ),
    Variable("twist_error", "rad", "error of the measured twist", comment=_ERROR),
    Variable(
        "twist_defect",
        "rad",
        "shortfall of the twist from a half turn, measured: pi - abs(twist)",
    ),
    Variable(
        "time_of_turn",
        "s",
        "time of one revolution of the handle about L, measured",
        comment=_MISSING,
        exact="time_of_turn_exact",
        error="time_of_turn_error",
    ),
    Variable("time_of_turn_error", "s", "error of the measured time of the revolution", comment=_ERROR),
    Variable(
        "ends_reversed",
        None,
        "side of the handle on which L lies after the revolution",
        "i1",
        ENDS,
        first_flag=-1,
        role=Role.HEADLINE,
    ),
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
        "initial angle of L about the handle: atan2(L3, L2), moments ascending",
        required=True,
    ),
    Parameter(
        "theta", Quantity("tilt", "rad", "0 to pi", Tilt), "initial angle between L and the handle", 0.5 * math.pi
    ),
    Parameter(
        "omega0",
        Quantity("spin rate", "rad s-1", "1e-150 ≤ omega0 ≤ 1e150", Spin),
        "L/I2, the spin rate about the intermediate axis with this L",
        1.0,
    ),
)

LAYOUT = layout_of_bodies(PARAMETERS, VARIABLES, tuple(EXACT))
COORDINATES = LAYOUT.coordinates
