"""Presentation of systems that are periodic in time."""

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING

from sweeps.systems.periodic.presentation.look import LOOK
from sweeps.systems.presentation import Page, Presentation

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure


class PeriodicPresentation(Presentation):
    """Figures of the regimes."""

    look = LOOK
    least = ("epsilon",)
    part = Page(question="Which periodic motions are stable, and how fast does a perturbation grow?")

    def figures(self, ds: "xr.Dataset") -> "dict[str, Callable[..., Figure | None]]":
        """Return the regimes over two parameters, for each base motion, with the exact boundary."""
        from sweeps.systems.periodic.presentation import figure_tongues

        curves = {"mathieu": figure_tongues.chart, "kapitza_pendulum": figure_tongues.averaged}.get(self.system.name)
        return {
            f"tongues_{name}": partial(
                figure_tongues.draw,
                ds,
                {"equilibrium": name},
                f"perturbed motion: {name}",
                LOOK,
                curves,
            )
            for name in ds["equilibrium"].values.tolist()
        }


PRESENTATION = PeriodicPresentation
