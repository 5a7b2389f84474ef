"""Dimensions of a map, boxes of bounded size that cover it, and meanings of flags."""

from collections.abc import Iterator, Mapping, Sequence
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from xarray import DataArray, Dataset
else:
    DataArray = Dataset = Any  # annotations alone do not load xarray


def dimensions(ds: Dataset) -> dict[str, int]:
    """Return name → length of the dimensions of a map's variables, in the order of the variable that has most."""
    largest = max(ds.data_vars.values(), key=lambda variable: variable.ndim)
    all_dims = [dim for variable in ds.data_vars.values() for dim in variable.dims]
    return {dim: ds.sizes[dim] for dim in dict.fromkeys([*largest.dims, *all_dims])}


def along(variable: DataArray, dims: Sequence[str]) -> np.ndarray:
    """Return the values of a variable along the given dimensions, in order, of length 1 if it has not the dimension."""
    present = [dim for dim in dims if dim in variable.dims]
    return variable.transpose(*present).values.reshape([variable.sizes[dim] if dim in present else 1 for dim in dims])


def own_of_points(ds: Dataset) -> list[str]:
    """Return the names of the coordinates that vary along `point`."""
    return [str(name) for name, c in ds.coords.items() if c.dims == ("point",) and c.dtype.kind == "f"]


def id_coordinates(ds: Dataset) -> list[str]:
    """Return the names of numeric coordinates that identify points but are no dimensions."""
    names = (name for name, c in ds.coords.items() if c.ndim and name not in ds.dims and c.dtype.kind == "f")
    return [str(name) for name in names if all(ds[dim].dtype.kind not in "OU" for dim in ds[name].dims)]


def nearest_by(ds: Dataset, requested: Mapping[str, float], at: Mapping[str, int]) -> dict[str, int]:
    """Return dimension → index of the point nearest to values of coordinates that have several dimensions.

    A coordinate's distance is measured in units of the range of all its values.

    Args:
        ds: the map.
        requested: coordinate → requested value.
        at: dimension → index, for dimensions with a chosen index.
    """
    dims = [dim for dim in dict.fromkeys(dim for name in requested for dim in ds[name].dims) if dim not in at]
    distance = np.zeros([ds.sizes[dim] for dim in dims])
    for name, value in requested.items():
        candidates = ds[name].isel({dim: at[dim] for dim in ds[name].dims if dim in at})
        distance = distance + np.square((along(candidates, dims) - value) / (np.ptp(ds[name].values) or 1.0))
    return dict(zip(dims, map(int, np.unravel_index(int(distance.argmin()), distance.shape)), strict=True))


def spreads_by_ratio(values: np.ndarray) -> bool:
    """Return True if most values are small compared with the greatest, so that a logarithmic axis separates them."""
    return bool(values.min() > 0 and values.max() > 30 * values.min() and np.median(values) < 0.2 * values.max())


def flags(variable: DataArray) -> dict[int, str]:
    """Return value → meaning of a flag variable (CF conventions); {} for any other variable."""
    words = str(variable.attrs.get("flag_meanings", "")).split()
    values = np.atleast_1d(variable.attrs.get("flag_values", [])).tolist()
    return dict(zip(values, words, strict=False)) if variable.dtype.kind in "iub" else {}


def runs(shape: Sequence[int], max_size: int) -> Iterator[tuple[slice, ...]]:
    """Yield boxes of at most `most` values (or one) that cover an array in C order."""
    box, size_left = [], max_size
    for size in reversed(shape):
        box.append(max(1, min(size, size_left)))
        size_left = size_left // box[-1] if box[-1] == size else 1
    yield from tiles(shape, box[::-1])


def tiles(shape: Sequence[int], box: Sequence[int]) -> Iterator[tuple[slice, ...]]:
    """Yield the boxes of shape `box` that cover an array, in C order; at the end of a dimension they may be smaller."""
    for corner in product(*(range(0, n, step) for n, step in zip(shape, box, strict=True))):
        yield tuple(slice(at, min(at + step, n)) for at, step, n in zip(corner, box, shape, strict=True))


def blocks(sizes: Mapping[str, int], max_points: int) -> Iterator[dict[str, slice]]:
    """Yield boxes (dimension → slice) of at most `most` points (or one) that cover a grid once, in storage order."""
    for box in runs(tuple(sizes.values()), max_points):
        yield dict(zip(sizes, box, strict=True))
