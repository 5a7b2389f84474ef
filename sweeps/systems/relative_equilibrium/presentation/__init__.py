"""Presentation of relative equilibria."""

from dataclasses import replace
from pathlib import Path

from sweeps.figure import colors
from sweeps.schema.datasets import Dataset
from sweeps.systems.presentation import Animations, Drawings, Page, Presentation, moving
from sweeps.systems.presentation.appearance import Appearance, Compared, Mark, Symbol
from sweeps.systems.relative_equilibrium.presentation.sentences import SENTENCES

_PAGE = Path(__file__).parent / "page"
APPEARANCE = Appearance(
    marks={
        "asymptotically_stable": Mark("stable, decays", "-", colors.SERIES_COLORS[2]),
        "flutter": Mark("flutter", "~", colors.SERIES_COLORS[3]),
        "no_equilibrium": Mark("no equilibrium", " ", ""),
        "equilibrium_undecided": Mark("equilibrium undecided", "?", ""),
        "not_excited": Mark("a mode not excited", "m", ""),
        "no_time_scale": Mark("no time scale", "0", ""),
    },
    symbols={"epsilon": Symbol(r"$\varepsilon$", "ε")},
)


class RelativeEquilibriumPresentation(Presentation):
    """Figures and animation of relative equilibria; a page with the eigenvalues of the chosen point in the plane."""

    appearance = APPEARANCE
    minimum_dims = ("epsilon",)
    plane_variable = ("growth_rate", ("equilibrium", "eigenvalue"))
    base_page = Page(
        (*moving.FILES, *(_PAGE / name for name in ("spectrum.html", "spectrum.js", "part.js"))),
        "Which equilibria are stable, which flutter, and how accurate are the eigenvalues?",
    )
    figure_paths = (("stability", "figure_spectra.draw"),)
    sentences = SENTENCES
    compared = (Compared(("eigenvalue_real", "eigenvalue_imag"), "eigenvalues", "rate_scale"),)

    def page(self, ds: Dataset) -> Page:
        """Return the motion about the equilibrium, and its eigenvalues."""
        return replace(self.base_page, facts=moving.page_facts(ds, self.system))

    def figures(self, ds: Dataset) -> Drawings:
        """Return the regimes and the agreement; of Foucault's pendulum first the turn of its plane."""
        is_foucault = self.system.name == "foucault"
        return ({"turn": self.drawing("figure_foucault.draw", ds)} if is_foucault else {}) | super().figures(ds)

    def animations(self, ds: Dataset) -> Animations:
        """Return the animation of the flat spin of a body with a viscous slug."""
        slug = self.system.name == "viscous_slug"
        return {"flat_spin": self.drawing("figure_flat_spin.frames", ds)} if slug else {}


PRESENTATION = RelativeEquilibriumPresentation
