"""What a definition of pumped bodies may say."""

from typing import Annotated

from pydantic import Field

from sweeps.schema.parameters import grid_model
from sweeps.schema.values import choice, mapping
from sweeps.systems.bodies.body import AXES, Axes
from sweeps.systems.bodies.shapes import RATIOS
from sweeps.systems.periodic.definition import PeriodicDefinition
from sweeps.systems.pumped_body.variables import PARAMETERS

MODULATIONS = ("moment", "inverse")
PumpedGrid = grid_model("PumpedGrid", PARAMETERS, __name__, RATIOS)


class PumpedDefinition(PeriodicDefinition):
    """A sweep of free bodies whose moments of inertia change periodically."""

    axes: Axes = Field((1, 2, 3), description=AXES)
    modulation: Annotated[str, choice(MODULATIONS)] = Field(
        "moment", description="what is I (1 + depth cos(frequency t + lag)): each moment, or its inverse"
    )
    grid: PumpedGrid = mapping("what is varied", PumpedGrid, required=True)
