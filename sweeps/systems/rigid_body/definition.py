"""What a definition of rigid bodies may say: which axes, which moments or bodies, and how each run is made."""

from collections.abc import Iterator
from functools import cached_property
from pathlib import Path
from typing import Annotated

from pydantic import AfterValidator, BeforeValidator, Field, PrivateAttr, ValidationInfo, model_validator

from sweeps.schema.definition import Definition, Integration
from sweeps.schema.parameters import grid_model
from sweeps.schema.refusals import Problem, description_of, display, hint, keys_of, refusal, refusals
from sweeps.schema.strict import Strict
from sweeps.schema.values import (
    Axis,
    Epsilon,
    Moment,
    Phase,
    Positive,
    Prose,
    ascending,
    choice,
    different,
    finite,
    line_of_text,
    not_empty,
)
from sweeps.schema.variables import Variable
from sweeps.systems.rigid_body import inertia, outline
from sweeps.systems.rigid_body.variables import (
    CERTIFICATE,
    FLIPS,
    IN_SPACE,
    MOMENTS,
    PARAMETERS,
    SHAREABLE,
    TERMS,
    VARIABLES,
    SpinRate,
)
from sweeps.systems.shapes import RATIOS

PROPAGATORS = ("direct", "exact")

GridEntries = grid_model("GridEntries", PARAMETERS, __name__, RATIOS)


class Ratios(Strict):
    """Moments of a body of which only the ratios are known."""

    I1: Moment = Field(description="I1 in any one unit (I3, M R2, …): finite, > 0")
    I2: Moment = Field(description="I2 in the same unit: finite, > 0")
    I3: Moment = Field(description="I3 in the same unit: finite, > 0")


_ROWS = "3 rows of 3 finite numbers: [[Ixx, Ixy, Ixz], [Iyx, Iyy, Iyz], [Izx, Izy, Izz]]"


def _tensor(value: object) -> tuple[tuple[float, ...], ...]:
    rows = value if isinstance(value, tuple | list) else ()
    if len(rows) != 3 or not all(isinstance(row, tuple | list) and len(row) == 3 for row in rows):
        raise refusal("is not a tensor of inertia", _ROWS)
    return tuple(tuple(finite(entry, _ROWS) for entry in row) for row in rows)


def _mesh_name(name: str) -> str:
    if wrong := inertia.unsupported(name):
        raise refusal(*wrong)
    return name


class Mesh(Strict):
    """A body as the closed surface that bounds it, evenly filled."""

    file: Annotated[str, line_of_text(1000), AfterValidator(_mesh_name)] = Field(
        description="an STL, OBJ, PLY or OFF file, its path relative to the definition's"
    )
    density: Positive = Field(default=None, description="density, kg m-3: finite, > 0")
    mass: Positive = Field(default=None, description="mass of the whole body, kg, in place of density: finite, > 0")
    unit: Annotated[str, choice(tuple(inertia.UNITS))] = Field(
        "m", description="unit of length of the file: " + ", ".join(inertia.UNITS)
    )

    @model_validator(mode="after")
    def _check_density(self) -> "Mesh":
        if (self.density is None) == (self.mass is None):
            wrong = "is missing" if self.density is None else "is given beside mass"
            shown = "" if self.density is None else display(self.density)
            raise refusals([Problem(("density",), shown, wrong, "density (kg m-3) or mass (kg), one of them")])
        return self


class Observed(Strict):
    """What people measured of a body's motion: for comparison only, nothing is computed from it."""

    period_days: Positive = Field(description="observed period, days of 86,400 s: > 0")
    what: Annotated[str, line_of_text(100)] = Field(description="the motion that has this period: one line of text")


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
        description="tensor of inertia about the centre of mass, kg m2, in place of moments, symmetric, "
        f"off-diagonal entries minus the products of inertia; {_ROWS}",
    )
    mesh: Mesh = Field(default=None, description="{file, density or mass, unit} in place of moments")
    omega0: SpinRate = Field(default=None, description="spin rate of this body, rad s-1: 1e-150 ≤ |omega0| ≤ 1e150")
    epsilon: Epsilon = Field(
        default=None, description="size of the perturbation of this body, relative: 0 < epsilon < 1"
    )
    phase: Phase = Field(default=None, description="direction of the perturbation of this body, rad: finite")
    axis: Axis = Field(default=None, description="the axis it spins about in nature: 1, 2 or 3")
    source: Prose = Field(default=None, description="source of the numbers: text")
    note: Prose = Field(default=None, description="remark for the reader: text")
    observed: Observed = Field(default=None, description="observed motion: {period_days, what}")

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
            wrong = [(name, "", "is missing") for name in MOMENTS if name not in given]
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
                self._digest = self._solid.digest
        except inertia.InertiaError as error:
            where = ("tensor",) if self.mesh is None else ("mesh", "file")
            shown = error.shown if self.mesh is None else display(self.mesh.file)
            raise refusals([Problem(where, shown, error.wrong, error.allowed)]) from None


class RigidBodyIntegration(Integration):
    """How each run of a rigid body is made."""

    propagator: Annotated[str, choice(PROPAGATORS)] = Field(
        "direct",
        description="integration method: direct (Taylor steps, each point certified by the closed form) or exact "
        "(steps of the closed form)",
    )
    collapse: bool = Field(
        False,
        description="true or false: whether points that differ by units alone are integrated once and expanded",
    )
    variables: Annotated[tuple[str, ...], AfterValidator(not_empty), AfterValidator(different)] = Field(
        None,
        description="which variables to make: a list of names of a map's variables; left out, all but the terms of "
        "omega_squared_error",
    )
    flips: bool = Field(
        False,
        description="true or false: whether to follow the motion on to its flips and its largest tilt, up to "
        "20,000 rotations each way",
    )
    attitude: bool = Field(
        False,
        description="true or false: whether to follow the attitude too, and measure how the spin axis moves in space",
    )

    @property
    def table(self) -> dict[str, Variable]:
        """Name → variable of a map that is made so."""
        possible = self._possible
        if self.variables is None:
            return {name: possible[name] for name in possible if name not in TERMS}
        return {name: possible[name] for name in possible if name in self.variables}

    @property
    def _possible(self) -> dict[str, Variable]:
        certificate = CERTIFICATE if self.propagator == "direct" else {}
        seen = IN_SPACE if self.attitude else {}
        return VARIABLES | certificate | (FLIPS if self.flips else {}) | seen | TERMS

    @model_validator(mode="after")
    def _check_variables(self) -> "RigidBodyIntegration":
        names = self._possible
        wrong = [
            Problem(
                ("variables", i), display(name), "is not a variable of this sweep" + hint(name, names), ", ".join(names)
            )
            for i, name in enumerate(self.variables or ())
            if name not in names
        ]
        if wrong:
            raise refusals(wrong)
        return self


def named_once(bodies: tuple["Body", ...]) -> tuple["Body", ...]:
    """Return the bodies, refused if two have the same name."""
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
    grid: GridEntries = Field(
        GridEntries.model_construct(), description="what is varied: a mapping with " + keys_of(GridEntries)
    )
    bodies: Annotated[tuple[Body, ...], AfterValidator(not_empty), AfterValidator(named_once)] = Field(
        default=(), description="a list of bodies, names unique, in place of I1, I2 and I3 in grid"
    )
    integration: RigidBodyIntegration = Field(
        RigidBodyIntegration.model_construct(),
        description="how each run is made: a mapping with " + keys_of(RigidBodyIntegration),
    )

    @cached_property
    def inputs(self) -> str:
        """The meshes of the bodies, or the table of points, one a line with the SHA-256 of its content."""
        return super().inputs or "\n".join(body.input for body in self.bodies if body.mesh is not None)

    @property
    def outlines(self) -> str:
        """The surfaces of the bodies that are meshes, with few faces (see `sweeps.systems.rigid_body.outline`)."""
        solids = {body.name: body.solid.surface for body in self.bodies if body.solid is not None}
        return outline.written(solids)

    def is_per_body(self, parameter: str) -> bool:
        """Return True if `parameter` (I1 … phase) is a coordinate along `body` rather than a dimension."""
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
            yield _grid_problem(name, "", "is missing", description_of(GridEntries, name))

    def _shared_problems(self, name: str) -> Iterator[Problem]:
        entry = getattr(self.grid, name)
        giving = [body for body in self.bodies if getattr(body, name) is not None]
        if giving and len(giving) == len(self.bodies):
            if name in self.grid.model_fields_set:
                wrong = "is given although every body has its own"
                yield _grid_problem(name, display(entry), wrong, f"{name} in grid or in every body, not both")
        elif entry is None:
            yield _grid_problem(name, "", "is missing", description_of(GridEntries, name))
        elif giving and not isinstance(entry, float):
            wrong = f"is a dimension, but {len(giving)} of {len(self.bodies)} bodies have their own {name}"
            allowed = f"a single number here, or {name} in no body, or in every body and not here"
            yield _grid_problem(name, display(entry), wrong, allowed)


def _grid_problem(name: str, shown: str, wrong: str, allowed: str) -> Problem:
    return Problem(("grid", name), shown, wrong, allowed)
