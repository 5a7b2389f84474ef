"""A map without xarray: what commands need that read it once, and should not wait for a library to load.

It answers as an `xarray.Dataset` does, to the few questions that `selection`, `summary` and the map in characters ask;
these take either.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from sweeps.reading.stored_values import StoredValues

Data = np.ndarray | StoredValues


class PlainVariable:
    """A variable or a coordinate: dimensions, attributes, and values that are read when they are asked for.

    The data lie in memory or in a file; `chosen` is a number, or a range of numbers, of each of its dimensions, or
    all. `encoding` is what holds of the variable in its file alone: `sha256`, the hash of its values.
    """

    def __init__(
        self, dims: Sequence[str], data: Data, attrs: Mapping, chosen: Sequence = (), encoding: Mapping | None = None
    ):
        self._own, self.data, self.attrs, self.dtype = tuple(dims), data, attrs, data.dtype
        self.encoding = dict(encoding or {})
        self._chosen = tuple(chosen or map(range, data.shape))
        left = [(dim, len(part)) for dim, part in zip(self._own, self._chosen, strict=True) if isinstance(part, range)]
        self.sizes = dict(left)
        self.dims, self.shape = tuple(self.sizes), tuple(self.sizes.values())
        self.ndim = len(self.dims)
        self._read: np.ndarray | None = None

    @property
    def size(self) -> int:
        """How many values it has."""
        return math.prod(self.shape)

    @property
    def values(self) -> np.ndarray:
        """The values, shape as `shape`."""
        if self._read is None:
            key = tuple(part if isinstance(part, int) else _slice(part) for part in self._chosen)
            read = self.data.read if isinstance(self.data, StoredValues) else self.data.__getitem__
            self._read = np.asarray(read(key))
        return self._read

    def load(self) -> "PlainVariable":
        """Return the variable itself, once read."""
        _ = self.values
        return self

    def reworded(self, change: Callable[[object], object]) -> "PlainVariable":
        """Return the same with attributes, and names along one dimension, changed by a function."""
        attrs = {key: change(value) for key, value in self.attrs.items()}
        if self.dtype.kind not in "OU" or self.ndim != 1:
            return PlainVariable(self._own, self.data, attrs, self._chosen)
        return PlainVariable(self.dims, np.array([change(value) for value in self.values], self.dtype.kind), attrs)

    def isel(self, at: Mapping[str, int | slice]) -> "PlainVariable":
        """Return a part: dimension → a number, and the dimension is gone, or a slice."""
        kept = zip(self._own, self._chosen, strict=True)
        chosen = [part[at[dim]] if dim in at and isinstance(part, range) else part for dim, part in kept]
        return PlainVariable(self._own, self.data, self.attrs, chosen)

    def __getitem__(self, box: tuple[slice, ...]) -> "PlainVariable":
        return self.isel(dict(zip(self.dims, box, strict=True)))

    def transpose(self, *dims: str) -> "PlainVariable":
        """Return the same with its dimensions in another order."""
        if dims == self.dims:
            return self
        return PlainVariable(dims, self.values.transpose([self.dims.index(dim) for dim in dims]), self.attrs)


def _slice(part: range) -> slice:
    return slice(part.start, part.stop if part.stop >= 0 else None, part.step) if part else slice(0, 0)


class PlainMap:
    """A map's variables and coordinates, as they stand in its file."""

    def __init__(
        self,
        data_vars: dict[str, PlainVariable],
        coords: dict[str, PlainVariable],
        attrs: dict[str, Any],
        others: Sequence[str] = (),
        close: Callable[[], None] = lambda: None,
    ):
        self.data_vars, self.coords, self.attrs, self.others, self.close = data_vars, coords, attrs, others, close
        self.variables = coords | data_vars
        self.sizes = {dim: size for one in self.variables.values() for dim, size in one.sizes.items()}
        self.dims = tuple(self.sizes)

    def __getitem__(self, name: str) -> PlainVariable:
        return self.variables[name]

    def __enter__(self) -> "PlainMap":
        return self

    def __exit__(self, *_) -> None:
        self.close()

    def isel(self, at: Mapping[str, int | slice] = {}, **more: int | slice) -> "PlainMap":
        """Return a part; see `PlainVariable.isel`."""
        return self._each(lambda one: one.isel({**at, **more}))

    def drop_dims(self, dims: set[str]) -> "PlainMap":
        """Return the variables that lie along none of some dimensions."""
        return self._each(lambda one: one if dims.isdisjoint(one.dims) else None)

    def reworded(self, attrs: dict[str, Any], change: Callable[[object], object]) -> "PlainMap":
        """Return the same with other attributes, and those of its variables changed by a function."""
        made = self._each(lambda one: one.reworded(change))
        made.attrs = attrs
        return made

    def _each(self, change: Callable[[PlainVariable], PlainVariable | None]) -> "PlainMap":
        changed = [{name: change(one) for name, one in of.items()} for of in (self.data_vars, self.coords)]
        groups = [{name: one for name, one in of.items() if one is not None} for of in changed]
        return PlainMap(*groups, self.attrs, self.others, self.close)
