"""The part of the page for relative equilibria: the eigenvalues of the chosen point in the plane."""

from pathlib import Path

from sweeps.systems.system import Page

_HERE = Path(__file__).parent
FILES = tuple(_HERE / name for name in ("first.html", "spectrum.js", "part.js"))
PAGE = Page(FILES, "Which equilibria are stable, which flutter, and how accurate are the eigenvalues?")
