"""The symmetric top's part of the page: the top turning."""

from pathlib import Path

from sweeps.systems import turning
from sweeps.systems.system import Page

PAGE = Page((*turning.FILES, Path(__file__).parent / "part.js"), keys="Space: play or pause.")
