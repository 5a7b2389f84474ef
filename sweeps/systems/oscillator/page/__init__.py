"""The part of the page for small oscillations: the motion of one mode, and where linear theory ends."""

from pathlib import Path

from sweeps.systems import rates
from sweeps.systems.system import Page

_HERE = Path(__file__).parent
PAGE = Page((_HERE / "mode.html", _HERE / "mode.js", *rates.FILES, _HERE / "part.js"))
