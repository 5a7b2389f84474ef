"""Presentation of uncertain bodies."""

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING

from sweeps.systems.presentation import Page, Presentation
from sweeps.systems.uncertain_bodies.presentation.look import LOOK

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure


class UncertainBodiesPresentation(Presentation):
    """Figure and table of probabilities and quantiles."""

    look = LOOK

    def page(self, ds: "xr.Dataset") -> Page:
        """Return bodies and axes in a table."""
        from sweeps.systems.uncertain_bodies.presentation.page import page

        return page(ds)

    def figures(self, ds: "xr.Dataset") -> "dict[str, Callable[..., Figure | None]]":
        """Return the probabilities and quantiles of the bodies."""
        from sweeps.systems.uncertain_bodies.presentation import figure_outlook

        return {"outlook": partial(figure_outlook.draw, ds)}


PRESENTATION = UncertainBodiesPresentation
