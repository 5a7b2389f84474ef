"""What a file of a system's maps may hold: names, types and allowed values, before any definition is read."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from typing import Any, get_args

import numpy as np

from sweeps.schema.variables import Variable


@dataclass(frozen=True)
class Layout:
    """The one description of a system's maps, which a file is held against."""

    #: name → each coordinate that a map may have; those that may be dimensions in storage order.
    coordinates: Mapping[str, Variable]
    variables: Mapping[str, Variable]  #: name → each variable that a map may have
    needed: tuple[str, ...]  #: names of the variables that a map has unless its own definition chose others
    #: coordinate that every map has, but for the spare ones → the checked type of its values (see
    #: `sweeps.schema.values`).
    values: Mapping[str, Any] = field(default_factory=dict)
    #: whether a map may have further coordinates and variables, all doubles: parameters whose names only the
    #: description of its system knows.
    is_open: bool = False
    along: str = ""  #: dimension along which coordinates may lie that are no dimensions; "" for none
    beside: tuple[str, ...] = ()  #: names of the coordinates that a map with that dimension has besides
    spare: tuple[str, ...] = ()  #: names of the coordinates that only some maps have
    #: coordinate → the dimensions, in storage order, along some of which it may lie where it is none.
    over: Mapping[str, tuple[str, ...]] = field(default_factory=dict)

    def required(self, held: Collection[str]) -> set[str]:
        """Return the names of the coordinates that a map must have, from those that it has."""
        beside = self.beside if self.along in held else ()
        return {*self.values, *beside} & {*self.coordinates} - {*self.spare}


def wrong(item: Any, value: float | str) -> str:
    """Return the allowed values of a checked type (see `sweeps.schema.values`) as text, "" for a valid value."""
    try:
        for check in get_args(item)[1:]:
            check.func(value)
    except ValueError as refused:  # pydantic's own, which is loaded where something is refused
        return refused.context["allowed"]
    return ""


def extremes(values: np.ndarray) -> list[float | int]:
    """Return the ends of values, and those nearest to zero on both sides: what holds of these holds of all."""
    ends = [values.min().item(), values.max().item()] if values.size else []
    if not ends or ends[0] > 0 or ends[1] < 0:
        return ends
    parts = values[values > 0], values[values < 0], values[values == 0]
    return ends + [end.item() for part in parts if part.size for end in (part.min(), part.max())]
