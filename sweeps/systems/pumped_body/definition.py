"""What a definition of pumped bodies may say."""

from typing import Annotated

from pydantic import Field

from sweeps.schema.definition import Definition
from sweeps.schema.parameters import grid_model
from sweeps.schema.refusals import keys_of
from sweeps.schema.strict import Strict
from sweeps.schema.values import Tolerance, choice
from sweeps.systems.bodies.body import AXES, Axes
from sweeps.systems.bodies.shapes import RATIOS
from sweeps.systems.pumped_body.variables import PARAMETERS

MODULATIONS = ("moment", "inverse")
PumpedGrid = grid_model("PumpedGrid", PARAMETERS, __name__, RATIOS)


class OnePeriod(Strict):
    """How each period is followed."""

    tolerance: Tolerance = Field(
        1e-12, description="truncation that the steps of one period may make, relative to the motion: 1e-13 to 1e-3"
    )

    @property
    def samples(self) -> int:
        """Return what stands for a run's length where time is estimated."""
        return 1


class PumpedDefinition(Definition):
    """A sweep of free bodies whose moments of inertia change periodically."""

    axes: Axes = Field((1, 2, 3), description=AXES)
    modulation: Annotated[str, choice(MODULATIONS)] = Field(
        "moment", description="what is I (1 + depth cos(frequency t + lag)): each moment, or its inverse"
    )
    grid: PumpedGrid = Field(description="what is varied: a mapping with " + keys_of(PumpedGrid))
    integration: OnePeriod = Field(
        OnePeriod(), description="how each period is followed: a mapping with " + keys_of(OnePeriod)
    )
