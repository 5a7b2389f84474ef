"""Section of a page that shows the motion of a described system, by its full equations and by linear theory.

The system's own script defines, in `part.rate`, the motion of the selected mode.
"""

from pathlib import Path
from typing import TYPE_CHECKING

from sweeps.schema.datasets import Dataset
from sweeps.systems.presentation import DRAWING
from sweeps.systems.presentation.moving.equations import page_equations

if TYPE_CHECKING:
    from sweeps.systems.described import Described

_FOLDER = Path(__file__).parent
_NAMES = ("first.html", "mechanism.css", "integrated.js", "mode.js", "mechanism.js")
INTEGRATION = _FOLDER / "integrated.js"
FILES = (DRAWING, *(_FOLDER / name for name in _NAMES))


def page_facts(ds: Dataset, system: "Described", suffix: str = "equilibrium") -> dict:
    """Return the equations for the page's scripts; None in their place if the map lacks a variable that they need.

    The equations of a Python file that only a map names are unknown: it is not run.

    Args:
        ds: the map.
        system: its system.
        suffix: ending of the names of the variables that contain the initial place of a motion.
    """
    if system.is_unread:
        return {"equations": None}
    description = system.description
    states = description.kept or tuple(description.states.values())
    needs = {*description.parameters, *(f"{c.name}_{suffix}" for c in states)}
    return {"equations": page_equations(description) if needs <= set(ds.variables) else None}
