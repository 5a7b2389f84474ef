"""Slices of a map by `isel` and `sel`, with the dimensions that its pictures expect."""

from typing import TYPE_CHECKING, Any

import numpy as np

from sweeps import systems
from sweeps.reading.definitions import definition_of
from sweeps.schema.refusals import RefusedError, cut_text
from sweeps.schema.variables import POINT, POINT_NAME, Layout, is_readable

if TYPE_CHECKING:
    import xarray as xr

ALLOWED_MAPS = "a Dataset of sweeps.open_map or sweeps.survey, or a slice of one, with its attributes and coordinates"


def check_is_map(ds: Any) -> None:
    """Refuse an object that is not the Dataset of a map."""
    if not hasattr(ds, "data_vars"):
        raise RefusedError(f"ds: is of type {type(ds).__name__}; allowed: {ALLOWED_MAPS}")
    version = str(ds.attrs.get("contract_version", ""))
    if not is_readable(version):
        problem = f"is {cut_text(version)!r}" if version else "is missing"
        raise RefusedError(f"ds: its attribute contract_version {problem}; allowed: {ALLOWED_MAPS}")
    try:
        systems.of_map(ds)
    except KeyError:
        name = cut_text(repr(ds.attrs["system"]))
        raise RefusedError(
            f"ds: its system {name} is not available; allowed: {', '.join(systems.system_names())}"
        ) from None
    if not ds.data_vars:
        raise RefusedError(f"ds: holds no variable; allowed: {ALLOWED_MAPS}")


def with_all_dimensions(ds: "xr.Dataset") -> "xr.Dataset":
    """Return a slice of a map with all dimensions of the map, in storage order; a whole map is returned unchanged.

    If `isel` or `sel` removed a dimension, its scalar coordinate becomes a dimension of length one again. Values along
    a dimension that are out of order are sorted, and repeated values left out.
    """
    layout = systems.of_map(ds).layout()
    if missing := sorted({*layout.required(ds.coords), *map(str, ds.dims)} - {*ds.coords}):
        allowed = "a slice that keeps its coordinates, as isel and sel do without drop=True"
        raise RefusedError(f"ds: the coordinate {missing[0]} is missing; allowed: {allowed}")
    if empty := [dim for dim, size in ds.sizes.items() if not size]:
        raise RefusedError(f"ds: has no points along {empty[0]}; allowed: a slice with one point or more")
    is_whole = all(coordinate.ndim for coordinate in ds.coords.values())
    return _in_order(ds if is_whole else _with_scalar_dimensions(ds, layout), layout)


def _with_scalar_dimensions(ds: "xr.Dataset", layout: Layout) -> "xr.Dataset":
    """Return the slice with a dimension of length one for each that `isel` or `sel` removed."""
    scalars = [str(name) for name, coordinate in ds.coords.items() if not coordinate.ndim]
    along = {name: dims for name, dims in layout.over.items() if {*dims} <= {*ds.coords}}
    if anchor := next((dim for dim in (POINT.name, layout.along) if dim in scalars), ""):
        along |= dict.fromkeys(_coordinates_of_point(ds, anchor, layout), (anchor,))
    dims = [name for name in scalars if name not in along]
    variables = {}
    for name, variable in ds.variables.items():
        if name in ds.coords:
            new_dims = [dim for dim in dims if dim in along.get(str(name), (name,))]
        else:
            over = layout.variables[str(name)].over if name in layout.variables else ()
            new_dims = [dim for dim in dims if dim in over or not any(dim in v.over for v in layout.variables.values())]
        variables[name] = variable.set_dims([*new_dims, *variable.dims]) if new_dims else variable
    data = {name: variable for name, variable in variables.items() if name not in ds.coords}
    return type(ds)(data, {name: variables[name] for name in ds.coords}, ds.attrs)


def _coordinates_of_point(ds: "xr.Dataset", anchor: str, layout: Layout) -> list[str]:
    """Return the scalar coordinates that belong to a body or a point (`anchor`), if the slice has a single one."""
    grid = definition_of(ds.attrs).get("grid") if anchor == layout.along else None
    keys = {*grid} if isinstance(grid, dict) else set()
    scalars = {str(name): coordinate for name, coordinate in ds.coords.items() if not coordinate.ndim}
    numbers = [name for name, coordinate in scalars.items() if coordinate.dtype.kind == "f"]
    return [name for name in (*numbers, *layout.beside, POINT_NAME.name) if name in ds.coords and name not in keys]


def _in_order(ds: "xr.Dataset", layout: Layout) -> "xr.Dataset":
    """Return the slice with dimensions in storage order; if values along one are unordered, sorted without repeats."""
    names = [*layout.coordinates]
    order = sorted(map(str, ds.coords), key=lambda name: names.index(name) if name in names else -1)
    for dim in ds.dims:
        values = ds[dim].values
        if values.dtype.kind in "OU":
            ds = ds if len({*values}) == values.size else ds.drop_duplicates(dim)
        elif values.dtype.kind in "iuf" and not ((np.diff(values) > 0).all() or (np.diff(values) < 0).all()):
            ds = ds.drop_duplicates(dim).sortby(dim)
    dims = [dim for dim in order if dim in ds.dims]
    is_ordered = all([dim for dim in dims if dim in v.dims] == [*v.dims] for v in ds.variables.values())
    return ds if is_ordered else ds.transpose(*dims)
