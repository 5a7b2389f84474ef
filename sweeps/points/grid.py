"""Point number ↔ coordinates: a grid of any size, of which only the part asked for is ever in memory.

Points are numbered in C order over the grid's dimensions: the last dimension runs fastest. Sizes are
Python integers, for a grid's size may exceed 64 bits long before anybody asks what it would cost.
"""

import math
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from sweeps.points import scattered
from sweeps.points.following import Following
from sweeps.points.ondemand import OnDemand
from sweeps.points.scattered import POINT, Scattered
from sweeps.schema.definition import Definition
from sweeps.schema.parameters import SPELLED_OUT, Range
from sweeps.systems import Dynamics


class _Runs(NamedTuple):
    """Which values of a dimension some points have, one after the other."""

    index: np.ndarray  #: numbers of the values
    counts: np.ndarray | None  #: how many points each lasts; None where that is one


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
        own = {name: ((dim,), values) for name, (dim, values) in self.system.auxiliary(self.definition).items()}
        columns = scattered.columns(self.scattered) if self.scattered else {}
        follows = self.following.coordinates(dict(zip(self.dims, self.shape, strict=True)), self.values)
        return own | {name: ((POINT,), values) for name, values in columns.items()} | follows

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
        own = self.following.dimensions(self.system.dimensions(self.definition))
        if self.scattered is None:
            return own
        points = {POINT: scattered.numbers(self.scattered.num)}
        return points | {dim: values for dim, values in own.items() if dim not in self.scattered.names}

    def points(self, start: int, stop: int) -> dict[str, np.ndarray]:
        """Return the coordinates of the points start … stop − 1.

        Returns:
            Each of `arguments` → its values (int64 or float64; SI units), of shape (stop − start,); memory is
            proportional to stop − start, whatever the grid's size.
        """
        if not 0 <= start <= stop <= self.size:
            allowed = f"0 ≤ start ≤ stop ≤ {self.size}"
            raise ValueError(f"points: {start} to {stop} is out of range; allowed: {allowed}")
        runs = self._runs(start, stop)
        own = self._own(runs[POINT].index) if POINT in runs else {}
        given = {*self.arguments, *self.following.needed} - {*self.following.names}
        columns = {name: self._column(name, runs, own) for name in given}
        columns |= self.following.at(columns)
        return {name: columns[name] for name in self.arguments}

    def _column(self, name: str, runs: dict[str, _Runs], own: dict[str, np.ndarray]) -> np.ndarray:
        """One of the coordinates that the points have, from the runs of their dimensions."""
        dim = POINT if name in own else name if name in runs else self.auxiliary[name][0][0]
        index, counts = runs[dim]
        if name in own:
            values = own[name]
        else:
            values = self.values(name, index) if name in runs else self.auxiliary[name][1][index]
        values = values if counts is None else np.repeat(values, counts)
        return values.astype(np.int64) if values.dtype.kind == "i" else values

    def _own(self, numbers: np.ndarray) -> dict[str, np.ndarray]:
        """What scattered points have of their own, at these numbers, which follow each other."""
        if not numbers.size:
            return {name: np.empty(0) for name in self.scattered.names}
        rows = self.scattered.rows(int(numbers[0]), int(numbers[-1]) + 1)
        return {name: np.ascontiguousarray(values) for name, values in rows.items()}

    def shard_bounds(self, count: int) -> list[tuple[int, int]]:
        """Cut the points into `count` consecutive ranges [start, stop) whose sizes differ by at most one."""
        if not 1 <= count <= self.size:
            raise ValueError(f"count: {count} is out of range; allowed: 1 to {self.size}, one a point")
        cuts = [self.size * k // count for k in range(count + 1)]
        return list(pairwise(cuts))

    def _runs(self, start: int, stop: int) -> dict[str, _Runs]:
        """Dimension → the runs of its values that the points start … stop − 1 go through."""
        found, inner = {}, 1  # how many points one value of the dimension lasts
        for dim, length in zip(reversed(self.dims), reversed(self.shape), strict=True):
            if length == 1:
                found[dim] = _Runs(np.zeros(1, dtype=np.int64), np.array([stop - start]))
                continue
            # Only offsets are arrays: the number of the first point may exceed 64 bits.
            first, after = start // inner, -(-stop // inner)
            index = np.arange(after - first) + first % length
            counts = None
            if inner > 1:
                counts = np.full(index.size, min(inner, stop - start))
                counts[:1] = min((first + 1) * inner, stop) - start
                counts[-1:] = stop - max((after - 1) * inner, start)
            found[dim] = _Runs(index % length if first % length + index.size > length else index, counts)
            inner *= length
        return found

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
