"""The part of the page of bodies that are not known exactly: a table, the draws as a cloud, how they spread."""

from pathlib import Path
from typing import TYPE_CHECKING

from sweeps.systems.presentation import Page
from sweeps.systems.rigid_body.presentation.page import FILES as OF_RIGID_BODIES
from sweeps.systems.rigid_body.presentation.page import natural_axes
from sweeps.systems.uncertain_bodies.presentation.page.drawn import facts

if TYPE_CHECKING:
    import xarray as xr

SHARED = tuple(path for path in OF_RIGID_BODIES if path.stem in ("bodies", "triangle"))
_OWN = ("first.html", "spread.html", "drawn.css", "drawn.js", "spread.js", "part.js")
FILES = (*SHARED, *(Path(__file__).parent / name for name in _OWN))
QUESTION = "With which probability is each spin unstable?"
KEYS = "★ marks the usual spin axis."


def page(ds: "xr.Dataset") -> Page:
    """Return the system's part of the page of a map."""
    return Page(FILES, QUESTION, KEYS, True, {"nature": natural_axes(ds), **facts(ds)})
