"""Presentation of observed periods."""

from sweeps.figure import colors
from sweeps.systems.bodies.presentation import MODES, SYMBOLS
from sweeps.systems.presentation import Page, Presentation
from sweeps.systems.presentation.appearance import Appearance, Mark, Symbol


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
    figure_paths = (("energies", "figure_energies.draw"),)


PRESENTATION = ObservedPeriodsPresentation
