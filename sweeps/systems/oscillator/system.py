"""Small oscillations of a described mechanical system, by their rates.

The descriptions are those of `sweeps/mechanics/library`, and any Python file that a definition names.
"""

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

import numpy as np
from pydantic import AfterValidator, model_validator

from sweeps.schema.definition import Definition, Integration
from sweeps.schema.parameters import key, mapping
from sweeps.schema.refusals import Problem, display, refusal, refusals
from sweeps.schema.values import Phase, Positive, Tolerance, number
from sweeps.schema.variables import Parameter, Quantity, Variable
from sweeps.systems import rates
from sweeps.systems.described import MECHANICS, PATHS, PLANNING, SEARCH, Described
from sweeps.systems.invariants import Columns, Invariant
from sweeps.systems.shared_variables import make_epsilon, make_layout, parse_rows, regime_pair, run_rows
from sweeps.systems.system import Example

if TYPE_CHECKING:
    from sweeps import mechanics


# Regimes in the order of their codes in a map, from -1.
REGIMES = ("undetermined", "stable", "unstable", "marginal")

VARIABLES = rates.rate_variables(
    reduced="extrapolated from a half and a quarter of it",
    by="extrapolation",
    size="the amplitude of the mode",
    window="of the size of the system",
) | parse_rows(
    "e_folds  1  e-folds of growth within the window of the log slope",
    *regime_pair(REGIMES),
    """
    amplitude      1    amplitude a of a cos(w t + alpha), relative to the size of the system; missing where not stable
        comment: from the start of the run and the measured frequency
    initial_phase  rad  phase alpha of a cos(w t + alpha); missing where not stable
        comment: from the start of the run and the measured frequency
    """,
    *run_rows("the second derivatives of V"),
    """
    energy_drift   1    largest change of the energy above the equilibrium, relative to the sum of its absolute
        terms [check]
    """,
)

DEGENERATE = parse_rows(
    """
    degenerate_frequency        rad s-1  angular frequency at the amplitude of the perturbation where V'' = 0 and a
        higher-order term of V confines
        comment: closed form of the leading term (sweeps/mechanics/degenerate.py), proportional to the amplitude to the
        power order/2 - 1; missing elsewhere
    degenerate_frequency_error  rad s-1  error of the frequency at the amplitude of the perturbation
        comment: bounds the effect of the other terms of V and of a varying mass at that amplitude
    degenerate_amplitude        1  turning point of that motion, relative to the size of the system
    degenerate_order            1  i1  order of the term of V that confines the motion; 0 where none does
    """
)

BRANCHES = parse_rows(
    """
    branches_decided  -  whether the branches are identified at this point
        flags: 0 decided undecided
        comment: decided: each equilibrium is followed from the default parameters with a proof, or straight through a
        bifurcation; undecided: two branches fit one equilibrium nearly as well, or one appears or ends alone
    """
)

PERTURBATION_PARAMETERS = (
    make_epsilon(1e-6, "the size of the system", "along the mode, relative to the size of the system"),
    Parameter(
        "phase",
        Quantity("direction", "rad", "finite", Phase),
        "direction of the perturbation in the plane of position and velocity over the rate scale",
        0.6,
        "direction of the perturbation: cos(phase) in position, -sin(phase) in velocity over the rate scale, rad",
    ),
)

_MODE = Variable("mode", "1", "normal mode, by ascending Ω²", "i1")
LAYOUT = make_layout(PERTURBATION_PARAMETERS, _MODE, 100, VARIABLES | DEGENERATE | BRANCHES, VARIABLES)
COORDINATES = LAYOUT.coordinates  # the coordinates without the parameters


ANIMATED = ("bead_on_hoop", "double_pendulum", "pendulum")
Component = Annotated[float, number(lambda x: True, "any finite number")]


def _not_zero(values: tuple[float, ...]) -> tuple[float, ...]:
    if not any(values):
        raise refusal("has no direction: all numbers are 0", "a list of numbers that are not all 0")
    return values


class OscillatorIntegration(Integration):
    """Length, accuracy and direction of each run of a small oscillation."""

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
    moving_names: ClassVar[tuple[str, ...]] = ()  # names of the coordinates

    @model_validator(mode="after")
    def _check_direction(self) -> "OscillatorDefinition":
        """Check that `direction` has a number for each moving coordinate, and `degenerate` a single coordinate."""
        direction = self.integration.direction
        if direction is not None and len(direction) != len(self.moving_names):
            reason = f"has {len(direction)} numbers"
            allowed = f"{len(self.moving_names)}, of {', '.join(self.moving_names)}"
            raise refusals([Problem(("integration", "direction"), display(direction), reason, allowed)])
        if self.integration.degenerate and len(self.moving_names) != 1:
            reason = f"is given for {len(self.moving_names)} coordinates"
            allowed = "false, or a system of one coordinate"
            raise refusals([Problem(("integration", "degenerate"), "true", reason, allowed)])
        return self


class Oscillator(Described):
    """The full equations of motion of a described system, near each of its equilibria, mode by mode."""

    point_seconds = 4e-5  # 1e-5 to 1e-4, by how hard its equilibria are to enclose
    start_seconds = 3.5  # its equations are derived
    method_text = "direct integration of the full Euler-Lagrange equations"
    kernels = ("flow.oscillations", "search.enclosures", "search.roots", "flow.matrices")
    shared_seconds = 8.0
    compiled: tuple[Example, ...] = (SEARCH, Example("flow.oscillations"), PLANNING)
    library = MECHANICS / "library"
    base_model = OscillatorDefinition
    spectrum = ("mode",)
    modes_are_separate = True
    several: Mapping[str, str] = {**Described.several, "mode": "modes"}
    literature = "Landau and Lifshitz, Mechanics, section 23"
    map_content = "measured rates of small oscillations about each equilibrium, compared with linear theory"

    def __init__(self, name: str, load: "Callable[[], mechanics.System]", source: bytes, folder: str = ""):
        super().__init__(name, load, source, folder)
        self.picture_seconds = 4.5 if name in ANIMATED else 2.5
        self.compiled = (*type(self).compiled, *([PATHS] if name in ANIMATED else []))

    @staticmethod
    def describes(description: "mechanics.System") -> bool:
        """Return True: this is the kind of all descriptions that belong to no further kind."""
        return True

    @property
    def samples_per_second(self) -> int:
        """Approximate speed, by the length of the generated code."""
        return self._code().samples_per_second

    def examples(self, definition: Definition | None = None) -> tuple[Example, ...]:
        """Return the calls for every described system, after the import of the generated code of an animation."""
        moving_code = [Example(str(self.mechanism.moving.path))] if self.name in ANIMATED else []
        return *moving_code, *super().examples(definition)

    def constants(self) -> dict[str, Any]:
        """Return the names of the coordinates, for which `direction` has one number each."""
        return {"moving_names": tuple(c.name for c in self.description.kept)}

    def numbers(self) -> dict[str, np.ndarray]:
        """Return the modes of an equilibrium."""
        return {"mode": np.arange(1, len(self.description.kept) + 1, dtype=np.int8)}

    def variables(self, definition: Definition | None = None) -> dict[str, Variable]:
        """Return name → variable, including the position of the equilibrium along each coordinate."""
        if definition is None:
            return VARIABLES
        degenerate = DEGENERATE if definition.integration.degenerate else {}
        branches = BRANCHES if self.description.follow else {}
        return VARIABLES | self.places() | degenerate | branches

    def has_pairs(self, columns: Columns) -> np.ndarray:
        """Return True: forces have a potential."""
        return np.ones(len(columns["status"]), dtype=bool)

    def invariants(self, columns: Columns, has_pairs: np.ndarray) -> Invariant:
        """Return Ω² of the mode, extrapolated to zero amplitude."""
        names = ("omega_squared_theory", "omega_squared_reduced", "omega_squared_reduced_error")
        return Invariant(*(columns[name][None] for name in names))

    def critical_modes(self, columns: Columns) -> tuple[np.ndarray, np.ndarray]:
        """Return 1, the number among the modes of a point that is one mode, and the frequency 0."""
        return np.ones(len(columns["status"]), dtype=np.int64), np.zeros(len(columns["status"]))

    def complex_rates(self, columns: Any) -> Any:
        """Return iΩ of each mode, or its growth rate, and an error: √a and √b differ by |a - b|/√|a| at most."""
        square, error = columns["omega_squared_reduced"], columns["omega_squared_reduced_error"]
        with np.errstate(all="ignore"):
            return np.sqrt(-square + 0j), np.fmin(error / np.sqrt(np.abs(square)), np.sqrt(error))

    def columns(self, points: Mapping[str, np.ndarray], integration: OscillatorIntegration) -> dict[str, np.ndarray]:
        """Return linear theory and the measured columns; see `sweeps.mechanics.normal_modes`."""
        self._load_code()
        settings = (integration.rotations, integration.samples_per_rotation, integration.tolerance)
        return self.mechanism.survey(self.slots(points), *settings, integration.direction, integration.degenerate)


KIND = Oscillator
