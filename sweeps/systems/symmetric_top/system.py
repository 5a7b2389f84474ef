"""The free symmetric top, spun at any angle to its figure axis: its definition, its columns and its pictures."""

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Annotated

import numpy as np
from pydantic import Field

from sweeps.schema import parameters
from sweeps.schema.definition import Definition, Integration
from sweeps.schema.parameters import Parameter, Quantity, Range, grid_model, spread
from sweeps.schema.refusals import keys_of
from sweeps.schema.values import MIN_SPIN_RATE, Positive, Tolerance, number, spin_rate
from sweeps.schema.variables import Variable, table
from sweeps.systems.system import System

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

SENSES = ("undetermined", "none", "with_spin", "against_spin")
SHAPES = ("asymmetric", "oblate", "prolate", "sphere")
STATUSES = ("ok", "short_window", "not_converged", "non_finite")

# ---------------------------------------------------------------------------------------------------------
# What a map holds

_SCATTER = "scatter of the samples only"
_RESOLVED = "0 where it does not stand out of the rounding of doubles"

VARIABLES = table(
    Variable(
        "precession_rate_theory",
        "rad s-1",
        "rate at which the angular velocity turns about the figure axis, closed form",
        comment="(I3/I1 - 1) omega3; positive turns from axis 1 towards axis 2",
    ),
    Variable(
        "precession_rate",
        "rad s-1",
        "rate at which the angular velocity turns about the figure axis, measured",
        comment=_RESOLVED,
    ),
    Variable("precession_rate_stderr", "rad s-1", "standard error of the measured precession rate", comment=_SCATTER),
    Variable(
        "momentum_precession_rate",
        "rad s-1",
        "rate at which the angular momentum turns about the figure axis, measured",
        comment=f"from a motion of its own; {_RESOLVED}",
    ),
    Variable(
        "momentum_precession_rate_stderr",
        "rad s-1",
        "standard error of the angular momentum's measured precession rate",
        comment=_SCATTER,
    ),
    Variable("period_theory", "s", "period of the precession, closed form; missing where the rate is 0"),
    Variable("period", "s", "period of the precession, measured; missing where the rate is 0"),
    Variable(
        "sense",
        None,
        "sense of the measured precession, relative to the spin about the figure axis",
        "i1",
        SENSES,
        first_flag=-1,
    ),
    Variable("shape", None, "kind of body by its moments", "i1", SHAPES),
    Variable("body_cone", "degree", "angle of the angular velocity to the figure axis, measured"),
    Variable("momentum_cone_theory", "degree", "angle of the angular momentum to the figure axis, closed form"),
    Variable("momentum_cone", "degree", "angle of the angular momentum to the figure axis, measured"),
    Variable("space_cone_theory", "degree", "angle of the angular velocity to the angular momentum, closed form"),
    Variable("space_cone", "degree", "angle of the angular velocity to the angular momentum, measured"),
    Variable("half_angle_drift", "degree", "largest change of the angular velocity's angle to the figure axis"),
    Variable(
        "coplanarity",
        "1",
        "how far the angular momentum leaves the plane of angular velocity and figure axis",
        comment="largest abs((L x omega) . e3)/(abs(L) abs(omega)) in the run, each vector from a motion of its own",
    ),
    Variable(
        "energy_drift",
        "1",
        "largest relative change of twice the kinetic energy",
        comment="L . omega, L and omega each from a motion of its own",
    ),
    Variable("momentum_drift", "1", "largest relative change of the squared angular momentum"),
    Variable(
        "propagation_error",
        "1",
        "largest distance of the integrated transverse part from the closed form, relative to its size",
    ),
    Variable("steps_per_sample", "1", "integration steps between two samples", "i4"),
    Variable("status", None, "whether the measurement can be trusted", "i1", STATUSES),
    Variable(
        "triangle_margin",
        "1",
        "least of (Ib + Ic - Ia)/(I1 + I2 + I3) over the axes; negative where no body can exist",
    ),
)

RATIO = Quantity(
    "ratio",
    "1",
    "> 0 (1e-150 ≤ ratio ≤ 1e150)",
    Annotated[float, number(lambda x: 1e-150 <= x <= 1e150, "a number > 0 (1e-150 ≤ ratio ≤ 1e150)")],
)
SPIN = Quantity(
    "spin rate about the figure axis",
    "rad s-1",
    "1e-150 ≤ |omega3| ≤ 1e150",
    spin_rate("omega3"),
    least=MIN_SPIN_RATE,
)
HALF_ANGLE = Quantity(
    "half-angle",
    "degree",
    "0 < half_angle < 90",
    Annotated[
        float,
        number(
            lambda x: 1e-100 <= x < 90,
            "a number with 0 < half_angle < 90 (and at least 1e-100), in degrees; at 0 nothing precesses",
        ),
    ],
)

PARAMETERS = (
    Parameter("ratio", RATIO, "ratio I3/I1 of the moments about the figure axis and across it", required=True),
    Parameter("omega3", SPIN, "spin rate about the figure axis", required=True),
    Parameter("half_angle", HALF_ANGLE, "angle of the angular velocity to the figure axis", required=True),
)
ARGUMENTS = tuple(parameter.name for parameter in PARAMETERS)
COORDINATES = parameters.coordinates(PARAMETERS)

# ---------------------------------------------------------------------------------------------------------
# What a definition holds

TopGrid = grid_model("TopGrid", PARAMETERS, __name__)


class TopIntegration(Integration):
    """How each run of a symmetric top is made."""

    rotations: Positive = Field(4.0, description="length of a run in rotations, 2π/|omega3|: > 0")
    tolerance: Tolerance = Field(
        1e-12,
        description="relative error allowed on the transverse part, 1e-13 to 1e-3: below 1e-13 the rounding of "
        "doubles over a run is larger than the request, above 1e-3 the error hides what is measured",
    )


class SymmetricTopDefinition(Definition):
    """A sweep of symmetric tops."""

    grid: TopGrid = Field(description="what is varied: a mapping with " + keys_of(TopGrid))
    integration: TopIntegration = Field(
        TopIntegration(),
        description="how each run is made: a mapping with " + keys_of(TopIntegration),
    )


# ---------------------------------------------------------------------------------------------------------
# The system


class SymmetricTop(System):
    """Euler's equations without torque for I1 = I2, at any angle to the figure axis."""

    name = "symmetric_top"
    model = SymmetricTopDefinition
    references = "Landau and Lifshitz, Mechanics, sections 33 and 36"
    caption = "measured precession of the free symmetric top about its figure axis, beside the closed form"
    samples_per_second = 18_000_000  # two motions each, angles and cones

    def dimensions(self, definition: SymmetricTopDefinition) -> dict[str, Range | np.ndarray]:
        """(ratio, omega3, half_angle)."""
        return {name: spread(getattr(definition.grid, name)) for name in ARGUMENTS}

    def arguments(self, definition: SymmetricTopDefinition) -> tuple[str, ...]:
        """Names of what a point consists of."""
        return ARGUMENTS

    def coordinates(self, definition: SymmetricTopDefinition) -> dict[str, Variable]:
        """Name → coordinate."""
        return COORDINATES

    def variables(self, definition: SymmetricTopDefinition | None = None) -> dict[str, Variable]:
        """Name → variable."""
        return VARIABLES

    def columns(self, points: Mapping[str, np.ndarray], integration: TopIntegration) -> dict[str, np.ndarray]:
        """The closed form beside what is measured; see `kernels.symmetric_top`."""
        from kernels import symmetric_top

        settings = (integration.rotations, integration.samples_per_rotation, integration.tolerance)
        return symmetric_top.survey(points, *settings)

    def method(self, definition: SymmetricTopDefinition) -> str:
        """How the motion was computed."""
        return "direct integration of Euler's equations"

    def compile(self) -> None:
        """Compiles the kernels of the precession."""
        point = {"ratio": 1.5, "omega3": 1.0, "half_angle": 30.0}
        self.columns({name: np.array([value]) for name, value in point.items()}, TopIntegration())

    def pictures(self, ds: "xr.Dataset") -> "dict[str, Callable[[], Figure | None]]":
        """Precession over I3/I1, and how far it keeps to the closed form over the half-angle."""
        from sweeps.systems.symmetric_top import figure_precession

        return {"precession": lambda: figure_precession.draw(ds)}


SYSTEM = SymmetricTop()
