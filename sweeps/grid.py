"""Point number ↔ coordinates: a grid of any size, of which only the part asked for is ever in memory.

Points are numbered in C order over the grid's dimensions: the last dimension runs fastest. Sizes are
Python integers, for a grid's size may exceed 64 bits long before anybody asks what it would cost.
"""

import math
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

from sweeps.definition import MAX_SHARDS, MOMENTS, SHAREABLE, SPELLED_OUT, Definition, Range

PARAMETERS = (*MOMENTS, *SHAREABLE)
# One core samples about a million runs of 64 samples in a second; a shard is worth ten of them.
SAMPLES_PER_SECOND = 64_000_000
SHARD_SECONDS = 10

Box = tuple[tuple[slice, ...], int, int]


@dataclass(frozen=True)
class Grid:
    """The points of a sweep.

    Dimensions are (axis, I1, I2, I3, omega0, epsilon, phase), or with bodies (body, axis) and those of
    omega0, epsilon and phase that no body gives; dimensions of length one are included.
    """

    definition: Definition

    @cached_property
    def dims(self) -> tuple[str, ...]:
        """Names of the dimensions, in storage order."""
        first = ("body", "axis") if self.definition.bodies else ("axis",)
        return first + tuple(name for name in PARAMETERS if not self.definition.is_per_body(name))

    @cached_property
    def shape(self) -> tuple[int, ...]:
        """Length of each dimension."""
        return tuple(self._length(dim) for dim in self.dims)

    @cached_property
    def size(self) -> int:
        """Number of points."""
        return math.prod(self.shape)

    @cached_property
    def coordinates(self) -> dict[str, np.ndarray]:
        """Dimension → its values, 1-D: axis int8, body text, the others float64 in SI units."""
        return {dim: self._spelled_out(dim) for dim in self.dims}

    @cached_property
    def body_coordinates(self) -> dict[str, np.ndarray]:
        """Name → values along `body`: I1 … I3, what bodies give, `moments_are_ratios`; {} without bodies."""
        bodies = self.definition.bodies
        if not bodies:
            return {}
        moments = np.array([body.moments for body in bodies]).T
        columns = dict(zip(MOMENTS, map(np.ascontiguousarray, moments), strict=True))
        for name in filter(self.definition.is_per_body, SHAREABLE):
            own = [getattr(body, name) for body in bodies]
            shared = getattr(self.definition.grid, name)
            columns[name] = np.array([shared if value is None else value for value in own])
        columns["moments_are_ratios"] = np.array([body.ratios is not None for body in bodies])
        return columns

    def points(self, start: int, stop: int) -> dict[str, np.ndarray]:
        """Coordinates of the points start … stop − 1.

        Args:
            start: number of the first point.
            stop: number after the last point; 0 ≤ start ≤ stop ≤ size.

        Returns:
            axis (int64) and I1, I2, I3 (kg m2), omega0 (rad s-1), epsilon (1), phase (rad) (float64), each
            of shape (stop − start,); memory is proportional to stop − start, whatever the grid's size.

        Raises:
            ValueError: for numbers outside the grid.
        """
        index = self._unravelled(start, stop)
        columns = {"axis": self._values("axis", index["axis"]).astype(np.int64)}
        for name in PARAMETERS:
            if name in index:
                columns[name] = self._values(name, index[name])
            else:
                columns[name] = self.body_coordinates[name][index["body"]]
        return columns

    def shard_bounds(self, count: int) -> list[tuple[int, int]]:
        """Cuts the points into `count` runs [start, stop), in order, whose sizes differ by one at most."""
        if not 1 <= count <= self.size:
            raise ValueError(f"count: {count} is out of range; allowed: 1 to {self.size}, one a point")
        cuts = [self.size * k // count for k in range(count + 1)]
        return list(pairwise(cuts))

    def hyperslabs(self, start: int, stop: int) -> list[Box]:
        """Cuts the points start … stop − 1 into boxes, each one contiguous run of points.

        Returns:
            (a slice per dimension, first point, point after the last) per box, in order, covering each
            point once; at most 2·ndim − 1 boxes.

        Raises:
            ValueError: for numbers outside the grid.
        """
        self._check_bounds(start, stop)
        boxes = []
        while start < stop:
            boxes.append(self._largest_box(start, stop))
            start = boxes[-1][2]
        return boxes

    def _largest_box(self, start: int, stop: int) -> Box:
        strides = [math.prod(self.shape[dim + 1 :]) for dim in range(len(self.shape))]
        dim = next(d for d, stride in enumerate(strides) if start % stride == 0 and start + stride <= stop)
        position = self._position(start)
        count = min(self.shape[dim] - position[dim], (stop - start) // strides[dim])
        slices = [slice(index, index + 1) for index in position[:dim]]
        slices += [slice(position[dim], position[dim] + count)]
        slices += [slice(0, length) for length in self.shape[dim + 1 :]]
        return tuple(slices), start, start + count * strides[dim]

    def _position(self, point: int) -> list[int]:
        position = []
        for length in reversed(self.shape):
            point, index = divmod(point, length)
            position.append(index)
        return position[::-1]

    def _unravelled(self, start: int, stop: int) -> dict[str, np.ndarray]:
        self._check_bounds(start, stop)
        steps = np.arange(stop - start)
        index = {}
        for dim, length in zip(reversed(self.dims), reversed(self.shape), strict=True):
            # Only offsets are arrays: the number of the first point may exceed 64 bits.
            start, first = divmod(start, length)
            steps, index[dim] = np.divmod(steps + first, length)
        return index

    def _check_bounds(self, start: int, stop: int) -> None:
        if not 0 <= start <= stop <= self.size:
            allowed = f"0 ≤ start ≤ stop ≤ {self.size}"
            raise ValueError(f"points: {start} to {stop} is out of range; allowed: {allowed}")

    def _length(self, dim: str) -> int:
        if dim == "body":
            return len(self.definition.bodies)
        if dim == "axis":
            return len(self.definition.axes)
        entry = getattr(self.definition.grid, dim)
        if isinstance(entry, Range):
            return entry.num
        return len(entry) if isinstance(entry, tuple) else 1

    def _spelled_out(self, dim: str) -> np.ndarray:
        if dim == "body":
            return np.array([body.name for body in self.definition.bodies])
        if dim == "axis":
            return np.array(self.definition.axes, np.int8)
        entry = getattr(self.definition.grid, dim)
        if isinstance(entry, Range):
            return entry.values(np.arange(entry.num))
        return np.atleast_1d(np.array(entry, np.float64))

    @cached_property  # longer axes are computed where they are asked for
    def _tables(self) -> dict[str, np.ndarray]:
        lengths = zip(self.dims, self.shape, strict=True)
        return {dim: self._spelled_out(dim) for dim, length in lengths if length <= SPELLED_OUT}

    def _values(self, dim: str, index: np.ndarray) -> np.ndarray:
        if dim in self._tables:
            return self._tables[dim][index]
        return getattr(self.definition.grid, dim).values(index)


def shard_count(definition: Definition, grid: Grid) -> int:
    """Number of files the work is cut into, never more than points.

    For `shards: auto`, as many as leave each ten seconds of work at SAMPLES_PER_SECOND, and at least one.
    """
    if definition.shards != "auto":
        return min(definition.shards, grid.size)
    worthwhile = grid.size * definition.integration.samples // (SAMPLES_PER_SECOND * SHARD_SECONDS)
    return max(1, min(worthwhile, grid.size, MAX_SHARDS))
