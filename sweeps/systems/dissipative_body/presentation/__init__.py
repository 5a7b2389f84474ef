"""Presentation of bodies that lose energy."""

from pathlib import Path

from sweeps.figure import colors
from sweeps.systems.bodies.presentation import SYMBOLS, on_triangle
from sweeps.systems.presentation import Presentation
from sweeps.systems.presentation.appearance import Appearance, Compared, Mark, Symbol

SENSES = {
    "positive": Mark("positive sense", "+", colors.STABLE),
    "negative": Mark("negative sense", "-", colors.UNSTABLE),
}
ANGLES = {"from_angle": Symbol(r"$\theta_0$", "θ₀"), "to_angle": Symbol(r"$\theta_1$", "θ₁")}


class DissipativePresentation(Presentation):
    """The final sense over starts, and the times to a flat spin over the loss; a page with the motion until then."""

    appearance = Appearance(SENSES, SYMBOLS | ANGLES)
    base_page = on_triangle("When is a body that loses energy in a flat spin?", Path(__file__).parent / "page/part.js")
    compared = (Compared(("eigenvalue_real", "eigenvalue_imag"), "eigenvalues about the axes"),)
    figure_paths = (("sense", "figure_settling.draw_sense"), ("settling", "figure_settling.draw_times"))


PRESENTATION = DissipativePresentation
