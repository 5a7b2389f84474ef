"""What a definition of twists may say."""

from pydantic import Field, model_validator

from sweeps.schema.definition import Definition
from sweeps.schema.parameters import grid_model
from sweeps.schema.refusals import keys_of, refusals
from sweeps.systems import listed
from sweeps.systems.once import Once
from sweeps.systems.shapes import RATIOS
from sweeps.systems.twist.variables import PARAMETERS, Spin

TwistGrid = grid_model("TwistGrid", PARAMETERS, __name__, RATIOS)
SHAREABLE = ("omega0",)


class Racket(listed.ListedBody):
    """One body that is thrown."""

    omega0: Spin = Field(default=None, description="L/I2 of this body, rad s-1: 1e-150 ≤ omega0 ≤ 1e150")


class TwistDefinition(Definition):
    """A sweep of throws."""

    grid: TwistGrid = Field(description="what is varied: a mapping with " + keys_of(TwistGrid))
    bodies: listed.bodies_of(Racket) = Field(
        default=(), description="a list of bodies, names unique, in place of I1, I2 and I3 in grid"
    )
    integration: Once = Field(Once(), description="how each throw is integrated: a mapping with " + keys_of(Once))

    @model_validator(mode="after")
    def _check_grid(self) -> "TwistDefinition":
        wrong = listed.problems(self, SHAREABLE)
        if wrong:
            raise refusals(wrong)
        return self
