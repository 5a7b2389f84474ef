"""What a table of parameters says: kinds of numbers, the keys that hold them, and the coordinates of those names."""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from sweeps.schema import units
from sweeps.schema.refusals import DefinitionError, display
from sweeps.schema.variables import Variable


@dataclass(frozen=True)
class Quantity:
    """A kind of number, which one parameter or several hold."""

    noun: str  #: what one value is called: "moment"
    units: str  #: UDUNITS text, "1" for none
    bounds: str  #: what is allowed, in few words
    item: Any  #: the checked type of one value (see `sweeps.schema.values`)
    least: float | None = None  #: the least absolute value, where 0 lies between what is allowed; None elsewhere


@dataclass(frozen=True)
class Parameter:
    """One key of a grid."""

    name: str  #: the key, and the coordinate of that name
    quantity: Quantity  #: what its values are
    long_name: str  #: what the coordinate means, one line (CF)
    default: float | None = None  #: its value where the key is left out; None where nothing stands in for it
    description: str = ""  #: what a refusal says of it; left out, the long name with unit and bounds
    required: bool = False  #: whether a definition without it is refused at once; False where the system itself looks


def amount(where: str, value: Any, unit: str) -> float:
    """Return a number from a number, or from text with a unit; refuse others."""
    try:
        number = float(units.number(value, unit))
    except (TypeError, ValueError, OverflowError):
        number = math.nan
    if not math.isfinite(number):
        raise DefinitionError(f"{where}: {display(value)}; allowed: a finite number, in one of {units.allowed(unit)}")
    return number


def coordinates(parameters: Iterable[Parameter]) -> dict[str, Variable]:
    """Return name → coordinate of each parameter."""
    return {p.name: Variable(p.name, p.quantity.units, p.long_name) for p in parameters}
