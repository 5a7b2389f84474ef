"""The rigid body's part of the page: the body turning, bodies in a table, and where linear theory ends."""

from pathlib import Path

from sweeps.reading.definitions import definition_of
from sweeps.schema.datasets import Dataset
from sweeps.systems import rates
from sweeps.systems.bodies import outline
from sweeps.systems.bodies.presentation import TRIANGLE, turning
from sweeps.systems.presentation import Page
from sweeps.systems.rigid_body import presets

_NAMES = ("first.html", "three.html", "bodies.css", "own.css", "bodies.js", "own.js", "part.js")
FILES = (*turning.FILES, *rates.FILES, TRIANGLE, *(Path(__file__).parent / name for name in _NAMES))
QUESTION = "Is a spin about each principal axis stable, with which rates, and how accurate are they?"
ON_PLANE = "On the triangle a drag changes the body. Space: play or pause. "
ON_PLANE += "Black lines: Ω² = 0 in linear theory. Hatched: physically impossible."
OWN_TITLE = "Spin a body of your own"  # title of the page that `polhode page` writes
ONE_SIZE = {"I3": 0.01748, "omega0": 10.0}  # kg m2 and rad/s, of the triangle of shapes in it: a thrown racket's
IN_TABLE = "★ marks the usual spin axis of a body."


def page(ds: Dataset) -> Page:
    """Return the system's part of the page of a map."""
    table = "body" in ds.dims
    facts = turning.FACTS | {"nature": natural_axes(ds), "outlines": outline.read(ds.attrs), "presets": presets.PRESETS}
    return Page(FILES, QUESTION, IN_TABLE if table else ON_PLANE, table, facts)


def natural_axes(ds: Dataset) -> dict[str, int]:
    """Return body → usual spin axis, from the definition that a map carries."""
    bodies = definition_of(ds.attrs).get("bodies")
    axes = {}
    for body in bodies if isinstance(bodies, tuple) else ():
        if isinstance(body, dict) and body.get("axis") in (1, 2, 3):
            axes[str(body.get("name"))] = int(body["axis"])
    return axes
