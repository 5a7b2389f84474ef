"""Parameters of a grid that follow from a pair of others; see `sweeps.systems.bodies.shapes.RATIOS`."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from sweeps.points.ondemand import OnDemand
from sweeps.schema.definition import Definition
from sweeps.schema.parameters import Range, spread


class Following:
    """The parameters of a grid that follow from others."""

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
