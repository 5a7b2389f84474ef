"""The free rigid body, spun about a principal axis and nudged: its definition, its columns and its pictures."""

import hashlib
from collections.abc import Callable, Iterator, Mapping
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import numpy as np
from pydantic import AfterValidator, BeforeValidator, Field, PrivateAttr, ValidationInfo, model_validator

from sweeps.schema import parameters
from sweeps.schema.definition import Definition, Integration
from sweeps.schema.parameters import Parameter, Quantity, Range, grid_model, spread
from sweeps.schema.refusals import Problem, description_of, display, hint, keys_of, refusal, refusals
from sweeps.schema.values import (
    MIN_SPIN_RATE,
    Axis,
    Epsilon,
    Moment,
    Phase,
    Positive,
    Prose,
    Strict,
    ascending,
    choice,
    different,
    finite,
    line_of_text,
    not_empty,
    spin_rate,
)
from sweeps.schema.variables import Variable, table
from sweeps.systems.rigid_body import inertia
from sweeps.systems.system import System

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure
    from PIL.Image import Image

PROPAGATORS = ("direct", "exact")
MOMENTS = ("I1", "I2", "I3")
SHAREABLE = ("omega0", "epsilon", "phase")  # what a body may give, and the grid gives where it does not
ARGUMENTS = ("axis", *MOMENTS, *SHAREABLE)

REGIMES = ("undetermined", "stable_minor", "stable_major", "unstable", "marginal", "sphere")
SHAPES = ("asymmetric", "oblate", "prolate", "sphere")
STATUSES = ("ok", "short_window", "not_converged", "non_finite")

COMPARED = 32  # points of a block that a collapsed sweep also integrates as themselves
LEAST_NUDGES = 6  # the picture of a power law in epsilon wants that many

# ---------------------------------------------------------------------------------------------------------
# What a map holds


_SCATTER = "scatter of the samples only: it does not know the bias of a finite amplitude"

VARIABLES = table(
    Variable("omega_squared_theory", "s-2", "signed square of the rate, linear theory"),
    Variable("omega_squared", "s-2", "signed square of the rate, measured"),
    Variable(
        "omega_squared_stderr",
        "s-2",
        "standard error of the measured signed square of the rate",
        comment=_SCATTER,
    ),
    Variable("growth_rate_theory", "s-1", "growth rate, linear theory; 0 where not unstable", sparse=True),
    Variable("growth_rate", "s-1", "growth rate, measured; 0 where not unstable", sparse=True),
    Variable("growth_rate_stderr", "s-1", "standard error of the measured growth rate", comment=_SCATTER, sparse=True),
    Variable("frequency_theory", "rad s-1", "angular frequency, linear theory; 0 where not stable"),
    Variable("frequency", "rad s-1", "angular frequency, measured; 0 where not stable"),
    Variable(
        "frequency_stderr",
        "rad s-1",
        "standard error of the measured angular frequency",
        comment=_SCATTER,
    ),
    Variable(
        "growth_rate_logslope",
        "s-1",
        "growth rate by the slope of the logarithm of the transverse size",
        comment="missing where its window (2 to 1000 times the start, below 0.01 omega0) holds under two e-folds",
        sparse=True,
    ),
    Variable("e_folds", "1", "e-folds of growth inside the window of the log slope", "f4"),
    Variable("euler_period", "s", "period of the nudge's turn about the spin axis, measured; missing where not stable"),
    Variable("regime_theory", None, "regime, linear theory", "i1", REGIMES[1:]),
    Variable("regime", None, "regime, measured", "i1", REGIMES, first_flag=-1),
    Variable("shape", None, "kind of body by its moments", "i1", SHAPES),
    Variable("growing_fraction", "1", "share of the start that lies on the growing mode", "f4"),
    Variable("samples_used", "1", "number of samples inside the measurement window", "i4"),
    Variable("window_end", "s", "time of the last sample inside the measurement window", sparse=True),
    Variable("steps_per_sample", "1", "integration steps between two samples", "i4"),
    Variable("status", None, "whether the measurement can be trusted", "i1", STATUSES),
    Variable(
        "triangle_margin",
        "1",
        "least of (Ib + Ic - Ia)/(I1 + I2 + I3) over the axes; negative where no body can exist",
        "f4",
    ),
    Variable("energy_drift", "1", "largest relative change of twice the kinetic energy", "f4"),
    Variable("momentum_drift", "1", "largest relative change of the squared angular momentum", "f4"),
    Variable(
        "perturbation_drift",
        "1",
        "largest change of the perturbation's own invariant, relative to its absolute terms",
        "f4",
        comment="Ib (Ib - Ia) wb^2 + Ic (Ic - Ia) wc^2, which sees errors that energy and momentum do not",
    ),
)

CERTIFICATE = table(
    Variable(
        "propagation_error",
        "1",
        "largest distance of the direct solution from the exact one, relative to the largest transverse size so far",
        "f4",
        comment="the certificate: over the samples used, across the spin axis, by an exact step that shares no code "
        "with the direct integrator",
    )
)

FLIPS = table(
    Variable(
        "flip_period",
        "s",
        "time between two changes of sign of the spin, measured; missing where it keeps its sign",
        comment="from the start forward to the first change and backward to the last one",
    ),
    Variable("flip_period_exact", "s", "time between two changes of sign of the spin, closed form: 2 K/p"),
    Variable(
        "max_tilt", "rad", "largest angle of the angular velocity from the end of the axis it starts near, measured"
    ),
    Variable("max_tilt_exact", "rad", "largest angle of the angular velocity from that end, closed form"),
    Variable(
        "frequency_exact",
        "rad s-1",
        "angular frequency of the motion at its own amplitude, closed form: pi p/(2 K)",
        comment="tends to frequency_theory about a stable axis as the nudge gets small",
    ),
)

SpinRate = spin_rate("omega0")
MOMENT = Quantity("moment", "kg m2", "finite, > 0", Moment)
SPIN = Quantity("spin rate", "rad s-1", "1e-150 ≤ |omega0| ≤ 1e150", SpinRate, least=MIN_SPIN_RATE)
SIZE = Quantity("size", "1", "0 < epsilon < 1", Epsilon)
DIRECTION = Quantity("direction", "rad", "finite", Phase)

PARAMETERS = (
    *(
        Parameter(
            f"I{i}",
            MOMENT,
            f"principal moment of inertia about axis {i}",
            description=f"moment of inertia about axis {i}, kg m2, > 0",
        )
        for i in (1, 2, 3)
    ),
    Parameter(
        "omega0",
        SPIN,
        "spin rate",
        description="spin rate, rad s-1, 1e-150 ≤ |omega0| ≤ 1e150, negative spins the other way",
    ),
    Parameter(
        "epsilon",
        SIZE,
        "size of the nudge relative to the spin rate",
        1e-6,
        "size of the nudge relative to omega0, 0 < epsilon < 1",
    ),
    Parameter(
        "phase",
        DIRECTION,
        "direction of the nudge in the (b, c) plane",
        0.6,
        "direction of the nudge in the (b, c) plane, rad, from b towards c",
    ),
)

COORDINATES = (
    table(Variable("axis", "1", "spin axis (1, 2 or 3)", "i1"), Variable("body", None, "body", "str"))
    | parameters.coordinates(PARAMETERS)
    | table(
        Variable(
            "moments_are_ratios",
            None,
            "whether the moments are known as ratios only",
            "i1",
            ("kilogram_square_metres", "ratios"),
            "where 1, I1, I2 and I3 of the body are in a unit of their own",
        )
    )
)

# ---------------------------------------------------------------------------------------------------------
# What a definition holds

GridEntries = grid_model("GridEntries", PARAMETERS, __name__)


class Ratios(Strict):
    """Moments of a body of which only the ratios are known."""

    I1: Moment = Field(description="I1 in any one unit (I3, M R2, …): finite, > 0")
    I2: Moment = Field(description="I2 in the same unit: finite, > 0")
    I3: Moment = Field(description="I3 in the same unit: finite, > 0")


_ROWS = "3 rows of 3 finite numbers: [[Ixx, Ixy, Ixz], [Iyx, Iyy, Iyz], [Izx, Izy, Izz]]"


def _tensor(value: object) -> tuple[tuple[float, ...], ...]:
    rows = value if isinstance(value, tuple | list) else ()
    if len(rows) != 3 or not all(isinstance(row, tuple | list) and len(row) == 3 for row in rows):
        raise refusal("is no tensor of inertia", _ROWS)
    return tuple(tuple(finite(entry, _ROWS) for entry in row) for row in rows)


class Mesh(Strict):
    """A body as the closed surface that bounds it, evenly filled."""

    file: Annotated[str, line_of_text(1000)] = Field(
        description="an STL, OBJ, PLY or OFF file, its path relative to the definition's"
    )
    density: Positive = Field(default=None, description="density, kg m-3: finite, > 0")
    mass: Positive = Field(default=None, description="mass of the whole body, kg, in place of density: finite, > 0")
    unit: Annotated[str, choice(tuple(inertia.UNITS))] = Field(
        "m", description="what the file's lengths are in: " + ", ".join(inertia.UNITS)
    )

    @model_validator(mode="after")
    def _check_density(self) -> "Mesh":
        if (self.density is None) == (self.mass is None):
            wrong = "is missing" if self.density is None else "is given beside mass"
            shown = "(nothing)" if self.density is None else display(self.density)
            raise refusals([Problem(("density",), shown, wrong, "density (kg m-3) or mass (kg), one of them")])
        return self


class Observed(Strict):
    """What people measured of a body's motion: for comparison only, nothing is computed from it."""

    period_days: Positive = Field(description="observed period, days of 86,400 s: > 0")
    what: Annotated[str, line_of_text(100)] = Field(description="what has that period: one line of text")


class Body(Strict):
    """One real body: its moments (or their ratios) and whatever else is its own."""

    name: Annotated[str, line_of_text(100)] = Field(
        description="the body's name, unique in the sweep: one line of text, at most 100 characters"
    )
    I1: Moment = Field(default=None, description="moment of inertia about axis 1, kg m2: finite, > 0")
    I2: Moment = Field(default=None, description="moment of inertia about axis 2, kg m2: finite, > 0")
    I3: Moment = Field(default=None, description="moment of inertia about axis 3, kg m2: finite, > 0")
    ratios: Ratios = Field(default=None, description="{I1, I2, I3} in place of moments, in any one unit")
    tensor: Annotated[tuple, BeforeValidator(_tensor)] = Field(
        default=None,
        description="the whole tensor of inertia about the centre of mass, kg m2, in place of moments, symmetric, "
        f"off-diagonal entries minus the products of inertia; {_ROWS}",
    )
    mesh: Mesh = Field(default=None, description="{file, density or mass, unit} in place of moments")
    omega0: SpinRate = Field(default=None, description="the body's own spin rate, rad s-1: 1e-150 ≤ |omega0| ≤ 1e150")
    epsilon: Epsilon = Field(default=None, description="the body's own size of the nudge, relative: 0 < epsilon < 1")
    phase: Phase = Field(default=None, description="the body's own direction of the nudge, rad: finite")
    axis: Axis = Field(default=None, description="the axis it spins about in nature: 1, 2 or 3")
    source: Prose = Field(default=None, description="where the numbers come from: text")
    note: Prose = Field(default=None, description="what a reader should know: text")
    observed: Observed = Field(default=None, description="what people measured: {period_days, what}")

    _principal: inertia.Principal | None = PrivateAttr(None)
    _solid: inertia.Solid | None = PrivateAttr(None)
    _digest: str = PrivateAttr("")

    @property
    def moments(self) -> tuple[float, float, float]:
        """(I1, I2, I3): kg m2, or in the unit of `ratios` where only those are known; ascending from tensor or mesh."""
        if self._principal is not None:
            return self._principal.moments
        given = self if self.ratios is None else self.ratios
        return given.I1, given.I2, given.I3

    @property
    def principal(self) -> inertia.Principal | None:
        """Principal moments and axes, where they come from a tensor or a mesh."""
        return self._principal

    @property
    def solid(self) -> inertia.Solid | None:
        """Mass properties, where they come from a mesh."""
        return self._solid

    @property
    def input(self) -> str:
        """The mesh's file as the definition names it, with the SHA-256 of its content; empty without a mesh."""
        return f"{self.mesh.file} {self._digest}" if self.mesh else ""

    @model_validator(mode="after")
    def _check_moments(self, info: ValidationInfo) -> "Body":
        either = "I1, I2 and I3 in kg m2, or ratios: {I1, I2, I3}, or tensor, or mesh: {file, …}, one of these"
        given = [name for name in MOMENTS if getattr(self, name) is not None]
        others = [name for name in ("ratios", "tensor", "mesh") if getattr(self, name) is not None]
        if others:
            wrong = [
                (name, display(getattr(self, name)), f"is given beside {others[0]}") for name in given + others[1:]
            ]
        else:
            wrong = [(name, "(nothing)", "is missing") for name in MOMENTS if name not in given]
        if wrong:
            raise refusals([Problem((name,), shown, what, either) for name, shown, what in wrong])
        self._find_principal((info.context or {}).get("folder", ""))
        return self

    def _find_principal(self, folder: str) -> None:
        try:
            if self.tensor is not None:
                self._principal = inertia.principal(self.tensor)
            elif self.mesh is not None:
                path = Path(folder) / self.mesh.file
                self._solid = inertia.solid(path, self.mesh.density, self.mesh.mass, self.mesh.unit)
                self._principal = self._solid.principal
                self._digest = hashlib.sha256(path.read_bytes()).hexdigest()
        except inertia.InertiaError as error:
            where = ("tensor",) if self.mesh is None else ("mesh", "file")
            shown = error.shown if self.mesh is None else display(self.mesh.file)
            raise refusals([Problem(where, shown, error.wrong, error.allowed)]) from None


class RigidBodyIntegration(Integration):
    """How each run of a rigid body is made."""

    propagator: Annotated[str, choice(PROPAGATORS)] = Field(
        "direct",
        description="how the motion is computed: direct (step by step, each point certified by the closed form) or "
        "exact (the closed form's own step)",
    )
    collapse: bool = Field(
        False,
        description="true or false: whether points that differ by units alone are integrated once and expanded",
    )
    variables: Annotated[tuple[str, ...], AfterValidator(not_empty), AfterValidator(different)] = Field(
        None,
        description="which variables to make: a list of names of a map's variables; left out, all of them",
    )
    flips: bool = Field(
        False,
        description="true or false: whether to follow the motion on to its flips and its largest tilt, up to "
        "10,000 rotations each way",
    )

    @property
    def table(self) -> dict[str, Variable]:
        """Name → variable of a map that is made so."""
        chosen = self._possible
        return chosen if self.variables is None else {name: chosen[name] for name in chosen if name in self.variables}

    @property
    def _possible(self) -> dict[str, Variable]:
        certificate = CERTIFICATE if self.propagator == "direct" else {}
        return VARIABLES | certificate | (FLIPS if self.flips else {})

    @model_validator(mode="after")
    def _check_variables(self) -> "RigidBodyIntegration":
        names = self._possible
        wrong = [
            Problem(
                ("variables", i), display(name), "is no variable of this sweep" + hint(name, names), ", ".join(names)
            )
            for i, name in enumerate(self.variables or ())
            if name not in names
        ]
        if wrong:
            raise refusals(wrong)
        return self


def _named_once(bodies: tuple["Body", ...]) -> tuple["Body", ...]:
    names = [body.name for body in bodies]
    problems = [
        Problem((number, "name"), display(name), "is an earlier body's name", "names that all differ")
        for number, name in enumerate(names)
        if name in names[:number]
    ]
    if problems:
        raise refusals(problems)
    return bodies


class RigidBodyDefinition(Definition):
    """A sweep of free rigid bodies: about which axes, over which moments or bodies."""

    axes: Annotated[
        tuple[Axis, ...], AfterValidator(not_empty), AfterValidator(different), AfterValidator(ascending)
    ] = Field((1, 2, 3), description="spin axes to survey: a list of 1, 2, 3, each once")
    grid: GridEntries = Field(GridEntries(), description="what is varied: a mapping with " + keys_of(GridEntries))
    bodies: Annotated[tuple[Body, ...], AfterValidator(not_empty), AfterValidator(_named_once)] = Field(
        default=(), description="a list of bodies, names unique, in place of I1, I2 and I3 in grid"
    )
    integration: RigidBodyIntegration = Field(
        RigidBodyIntegration(),
        description="how each run is made: a mapping with " + keys_of(RigidBodyIntegration),
    )

    @cached_property
    def inputs(self) -> str:
        """The meshes of the bodies, one a line with the SHA-256 of its content."""
        return "\n".join(body.input for body in self.bodies if body.mesh is not None)

    def is_per_body(self, parameter: str) -> bool:
        """Whether `parameter` (I1 … phase) is a coordinate on `body` rather than a dimension."""
        if parameter in MOMENTS:
            return bool(self.bodies)
        return any(getattr(body, parameter) is not None for body in self.bodies)

    @model_validator(mode="after")
    def _check_grid(self) -> "Definition":
        problems = [p for name in MOMENTS for p in self._moment_problems(name)]
        problems += [p for name in SHAREABLE for p in self._shared_problems(name)]
        if problems:
            raise refusals(problems)
        return self

    def _moment_problems(self, name: str) -> Iterator[Problem]:
        entry = getattr(self.grid, name)
        if self.bodies and entry is not None:
            allowed = "moments in bodies or in grid, not both"
            yield _grid_problem(name, display(entry), "is given beside bodies", allowed)
        if not self.bodies and entry is None:
            yield _grid_problem(name, "(nothing)", "is missing", description_of(GridEntries, name))

    def _shared_problems(self, name: str) -> Iterator[Problem]:
        entry = getattr(self.grid, name)
        giving = [body for body in self.bodies if getattr(body, name) is not None]
        if giving and len(giving) == len(self.bodies):
            if name in self.grid.model_fields_set:
                wrong = "is given although every body gives its own"
                yield _grid_problem(name, display(entry), wrong, f"{name} in grid or in every body, not both")
        elif entry is None:
            yield _grid_problem(name, "(nothing)", "is missing", description_of(GridEntries, name))
        elif giving and not isinstance(entry, float):
            wrong = f"makes a dimension, but {len(giving)} of {len(self.bodies)} bodies give their own {name}"
            allowed = f"a single number here, or {name} in no body, or in every body and not here"
            yield _grid_problem(name, display(entry), wrong, allowed)


def _grid_problem(name: str, shown: str, wrong: str, allowed: str) -> Problem:
    return Problem(("grid", name), shown, wrong, allowed)


# ---------------------------------------------------------------------------------------------------------
# The system


class RigidBody(System):
    """Euler's equations without torque, near each principal axis."""

    name = "rigid_body"
    model = RigidBodyDefinition
    references = "Landau and Lifshitz, Mechanics, sections 36 and 37"
    caption = "measured rates of small perturbations about each principal axis, beside linear theory"

    def dimensions(self, definition: RigidBodyDefinition) -> dict[str, Range | np.ndarray]:
        """(axis, I1, I2, I3, omega0, epsilon, phase), or (body, axis) and what no body gives itself."""
        bodies = {"body": np.array([body.name for body in definition.bodies])} if definition.bodies else {}
        shared = [name for name in (*MOMENTS, *SHAREABLE) if not definition.is_per_body(name)]
        axes = {"axis": np.array(definition.axes, np.int8)}
        return bodies | axes | {name: spread(getattr(definition.grid, name)) for name in shared}

    def auxiliary(self, definition: RigidBodyDefinition) -> dict[str, tuple[str, np.ndarray]]:
        """Along `body`: I1 … I3, what bodies give, `moments_are_ratios`; {} without bodies."""
        bodies = definition.bodies
        if not bodies:
            return {}
        moments = np.array([body.moments for body in bodies]).T
        columns = dict(zip(MOMENTS, map(np.ascontiguousarray, moments), strict=True))
        for name in filter(definition.is_per_body, SHAREABLE):
            own = [getattr(body, name) for body in bodies]
            shared = getattr(definition.grid, name)
            columns[name] = np.array([shared if value is None else value for value in own])
        columns["moments_are_ratios"] = np.array([body.ratios is not None for body in bodies])
        return {name: ("body", values) for name, values in columns.items()}

    def arguments(self, definition: RigidBodyDefinition) -> tuple[str, ...]:
        """Names of what a point consists of."""
        return ARGUMENTS

    def coordinates(self, definition: RigidBodyDefinition) -> dict[str, Variable]:
        """Name → coordinate."""
        return COORDINATES

    def variables(self, definition: RigidBodyDefinition | None = None) -> dict[str, Variable]:
        """Name → variable: the certificate where the integration is direct, the flips where they are asked for."""
        if definition is None:
            return VARIABLES
        return definition.integration.table

    def columns(self, points: Mapping[str, np.ndarray], integration: RigidBodyIntegration) -> dict[str, np.ndarray]:
        """Linear theory beside what is measured; see `kernels.survey`."""
        from kernels import survey

        settings = (integration.rotations, integration.samples_per_rotation, integration.tolerance)
        options = {"propagator": integration.propagator, "nonlinear": integration.flips, "wanted": integration.table}
        columns = survey.survey(points, *settings, collapse=integration.collapse, **options)
        if integration.collapse and "omega_squared" in columns:
            _compare_with_some_in_full(columns, points, settings, options)
        return columns

    def motions(self, points: Mapping[str, np.ndarray], integration: RigidBodyIntegration) -> int:
        """Points, or with `collapse` the distinct motions among them."""
        from kernels import survey

        return survey.motions(points) if integration.collapse else super().motions(points, integration)

    def method(self, definition: RigidBodyDefinition) -> str:
        """How the motion was computed."""
        if definition.integration.propagator == "exact":
            return "exact steps of the closed-form rotation"
        return "direct integration of Euler's equations, certified by the closed form"

    def compile(self) -> None:
        """Compiles the survey's kernels."""
        point = {"I1": 1.0, "I2": 2.0, "I3": 3.0, "axis": 2, "omega0": 1.0, "epsilon": 1e-6, "phase": 0.6}
        self.columns({name: np.array([value]) for name, value in point.items()}, RigidBodyIntegration(flips=True))

    def pictures(self, ds: "xr.Dataset") -> "dict[str, Callable[[], Figure | None]]":
        """Stability maps or the bodies in a row, theory against measurement, the breakdown, and the polhodes."""
        from sweeps.systems.rigid_body import (
            figure_agreement,
            figure_bodies,
            figure_breakdown,
            figure_polhodes,
            figure_stability,
        )

        found: dict[str, Callable[[], Figure | None]] = {}
        if "body" in ds.dims:
            found["bodies"] = lambda: figure_bodies.draw(ds)
        else:
            for axis in ds["axis"].values.tolist():
                found[f"stability_axis_{axis}"] = lambda axis=axis: figure_stability.draw(ds, axis)
        found["theory_against_measured"] = lambda: figure_agreement.draw(ds)
        if ds.sizes.get("epsilon", 0) >= LEAST_NUDGES:
            found["breakdown"] = lambda: figure_breakdown.draw(ds)
        found["polhodes"] = lambda: figure_polhodes.draw(ds)
        return found

    def animations(self, ds: "xr.Dataset") -> "dict[str, Callable[[], list[Image]]]":
        """One flip of the most unstable body that can exist."""
        from sweeps.systems.rigid_body import figure_flip

        return {"flip": lambda: figure_flip.frames(ds)}


def _compare_with_some_in_full(columns, points, settings, options):
    """Integrates a few points as themselves and holds the collapsed Ω² against theirs.

    Raises:
        ArithmeticError: where they differ by more than 1e-12 of ω0² (times the square of the moments' ratio, by which
            the rounding of a needle's moments grows): the collapse is then wrong, and no map is written.
    """
    from kernels import survey

    size = next(iter(points.values())).size
    some = np.random.default_rng(size).integers(0, size, min(size, COMPARED))
    chosen = {name: values[some] for name, values in points.items()}
    full = survey.measured(chosen, *settings, **options | {"nonlinear": False, "wanted": {"omega_squared"}})
    moments = np.stack([chosen[name] for name in MOMENTS])
    allowed = 1e-12 * np.square(moments.max(axis=0) / moments.min(axis=0))
    spin = np.abs(chosen["omega0"])
    apart = np.abs(columns["omega_squared"][some] - full["omega_squared"]) / spin / spin
    if not (apart <= allowed).all():
        raise ArithmeticError(f"collapsed and integrated points differ by {(apart / allowed).max():.2g}e-12")


SYSTEM = RigidBody()
