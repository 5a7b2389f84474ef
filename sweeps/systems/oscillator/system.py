"""Small oscillations of a described mechanical system: what its definition, and its columns are.

One `Oscillator` a description: those of `sweeps/mechanics/library`, and any Python file that a definition names.
"""

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from sweeps.schema.definition import Definition, Integration
from sweeps.schema.variables import Variable
from sweeps.systems.described import MECHANICS, PATHS, TAPES, Described
from sweeps.systems.kernel import Kernel
from sweeps.systems.oscillator import variables as tables
from sweeps.systems.oscillator.definition import OscillatorDefinition
from sweeps.systems.oscillator.variables import DEGENERATE, FOLLOWED, VARIABLES

if TYPE_CHECKING:
    from sweeps import mechanics

ANIMATED = ("bead_on_hoop", "double_pendulum", "pendulum")


class Oscillator(Described):
    """The full equations of motion of a described system, near each of its equilibria, mode by mode."""

    point_seconds = 4e-5  # 1e-5 to 1e-4, by how hard its equilibria are to enclose
    start_seconds = 3.5  # its equations are derived
    method_text = "direct integration of the full Euler-Lagrange equations"
    kernels = ("oscillations", "enclosures", "roots")
    compiled = (
        Kernel("oscillations", seconds=2.0),
        TAPES,
        Kernel("roots", seconds=6.0),
        Kernel("enclosures", seconds=3.0),
    )
    library = MECHANICS / "library"
    base_model = OscillatorDefinition
    tables = tables
    literature = "Landau and Lifshitz, Mechanics, section 23"
    shown = "measured rates of small oscillations about each equilibrium, compared with linear theory"

    def __init__(self, name: str, load: "Callable[[], mechanics.System]", source: bytes, folder: str = ""):
        super().__init__(name, load, source, folder)
        self.picture_seconds = 4.5 if name in ANIMATED else 2.5
        runs, *others = type(self).compiled
        self.compiled = (runs, *([PATHS] if name in ANIMATED else []), *others)

    @staticmethod
    def describes(description: "mechanics.System") -> bool:
        """Return True for any description of no other kind."""
        return True

    @property
    def samples_per_second(self) -> int:
        """By how long its generated code is."""
        return self._code().samples_per_second

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
