"""Presentation of observed periods."""

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING

from sweeps.systems.observed_periods.presentation.look import LOOK
from sweeps.systems.presentation import Page, Presentation

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure


class ObservedPeriodsPresentation(Presentation):
    """Figure of the energies; a page without a motion."""

    look = LOOK
    part = Page((), "Which bodies have both periods, in which mode, and with which certainty?")

    def figures(self, ds: "xr.Dataset") -> "dict[str, Callable[..., Figure | None]]":
        """Return the energies over the inertia triangle."""
        from sweeps.systems.observed_periods.presentation import figure_energies

        return {"energies": partial(figure_energies.draw, ds)}


PRESENTATION = ObservedPeriodsPresentation
