"""A rigid body on a Kepler ellipse: growth of perturbations of its attitude, in the orbit's plane and out of it.

Axes 1, 2 and 3 of the body point along the radius, along the track and along the orbit's normal in the reference
motion. (The system `gravity_gradient` has axes along the track, minus the normal and the nadir: its I1, I2, I3 are
I2, I3, I1 here, its k1 = (I2 - I3)/I1 and k3 = (I2 - I1)/I3 are k1 = (I3 - I1)/I2 and k3 = (I3 - I2)/I1 here.)
"""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from pydantic import Field, model_validator

from sweeps.schema.datasets import Dataset
from sweeps.schema.parameters import Range, grid_model, mapping, spread
from sweeps.schema.refusals import Problem, display, refusals
from sweeps.schema.values import Positive, choice, list_of_different, number
from sweeps.schema.variables import Layout, Parameter, Quantity, Variable, coordinates_of, table
from sweeps.systems import described
from sweeps.systems.bodies.variables import MOMENT, TRIANGLE_MARGIN
from sweeps.systems.orbit.shapes import SHAPES, inertia_ratios, margin_of
from sweeps.systems.periodic.system import (
    INVARIANTS,
    MULTIPLIER,
    MULTIPLIERS,
    FloquetSystem,
    OnePeriod,
    PeriodicDefinition,
    trace_reference,
)
from sweeps.systems.shared_variables import make_epsilon, parse_rows, with_theory
from sweeps.systems.system import Example, Point, Points, Reference

if TYPE_CHECKING:
    from sweeps.mechanics.model import Model

PLANES = ("in_plane", "out_of_plane")
#: motion → the parameters that it has in addition to those of the body, the orbit and the perturbation
MOTIONS = {
    "synchronous": ("eccentricity",),
    "libration": ("amplitude",),
    "spin_normal": ("eccentricity", "spin"),
    "spin_orbit": ("eccentricity", "p", "radial_axis"),
}
CAVEATS = "point-mass primary without J2; rigid body; no coupling of the rotation with the orbit"


def _quantity(noun: str, units: str, bounds: str, is_allowed) -> Quantity:
    """Return a kind of numbers with a check of their bounds."""
    text = f"a number with {bounds}" if any(sign in bounds for sign in "<≤>") else bounds
    return Quantity(noun, units, bounds, Annotated[float, number(is_allowed, text)])


RATIO = _quantity("ratio", "1", "0.01 ≤ ratio ≤ 100", lambda x: 0.01 <= x <= 100.0)
INERTIA_RATIO = _quantity("ratio of inertia", "1", "-1 < ratio < 1", lambda x: -1.0 < x < 1.0)
PARAMETERS = (
    *(
        Parameter(f"I{axis}", MOMENT, f"moment about the axis {where}")
        for axis, where in enumerate(("along the radius", "along the track", "of the orbit's normal"), 1)
    ),
    Parameter("a_over_b", RATIO, "radial over along-track semi-axis"),
    Parameter("b_over_c", RATIO, "along-track over normal semi-axis"),
    Parameter("k1", INERTIA_RATIO, "ratio (I3 - I1)/I2"),
    Parameter("k3", INERTIA_RATIO, "ratio (I3 - I2)/I1"),
    Parameter("K", _quantity("K", "1", "0 < K ≤ 2", lambda x: 0.0 < x <= 2.0), "ratio I3/I1, I1 = I2"),
    Parameter("asymmetry", INERTIA_RATIO, "equatorial asymmetry"),
    Parameter(
        "eccentricity", _quantity("eccentricity", "1", "0 ≤ e ≤ 0.95", lambda x: 0.0 <= x <= 0.95), "eccentricity", 0.0
    ),
    Parameter(
        "amplitude",
        _quantity("amplitude", "rad", "0 < amplitude ≤ 1.57", lambda x: 0.0 < x <= 1.57),
        "largest angle of the libration from the radius",
    ),
    Parameter("spin", _quantity("spin", "1", "-100 ≤ spin ≤ 100", lambda x: abs(x) <= 100.0), "spin over mean motion"),
    Parameter(
        "p",
        _quantity("p", "1", "1/2, 1, 3/2, 2 or 5/2", lambda x: x in (0.5, 1.0, 1.5, 2.0, 2.5)),
        "rotations per orbit",
    ),
    Parameter(
        "radial_axis",
        _quantity("axis", "1", "1 or 2", lambda x: x in (1.0, 2.0)),
        "axis that points along the radius at the pericentre",
        1.0,
    ),
    Parameter("semi_major_axis", Quantity("length", "m", "> 0", Positive), "semi-major axis of the orbit", 1.0),
    Parameter("mu", Quantity("mu", "m3 s-2", "> 0", Positive), "gravitational parameter of the primary", 1.0),
    make_epsilon(
        1e-8,
        "the sizes of tilts and momenta",
        "relative to tilts and momenta of order 1",
        "; of no effect: infinitesimal",
    ),
)
ARGUMENTS = (*(parameter.name for parameter in PARAMETERS), "plane")
_ERROR = "a bound: that of growth_per_period, over the orbits of a period"
VARIABLES = (
    MULTIPLIERS
    | INVARIANTS
    | parse_rows(
        *with_theory("growth_per_orbit", "1", "growth rate times the orbital period", _ERROR),
        """
    period         s    period of the motion: of the orbit, or of the libration
    angle_start    rad  angle of the radial axis from the radius at the pericentre, or at the time 0
    rate_start     1    derivative of this angle by the true anomaly, there
    base_residual  1    distance of the base motion from where it began a period before, relative to the states' sizes
    branch         1  i1  number of the motion among the odd periodic ones, by ascending rate_start; 0 if missing
        comment: the motion whose rate_start is nearest to p - 1; where it ends at a fold, the number changes
    """,
        TRIANGLE_MARGIN,
    )
)
_PLANE = Variable("plane", None, "plane of the perturbation", "str")
LAYOUT = Layout(
    coordinates_of(PARAMETERS) | table(_PLANE, MULTIPLIER),
    VARIABLES,
    tuple(name for name, variable in VARIABLES.items() if not variable.over),
    {parameter.name: parameter.quantity.item for parameter in PARAMETERS} | {"plane": str, MULTIPLIER.name: int},
    spare=(*(name for name in ARGUMENTS[:-1] if name not in ("semi_major_axis", "mu", "epsilon")), MULTIPLIER.name),
)
COORDINATES = LAYOUT.coordinates

OrbitGrid = grid_model("OrbitGrid", PARAMETERS, __name__)


class OrbitDefinition(PeriodicDefinition):
    """A sweep of rigid bodies on Kepler ellipses."""

    motion: Annotated[str, choice(tuple(MOTIONS))] = Field(
        "synchronous", description=f"the reference motion: {', '.join(MOTIONS)}"
    )
    planes: list_of_different(Annotated[str, choice(PLANES)]) = Field(
        (), description="in_plane, out_of_plane: which perturbations; left out, all that the motion has"
    )
    shape_uncertainty: Annotated[float, number(lambda x: 0.0 < x < 1.0, "a number with 0 < shape_uncertainty < 1")] = (
        Field(0.03, description="standard deviation of each ratio of semi-axes about start_at, for P(unstable)")
    )
    grid: OrbitGrid = mapping("what is varied", OrbitGrid, required=True)

    @property
    def shape(self) -> tuple[str, ...]:
        """Return the names of the parameters that give the body."""
        return next((names for names in SHAPES if all(getattr(self.grid, name) is not None for name in names)), ())

    @property
    def selected_planes(self) -> tuple[str, ...]:
        """Return the planes that are measured."""
        return self.planes or (PLANES[1:] if self.motion in ("libration", "spin_normal") else PLANES)

    @model_validator(mode="after")
    def _check_motion(self) -> "OrbitDefinition":
        """Refuse bodies given in no way or in two, and parameters and planes that the motion does not have."""
        all_shapes = [name for names in SHAPES for name in names]
        given = [name for name in all_shapes if getattr(self.grid, name) is not None]
        ways = "; ".join(", ".join(names) for names in SHAPES)
        grid: Any = self.grid
        problems = []
        if tuple(given) != self.shape:
            problems.append(
                Problem(("grid",), ", ".join(given) or "(nothing)", "does not give a body", f"one of {ways}")
            )
        motion_names = MOTIONS[self.motion]
        for name in sorted({name for names in MOTIONS.values() for name in names} - {*motion_names}):
            if name in grid.model_fields_set:
                words = f"is no parameter of {self.motion}"
                problems.append(
                    Problem(("grid", name), display(getattr(self.grid, name)), words, ", ".join(motion_names))
                )
        problems += [
            Problem(("grid", name), "(nothing)", f"is missing for {self.motion}", "a value")
            for name in motion_names
            if getattr(self.grid, name) is None
        ]
        if self.motion == "spin_normal" and not problems:
            entries = [spread(getattr(grid, name)) for name in self.shape]
            values = np.meshgrid(*([x.start, x.stop] if isinstance(x, Range) else x for x in entries))
            if inertia_ratios(dict(zip(self.shape, values, strict=True)))[1].any():
                problems.append(Problem(("grid",), ", ".join(given), "has bodies without I1 = I2", "I1 = I2, or K"))
        out_of_plane_only = self.motion in ("libration", "spin_normal")
        if "in_plane" in self.planes and out_of_plane_only:
            words = f"has no dynamics with motion {self.motion}: energy, or spin, and phase are constant"
            problems.append(Problem(("planes",), "in_plane", words, "out_of_plane"))
        if self.shape == ("asymmetry",) and self.selected_planes != PLANES[:1]:
            words = "does not determine the motion out of the plane"
            problems.append(Problem(("grid", "asymmetry"), "(given)", words, "with planes: [in_plane]"))
        if problems:
            raise refusals(problems)
        return self


class Orbit(FloquetSystem):
    """A rigid body on a Kepler ellipse, by the multipliers of its attitude.

    Args:
        motion: the reference motion.
    """

    name = "orbit"
    method_text = "Taylor series of the attitude with its tangent flow over one period, certified by collocation"
    kernels = (*FloquetSystem.kernels, "free.triangle")
    compile_seconds = 5.0
    model = OrbitDefinition
    references = "Beletsky (1966); Kane and Barba, J. Appl. Mech. 33 (1966) 402; Kane, AIAA J. 3 (1965) 726"
    caption = f"measured multipliers of a body's attitude on its orbit, beside linear theory ({CAVEATS})"
    samples_per_second = 300
    existence: tuple[str, ...] = ()

    def __init__(self, motion: str = "", shape: tuple[str, ...] = ()):
        self.motion_name, self.existence = motion, shape

    def bound(self, definition: OrbitDefinition) -> "Orbit":
        """Return the system with the definition's motion."""
        return Orbit(definition.motion, definition.shape)

    def arguments(self, definition: OrbitDefinition) -> tuple[str, ...]:
        """Return the names of the parameters that the body and the motion have, and the plane."""
        motion_names = (*definition.shape, *MOTIONS[definition.motion], "semi_major_axis", "mu", "epsilon")
        return (*(name for name in ARGUMENTS[:-1] if name in motion_names), "plane")

    def dimensions(self, definition: OrbitDefinition) -> dict[str, Range | np.ndarray]:
        """Return the parameters and the planes."""
        names = self.arguments(definition)[:-1]
        return {name: spread(getattr(definition.grid, name)) for name in names} | {
            "plane": np.array(definition.selected_planes)
        }

    def extra_dimensions(self, definition: OrbitDefinition) -> dict[str, np.ndarray]:
        """Return the multipliers of a point: two in the plane, four out of it."""
        count = 4 if "out_of_plane" in definition.selected_planes else 2
        return {"multiplier": np.arange(1, count + 1, dtype=np.int8)}

    def columns(self, points: Mapping[str, np.ndarray], integration: OnePeriod) -> dict[str, np.ndarray]:
        """Return the columns of the variational flow and of the measurement; see `equations`."""
        from sweeps.systems.orbit import equations

        return equations.survey(points, self.motion_name, integration.tolerance, tuple(VARIABLES))

    def impossible(self, points: Mapping[str, np.ndarray]) -> np.ndarray:
        """Return True for points at which one moment exceeds the sum of the two remaining moments."""
        return margin_of(points) < 0

    @property
    def mechanism(self) -> "Model":
        """The derived equations and the code that integrates them."""
        from sweeps.systems.orbit import equations

        return equations.orbit_model()

    def examples(self, definition: OrbitDefinition | None = None) -> tuple[Example, ...]:
        """Return the calls of all periodic systems, and the imports of the code of the definition's motion."""
        if definition is None:
            return self.compiled
        from sweeps.systems.orbit import equations

        models = [] if definition.selected_planes == PLANES[:1] else [equations.tilt_model(definition.motion)]
        models += [equations.planar_model()] if definition.motion in equations.RESONANCES else []
        codes = [code for model in models for code in (model.perturbed_code(self.is_still), model.moving)]
        return (*(Example(str(code.path)) for code in codes), *self.compiled, described.ENCLOSURES)

    def proofs(self, grid: Points) -> tuple[str, ...]:
        """Return the symmetries that are used."""
        return (
            "Hamilton's equations: multipliers come in pairs μ, 1/μ",
            "mirror image in the orbit's plane: perturbations in the plane and out of it separate",
        )

    def fingerprint(self) -> str:
        """Return a hash of the kernels, the generated code, its generator and the equations."""
        source = b"".join(Path(__file__).with_name(f"{name}.py").read_bytes() for name in ("equations", "odd_motions"))
        return described.hash_sources(self.kernels, self.mechanism.perturbed_code(self.is_still), source)

    @property
    def is_still(self) -> bool:
        """True if the reference motion is an exact solution, so that it is not integrated."""
        return self.motion_name in ("libration", "spin_normal")

    def motion(self, point: Point, duration: float | None, samples: int | None, tolerance: float) -> Dataset:
        """Return the motion by the full equations after a small tilt; see `Dynamics.motion`."""
        from sweeps.systems.orbit.motion import motion_of

        return motion_of(point, duration, samples, tolerance)

    def reference(self) -> Reference:
        """Return the trace of the monodromy matrix, found again by SciPy."""
        from sweeps.systems.orbit.scipy_trace import trace_by_scipy

        return trace_reference(trace_by_scipy)


SYSTEM = Orbit()
