"""What a definition of relative equilibria may say; each system's own model has its parameters in `grid`."""

from typing import Annotated

from pydantic import BeforeValidator, Field

from sweeps.schema.definition import Definition, Integration
from sweeps.schema.strict import mapping
from sweeps.schema.values import Positive, Tolerance, whole

MOST_RUNS = 4
NUMBER = whole(1, MOST_RUNS, f"a whole number from 1 to {MOST_RUNS}")


class FlowIntegration(Integration):
    """How the runs from a relative equilibrium are made."""

    rotations: Positive = Field(4.0, description="length of a run in cycles of the system's scale, 2π/rate_scale: > 0")
    tolerance: Tolerance = Field(1e-12, description="relative error allowed on the motion, 1e-13 to 1e-3")
    runs: Annotated[int | None, BeforeValidator(lambda runs: runs if runs is None else NUMBER.func(runs))] = Field(
        None,
        description=f"runs of each point, in different directions: 1 to {MOST_RUNS}; equal modes need one each; "
        "default one for every two eigenvalues, from two to four",
    )


class FlowDefinition(Definition):
    """A sweep of relative equilibria; each system's own model has its parameters in `grid`."""

    integration: FlowIntegration = mapping("how each run is made", FlowIntegration)
