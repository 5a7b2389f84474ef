r"""Bodies from parts: shapes with masses, places and tolerances, summed by the parallel-axis theorem.

Part i has the mass m_i, the centre of mass c_i and, about it, the mean squares of the coordinates
:math:`S_i = \frac{1}{m_i}\int x x^\mathsf{T} dm`. The sum has

.. math:: M = \sum m_i, \qquad c = \frac{1}{M} \sum m_i c_i, \qquad
    \Sigma = \sum m_i \big(S_i + (c_i - c)(c_i - c)^\mathsf{T}\big), \qquad T = \mathrm{tr}(\Sigma)\,1 - \Sigma

with the tensor of inertia T about c. As masses are positive and no S_i has a negative eigenvalue, the moments of every
sum are physically possible.

Source: Landau and Lifshitz, Mechanics, section 32; Goldstein, Classical Mechanics, chapter 5.
"""

import csv
import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import numpy as np
from pydantic import AfterValidator, BeforeValidator, Discriminator, Tag, create_model, model_validator

from sweeps.reading.definitions import file_text, plain, read_text
from sweeps.reading.tables import heading
from sweeps.schema.parameters import Strict, key
from sweeps.schema.refusals import (
    TAGS,
    DefinitionError,
    Problem,
    UnreadableError,
    display,
    hint,
    message,
    refusal,
    refusals,
    validate,
)
from sweeps.schema.values import MAX_AMOUNT, Amount, Prose, finite, in_unit, line_of_text, not_empty, number, numbers
from sweeps.systems.bodies import inertia
from sweeps.systems.bodies.body import Body, FileBody, check_unique_names


class Shape(NamedTuple):
    """A uniform shape about its centre, by its lengths in m."""

    words: tuple[str, ...]  #: meaning of each length
    mean_squares: Callable[..., tuple[float, float, float]]  #: of x, y and z over the mass, m2
    volume: Callable[..., float] | None = None  #: m3; None for a shape without volume, which has no density


SHAPES = {
    "box": Shape(("along x", "y", "z"), lambda *edges: tuple(np.square(edges) / 12), lambda *edges: math.prod(edges)),
    "cylinder": Shape(
        ("radius", "length along z"), lambda r, h: (r * r / 4, r * r / 4, h * h / 12), lambda r, h: math.pi * r * r * h
    ),
    "sphere": Shape(("radius",), lambda r: (r * r / 5,) * 3, lambda r: 4 / 3 * math.pi * r**3),
    "shell": Shape(("radius of a thin sphere",), lambda r: (r * r / 3,) * 3),
    "plate": Shape(("along x", "y, thin along z"), lambda a, b: (a * a / 12, b * b / 12, 0.0)),
    "rod": Shape(("length along z",), lambda h: (0.0, 0.0, h * h / 12)),
}
MAX_PIECES = 1000  # number of parts of a body; draws of more would take minutes
KINDS = (*SHAPES, "point", "body")
Name = Annotated[str, line_of_text(100)]


_TURNED = "{x: ANGLE, y: ANGLE, z: ANGLE}: rotations about these fixed axes in the order given (rad, or 90 deg), or a "
_TURNED += "unit quaternion, scalar first"


def _rotation(value: object) -> np.ndarray:
    """Return the rotation matrix of a mapping of axes to angles, or of a unit quaternion."""
    from scipy.spatial.transform import Rotation

    if isinstance(value, Mapping) and value and set(value) <= set("xyz"):
        angles = [finite(angle, _TURNED, "rad") for angle in value.values()]
        return Rotation.from_euler("".join(value), angles).as_matrix()
    quaternion = [finite(part, _TURNED) for part in value] if isinstance(value, tuple | list) else []
    if len(quaternion) != 4 or abs(math.hypot(*quaternion) - 1) > 1e-3:  # three decimals are enough
        raise refusal("is no rotation", _TURNED)
    return Rotation.from_quat(quaternion, scalar_first=True).as_matrix()


_MASS, _PLACE = "of the mass, relative (5 %): from 0 to below 1", "of the place along each of x, y and z, m: 0 to 1e30"


class Tolerance(Strict):
    """Standard deviations of the mass and the place of a part."""

    mass: in_unit("1", Annotated[float, number(lambda x: 0 <= x < 1, _MASS)]) = key(_MASS)
    place: in_unit("m", Annotated[float, number(lambda x: 0 <= x <= MAX_AMOUNT, _PLACE)]) = key(_PLACE)


class SharedTolerance(NamedTuple):
    """A tolerance that moves the rigid pieces of a part together."""

    part: str  #: name of the part
    mass: float = 0.0  #: relative standard deviation of its mass
    place: float = 0.0  #: standard deviation of its place along each coordinate, m

    def replace_by(self, tolerance: Tolerance | None) -> "SharedTolerance":
        """Return the source with the deviations that a tolerance gives."""
        return self._replace(**({} if tolerance is None else tolerance.model_dump(exclude_none=True)))


class Piece(NamedTuple):
    """A rigid piece: a part that has no parts."""

    mass: float  #: kg
    place: np.ndarray  #: centre of mass, m, shape (3,)
    mean_squares: np.ndarray  #: of the coordinates about it, m2, shape (3, 3)
    rounding: float = inertia.TENSOR_ROUNDING  #: moments that differ by less, relative to the largest, count as equal
    sources: tuple[SharedTolerance, ...] = ()  #: tolerances that it has


def _piece_of(body: Body, mass: Any) -> Piece:
    """Return a body, given by moments, tensor or mesh, as a piece in its own coordinates."""
    centre, rounding = np.zeros(3), inertia.TENSOR_ROUNDING
    if body.solid is not None:
        mass, centre, rounding = body.solid.mass, np.array(body.solid.centre), inertia.MESH_ROUNDING
    tensor = np.diag(body.moments) if body.principal is None else body.principal.tensor
    return Piece(mass, centre, inertia.second_moments(tensor) / mass, rounding)


OtherBody = Annotated[
    Annotated[Body, Tag(TAGS[0])] | Annotated["Assembly", Tag(TAGS[1])],
    Discriminator(lambda value: TAGS[isinstance(value, Mapping) and "parts" in value]),
    BeforeValidator(lambda value: {"name": "body", **value} if isinstance(value, Mapping) else value),
]


ShapeLengths: Any = create_model(
    "ShapeLengths",
    __base__=Strict,
    **{
        name: (Annotated[tuple, numbers(shape.words, "m", is_size=True)], key(f"lengths, m: {', '.join(shape.words)}"))
        for name, shape in SHAPES.items()
    },
)


class Part(ShapeLengths):
    """One part: its shape, mass and place."""

    name: Name = key("the part's name, unique in its list: one line of text, at most 100 characters", ...)
    point: bool = key("true for a point mass")
    body: OtherBody = key("another body: {parts}, {mesh: {file, density or mass, unit}}, {tensor} or {I1, I2, I3}")
    at: Annotated[tuple, numbers(("x", "y", "z"), "m")] = key(
        "place of its centre; of a mesh or parts, of their origin", (0.0,) * 3
    )
    turned: Annotated[Any, BeforeValidator(_rotation)] = key(f"before it is placed, {_TURNED}")
    mass: in_unit("kg", Amount) = key("mass, kg: > 0")
    density: in_unit("kg m-3", Amount) = key("density, kg m-3: > 0, in place of the mass of a shape with volume")
    tolerance: Tolerance = key("{mass, place}: standard deviations")

    @model_validator(mode="before")
    @classmethod
    def _mesh_as_body(cls, values: object) -> object:
        """Return a part of the kind mesh as one of the kind body, with the mesh's mass or density."""
        if not isinstance(values, Mapping) or "mesh" not in values:
            return values
        mesh = values["mesh"] if isinstance(values["mesh"], Mapping) else {"file": values["mesh"]}
        amount = {name: values[name] for name in ("mass", "density") if name in values}
        other_keys = {name: value for name, value in values.items() if name not in (*amount, "mesh")}
        return other_keys | {"body": {"mesh": {**mesh, **amount}}}

    @model_validator(mode="after")
    def _check_mass(self) -> "Part":
        """Refuse a part of no kind or of several, and one without the mass that its kind needs."""
        kinds = [name for name in KINDS if getattr(self, name) not in (None, False)]
        if len(kinds) != 1:
            problem = f"has {' and '.join(kinds)}" if kinds else "has no shape"
            raise refusal(problem, f"one of {', '.join((*KINDS, 'mesh'))}")
        if isinstance(self.body, Assembly) or (self.body is not None and self.body.solid is not None):
            options = []
        else:
            options = ["mass", "density"] if kinds[0] in SHAPES and SHAPES[kinds[0]].volume else ["mass"]
        masses = [name for name in ("mass", "density") if getattr(self, name) is not None]
        if len(masses) != bool(options) or not set(masses) <= set(options):
            reason = f"is not as a {kinds[0]} needs it" if masses else "is missing"
            allowed = " or ".join(options) or "no mass: it follows from the body"
            raise refusals([Problem((masses[-1] if masses else "mass",), "", reason, allowed)])
        if isinstance(self.body, Body) and self.body.ratios is not None:
            raise refusals([Problem(("body", "ratios"), "", "are no moments", "tensor, or I1, I2 and I3, kg m2")])
        return self

    def pieces(self, default: SharedTolerance) -> Iterator[Piece]:
        """Yield its rigid pieces in the coordinates of the whole; `default` is the tolerance of parts without own."""
        rotation = np.eye(3) if self.turned is None else self.turned
        inner: Iterable[Piece] = [Piece(self.mass, np.zeros(3), np.zeros((3, 3)))]
        nominal = default._replace(part=self.name)
        if isinstance(self.body, Assembly):
            inner, nominal = self.body.pieces(default), SharedTolerance(self.name)
        elif self.body is not None:
            inner = [_piece_of(self.body, self.mass)]
        for shape, lengths in ((SHAPES[name], getattr(self, name)) for name in SHAPES if getattr(self, name)):
            mass = self.density * shape.volume(*lengths) if self.mass is None and shape.volume else self.mass
            inner = [Piece(mass, np.zeros(3), np.diag(shape.mean_squares(*lengths)))]
        source = nominal.replace_by(self.tolerance)
        for piece in inner:
            sources = [each._replace(part=f"{self.name}/{each.part}") for each in piece.sources]
            yield piece._replace(
                place=np.array(self.at) + rotation @ piece.place,
                mean_squares=rotation @ piece.mean_squares @ rotation.T,
                sources=(*sources, *([source] if any(source[1:]) else ())),
            )


class Assembly(Strict):
    """A body of parts."""

    name: Name = key("the body's name: one line of text, at most 100 characters", ...)
    parts: Annotated[tuple[Part, ...], BeforeValidator(not_empty), AfterValidator(check_unique_names)] = key(
        "a list of parts, names unique", ...
    )
    tolerance: Tolerance = key("{mass, place}: standard deviations of parts without their own")
    spin: Annotated[tuple, numbers(("x", "y", "z"), "rad s-1")] = key(
        "angular velocity in the axes of the parts, rad s-1"
    )
    states: Annotated[dict[str, dict[str, dict] | None], AfterValidator(not_empty)] = key(
        "a mapping of states to mappings of parts to mappings of the keys that differ", {"": {}}
    )
    source: Prose = key("source of the numbers: text")
    note: Prose = key("remark for the reader: text")

    @model_validator(mode="after")
    def _check_names(self) -> "Assembly":
        """Refuse states of unknown parts, and a spin of zero."""
        names = [part.name for part in self.parts]
        for state, changes in self.states.items():
            for name in set(changes or ()) - set(names):
                allowed = "the names of parts: " + ", ".join(names)
                raise refusals([Problem(("states", state, name), "", "is no part" + hint(name, names), allowed)])
        if self.spin is not None and not any(self.spin):
            raise refusals([Problem(("spin",), display(self.spin), "is no spin", "an angular velocity other than 0")])
        return self

    def pieces(self, default: SharedTolerance) -> Iterator[Piece]:
        """Yield its rigid pieces; `default` is the tolerance of parts without their own."""
        for part in self.parts:
            yield from part.pieces(default.replace_by(self.tolerance))


class Pieces(NamedTuple):
    """The rigid pieces of a body as arrays, places relative to its centre of mass."""

    masses: np.ndarray  #: kg, shape (pieces,)
    places: np.ndarray  #: centres of mass, m, shape (pieces, 3)
    mean_squares: np.ndarray  #: of the coordinates about them, m2, shape (pieces, 3, 3)
    parts: dict[str, list[int]]  #: name of a part → numbers of its pieces
    sources: dict[SharedTolerance, list[int]]  #: tolerance → numbers of the pieces that it moves
    rounding: float  #: moments that differ by less, relative to the largest, count as equal


def sum_pieces(masses: np.ndarray, places: np.ndarray, mean_squares: np.ndarray) -> tuple[np.ndarray, ...]:
    """Return mass, centre of mass and tensor of inertia about it, of one body or of many at once.

    Args:
        masses: kg, shape (…, pieces).
        places: centres of mass, m, shape (…, pieces, 3).
        mean_squares: of the coordinates about them, m2, shape (pieces, 3, 3).

    Returns:
        kg, shape (…); m, shape (…, 3); kg m2, shape (…, 3, 3).
    """
    mass = masses.sum(axis=-1)
    centre = (masses[..., None] * places).sum(axis=-2) / mass[..., None]
    offset = places - centre[..., None, :]
    second = np.tensordot(masses, mean_squares, 1) + np.swapaxes(masses[..., None] * offset, -1, -2) @ offset
    return mass, centre, inertia.tensor_of(second)


# -- files and mappings

COLUMNS = "name shape size_1 size_2 size_3 mass density x y z turned_x turned_y turned_z tolerance_mass tolerance_place"


def table_parts(text: str) -> tuple[dict, ...]:
    """Return the parts of a CSV table with some of the columns `COLUMNS`; a heading may have a unit, "x (mm)"."""
    delimiter = next((sign for sign in ",;\t" if sign in text.partition("\n")[0]), ",")
    first, *rows = [row for row in csv.reader(text.splitlines(), delimiter=delimiter) if any(row)] or [[]]
    headings, parts = [heading(title) for title in first if title.strip()], []
    names = [name for name, unit in headings]
    for name in names:
        if name not in COLUMNS.split() or names.count(name) > 1:
            raise UnreadableError(("table",), display(name), "is an unknown or a repeated column", COLUMNS)
    for line, row in enumerate(rows, 1):
        if any(row[len(headings) :]):
            raise UnreadableError(("table",), f"row {line}", "has more values than columns", "a decimal point")
        filled = [(*title, cell.strip()) for title, cell in zip(headings, row, strict=False) if cell.strip()]
        values: dict[str, Any] = {name: _cell(name, unit, cell) for name, unit, cell in filled}
        part: dict[str, Any] = {"name": "", "at": tuple(values.pop(axis, 0.0) for axis in "xyz")}
        shape, sizes = values.pop("shape", ""), [name for name in ("size_1", "size_2", "size_3") if name in values]
        part |= {shape: shape == "point" or tuple(map(values.pop, sizes))} if shape else {}
        for name, value in values.items():
            outer, _separator, inner = name.partition("_")
            part[outer] = {**part.get(outer, {}), inner: value} if inner else value
        parts.append(part)
    return tuple(parts)


def _cell(name: str, unit: str, text: str) -> float | str:
    """Return the text of a column of names, or a number, with its unit as text if its heading has one."""
    try:
        return text if name in ("name", "shape") else f"{float(text)!r} {unit}" if unit else float(text)
    except ValueError:
        return text


def read_bodies(source: str | Mapping) -> list[FileBody]:
    """Return the bodies of parts, one for each of their states.

    Args:
        source: a file (YAML, JSON, or a CSV table) or a mapping with the keys of `Assembly`.

    Raises:
        DefinitionError: naming the key, its value and the allowed values.
    """
    label, name = (source, Path(source).stem) if isinstance(source, str) else ("body", "your body")
    bodies, folder = [], str(Path(label).parent)  # paths of meshes are relative to the folder
    try:
        values: Any = _file_values(source) if isinstance(source, str) else plain(source)
        if not isinstance(values, dict) or "parts" not in values:
            allowed = "a list of parts (a definition of a sweep is given by --definition)"
            raise UnreadableError(("parts",), "", "is missing", allowed)
    except UnreadableError as error:
        raise DefinitionError(message(label, [error.problem])) from None
    values = {"name": name, **values}
    for state, changes in validate(Assembly, values, label, folder=folder).states.items():
        title = f"{label}: states.{state}" if state else label
        parts = tuple({**part, **(changes or {}).get(part["name"], {})} for part in values["parts"])
        assembly = validate(Assembly, {**values, "parts": parts}, title, folder=folder)
        try:
            bodies.append(_file_body(assembly, state))
        except inertia.InertiaError as error:
            raise DefinitionError(message(title, [Problem(("parts",), "", error.wrong, error.allowed)])) from None
    return bodies


def _file_values(path: str) -> object:
    text = file_text(Path(path))
    return {"parts": table_parts(text)} if path.lower().endswith(".csv") else plain(read_text(text))


def _file_body(assembly: Assembly, state: str) -> FileBody:
    """Return the sum of the parts in a state as an entry of a definition, with its pieces."""
    default = SharedTolerance("").replace_by(assembly.tolerance)
    owned = [(part.name, piece) for part in assembly.parts for piece in part.pieces(default)]
    if len(owned) > MAX_PIECES:
        raise inertia.InertiaError("", f"have {len(owned):,} rigid pieces", f"at most {MAX_PIECES:,}")
    parts: dict[str, list[int]] = {}
    sources: dict[SharedTolerance, list[int]] = {}
    for place, (part, piece) in enumerate(owned):
        parts.setdefault(part, []).append(place)
        for source in piece.sources:
            sources.setdefault(source, []).append(place)
    masses, places, mean_squares, roundings = map(np.array, list(zip(*(each[1] for each in owned), strict=True))[:4])
    mass, centre, tensor = sum_pieces(masses, places, mean_squares)
    principal = inertia.principal(tensor.tolist(), roundings.max())
    if principal.notes:  # moments that were made equal
        tensor = principal.tensor
    title = ", ".join(filter(None, (assembly.name, state)))
    point = ", ".join(f"{coordinate:.6g}" for coordinate in centre + 0.0)
    return FileBody(
        name=state or title,
        entry={"name": title, "tensor": ((tensor + tensor.T) / 2).tolist()},
        omega=assembly.spin,
        facts={"mass": float(mass), "centre": centre.tolist(), "parts": len(parts)},
        lines=(f"{len(parts):,} parts, {mass:.6g} kg, centre of mass ({point}) m",),
        pieces=Pieces(masses, places - centre, mean_squares, parts, sources, float(roundings.max())),
    )
