"""What a file of a system's maps may hold: names, types and allowed values, before any definition is read."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, get_args

from sweeps.schema.variables import Variable


@dataclass(frozen=True)
class Layout:
    """The one description of a system's maps, which a file is held against.

    Attributes:
        coordinates: name → each coordinate that a map may have; those that may be dimensions in storage order.
        variables: name → each variable that a map may have.
        needed: names of the variables that a map has unless its own definition chose others.
        values: coordinate that every map has, but for the spare ones → the checked type of its values (see
            `sweeps.schema.values`).
        is_open: whether a map may have further coordinates and variables, all doubles: parameters whose names only
            the description of its system knows.
        along: dimension along which coordinates may lie that are no dimensions; "" for none.
        beside: names of the coordinates that a map with that dimension has besides.
        spare: names of the coordinates that only some maps have.
        over: coordinate → the dimensions, in storage order, along some of which it may lie where it is none.
    """

    coordinates: Mapping[str, Variable]
    variables: Mapping[str, Variable]
    needed: tuple[str, ...]
    values: Mapping[str, Any] = field(default_factory=dict)
    is_open: bool = False
    along: str = ""
    beside: tuple[str, ...] = ()
    spare: tuple[str, ...] = ()
    over: Mapping[str, tuple[str, ...]] = field(default_factory=dict)

    def wrong(self, name: str, value: float | str) -> str:
        """Return the allowed values of a coordinate as text, "" for a valid value."""
        try:
            for check in get_args(self.values.get(name))[1:]:
                check.func(value)
        except ValueError as refused:  # pydantic's own, which is loaded where something is refused
            return refused.context["allowed"]
        return ""
