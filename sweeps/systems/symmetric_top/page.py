"""The symmetric top's part of the page: the top turning."""

from pathlib import Path

from sweeps.systems.system import Page

PAGE = Page((Path(__file__).parent / "scripts" / "part.js",), keys="Space plays it.")
