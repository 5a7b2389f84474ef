"""A sweep: its definition, its system and its points.

Points are numbered in C order over the grid's dimensions: the last dimension runs fastest. Of a grid, with a size that
may exceed 64 bits (sizes are Python integers), only the requested part is ever in memory.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np

from sweeps import systems
from sweeps.points import scattered
from sweeps.points.scattered import POINT, OnDemand, SampledPoints
from sweeps.schema.definition import MAX_SHARDS, Definition
from sweeps.schema.parameters import SPELLED_OUT, Range, spread
from sweeps.schema.variables import Variable

Axis = Range | np.ndarray | OnDemand  # values along a dimension

SHARD_SECONDS = 10  # s of work in one shard; its file and its job cost about one second


class DerivedParameters:
    """Parameters of a grid that follow from a pair of ratios; see `sweeps.systems.bodies.shapes.RATIOS`."""

    def __init__(self, definition: Definition):
        self._pair: dict[str, Any] = dict(definition.pair or {}) if definition.sample is None else {}
        self._derived: Any = definition.grid.derived if self._pair else None
        #: their names; () if the grid gives all of its parameters itself
        self.names = self._derived.names if self._derived else ()
        #: names of the parameters that they follow from
        self.needed_names = tuple(dict.fromkeys(parent for name in self.names for parent in self._derived.over[name]))

    def dimensions(self, dimensions: Mapping[str, Any]) -> dict[str, Range | np.ndarray]:
        """Return the dimensions of a system, with the pair in place of the parameters derived from it."""
        pair_dims = dict(zip(self.names, self._pair.items(), strict=True))
        along = (pair_dims.get(name, (name, values)) for name, values in dimensions.items())
        return {name: spread(values) if name in self._pair else values for name, values in along}

    def at(self, values: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
        """Compute each derived parameter from the values it depends on."""
        return {name: self._derived.compute_values(name, values) for name in self.names}

    def coordinates(self, shape: Mapping[str, int], values: Any) -> dict[str, tuple[tuple[str, ...], OnDemand]]:
        """Return name → (dimensions, values) of each derived coordinate."""
        coordinates = {}
        for name in self.names:
            dims = self._derived.over[name]

            def compute(*box: slice, name: str = name, dims: tuple[str, ...] = dims) -> np.ndarray:
                along = [values(dim, np.arange(cut.start, cut.stop)) for dim, cut in zip(dims, box, strict=True)]
                parents = dict(zip(dims, np.meshgrid(*along, indexing="ij"), strict=True))
                return np.ascontiguousarray(self._derived.compute_values(name, parents))

            coordinates[name] = dims, OnDemand(tuple(shape[dim] for dim in dims), "f8", compute)
        return coordinates


class Grid:
    """The points of a sweep; its system defines their dimensions and the order of these, those of length one too."""

    def __init__(self, definition: Definition, system: systems.Dynamics):
        self.definition, self.system = definition, system
        #: the points along `point`; None if all dimensions are the system's own
        self.point_rows = SampledPoints(definition) if definition.sample is not None else definition.rows
        self.derived_parameters = DerivedParameters(definition)  #: parameters that follow from a pair of ratios
        self._along = self._axes()
        #: dimension → its length, in storage order
        self.sizes = {dim: v.num if isinstance(v, Range) else v.size for dim, v in self._along.items()}
        self.dims, self.shape = tuple(self.sizes), tuple(self.sizes.values())
        self.size = math.prod(self.shape)  #: number of points
        #: dimension that variables have at every point → the values along it
        self.extra_dimensions = system.extra_dimensions(definition)
        self.extra_sizes = {dim: values.size for dim, values in self.extra_dimensions.items()}  #: their lengths
        self.arguments = system.arguments(definition)  #: names of the coordinates that a point consists of

    def _axes(self) -> "dict[str, Axis]":
        """Return dimension → values, with long ranges and numbers of points computed on demand."""
        own_axes = self.derived_parameters.dimensions(self.system.dimensions(self.definition))
        # longer axes are computed when they are read
        dimensions: dict[str, Axis] = {dim: _expand_range(v, SPELLED_OUT) for dim, v in own_axes.items()}
        if self.point_rows is None:
            return dimensions
        numbers = OnDemand((self.point_rows.num,), "i8", lambda part: np.arange(part.start + 1, part.stop + 1))
        return {POINT: numbers} | {dim: v for dim, v in dimensions.items() if dim not in self.point_rows.names}

    @cached_property
    def coordinates(self) -> dict[str, np.ndarray | OnDemand]:
        """Dimension → its values, 1-D: whole numbers, text or float64, in the units of the system's coordinates."""
        return {dim: v.values(np.arange(v.num)) if isinstance(v, Range) else v for dim, v in self._along.items()}

    @cached_property
    def auxiliary(self) -> dict[str, tuple[tuple[str, ...], np.ndarray | OnDemand]]:
        """Name → (dimensions, values) of coordinates of bodies and points, and of derived parameters."""
        of_system = self.system.auxiliary(self.definition)
        coordinates: dict[str, tuple[tuple[str, ...], Any]] = {n: ((dim,), v) for n, (dim, v) in of_system.items()}
        columns = scattered.lazy_columns(self.point_rows) if self.point_rows else {}
        follows = self.derived_parameters.coordinates(self.sizes, self.values)
        if point_names := getattr(self.point_rows, "point_names", ()):
            coordinates["name"] = (POINT,), np.array(point_names)
        return coordinates | {name: ((POINT,), values) for name, values in columns.items()} | follows

    def points(self, start: int, stop: int) -> dict[str, np.ndarray]:
        """Return each of `arguments` → its values (SI units) at the points start … stop − 1, shape (stop − start,)."""
        if not 0 <= start <= stop <= self.size:
            raise ValueError(f"points: {start} to {stop} is out of range; allowed: 0 ≤ start ≤ stop ≤ {self.size}")
        index = self._index(start, stop)
        of_points = self._row_values(index[POINT]) if POINT in index else {}
        needed_names = {*self.arguments, *self.derived_parameters.needed_names} - {*self.derived_parameters.names}
        columns = {name: of_points[name] if name in of_points else self._column(name, index) for name in needed_names}
        columns |= self.derived_parameters.at(columns)
        return {name: columns[name] for name in self.arguments}

    def _index(self, start: int, stop: int) -> dict[str, np.ndarray]:
        """Return dimension → the number along it of each of the points start … stop − 1."""
        indices, carry = {}, np.arange(stop - start)
        for dim, length in zip(reversed(self.dims), reversed(self.shape), strict=True):
            start, first = divmod(start, length)  # of Python's integers: a point's number may exceed 64 bits
            total = first + carry
            carry = total // length
            indices[dim] = total - carry * length
        return indices

    def _column(self, name: str, index: dict[str, np.ndarray]) -> np.ndarray:
        """Return a coordinate of points, from their numbers along the dimensions."""
        if name in index:
            values = self.values(name, index[name])
        else:
            (dim, *_), along = self.auxiliary[name]
            values = along[index[dim]]
        return values.astype(np.int64) if values.dtype.kind == "i" else values

    def _row_values(self, numbers: np.ndarray) -> dict[str, np.ndarray]:
        """Return name → values of the parameters of sampled or listed points, at these numbers, which ascend."""
        first, after = (int(numbers[0]), int(numbers[-1]) + 1) if numbers.size else (0, 0)
        return {name: values[numbers - first] for name, values in self.point_rows.rows(first, after).items()}

    def shard_bounds(self, count: int) -> list[tuple[int, int]]:
        """Cut the points into `count` consecutive ranges [start, stop) with sizes that differ by 1 at most."""
        if not 1 <= count <= self.size:
            raise ValueError(f"count: {count} is out of range; allowed: 1 to {self.size}, one a point")
        cuts = [self.size * k // count for k in range(count + 1)]
        return list(pairwise(cuts))

    def values(self, dim: str, index: np.ndarray) -> np.ndarray:
        """Return the values of a dimension at these numbers along it."""
        along = self._along[dim]
        return along.values(index) if isinstance(along, Range) else along[index]


def _expand_range(values: Range | np.ndarray, max_values: int) -> Range | np.ndarray:
    return values.values(np.arange(values.num)) if isinstance(values, Range) and values.num <= max_values else values


@dataclass(frozen=True, eq=False)
class Sweep:
    """A checked definition with its system and its grid."""

    definition: Definition  #: its validated definition
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
            return min(int(definition.shards), size)
        worthwhile = size * self.system.cost(definition).samples // (self.system.samples_per_second * SHARD_SECONDS)
        return max(1, min(worthwhile, size, MAX_SHARDS))

    @property
    def each(self) -> dict[str, int]:
        """Dimension → length, for the dimensions of results that each point has: equilibria, modes or eigenvalues."""
        return {dim: n for dim, n in self.grid.sizes.items() if n > 1 and dim in self.system.several}

    @property
    def size_in_words(self) -> str:
        """The number of points, and of each one's results, in words: "25,680 points (4 eigenvalues each)"."""
        each = [f"{n} {self.system.several[dim]}" for dim, n in self.each.items()]
        points = f"{self.grid.size // math.prod(self.each.values()):,} points"
        return f"{points} ({' and '.join(each)} each)" if each else points

    def shape_at(self, name: str) -> tuple[int, ...]:
        """Return the shape of a variable's value at one point: () without further dimensions."""
        return tuple(self.grid.extra_sizes[dim] for dim in self.variables[name].over)

    def __reduce__(self):
        """Pickle a sweep as its definition."""
        return build_sweep, (self.definition,)


def build_sweep(definition: Definition, system: systems.Dynamics | None = None) -> Sweep:
    """Return the sweep of a definition and its system; by default the system that the definition names."""
    system = (system or systems.resolve(definition.system, definition.folder)).bound(definition)
    return Sweep(definition, system, Grid(definition, system), system.variables(definition))
