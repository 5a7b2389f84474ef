"""Model of a rigid body in definitions: its moments or their ratios, its tensor of inertia or its mesh."""

from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, field
from functools import cached_property
from operator import attrgetter
from pathlib import Path
from typing import Annotated, Any, ClassVar

import numpy as np
from pydantic import AfterValidator, BeforeValidator, PrivateAttr, ValidationInfo, model_validator

from sweeps.schema.definition import Definition
from sweeps.schema.parameters import Strict, key, mapping
from sweeps.schema.refusals import DefinitionError, Problem, description_of, display, refusal, refusals
from sweeps.schema.values import TOLERANCE, Positive, Prose, Tolerance, choice, finite, in_unit, line_of_text, not_empty
from sweeps.systems.bodies import inertia, molecules, outline
from sweeps.systems.bodies.variables import MOMENTS, Moment

AXES = "spin axes to survey: a list of 1, 2, 3, each once"
FORMS_OF_BODY = ("ratios", "tensor", "mesh", "rotational")  # keys that replace moments
MAX_PRINTED = 10  # bodies; `check` prints the axes of the first ones
BODIES = "a list of bodies, names unique, in place of I1, I2 and I3 in grid"
FORMS = "three moments, a tensor of 3 rows of 3, a body's mapping as in a definition, or a body's name"


class Ratios(Strict):
    """Ratios of the moments of a body of unknown mass."""

    I1: Moment = key("I1 in any one unit (I3, M R2, …): finite, > 0", ...)
    I2: Moment = key("I2 in the same unit: finite, > 0", ...)
    I3: Moment = key("I3 in the same unit: finite, > 0", ...)


_ROWS = "3 rows of 3 finite numbers: [[Ixx, Ixy, Ixz], [Iyx, Iyy, Iyz], [Izx, Izy, Izz]]"


def _tensor(value: object) -> tuple[tuple[float, ...], ...]:
    """Return three rows of three finite numbers, kg m2; refuse every other value."""
    rows = value if isinstance(value, tuple | list) else ()
    if len(rows) != 3 or not all(isinstance(row, tuple | list) and len(row) == 3 for row in rows):
        raise refusal("is not a tensor of inertia", _ROWS)
    return tuple(tuple(finite(entry, _ROWS, "kg m2") for entry in row) for row in rows)


Tensor = Annotated[tuple, BeforeValidator(_tensor)]


def _mesh_name(name: str) -> str:
    if problem := inertia.unsupported_format(name):
        raise refusal(*problem)
    return name


def _moments_of_molecule(value: object) -> tuple[float, ...]:
    """Return the moments, kg m2, of three rotational constants with units."""
    constants = value if isinstance(value, tuple | list) and len(value) == 3 else ()
    moments = [moment for constant in constants if (moment := molecules.moment_of_constant(constant)) is not None]
    if len(moments) != 3:
        raise refusal("is not a list of rotational constants", f"[A, B, C], each {molecules.ALLOWED}")
    return tuple(moments)


class Mesh(Strict):
    """A body of uniform density inside a closed surface."""

    file: Annotated[str, line_of_text(1000), AfterValidator(_mesh_name)] = key(
        "an STL, OBJ, PLY, OFF, GLB, DAE, TAB or TXT file, its path relative to the definition's", ...
    )
    density: in_unit("kg m-3", Positive) = key("density, kg m-3: finite, > 0")
    mass: in_unit("kg", Positive) = key("mass of the whole body, kg, in place of density: finite, > 0")
    unit: Annotated[str, choice(tuple(inertia.UNITS))] = key(
        "unit of length of the file: " + ", ".join(inertia.UNITS), "m"
    )

    @model_validator(mode="after")
    def _check_density(self) -> "Mesh":
        """Refuse a mesh without density and mass, or with both."""
        if (self.density is None) == (self.mass is None):
            reason = "is missing" if self.density is None else "is given beside mass"
            value = "" if self.density is None else display(self.density)
            raise refusals([Problem(("density",), value, reason, "density (kg m-3) or mass (kg), one of them")])
        return self


class Body(Strict):
    """A real body: its moments, their ratios, its tensor or its mesh; systems add further keys."""

    name: Annotated[str, line_of_text(100)] = key(
        "the body's name, unique in the sweep: one line of text, at most 100 characters", ...
    )
    I1: in_unit("kg m2", Moment) = key("moment of inertia about axis 1, kg m2: finite, > 0")
    I2: in_unit("kg m2", Moment) = key("moment of inertia about axis 2, kg m2: finite, > 0")
    I3: in_unit("kg m2", Moment) = key("moment of inertia about axis 3, kg m2: finite, > 0")
    ratios: Ratios = key("{I1, I2, I3} in place of moments, in any one unit")
    tensor: Tensor = key(
        "tensor of inertia about the centre of mass, kg m2, in place of moments, symmetric, "
        f"off-diagonal entries minus the products of inertia; {_ROWS}"
    )
    mesh: Mesh = key("{file, density or mass, unit} in place of moments")
    rotational: Annotated[tuple, BeforeValidator(_moments_of_molecule)] = key(
        f"rotational constants [A, B, C] of a molecule in place of moments, each {molecules.ALLOWED}"
    )
    source: Prose = key("source of the numbers: text")
    note: Prose = key("remark for the reader: text")

    _principal: inertia.Principal | None = PrivateAttr(None)
    _solid: inertia.Solid | None = PrivateAttr(None)
    _frame: str | None = PrivateAttr(None)
    principal = property(attrgetter("_principal"), doc="Principal moments and axes, of a tensor or a mesh; else None.")
    solid = property(attrgetter("_solid"), doc="Mass properties, of a mesh; else None.")

    @property
    def frame(self) -> str:
        """Owner of the axes of the body's vectors: "file", "tensor", "mesh", or "body" for the principal axes."""
        return self._frame or next((name for name in ("tensor", "mesh") if getattr(self, name) is not None), "body")

    def set_frame(self, frame: str | None) -> None:
        """Set the owner of the axes of its tensor; None for the tensor itself."""
        self._frame = frame

    @property
    def moments(self) -> tuple[float, float, float]:
        """(I1, I2, I3), kg m2, or in the unit of `ratios` if only those are known; ascending from a tensor or mesh."""
        if self._principal is not None:
            return self._principal.moments
        if self.rotational is not None:
            return self.rotational
        source = self if self.ratios is None else self.ratios
        return source.I1, source.I2, source.I3

    @model_validator(mode="after")
    def _check_moments(self, info: ValidationInfo) -> "Body":
        """Refuse a body with no form or two forms of its moments, and derive moments from the others."""
        allowed = (
            "I1, I2 and I3 in kg m2, or ratios: {I1, I2, I3}, or tensor, mesh: {file, …}, rotational, one of these"
        )
        moments = [name for name in MOMENTS if getattr(self, name) is not None]
        alternatives = [name for name in FORMS_OF_BODY if getattr(self, name) is not None]
        if alternatives:
            reason = f"is given beside {alternatives[0]}"
            conflicts = [(name, display(getattr(self, name)), reason) for name in moments + alternatives[1:]]
        else:
            conflicts = [(name, "", "is missing") for name in MOMENTS if name not in moments]
        if conflicts:
            raise refusals([Problem((name,), value, reason, allowed) for name, value, reason in conflicts])
        self._find_principal((info.context or {}).get("folder", ""))
        return self

    def _find_principal(self, folder: str) -> None:
        """Find principal moments and axes of a tensor or a mesh, whose file is relative to a folder."""
        try:
            if self.tensor is not None:
                self._principal = inertia.principal(self.tensor)
            elif self.mesh is not None:
                path = Path(folder) / self.mesh.file
                self._solid = inertia.solid(path, self.mesh.density, self.mesh.mass, self.mesh.unit)
                self._principal = self._solid.principal
        except (inertia.InertiaError, inertia.MeshError) as error:
            where = ("mesh", "file") if self.mesh else ("tensor",)
            value = display(self.mesh.file) if self.mesh else getattr(error, "shown", "")
            raise refusals([Problem(where, value, error.wrong, error.allowed)]) from None


@dataclass(frozen=True)
class FileBody:
    """A body that a file describes, as a definition would give it, and what the file has in addition."""

    name: str  #: name among the bodies of the file, by which FILE:NAME selects it
    entry: Any  #: entry of a definition: name, and tensor about the centre of mass, kg m2
    omega: tuple[float, float, float] | None = None  #: angular velocity that the file gives, rad s-1, in its axes
    facts: dict[str, Any] = field(default_factory=dict)  #: further numbers for JSON
    lines: tuple[str, ...] = ()  #: further lines for people
    pieces: Any = None  #: its `sweeps.systems.bodies.parts.Pieces`, if it is a sum of parts
    frame: str | None = "file"  #: owner of the axes of its tensor: see `Body.frame`


def check_unique_names(bodies: tuple) -> tuple:
    """Return bodies or parts with different names; refuse others."""
    names = [body.name for body in bodies]
    words = "is an earlier name", "names that all differ"
    if repeated := [number for number, name in enumerate(names) if name in names[:number]]:
        raise refusals([Problem((number, "name"), display(names[number]), *words) for number in repeated])
    return bodies


def list_of(model: type[Body]) -> object:
    """Return the type of a definition's `bodies`: a list with unique names."""
    return Annotated[tuple[model, ...], AfterValidator(not_empty), AfterValidator(check_unique_names)]


class BodiesDefinition(Definition):
    """A sweep of rigid bodies, over moments in its grid or over a list."""

    #: names of the parameters that a body may have in addition to its moments; the grid has them otherwise.
    shareable: ClassVar[tuple[str, ...]] = ()
    bodies: list_of(Body) = key(BODIES, ())

    @cached_property
    def inputs(self) -> str:
        """The bodies' mesh files, or the table of points, one per line with the SHA-256 of its content."""
        return super().inputs or "\n".join(f"{body.mesh.file} {body.solid.digest}" for body in self.bodies if body.mesh)

    @property
    def outlines(self) -> str:
        """The simplified surfaces of bodies from meshes (see `sweeps.systems.bodies.outline`)."""
        return outline.format_outlines(
            {body.name: body.solid.surface for body in self.bodies if body.solid is not None}
        )

    @property
    def input_notes(self) -> str:
        """The remarks on bodies' tensors and meshes, a line each."""
        return "\n".join(
            f"{body.name}: {note}" for body in self.bodies if body.principal for note in body.principal.notes
        )

    def is_per_body(self, parameter: str) -> bool:
        """Return True if `parameter` (I1 … phase) is a coordinate along `body` rather than a dimension."""
        if parameter in MOMENTS:
            return bool(self.bodies)
        return any(getattr(body, parameter, None) is not None for body in self.bodies)

    @classmethod
    def needs_files(cls, values: Mapping) -> str:
        """Return why mesh files are needed; "" if no body is a mesh."""
        bodies = values.get("bodies")
        if isinstance(bodies, tuple) and any(isinstance(body, dict) and "mesh" in body for body in bodies):
            return "its bodies are mesh files, read only where --definition names them"
        return ""

    @property
    def remarks(self) -> list[tuple[str, str]]:
        """Principal moments and axes of the first bodies given by a tensor or a mesh."""
        bodies, rows = [body for body in self.bodies if body.principal], []
        for body in bodies[:MAX_PRINTED]:
            rows.append(("body", f"{body.name}: principal moments and axes, in the coordinates of the input"))
            rows += [("", line) for line in inertia.axis_lines(body.principal)]
        if len(bodies) > MAX_PRINTED:
            rows.append(("body", f"and {len(bodies) - MAX_PRINTED:,} more (--json has all of them)"))
        return rows

    @property
    def facts(self) -> dict:
        """Principal moments and axes of all such bodies."""
        return {"bodies": {body.name: asdict(body.principal) for body in self.bodies if body.principal}}

    @model_validator(mode="after")
    def _check_bodies(self) -> "BodiesDefinition":
        """Refuse moments in the grid beside bodies, and shared values that are given twice or not at all."""
        problems = [problem for name in MOMENTS for problem in self._moment_problems(name)]
        problems += [problem for name in self.shareable for problem in self._shared_problems(name)]
        if problems:
            raise refusals(problems)
        return self

    def _grid_problem(self, name: str, reason: str, allowed: str = "") -> Problem:
        entry = getattr(self.grid, name)
        value = "" if entry is None else display(entry)
        return Problem(("grid", name), value, reason, allowed or description_of(type(self.grid), name))

    def _moment_problems(self, name: str) -> Iterator[Problem]:
        """Yield the problem of a moment that is missing in the grid, or in the grid although bodies are listed."""
        entry = getattr(self.grid, name)
        if self.bodies and entry is not None:
            yield self._grid_problem(name, "is given beside bodies", "moments in bodies or in grid, not both")
        if not self.bodies and entry is None:
            yield self._grid_problem(name, "is missing")

    def _shared_problems(self, name: str) -> Iterator[Problem]:
        """Yield the problems of a value that stands in the grid or in every body."""
        entry = getattr(self.grid, name)
        own_values = [body for body in self.bodies if getattr(body, name) is not None]
        if own_values and len(own_values) == len(self.bodies):
            if name in self.grid.model_fields_set:
                reason = "is given although every body has its own"
                yield self._grid_problem(name, reason, f"{name} in grid or in every body, not both")
        elif entry is None:
            yield self._grid_problem(name, "is missing")
        elif own_values and not isinstance(entry, float):
            reason = f"is a dimension, but {len(own_values)} of {len(self.bodies)} bodies have their own {name}"
            allowed = f"a single number here, or {name} in no body, or in every body and not here"
            yield self._grid_problem(name, reason, allowed)


def body_entry(body: object) -> dict:
    """Return the entry of a definition for a body's mapping, its three moments or its tensor of inertia.

    Numbers may be text with a unit, "12 kg cm2".
    """
    if isinstance(body, Mapping):
        return dict(body)
    values = np.array(body, dtype=object) if isinstance(body, list | tuple | np.ndarray) else np.empty(0)
    if values.shape == (3,):
        return dict(zip(MOMENTS, map(_plain, values), strict=True))
    if values.shape == (3, 3):
        return {"tensor": [[_plain(value) for value in row] for row in values]}
    raise DefinitionError(f"body: {display(body)} is not a body; allowed: {FORMS}")


def _plain(value: object) -> object:
    return value.item() if isinstance(value, np.generic) else value


class Once(Strict):
    """Method of following each motion."""

    propagator: Annotated[str, choice(("direct", "exact"))] = key(
        "direct (integrated and measured, with the closed form beside it) or exact (the closed form alone)", "direct"
    )
    tolerance: Tolerance = key(f"integration error allowed in the measurement, {TOLERANCE}", 1e-10)

    @property
    def measured(self) -> bool:
        """Return True if the motion is integrated and measured."""
        return self.propagator == "direct"

    @property
    def samples(self) -> int:
        """Return the length of a run by which time is estimated: an integrated motion counts tenfold."""
        return 10 if self.measured else 1


class FollowedDefinition(BodiesDefinition):
    """A sweep of bodies that are followed through one revolution."""

    integration: Once = mapping("how each motion is integrated", Once)

    @property
    def follows_attitude(self) -> bool:
        """Return True if the motion is integrated."""
        return self.integration.measured
