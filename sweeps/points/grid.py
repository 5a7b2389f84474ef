"""Point number ↔ coordinates: a grid of any size, of which only the part asked for is ever in memory.

Points are numbered in C order over the grid's dimensions: the last dimension runs fastest. Sizes are
Python integers, for a grid's size may exceed 64 bits long before anybody asks what it would cost.
"""

import math
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

from sweeps.points import scattered
from sweeps.points.ondemand import Following, OnDemand
from sweeps.points.scattered import POINT, Scattered
from sweeps.schema.definition import Definition
from sweeps.schema.parameters import SPELLED_OUT, Range
from sweeps.systems import Dynamics


@dataclass(frozen=True)
class Grid:
    """The points of a sweep.

    Its system says which dimensions those have, in which order, and the values along them; dimensions of length one
    are included.
    """

    definition: Definition
    system: Dynamics

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
        """Name → (dimensions, values along them) of each coordinate that is no dimension.

        That is what bodies and points have of their own, and what follows from others.
        """
        coordinates = {name: ((dim,), values) for name, (dim, values) in self.system.auxiliary(self.definition).items()}
        columns = scattered.columns(self.scattered) if self.scattered else {}
        follows = self.following.coordinates(dict(zip(self.dims, self.shape, strict=True)), self.values)
        return coordinates | {name: ((POINT,), values) for name, values in columns.items()} | follows

    @cached_property
    def following(self) -> Following:
        """The parameters that follow from others, along whose dimensions they lie."""
        return Following(self.definition)

    @cached_property
    def scattered(self) -> Scattered | None:
        """The points along `point`; None where all dimensions are the system's own."""
        return scattered.of(self.definition)

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
        if self.scattered is None:
            return dimensions
        points = {POINT: scattered.numbers(self.scattered.num)}
        return points | {dim: values for dim, values in dimensions.items() if dim not in self.scattered.names}

    def points(self, start: int, stop: int) -> dict[str, np.ndarray]:
        """Return the coordinates of the points start … stop − 1.

        Returns:
            Each of `arguments` → its values (int64 or float64; SI units), of shape (stop − start,); memory is
            proportional to stop − start, whatever the grid's size.
        """
        if not 0 <= start <= stop <= self.size:
            allowed = f"0 ≤ start ≤ stop ≤ {self.size}"
            raise ValueError(f"points: {start} to {stop} is out of range; allowed: {allowed}")
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

    @cached_property  # longer axes are computed where they are asked for
    def _tables(self) -> dict[str, np.ndarray]:
        lengths = zip(self._along.items(), self.shape, strict=True)
        return {dim: _spelled_out(v) for (dim, v), n in lengths if n <= SPELLED_OUT and dim != POINT}

    def values(self, dim: str, index: np.ndarray) -> np.ndarray:
        """Return the values of a dimension at these numbers along it."""
        if dim in self._tables:
            return self._tables[dim][index]
        along = self._along[dim]
        return along.values(index) if isinstance(along, Range) else along[index]


def _spelled_out(values: Range | np.ndarray | OnDemand) -> np.ndarray | OnDemand:
    return values.values(np.arange(values.num)) if isinstance(values, Range) else values
