"""Points that are no grid: drawn, or listed in a table. They stand along the dimension `point`, in any number.

No list of all of them is ever made: whoever needs some asks for these.
"""

from collections.abc import Mapping
from functools import lru_cache, partial
from typing import TYPE_CHECKING, Protocol

import numpy as np

from sweeps.points.ondemand import OnDemand
from sweeps.schema.definition import Definition, ends_alone
from sweeps.schema.parameters import Range, spread
from sweeps.schema.refusals import UnreadableError, display

if TYPE_CHECKING:
    from sweeps.points.tables import Table

POINT = "point"
PART_POINTS = 2**17  # of which coordinates are read, and written, at once
BESIDE = ("sample", "bodies")  # other ways to say what points there are


class Scattered(Protocol):
    """Points along `point`."""

    names: tuple[str, ...]  #: the parameters that each has of its own
    num: int  #: how many points there are

    def rows(self, start: int, stop: int) -> Mapping[str, np.ndarray]:
        """Return name → values at the points start … stop − 1 (from 0), float64 of shape (stop − start,)."""


class Drawn:
    """Points drawn over the ranges of a definition's grid; see `Scattered`."""

    def __init__(self, definition: Definition):
        from sweeps.points.draws import Draw

        self._ranges, self.num = definition.drawn, definition.sample.num
        self._grid, self._pair = definition.grid, dict(definition.pair or {})
        self._draw = Draw(definition.sample, len(self._ranges))
        names = tuple(name for name in self._ranges if name not in self._pair)
        self.names = (*self._grid.derived.names, *names) if self._pair else names
        follows = {name for over in self._grid.derived.over.values() for name in over} if self._pair else set()
        self._others = follows - {*self._pair}

    def rows(self, start: int, stop: int) -> Mapping[str, np.ndarray]:
        """Return name → values at the points start … stop − 1 (from 0), float64 of shape (stop − start,)."""
        shares = self._draw.shares(start, stop)
        drawn = {}
        for k, (name, spaced) in enumerate(self._ranges.items()):
            is_one = name in self._pair
            drawn[name] = self._grid.derived.drawn(name, spaced, shares[:, k]) if is_one else spaced.drawn(shares[:, k])
        if self._pair:
            one = {name: _first(getattr(self._grid, name)) for name in self._others}
            values = one | {name: np.full(stop - start, _first(e)) for name, e in self._pair.items()} | drawn
            drawn = {name: self._grid.derived.given(name, values) for name in self._grid.derived.names} | drawn
            drawn = {name: drawn[name] for name in self.names}
        return drawn


def _first(entry: object) -> float:
    values = spread(entry)
    return values.start if isinstance(values, Range) else float(values[0])


def of(definition: Definition) -> Scattered | None:
    """Return the points of a definition along `point`, None where its points form a grid."""
    if definition.rows is not None:
        return definition.rows
    return Drawn(definition) if definition.sample is not None else None


def completed(values: Mapping, model: type[Definition], folder: str) -> "tuple[dict, Table | None]":
    """Return the plain values of a definition with ranges over the sampled or listed points, and its table.

    So whatever is asked of the values of a grid is asked of those of scattered points as well.
    """
    values, file = ends_alone(values), values.get("table")
    grid = values.get("grid", {})
    wanted = model.model_fields["grid"].annotation
    derived = getattr(wanted, "derived", None)
    if derived and isinstance(grid, dict) and isinstance(grid.get(derived.key), dict):
        values = {**values, "grid": derived.completed(values)}
    if not isinstance(file, str) or not isinstance(grid, dict):
        return values, None
    for other in (*BESIDE, *([derived.key] if derived else [])):
        if other in values or other in grid:
            raise UnreadableError(("table",), display(file), f"is given beside {other}", "one of these")
    from sweeps.points import tables  # loaded for a table that is there

    table = tables.read(file, folder, wanted, grid)
    ends = dict(zip(table.names, table.ends, strict=True))
    ranges = {n: low if low == high else {"start": low, "stop": high, "num": 2} for n, (low, high) in ends.items()}
    return {**values, "grid": grid | ranges}, table


def numbers(num: int) -> OnDemand:
    """Return the coordinate `point`: 1 … num."""
    return OnDemand((num,), "i8", lambda part: np.arange(part.start + 1, part.stop + 1))


def columns(source: Scattered) -> dict[str, OnDemand]:
    """Return each parameter at all points; a table's rows are read once for all parameters."""
    last = lru_cache(maxsize=1)(source.rows)

    def values(name: str, part: slice) -> np.ndarray:
        rows = last if part.stop - part.start <= PART_POINTS else source.rows
        return np.array(rows(part.start, part.stop)[name])  # apart from the other parameters

    return {name: OnDemand((source.num,), "f8", partial(values, name)) for name in source.names}
