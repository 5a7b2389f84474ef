"""Places in a map: the grid's values nearest to what a person asked for, in words."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from sweeps.boxes import dimensions, own_of_points
from sweeps.schema.refusals import RefusedError, hint, shortened

if TYPE_CHECKING:
    import xarray as xr

_LISTED = 8
POINT = "point"


class SelectionError(RefusedError):
    """What is wrong with a choice of coordinates; `str()` is the message for a person."""


@dataclass(frozen=True)
class Place:
    """A value of one dimension.

    Attributes:
        dim: the dimension.
        index: its number, from 0.
        value: the grid's value there.
        asked: what a person asked for; None where the dimension has that value alone.
        units: UDUNITS text.
        outside: whether what was asked lies beyond the grid's ends.
        by: of a point that was chosen by coordinates of its own, what was asked of these, in words; "" for others.
    """

    dim: str
    index: int
    value: float | int | str
    asked: float | str | None
    units: str
    outside: bool = False
    by: str = ""

    def __str__(self):
        if self.by:
            return f"{self.dim} = {in_words(self.value)} (nearest to {self.by})"
        unit = "" if self.units in ("1", "") else f" {self.units}"
        text = f"{self.dim} = {in_words(self.value)}{unit}"
        if self.asked is None or self.asked == self.value:
            return text
        return f"{text} (nearest to {in_words(self.asked)}{', which is outside the grid' if self.outside else ''})"


def in_words(value: float | int | str) -> str:
    """A coordinate's value as people write it."""
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def nearest(ds: "xr.Dataset", chosen: Mapping[str, str]) -> dict[str, Place]:
    """The place nearest to what was chosen along each dimension, and the only place of dimensions of length one.

    Args:
        ds: a map.
        chosen: dimension → value as typed. Numbers need not stand on the grid (nearest by difference; axes must);
            names of bodies may leave out what is not needed to tell them. Of points that are drawn or listed, the
            nearest by their own coordinates, each in units of the range that all points have.

    Returns:
        Dimension → place, in storage order; dimensions that are longer than one and not chosen are left out.

    Raises:
        SelectionError: for a name that is no dimension, and a value that is none of its kind.
    """
    sizes = dimensions(ds)
    own = {name: text for name, text in chosen.items() if name in own_of_points(ds) and POINT not in chosen}
    chosen = {name: text for name, text in chosen.items() if name not in own}
    for name in chosen:
        if name not in sizes:
            along = "point, which is chosen already" if POINT in sizes else "body, not a dimension"
            beside = f"is a coordinate along {along}"
            wrong = beside if name in ds.coords else "is no dimension of this map"
            allowed = ", ".join(f"--{dim}" for dim in sizes)
            raise SelectionError(f"--{shortened(name)}: {wrong}{hint(name, sizes)}; allowed: {allowed}")
    found = {dim: _place(ds, dim, chosen.get(dim)) for dim, size in sizes.items() if size == 1 or dim in chosen}
    return ({POINT: _nearest_point(ds, own)} if own else {}) | found


def _nearest_point(ds: "xr.Dataset", own: Mapping[str, str]) -> Place:
    """The point nearest to some of its coordinates."""
    away, said = np.zeros(ds.sizes[POINT]), []
    for name, text in own.items():
        values = ds[name].values
        asked = _number(name, text, values)
        away += np.square((values - asked) / (np.ptp(values) or 1.0))
        said.append(str(Place(name, 0, asked, None, str(ds[name].attrs.get("units", "")))))
    index = int(away.argmin())
    number = ds[POINT].values[index].item()
    return Place(POINT, index, number, number, "", by=", ".join(said))


def assigned(text: str) -> tuple[str, str]:
    """Dimension and value of "I3=0.0175".

    Raises:
        SelectionError: where there is no name, no sign of equality or no value.
    """
    name, _, value = text.partition("=")
    if not name or not value:
        raise SelectionError(f"--at: {shortened(repr(text))} names no place; allowed: DIMENSION=VALUE, as in I3=0.0175")
    return name.strip(), value.strip()


def _place(ds: "xr.Dataset", dim: str, text: str | None) -> Place:
    values = ds[dim].values
    units = str(ds[dim].attrs.get("units", ""))
    if text is None:
        return Place(dim, 0, values[0].item() if values.dtype.kind != "O" else str(values[0]), None, units)
    if values.dtype.kind in "OU":
        names = [str(value) for value in values]
        index = names.index(named(text, names, f"--{dim}"))
        return Place(dim, index, names[index], names[index], "")
    asked = _number(dim, text, values)
    index = int(np.abs(values.astype(float) - asked).argmin())
    outside = not values.min() <= asked <= values.max()
    return Place(dim, index, values[index].item(), asked, units, outside)


def _number(dim: str, text: str, values: np.ndarray) -> float:
    allowed = span(values)
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise SelectionError(f"--{dim}: {shortened(repr(text))} is no number; allowed: {allowed}")
    if values.dtype.kind in "iu" and number not in values:
        raise SelectionError(f"--{dim}: {text} is not in this map; allowed: {allowed}")
    return number


def span(values: np.ndarray) -> str:
    """What stands along a dimension, in a few words."""
    if values.size <= _LISTED or values.dtype.kind in "OU":
        return ", ".join(in_words(value if isinstance(value, str) else value.item()) for value in values)
    low, high = in_words(values.min().item()), in_words(values.max().item())
    return f"{low} to {high} ({values.size:,} values)"


def named(text: str, names: list[str], where: str) -> str:
    """The one name that a person means: the name itself, in any case, or a part that only one has.

    Raises:
        SelectionError: where there is none, with a near name, or more than one.
    """
    low = text.strip().lower()
    exact = [name for name in names if name.lower() == low]
    found = exact or [name for name in names if low and low in name.lower()]
    if len(found) == 1:
        return found[0]
    if found:
        raise SelectionError(f"{where}: {shortened(repr(text))} may be several; allowed: {', '.join(found)}")
    raise SelectionError(
        f"{where}: {shortened(repr(text))} is not among the names{_near(text, names)}; allowed: {', '.join(names)}"
    )


def _near(text: str, names: list[str]) -> str:
    """A near name, of whole names or of their words, for a name may be longer than what people call it."""
    words = {word.lower(): name for name in names for word in (name, *name.split())}
    question = hint(text.strip().lower(), words)
    return f" (did you mean {words[question[len(' (did you mean ') : -2]]}?)" if question else ""


def left(ds: "xr.Dataset", places: Mapping[str, Place]) -> list[str]:
    """Dimensions at which no place is chosen yet."""
    return [dim for dim in dimensions(ds) if dim not in places]


def at(ds: "xr.Dataset", places: Mapping[str, Place]) -> "xr.Dataset":
    """The part of a map at some places; their dimensions become scalar coordinates."""
    return ds.isel({dim: place.index for dim, place in places.items()})


def how_to_choose(ds: "xr.Dataset", dims: list[str]) -> str:
    """What may be chosen along some dimensions: "--I1 VALUE (0.5 to 1.5, 24 values), …"."""
    own = {POINT: "".join(f", or --{name} {span(ds[name].values)}" for name in own_of_points(ds))}
    return ", ".join(f"--{dim} {span(ds[dim].values)}{own.get(dim, '')}" for dim in dims)
