"""The rigid body's part of the page: the body turning, bodies in a table, and where linear theory ends."""

from pathlib import Path
from typing import TYPE_CHECKING

from sweeps.reading.definitions import definition_of
from sweeps.systems import rates
from sweeps.systems.bodies import outline
from sweeps.systems.bodies.presentation import TRIANGLE
from sweeps.systems.presentation import Page, turning

if TYPE_CHECKING:
    import xarray as xr

_OWN = tuple(Path(__file__).parent / name for name in ("bodies.css", "bodies.js", "part.js"))
FILES = (*turning.FILES, *rates.FILES, *_OWN[:2], TRIANGLE, _OWN[2])
QUESTION = "Is a spin about each principal axis stable, with which rates, and how accurate are they?"
ON_PLANE = "Space: play or pause. Black lines: Ω² = 0 in linear theory. Hatched: physically impossible."
IN_TABLE = "★ marks the usual spin axis of a body."


def page(ds: "xr.Dataset") -> Page:
    """Return the system's part of the page of a map."""
    table = "body" in ds.dims
    facts = {"nature": natural_axes(ds), "outlines": outline.read(ds.attrs)}
    return Page(FILES, QUESTION, IN_TABLE if table else ON_PLANE, table, facts)


def natural_axes(ds: "xr.Dataset") -> dict[str, int]:
    """Return body → usual spin axis, from the definition that a map carries."""
    bodies = definition_of(ds.attrs).get("bodies")
    found = {}
    for body in bodies if isinstance(bodies, tuple) else ():
        if isinstance(body, dict) and body.get("axis") in (1, 2, 3):
            found[str(body.get("name"))] = int(body["axis"])
    return found
