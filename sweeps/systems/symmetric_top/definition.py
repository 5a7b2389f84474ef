"""What a definition of symmetric tops may say."""

from pydantic import Field

from sweeps.schema.definition import Definition, Integration
from sweeps.schema.parameters import grid_model
from sweeps.schema.refusals import keys_of
from sweeps.schema.values import TOLERANCE, Positive, Tolerance
from sweeps.systems.symmetric_top.variables import PARAMETERS

TopGrid = grid_model("TopGrid", PARAMETERS, __name__)


class TopIntegration(Integration):
    """How each run of a symmetric top is made."""

    rotations: Positive = Field(4.0, description="length of a run in rotations, 2π/|omega3|: > 0")
    tolerance: Tolerance = Field(1e-12, description=f"relative error allowed on the transverse part, {TOLERANCE}")


class SymmetricTopDefinition(Definition):
    """A sweep of symmetric tops."""

    grid: TopGrid = Field(description="what is varied: a mapping with " + keys_of(TopGrid))
    integration: TopIntegration = Field(
        TopIntegration.model_construct(),
        description="how each run is made: a mapping with " + keys_of(TopIntegration),
    )
