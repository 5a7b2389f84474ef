"""Coordinates with more values than need be in memory: made where they are asked for, some from others at a point."""

import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from sweeps.schema.definition import Definition
from sweeps.schema.parameters import Range, spread


class OnDemand:
    """Values that are made where they are asked for; it reads as an array.

    `part` returns the values of a box, given by a slice of each dimension, start and stop inside the shape.
    """

    def __init__(self, shape: tuple[int, ...], dtype: str, part: Callable[..., np.ndarray]):
        self.shape, self.ndim, self.size, self.dtype = shape, len(shape), math.prod(shape), np.dtype(dtype)
        self._part = part

    def __getitem__(self, box: slice | tuple[slice, ...]) -> np.ndarray:
        box = box if isinstance(box, tuple) else (box,)
        ends = (part.indices(size) for part, size in zip(box, self.shape, strict=True))
        return self._part(*(slice(a, max(a, b)) for a, b, _ in ends)).astype(self.dtype, copy=False)

    def __array__(self, dtype=None, copy=None) -> np.ndarray:
        return self[(slice(None),) * self.ndim].astype(dtype or self.dtype, copy=False)


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
