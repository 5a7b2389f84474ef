"""Small oscillations of a described mechanical system: what its definition, and its columns are.

One `Oscillator` a description: those of `sweeps/mechanics/library`, and any Python file that a definition names.
"""

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

import numpy as np
from pydantic import AfterValidator, model_validator

from sweeps.schema.definition import Definition, Integration
from sweeps.schema.parameters import key, mapping
from sweeps.schema.refusals import Problem, display, refusal, refusals
from sweeps.schema.values import Positive, Tolerance, number
from sweeps.schema.variables import Variable
from sweeps.systems.described import MECHANICS, PATHS, PLANNING, SEARCH, Described
from sweeps.systems.oscillator import variables as tables
from sweeps.systems.oscillator.variables import DEGENERATE, FOLLOWED, VARIABLES
from sweeps.systems.system import Kernel

if TYPE_CHECKING:
    from sweeps import mechanics

ANIMATED = ("bead_on_hoop", "double_pendulum", "pendulum")
Component = Annotated[float, number(lambda x: True, "any finite number")]


def _not_zero(values: tuple[float, ...]) -> tuple[float, ...]:
    if not any(values):
        raise refusal("has no direction: all numbers are 0", "a list of numbers that are not all 0")
    return values


class OscillatorIntegration(Integration):
    """How each run of a small oscillation is made."""

    rotations: Positive = key("length of a run in cycles of the system's scale, 2π/rate_scale: > 0", 4.0)
    tolerance: Tolerance = key("relative error allowed on the motion, 1e-13 to 1e-3", 1e-10)
    direction: Annotated[tuple[Component, ...], AfterValidator(_not_zero)] = key(
        "direction of the perturbation: a list of one number per coordinate, in the coordinates' units, "
        "not all 0; default along each mode"
    )
    degenerate: bool = key(
        "true or false: for a system of one coordinate, whether to compute the frequency at the "
        "amplitude of the perturbation where V'' = 0 and a higher-order term confines the motion",
        False,
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


class Oscillator(Described):
    """The full equations of motion of a described system, near each of its equilibria, mode by mode."""

    point_seconds = 4e-5  # 1e-5 to 1e-4, by how hard its equilibria are to enclose
    start_seconds = 3.5  # its equations are derived
    method_text = "direct integration of the full Euler-Lagrange equations"
    kernels = ("oscillations", "enclosures", "roots", "matrices")
    compiled = (*SEARCH, Kernel("oscillations", seconds=2.0), *PLANNING)
    library = MECHANICS / "library"
    base_model = OscillatorDefinition
    tables = tables
    spectrum = ("mode",)
    several: Mapping[str, str] = {**Described.several, "mode": "modes"}
    literature = "Landau and Lifshitz, Mechanics, section 23"
    shown = "measured rates of small oscillations about each equilibrium, compared with linear theory"

    def __init__(self, name: str, load: "Callable[[], mechanics.System]", source: bytes, folder: str = ""):
        super().__init__(name, load, source, folder)
        self.picture_seconds = 4.5 if name in ANIMATED else 2.5
        self.compiled = (*type(self).compiled, *([PATHS] if name in ANIMATED else []))

    @staticmethod
    def describes(description: "mechanics.System") -> bool:
        """Return True for any description of no other kind."""
        return True

    @property
    def samples_per_second(self) -> int:
        """By how long its generated code is."""
        return self._code().samples_per_second

    def kernels_of(self, definition: Definition | None = None) -> tuple[Kernel, ...]:
        """Return the kernels of every described system, after the generated code of an animation."""
        kernels = super().kernels_of(definition)
        if self.name not in ANIMATED:
            return kernels
        code = self.mechanism.moving
        return Kernel(str(code.path), seconds=code.compile_seconds), *kernels

    def constants(self) -> dict[str, Any]:
        """Return the names of the coordinates, for which `direction` has one number each."""
        return {"moved": tuple(c.name for c in self.description.kept)}

    def numbers(self) -> dict[str, np.ndarray]:
        """Return the modes of an equilibrium."""
        return {"mode": np.arange(1, len(self.description.kept) + 1, dtype=np.int8)}

    def variables(self, definition: Definition | None = None) -> dict[str, Variable]:
        """Return name → variable, including the position of the equilibrium along each coordinate."""
        if definition is None:
            return VARIABLES
        degenerate = DEGENERATE if definition.integration.degenerate else {}
        followed = FOLLOWED if self.description.follow else {}
        return VARIABLES | self.places() | degenerate | followed

    def columns(self, points: Mapping[str, np.ndarray], integration: Integration) -> dict[str, np.ndarray]:
        """Return linear theory and the measured columns; see `sweeps.mechanics.normal_modes`."""
        self._compiled()
        settings = (integration.rotations, integration.samples_per_rotation, integration.tolerance)
        return self.mechanism.survey(self.slots(points), *settings, integration.direction, integration.degenerate)


KIND = Oscillator
