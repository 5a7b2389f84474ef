"""Places in a map: the grid's values nearest to what a person asked for, in words."""

import math
from collections.abc import Mapping
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from sweeps.schema import units as in_units
from sweeps.schema.datasets import dimensions, id_coordinates, nearest_by
from sweeps.schema.refusals import MapError, cut_text, hint, list_names, match_name
from sweeps.schema.variables import POINT, POINT_NAME

if TYPE_CHECKING:
    import xarray as xr

_LISTED = 8  # numbers


class SelectionError(MapError):
    """What is wrong with a choice of coordinates; `str()` is the message for a person."""


@dataclass(frozen=True)
class Place:
    """A value of one dimension."""

    dim: str  #: the dimension
    index: int  #: its number, from 0
    value: float | int | str  #: the grid's value there
    requested: float | str | None  #: the value requested; None where the dimension has that value alone
    units: str  #: UDUNITS text
    outside: bool = False  #: whether the requested value lies beyond the grid's ends
    #: of a place that was chosen by coordinates that are no dimension, the values requested of these, in words; "" for
    #: others.
    by: str = ""

    def __str__(self):
        unit = "" if self.units in ("1", "") else f" {self.units}"
        text = f"{self.dim} = {in_words(self.value)}{unit}"
        if self.by:
            return f"{text} (nearest to {self.by})"
        if self.requested is None or self.requested == self.value:
            return text
        return f"{text} (nearest to {in_words(self.requested)}{', which is outside the grid' if self.outside else ''})"


def in_words(value: float | int | str) -> str:
    """Return the value of a coordinate as text."""
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def nearest(ds: "xr.Dataset", chosen: Mapping[str, str], prefix: str = "") -> dict[str, Place]:
    """Return dimension → place nearest to the chosen value, in storage order, and those of dimensions of length one.

    Values are as typed. Numbers need not stand on the grid (nearest by difference; axes must); names of bodies may
    leave out what is not needed to tell them. Where points have coordinates that are no dimensions, the nearest by
    these, each in units of the range that all points have. `prefix` precedes names in messages: "--" in a shell.
    """
    sizes = dimensions(ds)
    if (text := chosen.get(POINT_NAME.name)) and POINT_NAME.name in ds.coords and POINT.name not in chosen:
        names = [str(name) for name in np.atleast_1d(ds[POINT_NAME.name].values)]
        number = names.index(match_name(text, names, f"{prefix}{POINT_NAME.name}", SelectionError)) + 1
        chosen = {key: value for key, value in chosen.items() if key != POINT_NAME.name} | {POINT.name: str(number)}
    scattered = {n: text for n, text in chosen.items() if n in id_coordinates(ds) and not {*ds[n].dims} <= {*chosen}}
    chosen = {name: text for name, text in chosen.items() if name not in scattered}
    for name in (name for name in chosen if name not in sizes):
        wrong, allowed = "is no dimension of this map", ", ".join(f"{prefix}{dim}" for dim in sizes)
        if name in ds.coords:
            beside = "which is chosen already" if name in id_coordinates(ds) else "not a dimension"
            wrong = f"is a coordinate along {' and '.join(ds[name].dims or ('no dimension',))}, {beside}"
        raise SelectionError(f"{prefix}{cut_text(name)}: {wrong}{hint(name, sizes)}; allowed: {allowed}")
    places = {
        dim: _place(ds, dim, chosen.get(dim), prefix) for dim, size in sizes.items() if size == 1 or dim in chosen
    }
    places |= _nearest_by(ds, scattered, places, prefix) if scattered else {}
    return {dim: places[dim] for dim in sizes if dim in places}


def _nearest_by(
    ds: "xr.Dataset", texts: Mapping[str, str], places: Mapping[str, Place], prefix: str
) -> dict[str, Place]:
    """Return the places nearest to some coordinates that are no dimensions, where others are chosen already."""
    units = {name: str(ds[name].attrs.get("units", "")) for name in (*texts, *ds.dims)}
    requested = {name: _number(prefix + name, text, ds[name].values, units[name]) for name, text in texts.items()}
    said = ", ".join(str(Place(name, 0, value, None, units[name])) for name, value in requested.items())
    result = {}
    for dim, index in nearest_by(ds, requested, {place.dim: place.index for place in places.values()}).items():
        value = ds[dim].values[index].item()
        result[dim] = Place(dim, index, value, value, units[dim], by=said)
    return result


def assigned(text: str) -> tuple[str, str]:
    """Return dimension and value of "I3=0.0175"."""
    name, _, value = text.partition("=")
    if not name or not value:
        raise SelectionError(f"--at: {cut_text(repr(text))} names no place; allowed: DIMENSION=VALUE, as in I3=0.0175")
    return name.strip(), value.strip()


def _place(ds: "xr.Dataset", dim: str, text: str | None, prefix: str) -> Place:
    values, units = ds[dim].values, str(ds[dim].attrs.get("units", ""))
    if text is None:
        return Place(dim, 0, values[0].item() if values.dtype.kind != "O" else str(values[0]), None, units)
    if values.dtype.kind in "OU":
        names = [str(value) for value in values]
        index = names.index(match_name(text, names, f"{prefix}{dim}", SelectionError))
        return Place(dim, index, names[index], names[index], "")
    requested = _number(prefix + dim, text, values, units)
    index = int(np.abs(values.astype(float) - requested).argmin())
    outside = not values.min() <= requested <= values.max()
    return Place(dim, index, values[index].item(), requested, units, outside)


def _number(where: str, text: str, values: np.ndarray, unit: str) -> float:
    allowed = span(values)
    try:
        number = float(in_units.number(text, unit))
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise SelectionError(f"{where}: {cut_text(repr(text))} is no number; allowed: {allowed}")
    if values.dtype.kind in "iu" and number not in values:
        raise SelectionError(f"{where}: {text} is not in this map; allowed: {allowed}")
    return number


def span(values: np.ndarray) -> str:
    """Return the range of a coordinate's values in a few words."""
    values = np.ravel(values)
    if values.dtype.kind in "OU":
        return list_names([*map(str, values)])
    if values.size <= _LISTED:
        return ", ".join(in_words(value.item()) for value in values)
    low, high = in_words(values.min().item()), in_words(values.max().item())
    return f"{low} to {high} ({values.size:,} values)"


def left(ds: "xr.Dataset", places: Mapping[str, Place]) -> list[str]:
    """Return the dimensions without a chosen value."""
    return [dim for dim in dimensions(ds) if dim not in places]


def at(ds: "xr.Dataset", places: Mapping[str, Place]) -> "xr.Dataset":
    """Return the part of a map at chosen indices; their dimensions become scalar coordinates."""
    return ds.isel({dim: place.index for dim, place in places.items()})


def point(
    ds: "xr.Dataset | str | Path", chosen: Mapping[str, object], prefix: str = ""
) -> "tuple[xr.Dataset, dict[str, Place]]":
    """Return the point of a map nearest to the chosen values, loaded, and its place along each dimension.

    Dimensions of the system's own, such as the eigenvalues of one equilibrium, are kept whole where no value is chosen.
    """
    from sweeps import systems
    from sweeps.maps import slices, storage
    from sweeps.maps.description import further_dimensions

    with storage.open_map(ds) if isinstance(ds, str | Path) else nullcontext(ds) as opened:
        slices.check_is_map(opened)
        places = nearest(opened, {name: str(value) for name, value in chosen.items()}, prefix)
        whole = {*systems.of_map(opened).spectrum, *further_dimensions(opened)}
        if dims := [dim for dim in left(opened, places) if dim not in whole]:
            allowed = f"a value for each, {how_to_choose(opened, dims, prefix)}"
            where = f"{ds}: " if opened is not ds else ""
            counted = f"{len(dims)} dimension{'s have' if dims[1:] else ' has'} no value"
            raise SelectionError(f"{where}{counted} ({', '.join(dims)}); allowed: {allowed}")
        return at(opened, places).load(), places


def how_to_choose(ds: "xr.Dataset", dims: list[str], prefix: str = "") -> str:
    """Return the possible values of some dimensions: "I1=0.5 to 1.5 (24 values), …", in a shell "--I1 0.5 to …"."""
    sign = " " if prefix else "="
    alternatives = dict.fromkeys(dims, "")
    for name in id_coordinates(ds):
        first = next((dim for dim in ds[name].dims if dim in alternatives), None)
        alternatives |= (
            {first: f"{alternatives[first]}, or {prefix}{name}{sign}{span(ds[name].values)}"} if first else {}
        )
    return ", ".join(f"{prefix}{dim}{sign}{span(ds[dim].values)}{alternatives[dim]}" for dim in dims)
