"""Presentation of small oscillations."""

from dataclasses import replace
from pathlib import Path

from sweeps.schema.datasets import Dataset
from sweeps.systems import rates
from sweeps.systems.oscillator.presentation.sentences import SENTENCES
from sweeps.systems.oscillator.system import ANIMATED
from sweeps.systems.presentation import Animations, Drawings, Page, Presentation, moving
from sweeps.systems.presentation.appearance import Appearance, Compared, Symbol

APPEARANCE = Appearance(symbols={"epsilon": Symbol(r"$\varepsilon$", "ε"), "phase": Symbol(r"$\varphi$", "φ")})

_PAGE = Path(__file__).parent / "page"
_FILES = (*moving.FILES, *(_PAGE / name for name in ("places.html", "places.js")), *rates.FILES, _PAGE / "part.js")


class OscillatorPresentation(Presentation):
    """Figures, animations and page of small oscillations."""

    appearance = APPEARANCE
    minimum_dims = ("epsilon",)
    plane_variable = ("omega_squared", ("equilibrium", "mode"))
    base_page = Page(_FILES, "Where are the equilibria, are they stable, and how accurate are the rates?")
    sentences = SENTENCES
    figure_paths = (("oscillations", "figure_oscillations.draw"),)
    compared = (Compared(("frequency",), "oscillates in theory"), Compared(("growth_rate",), "grows in theory"))

    def figures(self, ds: Dataset) -> Drawings:
        """Return the figures; of a double pendulum its modes, of central potentials rates over the orbital rate."""
        if self.system.name == "double_pendulum":
            return {"modes": self.drawing("figure_modes.draw", ds, self.system)} | self.agreement_figure(ds)
        has_exponents = self.system.name == "central_potential" and ds.sizes["exponent"] > 1
        orbits = {"oscillations": self.drawing("figure_orbits.draw", ds, self.system)} if has_exponents else {}
        return super().figures(ds) | orbits

    def page(self, ds: Dataset) -> Page:
        """Return the motion of one mode, and the equilibria."""
        return replace(self.base_page, facts=moving.page_facts(ds, self.system))

    def animations(self, ds: Dataset) -> Animations:
        """Return animations of the bead on a hoop and of pendulums near a stable and an unstable equilibrium."""
        if self.system.name not in ANIMATED:
            return {}
        return {"motion": self.drawing("figure_motion.frames", ds, self.system.mechanism)}


PRESENTATION = OscillatorPresentation
