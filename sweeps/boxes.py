"""A map's shape and how it is read: dimensions, boxes of bounded size that cover them, the meanings of flags."""

from collections.abc import Iterator, Mapping, Sequence
from itertools import product
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import xarray as xr


def dimensions(ds: "xr.Dataset") -> dict[str, int]:
    """Name → length of the dimensions of a map's variables, in the order of the one that has most."""
    largest = max(ds.data_vars.values(), key=lambda variable: variable.ndim)
    others = [dim for variable in ds.data_vars.values() for dim in variable.dims]
    return {dim: ds.sizes[dim] for dim in dict.fromkeys([*largest.dims, *others])}


def along(variable: "xr.DataArray", dims: Sequence[str]) -> np.ndarray:
    """Values of a variable, of a Dataset or a plain map, along dimensions in that order: length 1 for what it lacks."""
    own = [dim for dim in dims if dim in variable.dims]
    return variable.transpose(*own).values.reshape([variable.sizes[dim] if dim in own else 1 for dim in dims])


def own_of_points(ds: "xr.Dataset") -> list[str]:
    """Names of the coordinates that points have of their own, along `point`."""
    return [str(name) for name, c in ds.coords.items() if c.dims == ("point",) and c.dtype.kind == "f"]


def spreads_by_ratio(values: np.ndarray) -> bool:
    """Whether most values are small beside the greatest: then a logarithmic axis tells them apart."""
    return bool(values.min() > 0 and values.max() > 30 * values.min() and np.median(values) < 0.2 * values.max())


def flags(variable: "xr.DataArray") -> dict[int, str]:
    """Value → meaning of a flag variable by the CF conventions; {} for any other."""
    words = str(variable.attrs.get("flag_meanings", "")).split()
    values = np.atleast_1d(variable.attrs.get("flag_values", [])).tolist()
    return dict(zip(values, words, strict=False)) if variable.dtype.kind in "iub" else {}


def runs(shape: Sequence[int], most: int) -> Iterator[tuple[slice, ...]]:
    """Boxes of at most `most` values (or one) that hold an array's values in C order, one run after the other."""
    box, left = [], most
    for size in reversed(shape):
        box.append(max(1, min(size, left)))
        left = left // box[-1] if box[-1] == size else 1
    for corner in product(*(range(0, n, step) for n, step in zip(shape, reversed(box), strict=True))):
        ends = zip(corner, reversed(box), shape, strict=True)
        yield tuple(slice(at, min(at + step, n)) for at, step, n in ends)


def blocks(sizes: Mapping[str, int], most: int) -> Iterator[dict[str, slice]]:
    """Boxes that cover a grid once, in storage order, each of at most `most` points (or of one): dimension → slice."""
    for box in runs(tuple(sizes.values()), most):
        yield dict(zip(sizes, box, strict=True))
