"""A sweep that can be measured: its definition, resolved once, and its points, handed on the whole way to a map.

Points are numbered in C order over the grid's dimensions: the last dimension runs fastest. Of a grid, whose size may
exceed 64 bits (sizes are Python integers), only the part asked for is ever in memory.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from sweeps import systems
from sweeps.points import scattered
from sweeps.points.scattered import POINT, Drawn, OnDemand
from sweeps.schema.definition import MAX_SHARDS, Definition
from sweeps.schema.parameters import SPELLED_OUT, Range, spread
from sweeps.schema.variables import Variable

if TYPE_CHECKING:
    from sweeps.points.tables import Table

SHARD_SECONDS = 10  # a file and a job cost a second or so: a shard is worth ten of work


class Following:
    """The parameters of a grid that follow from a pair of others; see `sweeps.systems.bodies.shapes.RATIOS`."""

    def __init__(self, definition: Definition):
        self._pair = {} if definition.pair is None or definition.sample is not None else dict(definition.pair)
        self._derived = definition.grid.derived if self._pair else None
        #: what they are called; () where the grid gives all of its parameters itself
        self.names = self._derived.names if self._derived else ()
        #: what they follow from
        self.needed = tuple(dict.fromkeys(one for name in self.names for one in self._derived.over[name]))

    def dimensions(self, dimensions: Mapping[str, Any]) -> dict[str, Range | np.ndarray]:
        """Return the dimensions of a system, with the pair in place of the parameters derived from it."""
        instead = dict(zip(self.names, self._pair.items(), strict=True))
        along = (instead.get(name, (name, values)) for name, values in dimensions.items())
        return {name: spread(values) if name in self._pair else values for name, values in along}

    def at(self, values: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
        """Compute each derived parameter from the values it depends on."""
        return {name: self._derived.given(name, values) for name in self.names}

    def coordinates(self, shape: Mapping[str, int], values: Any) -> dict[str, tuple[tuple[str, ...], OnDemand]]:
        """Return name → (dimensions, values) of each derived coordinate."""
        coordinates = {}
        for name in self.names:
            dims = self._derived.over[name]

            def part(*box: slice, name: str = name, dims: tuple[str, ...] = dims) -> np.ndarray:
                along = [values(dim, np.arange(one.start, one.stop)) for dim, one in zip(dims, box, strict=True)]
                made = self._derived.given(name, dict(zip(dims, np.meshgrid(*along, indexing="ij"), strict=True)))
                return np.ascontiguousarray(made)

            coordinates[name] = dims, OnDemand(tuple(shape[dim] for dim in dims), "f8", part)
        return coordinates


@dataclass(frozen=True)
class Grid:
    """The points of a sweep; its system says which dimensions they have, in which order, those of length one too."""

    definition: Definition
    system: systems.Dynamics

    @cached_property
    def dims(self) -> tuple[str, ...]:
        """Names of the dimensions, in storage order."""
        return tuple(self._along)

    @cached_property
    def shape(self) -> tuple[int, ...]:
        """Length of each dimension."""
        return tuple(v.num if isinstance(v, Range) else v.size for v in self._along.values())

    @cached_property
    def size(self) -> int:
        """Number of points."""
        return math.prod(self.shape)

    @cached_property
    def coordinates(self) -> dict[str, np.ndarray | OnDemand]:
        """Dimension → its values, 1-D: whole numbers, text or float64, in the units of the system's coordinates."""
        return {dim: _spelled_out(values) for dim, values in self._along.items()}

    @cached_property
    def auxiliary(self) -> dict[str, tuple[tuple[str, ...], np.ndarray | OnDemand]]:
        """Name → (dimensions, values) of coordinates of bodies and points, and of those that follow from others."""
        coordinates = {name: ((dim,), values) for name, (dim, values) in self.system.auxiliary(self.definition).items()}
        columns = scattered.columns(self.scattered) if self.scattered else {}
        follows = self.following.coordinates(dict(zip(self.dims, self.shape, strict=True)), self.values)
        if point_names := getattr(self.scattered, "point_names", ()):
            coordinates["name"] = (POINT,), np.array(point_names)
        return coordinates | {name: ((POINT,), values) for name, values in columns.items()} | follows

    @cached_property
    def following(self) -> Following:
        """The parameters that follow from others, along whose dimensions they lie."""
        return Following(self.definition)

    @cached_property
    def scattered(self) -> "Drawn | Table | None":
        """The points along `point`; None where all dimensions are the system's own."""
        return Drawn(self.definition) if self.definition.sample is not None else self.definition.rows

    @cached_property
    def further(self) -> dict[str, np.ndarray]:
        """Dimension that variables have at every point → the values along it."""
        return self.system.further(self.definition)

    @cached_property
    def arguments(self) -> tuple[str, ...]:
        """Names of the coordinates that a point consists of."""
        return self.system.arguments(self.definition)

    @cached_property
    def _along(self) -> dict[str, Range | np.ndarray | OnDemand]:
        dimensions = self.following.dimensions(self.system.dimensions(self.definition))
        # longer axes are computed where they are asked for
        dimensions = {dim: _spelled_out(values, SPELLED_OUT) for dim, values in dimensions.items()}
        if self.scattered is None:
            return dimensions
        numbers = OnDemand((self.scattered.num,), "i8", lambda part: np.arange(part.start + 1, part.stop + 1))
        return {POINT: numbers} | {dim: v for dim, v in dimensions.items() if dim not in self.scattered.names}

    def points(self, start: int, stop: int) -> dict[str, np.ndarray]:
        """Return each of `arguments` → its values (SI units) at the points start … stop − 1, shape (stop − start,)."""
        if not 0 <= start <= stop <= self.size:
            raise ValueError(f"points: {start} to {stop} is out of range; allowed: 0 ≤ start ≤ stop ≤ {self.size}")
        index = self._index(start, stop)
        of_points = self._own(index[POINT]) if POINT in index else {}
        given = {*self.arguments, *self.following.needed} - {*self.following.names}
        columns = {name: of_points[name] if name in of_points else self._column(name, index) for name in given}
        columns |= self.following.at(columns)
        return {name: columns[name] for name in self.arguments}

    def _index(self, start: int, stop: int) -> dict[str, np.ndarray]:
        """Return dimension → the number along it of each of the points start … stop − 1."""
        indices, carried = {}, np.arange(stop - start)
        for dim, length in zip(reversed(self.dims), reversed(self.shape), strict=True):
            start, first = divmod(start, length)  # of Python's integers: a point's number may exceed 64 bits
            total = first + carried
            carried = total // length
            indices[dim] = total - carried * length
        return indices

    def _column(self, name: str, index: dict[str, np.ndarray]) -> np.ndarray:
        """Return one of the coordinates of points, from their numbers along the dimensions."""
        if name in index:
            values = self.values(name, index[name])
        else:
            (dim, *_), along = self.auxiliary[name]
            values = along[index[dim]]
        return values.astype(np.int64) if values.dtype.kind == "i" else values

    def _own(self, numbers: np.ndarray) -> dict[str, np.ndarray]:
        """Return what scattered points have of their own, at these numbers, which ascend."""
        first, after = (int(numbers[0]), int(numbers[-1]) + 1) if numbers.size else (0, 0)
        return {name: values[numbers - first] for name, values in self.scattered.rows(first, after).items()}

    def shard_bounds(self, count: int) -> list[tuple[int, int]]:
        """Cut the points into `count` consecutive ranges [start, stop) whose sizes differ by at most one."""
        if not 1 <= count <= self.size:
            raise ValueError(f"count: {count} is out of range; allowed: 1 to {self.size}, one a point")
        cuts = [self.size * k // count for k in range(count + 1)]
        return list(pairwise(cuts))

    def values(self, dim: str, index: np.ndarray) -> np.ndarray:
        """Return the values of a dimension at these numbers along it."""
        along = self._along[dim]
        return along.values(index) if isinstance(along, Range) else along[index]


def _spelled_out(values: Range | np.ndarray | OnDemand, most: float = math.inf) -> Range | np.ndarray | OnDemand:
    is_range = isinstance(values, Range) and values.num <= most
    return values.values(np.arange(values.num)) if is_range else values


@dataclass(frozen=True, eq=False)
class Sweep:
    """A checked definition with its system and its grid."""

    definition: Definition  #: what a person wrote
    system: systems.Dynamics  #: its equations of motion
    grid: Grid  #: its points
    variables: dict[str, Variable]  #: name → each variable of its map, in the order of the file

    @property
    def name(self) -> str:
        """The sweep's name: the stem of its definition's file."""
        return self.definition.name

    @property
    def shards(self) -> int:
        """Number of files the work is cut into, never more than points.

        For `shards: auto`, as many as leave each ten seconds of work at the system's speed, and at least one.
        """
        size, definition = self.grid.size, self.definition
        if definition.shards != "auto":
            return min(definition.shards, size)
        worthwhile = size * self.system.cost(definition).samples // (self.system.samples_per_second * SHARD_SECONDS)
        return max(1, min(worthwhile, size, MAX_SHARDS))

    @property
    def each(self) -> dict[str, int]:
        """Dimension → length of what each point has several of: equilibria, and modes or eigenvalues."""
        sizes = zip(self.grid.dims, self.grid.shape, strict=True)
        return {dim: n for dim, n in sizes if n > 1 and dim in self.system.several}

    @property
    def counted(self) -> str:
        """The number of points, and what each has several of, in words: "25,680 points (4 eigenvalues each)"."""
        each = [f"{n} {self.system.several[dim]}" for dim, n in self.each.items()]
        points = f"{self.grid.size // math.prod(self.each.values()):,} points"
        return f"{points} ({' and '.join(each)} each)" if each else points

    @property
    def has_other_inputs(self) -> bool:
        """Whether the definition, or its system, depends on more than the definition's text and the sources here."""
        definition, module = self.definition, type(self.system).__module__
        is_ours = module.startswith("sweeps.") and not definition.system.endswith(".py")
        return bool(not is_ours or definition.inputs or "mesh" in definition.text)

    def shape_at(self, name: str) -> tuple[int, ...]:
        """Return the shape of a variable's value at one point: () without further dimensions."""
        return tuple(self.grid.further[dim].size for dim in self.variables[name].over)

    def __reduce__(self):
        """Pickle a sweep as its definition."""
        return of, (self.definition,)


def of(definition: Definition, system: systems.Dynamics | None = None) -> Sweep:
    """Return the sweep of a definition and its system, which is looked up if not given."""
    system = (system or systems.resolve(definition.system, definition.folder)).bound(definition)
    return Sweep(definition, system, Grid(definition, system), system.variables(definition))
