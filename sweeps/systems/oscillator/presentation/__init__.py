"""Presentation of small oscillations."""

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

from sweeps.systems.oscillator.system import ANIMATED
from sweeps.systems.presentation import Page, Presentation
from sweeps.systems.presentation.look import Look, Symbol

if TYPE_CHECKING:
    import numpy as np
    import xarray as xr

LOOK = Look(symbols={"epsilon": Symbol(r"$\varepsilon$", "ε"), "phase": Symbol(r"$\varphi$", "φ")})


class OscillatorPresentation(Presentation):
    """Figures, animations and page of small oscillations."""

    look = LOOK
    least = ("epsilon",)
    drawn = (
        ("oscillations", "figure_oscillations.draw"),
        ("theory_against_measured", "figure_oscillations.draw_agreement"),
    )

    def page(self, ds: "xr.Dataset") -> Page:
        """Return the motion of one mode, and the equilibria."""
        from sweeps.systems.oscillator.presentation.page import page

        return page(ds, None if self.system.name.endswith(".py") else self.system.description)

    def animations(self, ds: "xr.Dataset") -> "dict[str, Callable[[], Iterator[np.ndarray]]]":
        """Return animations of the bead on a hoop and of pendulums near a stable and an unstable equilibrium."""
        if self.system.name not in ANIMATED:
            return {}
        return {"motion": self.drawing("figure_motion.frames", ds, self.system.name, self.system.mechanism)}


PRESENTATION = OscillatorPresentation
