"""The part of the page of bodies that are not known exactly: bodies and axes in a table."""

from pathlib import Path
from typing import TYPE_CHECKING

from sweeps.systems.rigid_body.page import FILES as OF_RIGID_BODIES
from sweeps.systems.rigid_body.page import natural_axes
from sweeps.systems.system import Page

if TYPE_CHECKING:
    import xarray as xr

TABLE = tuple(path for path in OF_RIGID_BODIES if path.stem == "bodies")
FILES = (*TABLE, Path(__file__).parent / "part.js")
QUESTION = "How likely is a spin unstable, as well as the body is known?"
KEYS = "Quantiles and sensitivities stand in the map beside this page. ★ marks the axis that the definition names."


def page(ds: "xr.Dataset") -> Page:
    """The part of the page of one map."""
    return Page(FILES, QUESTION, KEYS, True, {"nature": natural_axes(ds)})
