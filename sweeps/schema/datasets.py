"""Dimensions, coordinates and flags of a map's Dataset."""

from collections.abc import Hashable, Mapping, Sequence
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
    return {str(dim): ds.sizes[dim] for dim in dict.fromkeys([*largest.dims, *all_dims])}


def along(variable: DataArray, dims: Sequence[Hashable]) -> np.ndarray:
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
    dims = [dim for dim in dict.fromkeys(str(dim) for name in requested for dim in ds[name].dims) if dim not in at]
    distance = np.zeros([ds.sizes[dim] for dim in dims])
    for name, value in requested.items():
        candidates = ds[name].isel({dim: index for dim, index in at.items() if dim in ds[name].dims})
        distance = distance + np.square((along(candidates, dims) - value) / (np.ptp(ds[name].values) or 1.0))
    return dict(zip(dims, map(int, np.unravel_index(int(distance.argmin()), distance.shape)), strict=True))


def units_of(variable: DataArray) -> str:
    """Return the UDUNITS text of a variable or a coordinate; "" without a unit."""
    units = str(variable.attrs.get("units", ""))
    return "" if units == "1" else units


def long_name(variable: DataArray) -> str:
    """Return the meaning of a variable or a coordinate in one line; its name if it has none."""
    return str(variable.attrs.get("long_name", variable.name))


def spreads_by_ratio(values: np.ndarray) -> bool:
    """Return True if most values are small compared with the greatest, so that a logarithmic axis separates them."""
    return bool(values.min() > 0 and values.max() > 30 * values.min() and np.median(values) < 0.2 * values.max())


def flags(variable: DataArray) -> dict[int, str]:
    """Return value → meaning of a flag variable (CF conventions); {} for any further variable."""
    words = str(variable.attrs.get("flag_meanings", "")).split()
    values = np.atleast_1d(variable.attrs.get("flag_values", [])).tolist()
    return dict(zip(values, words, strict=False)) if variable.dtype.kind in "iub" else {}
