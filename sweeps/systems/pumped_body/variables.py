"""What a map of pumped bodies holds: its variables, its coordinates, and the parameters that they vary."""

from dataclasses import replace
from typing import Annotated

from sweeps.schema.values import Phase, number, whole
from sweeps.schema.variables import Parameter, Quantity, table
from sweeps.systems.bodies import variables as bodies
from sweeps.systems.bodies.variables import MOMENTS
from sweeps.systems.periodic.variables import MULTIPLIER, MULTIPLIERS

CHANGING = (*MOMENTS, *(f"{name}{i}" for name in ("depth", "lag") for i in (1, 2, 3)))

VARIABLES = MULTIPLIERS | table(
    replace(
        bodies.TRIANGLE_MARGIN,
        long_name="least of (Ib + Ic - Ia)/(I1 + I2 + I3) over the axes and the period; negative where no body can do "
        "that",
    )
)

Depth = Annotated[float, number(lambda x: -0.99 <= x <= 0.99, "a number from -0.99 to 0.99: no moment reaches 0")]
Frequency = Annotated[
    float, number(lambda x: 1e-150 <= x <= 1e150, "a number with 1e-150 ≤ frequency ≤ 1e150 in rad s-1")
]
DEPTH = Quantity("depth", "1", "-0.99 to 0.99", Depth)

PARAMETERS = (
    *(
        replace(moment, long_name=f"{moment.long_name}, mean", description="", required=True)
        for moment in bodies.PRINCIPAL
    ),
    *(Parameter(f"depth{i}", DEPTH, f"depth of the modulation of moment {i}, relative", 0.0) for i in (1, 2, 3)),
    *(
        Parameter(f"lag{i}", Quantity("angle", "rad", "finite", Phase), f"phase of the modulation of moment {i}", 0.0)
        for i in (1, 2, 3)
    ),
    Parameter(
        "frequency",
        Quantity("frequency", "rad s-1", "1e-150 ≤ frequency ≤ 1e150", Frequency),
        "angular frequency of the modulation",
        required=True,
    ),
    Parameter(
        "omega0", bodies.SIGNED_SPIN, "spin rate: angular momentum over the mean moment of the spin axis", required=True
    ),
    bodies.EPSILON,
    bodies.PHASE,
)
ARGUMENTS = ("axis", *(parameter.name for parameter in PARAMETERS))
_FREE = bodies.layout(PARAMETERS, VARIABLES, [n for n, v in VARIABLES.items() if not v.over], spun=True, listed=False)
LAYOUT = replace(
    _FREE,
    coordinates=_FREE.coordinates | table(MULTIPLIER),
    spare=(*_FREE.spare, MULTIPLIER.name),
    values=_FREE.values | {"multiplier": Annotated[int, whole(1, 2, "1 or 2")]},
)
COORDINATES = LAYOUT.coordinates
