"""Slices of a map: what `isel` and `sel` leave of it, with the dimensions that its pictures expect."""

from typing import TYPE_CHECKING, Any

import numpy as np

from sweeps import systems
from sweeps.reading.definitions import definition_of
from sweeps.schema.refusals import RefusedError, cut_text
from sweeps.schema.variables import POINT, POINT_NAME, Layout, is_readable

if TYPE_CHECKING:
    import xarray as xr

ALLOWED = "a Dataset of sweeps.open_map or sweeps.survey, or a slice of one, with its attributes and coordinates"


def check_is_map(ds: Any) -> None:
    """Refuse what is no Dataset of a map."""
    if not hasattr(ds, "data_vars"):
        raise RefusedError(f"ds: is of type {type(ds).__name__}; allowed: {ALLOWED}")
    version = str(ds.attrs.get("contract_version", ""))
    if not is_readable(version):
        wrong = f"is {cut_text(version)!r}" if version else "is missing"
        raise RefusedError(f"ds: its attribute contract_version {wrong}; allowed: {ALLOWED}")
    try:
        systems.of_map(ds)
    except KeyError:
        name = cut_text(repr(ds.attrs["system"]))
        raise RefusedError(
            f"ds: its system {name} is not available; allowed: {', '.join(systems.system_names())}"
        ) from None
    if not ds.data_vars:
        raise RefusedError(f"ds: holds no variable; allowed: {ALLOWED}")


def with_all_dimensions(ds: "xr.Dataset") -> "xr.Dataset":
    """Return a slice of a map with all dimensions of the map, in storage order; a whole map is returned as it is.

    Where `isel` or `sel` took a dimension, its scalar coordinate becomes a dimension of length one again. Values along
    a dimension that are out of order are sorted, and repeated ones left out.
    """
    layout = systems.of_map(ds).layout()
    if missing := sorted({*layout.required(ds.coords), *map(str, ds.dims)} - {*ds.coords}):
        allowed = "a slice that keeps its coordinates, as isel and sel do without drop=True"
        raise RefusedError(f"ds: the coordinate {missing[0]} is missing; allowed: {allowed}")
    if empty := [dim for dim, size in ds.sizes.items() if not size]:
        raise RefusedError(f"ds: has no points along {empty[0]}; allowed: a slice with one point or more")
    return _in_order(ds if all(one.ndim for one in ds.coords.values()) else _widened(ds, layout), layout)


def _widened(ds: "xr.Dataset", layout: Layout) -> "xr.Dataset":
    """Return the slice with a dimension of length one for each that `isel` or `sel` took."""
    taken = [str(name) for name, coordinate in ds.coords.items() if not coordinate.ndim]
    along = {name: dims for name, dims in layout.over.items() if {*dims} <= {*ds.coords}}
    if anchor := next((dim for dim in (POINT.name, layout.along) if dim in taken), ""):
        along |= dict.fromkeys(_of_one(ds, anchor, layout), (anchor,))
    dims = [name for name in taken if name not in along]
    variables = {}
    for name, variable in ds.variables.items():
        if name in ds.coords:
            added = [dim for dim in dims if dim in along.get(name, (name,))]
        else:
            over = layout.variables[name].over if name in layout.variables else ()
            added = [dim for dim in dims if dim in over or not any(dim in v.over for v in layout.variables.values())]
        variables[name] = variable.set_dims([*added, *variable.dims]) if added else variable
    data = {name: variable for name, variable in variables.items() if name not in ds.coords}
    return type(ds)(data, {name: variables[name] for name in ds.coords}, ds.attrs)


def _of_one(ds: "xr.Dataset", anchor: str, layout: Layout) -> list[str]:
    """Return the scalar coordinates that belong to the one body, or the one point, that a slice has left."""
    grid = definition_of(ds.attrs).get("grid") if anchor == layout.along else None
    keys = {*grid} if isinstance(grid, dict) else set()
    numbers = [str(name) for name, one in ds.coords.items() if not one.ndim and one.dtype.kind == "f"]
    return [name for name in (*numbers, *layout.beside, POINT_NAME.name) if name in ds.coords and name not in keys]


def _in_order(ds: "xr.Dataset", layout: Layout) -> "xr.Dataset":
    """Return the slice with its dimensions in storage order, and the values along each of them in order."""
    names = [*layout.coordinates]
    order = sorted(map(str, ds.coords), key=lambda name: names.index(name) if name in names else -1)
    for dim in ds.dims:
        values = ds[dim].values
        if values.dtype.kind in "OU":
            ds = ds if len({*values}) == values.size else ds.drop_duplicates(dim)
        elif values.dtype.kind in "iuf" and not ((np.diff(values) > 0).all() or (np.diff(values) < 0).all()):
            ds = ds.drop_duplicates(dim).sortby(dim)
    stored = [dim for dim in order if dim in ds.dims]
    is_stored = all([dim for dim in stored if dim in v.dims] == [*v.dims] for v in ds.variables.values())
    return ds if is_stored else ds.transpose(*stored)
