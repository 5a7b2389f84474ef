"""What a table of parameters says: kinds of numbers, the keys that hold them, and the coordinates of those names."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from sweeps.schema.variables import Variable


@dataclass(frozen=True)
class Quantity:
    """A kind of number, which one parameter or several hold.

    Attributes:
        noun: what one value is called: "moment".
        units: UDUNITS text, "1" for none.
        bounds: what is allowed, in few words.
        item: the checked type of one value (see `sweeps.schema.values`).
        least: the least absolute value, where 0 lies between what is allowed; None elsewhere.
    """

    noun: str
    units: str
    bounds: str
    item: Any
    least: float | None = None


@dataclass(frozen=True)
class Parameter:
    """One key of a grid.

    Attributes:
        name: the key, and the coordinate of that name.
        quantity: what its values are.
        long_name: what the coordinate means, one line (CF).
        default: its value where the key is left out; None where nothing stands in for it.
        description: what a refusal says of it; left out, the long name with unit and bounds.
        required: whether a definition without it is refused at once; False where the system itself looks.
    """

    name: str
    quantity: Quantity
    long_name: str
    default: float | None = None
    description: str = ""
    required: bool = False


def coordinates(parameters: Iterable[Parameter]) -> dict[str, Variable]:
    """Return name → coordinate of each parameter."""
    return {p.name: Variable(p.name, p.quantity.units, p.long_name) for p in parameters}
