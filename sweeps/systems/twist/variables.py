"""What a map of twists holds: its variables, its coordinates, and the parameters that they vary."""

import math
from typing import Annotated

from kernels import statuses
from sweeps.schema.values import Phase, number
from sweeps.schema.variables import Parameter, Quantity
from sweeps.systems.bodies import variables as bodies
from sweeps.systems.bodies.variables import MOMENTS
from sweeps.systems.shared_variables import rows, status, with_exact

ARGUMENTS = (*MOMENTS, "chi", "theta", "omega0")

_MISSING = "missing where L is parallel to the handle"

_TWIST = "twist per revolution of the handle about L (signed change of chi)"
_TURN = "time of one revolution of the handle about L"

EXACT = rows(
    f"""
    twist_exact          rad  {_TWIST}, closed form
    time_of_turn_exact   s    {_TURN}, closed form
    twist_defect_theory  rad  shortfall of the twist from a half turn on the separatrix, symmetric start and end
        comment: 2 eps with artanh(sqrt(a) cos(eps)/sqrt(a + b sin(eps)^2)) = growth (pi + arcsin(cos(eps) sqrt(b/(a +
        b)))), a = I2/I1 - 1, b = 1 - I2/I3; falls with exp(-pi growth)
    growth               1    growth rate about the intermediate axis over the spin rate, linear theory: sqrt(a b)
    """,
    bodies.TRIANGLE_MARGIN,
)

MEASURED = rows(
    *with_exact("twist", "rad", _TWIST, "twist", bodies.TWO_RUNS, _MISSING),
    "twist_defect  rad  shortfall of the twist from a half turn, measured: pi - abs(twist)",
    *with_exact("time_of_turn", "s", _TURN, "time of the revolution", bodies.TWO_RUNS, _MISSING),
    """
    ends_reversed  -  side of the handle on which L lies after the revolution [headline]
        flags: -1 undetermined same_side reversed
    """,
    status(statuses.NON_FINITE),
)

VARIABLES = MEASURED | EXACT

Tilt = Annotated[float, number(lambda x: 0 <= x <= math.pi, "a number from 0 to pi, in rad")]

PARAMETERS = (
    *bodies.PRINCIPAL,
    Parameter(
        "chi",
        Quantity("side", "rad", "finite", Phase),
        "initial angle of L about the handle: atan2(L3, L2), moments ascending",
        required=True,
    ),
    Parameter(
        "theta", Quantity("tilt", "rad", "0 to pi", Tilt), "initial angle between L and the handle", 0.5 * math.pi
    ),
    bodies.spin("L/I2, the spin rate about the intermediate axis with this L"),
)

LAYOUT = bodies.layout(PARAMETERS, VARIABLES, EXACT)
