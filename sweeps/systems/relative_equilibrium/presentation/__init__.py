"""Presentation of relative equilibria."""

from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from sweeps.systems.presentation import Page, Presentation
from sweeps.systems.relative_equilibrium.presentation.look import LOOK

if TYPE_CHECKING:
    import numpy as np
    import xarray as xr
    from matplotlib.figure import Figure


_PAGE = Path(__file__).parent / "page"


class RelativeEquilibriumPresentation(Presentation):
    """Figures and animation of relative equilibria; a page with the eigenvalues of the chosen point in the plane."""

    look = LOOK
    least = ("epsilon",)
    part = Page(
        tuple(_PAGE / name for name in ("first.html", "spectrum.js", "part.js")),
        "Which equilibria are stable, which flutter, and how accurate are the eigenvalues?",
    )

    def figures(self, ds: "xr.Dataset") -> "dict[str, Callable[..., Figure | None]]":
        """Return the map and the agreement with theory."""
        from sweeps.systems.relative_equilibrium.presentation import figure_spectra as figure

        return {"stability": partial(figure.draw, ds), "theory_against_measured": partial(figure.draw_agreement, ds)}

    def animations(self, ds: "xr.Dataset") -> "dict[str, Callable[[], Iterator[np.ndarray]]]":
        """Return the animation of the flat spin of a body with a viscous slug."""
        from sweeps.systems.relative_equilibrium.presentation import figure_flat_spin

        return {"flat_spin": partial(figure_flat_spin.frames, ds)} if self.system.name == "viscous_slug" else {}


PRESENTATION = RelativeEquilibriumPresentation
