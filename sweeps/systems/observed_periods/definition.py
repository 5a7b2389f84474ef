"""The definition of a sweep of observed periods: its grid, its bodies."""

from pydantic import Field, model_validator

from sweeps.schema.definition import Definition
from sweeps.schema.parameters import grid_model
from sweeps.schema.refusals import keys_of, refusals
from sweeps.schema.strict import Strict
from sweeps.systems import listed
from sweeps.systems.observed_periods.variables import PARAMETERS
from sweeps.systems.shapes import RATIOS

PeriodsGrid = grid_model("PeriodsGrid", PARAMETERS, __name__, RATIOS)


class Nothing(Strict):
    """How each motion is followed: not at all."""

    @property
    def measured(self) -> bool:
        """Return False: the energies are solved for in closed form."""
        return False


class ObservedPeriodsDefinition(Definition):
    """A sweep of bodies of which two periods were observed."""

    grid: PeriodsGrid = Field(description="what is varied: a mapping with " + keys_of(PeriodsGrid))
    bodies: listed.bodies_of(listed.ListedBody) = Field(
        default=(), description="a list of bodies, names unique, in place of I1, I2 and I3 in grid"
    )
    integration: Nothing = Field(Nothing(), description="an empty mapping: energies are computed in closed form")

    @model_validator(mode="after")
    def _check_grid(self) -> "ObservedPeriodsDefinition":
        if wrong := listed.problems(self, ()):
            raise refusals(wrong)
        return self
