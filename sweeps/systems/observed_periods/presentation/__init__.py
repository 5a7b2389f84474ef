"""Presentation of observed periods."""

from sweeps.figure import colors
from sweeps.schema.datasets import Dataset
from sweeps.systems.bodies.presentation import MODES, SYMBOLS
from sweeps.systems.observed_periods.system import VARIABLES
from sweeps.systems.presentation import Page, Presentation
from sweeps.systems.presentation.appearance import Appearance, Mark, Symbol


def sentence(dataset: Dataset) -> str:
    """Return the shares of the possible shapes with both periods in both modes, and in none."""
    none, both = (
        100 * (dataset["modes"] == VARIABLES["modes"].flags.index(name)).mean().item() for name in ("none", "both")
    )
    return f"Both modes are possible for {both:.0f} % of shapes, none for {none:.0f} %"


SENTENCES = {"observed_periods": sentence}


class ObservedPeriodsPresentation(Presentation):
    """The energies over the inertia triangle; a page without a motion."""

    appearance = Appearance(
        MODES
        | {"none": Mark("excluded in both modes", "x", colors.GREY), "both": Mark("either mode", "*", colors.UNSTABLE)},
        SYMBOLS
        | {
            "P_psi": Symbol(r"$P_\psi$", "P_ψ"),
            "P_phi": Symbol(r"$P_\phi$", "P_φ"),
            "sigma_psi": Symbol(r"$\sigma_\psi$", "σ_ψ"),
            "sigma_phi": Symbol(r"$\sigma_\phi$", "σ_φ"),
        },
    )
    base_page = Page((), "Which bodies have both periods, in which mode, and with which certainty?")
    sentences = SENTENCES
    figure_paths = (("energies", "figure_energies.draw"),)


PRESENTATION = ObservedPeriodsPresentation
