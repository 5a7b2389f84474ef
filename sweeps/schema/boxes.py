"""Dimensions of a map, boxes of bounded size that cover it, and meanings of flags."""

from collections.abc import Iterator, Mapping, Sequence
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from xarray import DataArray, Dataset
else:
    DataArray = Dataset = Any  # to annotate a map is no reason to load xarray


def dimensions(ds: Dataset) -> dict[str, int]:
    """Return name → length of the dimensions of a map's variables, in the order of the variable that has most."""
    largest = max(ds.data_vars.values(), key=lambda variable: variable.ndim)
    others = [dim for variable in ds.data_vars.values() for dim in variable.dims]
    return {dim: ds.sizes[dim] for dim in dict.fromkeys([*largest.dims, *others])}


def along(variable: DataArray, dims: Sequence[str]) -> np.ndarray:
    """Return the values of a variable with the given dimensions in order, of length 1 where it lacks one."""
    present = [dim for dim in dims if dim in variable.dims]
    return variable.transpose(*present).values.reshape([variable.sizes[dim] if dim in present else 1 for dim in dims])


def own_of_points(ds: Dataset) -> list[str]:
    """Return the names of the coordinates that vary along `point`."""
    return [str(name) for name, c in ds.coords.items() if c.dims == ("point",) and c.dtype.kind == "f"]


def placing(ds: Dataset) -> list[str]:
    """Return the names of numeric coordinates that identify points but are no dimensions."""
    names = (name for name, c in ds.coords.items() if c.ndim and name not in ds.dims and c.dtype.kind == "f")
    return [str(name) for name in names if all(ds[dim].dtype.kind not in "OU" for dim in ds[name].dims)]


def nearest_by(ds: Dataset, requested: Mapping[str, float], at: Mapping[str, int]) -> dict[str, int]:
    """Return dimension → index of the point nearest to values of coordinates that lie along several dimensions.

    A coordinate's distance counts in units of the range of all its values; dimensions in `at` are chosen already.
    """
    dims = [dim for dim in dict.fromkeys(dim for name in requested for dim in ds[name].dims) if dim not in at]
    away = np.zeros([ds.sizes[dim] for dim in dims])
    for name, value in requested.items():
        part = ds[name].isel({dim: at[dim] for dim in ds[name].dims if dim in at})
        away = away + np.square((along(part, dims) - value) / (np.ptp(ds[name].values) or 1.0))
    return dict(zip(dims, map(int, np.unravel_index(int(away.argmin()), away.shape)), strict=True))


def spreads_by_ratio(values: np.ndarray) -> bool:
    """Return True if most values are small compared with the greatest, so that a logarithmic axis separates them."""
    return bool(values.min() > 0 and values.max() > 30 * values.min() and np.median(values) < 0.2 * values.max())


def flags(variable: DataArray) -> dict[int, str]:
    """Return value → meaning of a flag variable (CF conventions); {} for any other variable."""
    words = str(variable.attrs.get("flag_meanings", "")).split()
    values = np.atleast_1d(variable.attrs.get("flag_values", [])).tolist()
    return dict(zip(values, words, strict=False)) if variable.dtype.kind in "iub" else {}


def runs(shape: Sequence[int], most: int) -> Iterator[tuple[slice, ...]]:
    """Yield boxes of at most `most` values (or one) that cover an array in C order."""
    box, left = [], most
    for size in reversed(shape):
        box.append(max(1, min(size, left)))
        left = left // box[-1] if box[-1] == size else 1
    yield from tiles(shape, box[::-1])


def tiles(shape: Sequence[int], box: Sequence[int]) -> Iterator[tuple[slice, ...]]:
    """Yield the boxes into which an array is cut by a box of some shape, in C order; the last ones may be smaller."""
    for corner in product(*(range(0, n, step) for n, step in zip(shape, box, strict=True))):
        yield tuple(slice(at, min(at + step, n)) for at, step, n in zip(corner, box, shape, strict=True))


def blocks(sizes: Mapping[str, int], most: int) -> Iterator[dict[str, slice]]:
    """Yield boxes (dimension → slice) of at most `most` points (or one) that cover a grid once, in storage order."""
    for box in runs(tuple(sizes.values()), most):
        yield dict(zip(sizes, box, strict=True))
