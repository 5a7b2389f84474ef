"""Selection of points and slices of a map by values of its coordinates; the nearest grid values are used."""

import math
from collections.abc import Mapping
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from sweeps.schema import units
from sweeps.schema.datasets import dimensions, id_coordinates, nearest_by
from sweeps.schema.refusals import MapError, cut_text, hint, list_names, match_name
from sweeps.schema.variables import POINT, POINT_NAME

if TYPE_CHECKING:
    import xarray as xr

MAX_LISTED_VALUES = 8  # values of a coordinate that a message lists; of more, it states the range


class SelectionError(MapError):
    """A coordinate that cannot be selected; the message names it and lists the allowed values."""


@dataclass(frozen=True)
class Place:
    """A value of one dimension."""

    dim: str  #: the dimension
    index: int  #: number of the value, from 0
    value: float | int | str  #: the grid's value there
    requested: float | str | None  #: the requested value; None if the dimension has one value
    units: str  #: UDUNITS text
    outside: bool = False  #: True if the requested value is outside the range of the grid
    by: str = ""  #: requested values of coordinates that are no dimensions, if these determined the place

    def __str__(self):
        unit = "" if self.units in ("1", "") else f" {self.units}"
        text = f"{self.dim} = {format_value(self.value)}{unit}"
        if self.by:
            return f"{text} (nearest to {self.by})"
        if self.requested is None or self.requested == self.value:
            return text
        note = ", which is outside the grid" if self.outside else ""
        return f"{text} (nearest to {format_value(self.requested)}{note})"


def format_value(value: float | int | str) -> str:
    """Return the value of a coordinate as text."""
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def nearest_places(ds: "xr.Dataset", requested: Mapping[str, str], prefix: str = "") -> dict[str, Place]:
    """Return dimension → place nearest to the requested value, in storage order; dimensions of length one included.

    Numbers need not be grid values (the smallest difference decides), except axes; a unique fragment of a body's name
    is sufficient. If points have coordinates that are no dimensions, distances in these are measured in units of
    the range of all points.

    Args:
        ds: the map.
        requested: dimension or coordinate → value as typed, with a unit or without.
        prefix: precedes names in messages: "--" on the command line.

    Raises:
        SelectionError: for a name or a value that the map does not have.
    """
    sizes = dimensions(ds)
    if (text := requested.get(POINT_NAME.name)) and POINT_NAME.name in ds.coords and POINT.name not in requested:
        names = [str(name) for name in np.atleast_1d(ds[POINT_NAME.name].values)]
        number = names.index(match_name(text, names, f"{prefix}{POINT_NAME.name}", SelectionError)) + 1
        requested = {**requested, POINT.name: str(number)}
        del requested[POINT_NAME.name]
    identifiers = [name for name in requested if name in id_coordinates(ds)]
    point_coordinates = {n: requested[n] for n in identifiers if not {*ds[n].dims} <= {*requested}}
    requested = {name: text for name, text in requested.items() if name not in point_coordinates}
    for name in (name for name in requested if name not in sizes):
        problem, allowed = "is no dimension of this map", ", ".join(f"{prefix}{dim}" for dim in sizes)
        if name in ds.coords:
            reason = "which is chosen already" if name in id_coordinates(ds) else "not a dimension"
            problem = f"is a coordinate along {' and '.join(map(str, ds[name].dims or ('no dimension',)))}, {reason}"
        raise SelectionError(f"{prefix}{cut_text(name)}: {problem}{hint(name, sizes)}; allowed: {allowed}")
    dims = [dim for dim, size in sizes.items() if size == 1 or dim in requested]
    places = {dim: _nearest_place(ds, dim, requested.get(dim), prefix) for dim in dims}
    places |= _nearest_by(ds, point_coordinates, places, prefix) if point_coordinates else {}
    return {dim: places[dim] for dim in sizes if dim in places}


def _nearest_by(
    ds: "xr.Dataset", texts: Mapping[str, str], places: Mapping[str, Place], prefix: str
) -> dict[str, Place]:
    """Return the places nearest to values of coordinates that are no dimensions, given the places already chosen."""
    units = {name: str(ds[name].attrs.get("units", "")) for name in (*texts, *ds.dims)}
    requested = {name: _parse_number(prefix + name, text, ds[name].values, units[name]) for name, text in texts.items()}
    words = ", ".join(str(Place(name, 0, value, None, units[name])) for name, value in requested.items())
    result = {}
    for dim, index in nearest_by(ds, requested, {place.dim: place.index for place in places.values()}).items():
        value = ds[dim].values[index].item()
        result[dim] = Place(dim, index, value, value, units[dim], by=words)
    return result


def parse_assignment(text: str) -> tuple[str, str]:
    """Return (dimension, value) of a text such as "I3=0.0175"."""
    name, _, value = text.partition("=")
    if not name or not value:
        raise SelectionError(f"--at: {cut_text(repr(text))} names no place; allowed: DIMENSION=VALUE, as in I3=0.0175")
    return name.strip(), value.strip()


def _nearest_place(ds: "xr.Dataset", dim: str, text: str | None, prefix: str) -> Place:
    """Return the grid value of a dimension nearest to a text's number, or with its name; the first for None."""
    values, units = ds[dim].values, str(ds[dim].attrs.get("units", ""))
    if text is None:
        return Place(dim, 0, values[0].item() if values.dtype.kind != "O" else str(values[0]), None, units)
    if values.dtype.kind in "OU":
        names = [str(value) for value in values]
        index = names.index(match_name(text, names, f"{prefix}{dim}", SelectionError))
        return Place(dim, index, names[index], names[index], "")
    requested = _parse_number(prefix + dim, text, values, units)
    index = int(np.abs(values.astype(float) - requested).argmin())
    outside = not values.min() <= requested <= values.max()
    return Place(dim, index, values[index].item(), requested, units, outside)


def _parse_number(where: str, text: str, values: np.ndarray, unit: str) -> float:
    """Return the number in a text in a dimension's unit; refuse text, and integers that the map does not have."""
    allowed = format_range(values)
    try:
        number = float(units.number(text, unit))
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise SelectionError(f"{where}: {cut_text(repr(text))} is no number; allowed: {allowed}")
    if values.dtype.kind in "iu" and number not in values:
        raise SelectionError(f"{where}: {text} is not in this map; allowed: {allowed}")
    return number


def format_range(values: np.ndarray) -> str:
    """Return the range of a coordinate's values in a few words."""
    values = np.ravel(values)
    if values.dtype.kind in "OU":
        return list_names([*map(str, values)])
    if values.size <= MAX_LISTED_VALUES:
        return ", ".join(format_value(value.item()) for value in values)
    low, high = format_value(values.min().item()), format_value(values.max().item())
    return f"{low} to {high} ({values.size:,} values)"


def select_places(ds: "xr.Dataset", places: Mapping[str, Place]) -> "xr.Dataset":
    """Return the slice of a map at some places; their dimensions become scalar coordinates."""
    return ds.isel({dim: place.index for dim, place in places.items()})


def select_point(
    ds: "xr.Dataset | str | Path", requested: Mapping[str, object], prefix: str = ""
) -> "tuple[xr.Dataset, dict[str, Place]]":
    """Return the point of a map nearest to requested values, loaded, and its place along each dimension.

    Dimensions that count results of one point, such as eigenvalues, stay whole without a requested value.

    Args:
        ds: a map, or its path.
        requested: dimension or coordinate → value.
        prefix: precedes names in messages: "--" on the command line.

    Raises:
        SelectionError: for a dimension without a value, and a name or a value that the map does not have.
    """
    from sweeps import systems
    from sweeps.maps import slices, storage
    from sweeps.maps.description import extra_dimensions

    with storage.open_map(ds) if isinstance(ds, str | Path) else nullcontext(ds) as whole_map:
        slices.check_is_map(whole_map)
        places = nearest_places(whole_map, {name: str(value) for name, value in requested.items()}, prefix)
        spectrum_dims = {*systems.of_map(whole_map).spectrum, *extra_dimensions(whole_map)}
        dims = [dim for dim in dimensions(whole_map) if dim not in {*places, *spectrum_dims}]
        check_places(whole_map, dims, prefix, f"{ds}: " if whole_map is not ds else "")
        return select_places(whole_map, places).load(), places


def check_places(ds: "xr.Dataset", dims: list[str], prefix: str, file_name: str = "") -> None:
    """Refuse dimensions without a value; `file_name` and `prefix` begin the message and the dimensions in it."""
    if dims:
        allowed = f"a value for each, {how_to_choose(ds, dims, prefix)}"
        problem = f"{len(dims)} dimension{'s have' if dims[1:] else ' has'} no value"
        raise SelectionError(f"{file_name}{problem} ({', '.join(dims)}); allowed: {allowed}")


def how_to_choose(ds: "xr.Dataset", dims: list[str], prefix: str = "") -> str:
    """Return the possible values of some dimensions, for example "I1=0.5 to 1.5 (24 values), …".

    Args:
        ds: the map.
        dims: the dimensions.
        prefix: precedes names; with "--", the text is that of the command line, "--I1 0.5 to 1.5 …".
    """
    sign = " " if prefix else "="
    alternatives = dict.fromkeys(dims, "")
    for name in id_coordinates(ds):
        first = next((dim for dim in ds[name].dims if dim in alternatives), None)
        alternatives |= (
            {first: f"{alternatives[first]}, or {prefix}{name}{sign}{format_range(ds[name].values)}"} if first else {}
        )
    return ", ".join(f"{prefix}{dim}{sign}{format_range(ds[dim].values)}{alternatives[dim]}" for dim in dims)
