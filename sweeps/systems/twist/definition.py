"""What a definition of twists may say."""

from typing import ClassVar

from pydantic import Field

from sweeps.schema.parameters import grid_model
from sweeps.schema.refusals import keys_of
from sweeps.systems.bodies.body import BODIES, Body, FollowedDefinition, list_of
from sweeps.systems.bodies.shapes import RATIOS
from sweeps.systems.bodies.variables import Spin
from sweeps.systems.twist.variables import PARAMETERS

TwistGrid = grid_model("TwistGrid", PARAMETERS, __name__, RATIOS)


class Racket(Body):
    """One body that is thrown."""

    omega0: Spin = Field(default=None, description="L/I2 of this body, rad s-1: 1e-150 ≤ omega0 ≤ 1e150")


class TwistDefinition(FollowedDefinition):
    """A sweep of throws."""

    shareable: ClassVar = ("omega0",)
    grid: TwistGrid = Field(description="what is varied: a mapping with " + keys_of(TwistGrid))
    bodies: list_of(Racket) = Field(default=(), description=BODIES)
