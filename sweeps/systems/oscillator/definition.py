"""What a definition of small oscillations may say; each system's own model has its parameters in `grid`."""

from typing import Annotated, ClassVar

from pydantic import AfterValidator, Field, model_validator

from sweeps.schema.definition import Definition, Integration
from sweeps.schema.refusals import Problem, display, refusal, refusals
from sweeps.schema.strict import mapping
from sweeps.schema.values import Positive, Tolerance, number

Component = Annotated[float, number(lambda x: True, "any finite number")]


def _not_zero(values: tuple[float, ...]) -> tuple[float, ...]:
    if not any(values):
        raise refusal("has no direction: all numbers are 0", "a list of numbers that are not all 0")
    return values


class OscillatorIntegration(Integration):
    """How each run of a small oscillation is made."""

    rotations: Positive = Field(4.0, description="length of a run in cycles of the system's scale, 2π/rate_scale: > 0")
    tolerance: Tolerance = Field(1e-10, description="relative error allowed on the motion, 1e-13 to 1e-3")
    direction: Annotated[tuple[Component, ...], AfterValidator(_not_zero)] = Field(
        None,
        description="direction of the perturbation: a list of one number per coordinate, in the coordinates' units, "
        "not all 0; default along each mode",
    )
    degenerate: bool = Field(
        False,
        description="true or false: for a system of one coordinate, whether to compute the frequency at the "
        "amplitude of the perturbation where V'' = 0 and a higher-order term confines the motion",
    )


class OscillatorDefinition(Definition):
    """A sweep of small oscillations; each system's own model has its parameters in `grid`."""

    integration: OscillatorIntegration = mapping("how each run is made", OscillatorIntegration)
    moved: ClassVar[tuple[str, ...]] = ()  # names of the coordinates

    @model_validator(mode="after")
    def _check_direction(self) -> "OscillatorDefinition":
        direction = self.integration.direction
        if direction is not None and len(direction) != len(self.moved):
            wrong = f"has {len(direction)} numbers"
            allowed = f"{len(self.moved)}, of {', '.join(self.moved)}"
            raise refusals([Problem(("integration", "direction"), display(direction), wrong, allowed)])
        if self.integration.degenerate and len(self.moved) != 1:
            wrong, allowed = f"is given for {len(self.moved)} coordinates", "false, or a system of one coordinate"
            raise refusals([Problem(("integration", "degenerate"), "true", wrong, allowed)])
        return self
