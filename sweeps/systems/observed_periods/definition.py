"""The definition of a sweep of observed periods: its grid, its bodies."""

from pydantic import Field

from sweeps.schema.parameters import grid_model
from sweeps.schema.refusals import keys_of
from sweeps.schema.strict import Strict
from sweeps.systems.bodies.body import BodiesDefinition
from sweeps.systems.bodies.shapes import RATIOS
from sweeps.systems.observed_periods.variables import PARAMETERS

PeriodsGrid = grid_model("PeriodsGrid", PARAMETERS, __name__, RATIOS)


class Nothing(Strict):
    """How each motion is followed: not at all."""

    @property
    def measured(self) -> bool:
        """Return False: the energies are solved for in closed form."""
        return False

    @property
    def samples(self) -> int:
        """Return 1: nothing is sampled."""
        return 1


class ObservedPeriodsDefinition(BodiesDefinition):
    """A sweep of bodies of which two periods were observed."""

    grid: PeriodsGrid = Field(description="what is varied: a mapping with " + keys_of(PeriodsGrid))
    integration: Nothing = Field(Nothing(), description="an empty mapping: energies are computed in closed form")
