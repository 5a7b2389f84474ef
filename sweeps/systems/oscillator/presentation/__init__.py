"""Presentation of small oscillations."""

from collections.abc import Callable, Iterator
from functools import partial
from typing import TYPE_CHECKING

from sweeps.systems.oscillator.presentation.look import LOOK
from sweeps.systems.oscillator.system import ANIMATED
from sweeps.systems.presentation import Page, Presentation

if TYPE_CHECKING:
    import numpy as np
    import xarray as xr
    from matplotlib.figure import Figure


class OscillatorPresentation(Presentation):
    """Figures, animations and page of small oscillations."""

    look = LOOK
    least = ("epsilon",)

    def page(self, ds: "xr.Dataset") -> Page:
        """Return the motion of one mode, and the equilibria."""
        from sweeps.systems.oscillator.presentation.page import page

        return page(ds, None if self.system.name.endswith(".py") else self.system.description)

    def figures(self, ds: "xr.Dataset") -> "dict[str, Callable[..., Figure | None]]":
        """Return the map and the agreement with theory."""
        from sweeps.systems.oscillator.presentation import figure_oscillations as figure

        return {"oscillations": partial(figure.draw, ds), "theory_against_measured": partial(figure.draw_agreement, ds)}

    def animations(self, ds: "xr.Dataset") -> "dict[str, Callable[[], Iterator[np.ndarray]]]":
        """Return animations of the bead on a hoop and of pendulums near a stable and an unstable equilibrium."""
        if self.system.name not in ANIMATED:
            return {}
        from sweeps.systems.oscillator.presentation import figure_motion

        return {"motion": partial(figure_motion.frames, ds, self.system.name, self.system.mechanism)}


PRESENTATION = OscillatorPresentation
