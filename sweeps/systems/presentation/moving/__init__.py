"""The part of a page that shows a described system moving, by its full equations, beside linear theory.

For the pages of systems that descriptions make. Their own script says, in `part.rate`, how the chosen mode moves.
"""

from pathlib import Path
from typing import TYPE_CHECKING

from sweeps.schema.datasets import Dataset
from sweeps.systems.presentation import DRAWING
from sweeps.systems.presentation.moving.equations import facts

if TYPE_CHECKING:
    from sweeps.systems.described import Described

_HERE = Path(__file__).parent
_NAMES = ("first.html", "mechanism.css", "integrated.js", "mode.js", "mechanism.js")
FILES = (DRAWING, *(_HERE / name for name in _NAMES))


def facts_of(ds: Dataset, system: "Described", suffix: str = "equilibrium") -> dict:
    """Return what the scripts are told: the equations, where the map has all that stands in them.

    A file that only a map names is not run. Names of variables with `suffix` hold where a motion starts.
    """
    if system.name.endswith(".py"):
        return {"equations": None}
    description = system.description
    moving = description.kept or tuple(description.states.values())
    needed = {*description.parameters, *(f"{c.name}_{suffix}" for c in moving)}
    return {"equations": facts(description) if needed <= set(ds.variables) else None}
