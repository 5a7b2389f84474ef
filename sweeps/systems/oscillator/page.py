"""The part of the page for small oscillations: the motion of one mode, and where linear theory ends."""

from pathlib import Path

from sweeps.systems.system import Page

OWN, SHARED = Path(__file__).parent / "scripts", Path(__file__).parents[1] / "scripts"
PAGE = Page((SHARED / "rates.js", OWN / "mode.js", OWN / "part.js"))
