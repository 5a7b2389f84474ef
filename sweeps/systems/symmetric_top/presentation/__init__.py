"""Presentation of symmetric tops."""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from sweeps.systems.presentation import Page, Presentation, turning
from sweeps.systems.symmetric_top.presentation.look import LOOK

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure


class SymmetricTopPresentation(Presentation):
    """Figures of the precession and of the cones; a page with the top turning."""

    look = LOOK
    part = Page((*turning.FILES, Path(__file__).parent / "page" / "part.js"), keys="Space: play or pause.")

    def figures(self, ds: "xr.Dataset") -> "dict[str, Callable[..., Figure | None]]":
        """Return the precession over I3/I1, its deviation over the half-angle, and the cones."""
        from sweeps.systems.symmetric_top.presentation import figure_cones, figure_precession

        return {"precession": partial(figure_precession.draw, ds), "cones": partial(figure_cones.draw, ds)}


PRESENTATION = SymmetricTopPresentation
