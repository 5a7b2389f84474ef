"""Presentation of symmetric tops."""

from pathlib import Path

from sweeps.figure import colors
from sweeps.systems.bodies.presentation import turning
from sweeps.systems.presentation import Page, Presentation
from sweeps.systems.presentation.appearance import Appearance, Compared, Mark, Symbol

APPEARANCE = Appearance(
    {
        "with_spin": Mark("with spin", "+", colors.STABLE),
        "against_spin": Mark("against spin", "-", colors.UNSTABLE),
        "none": Mark("none", "0", colors.GREY),
        "sphere": Mark("sphere", "o", colors.LIGHT_GREY),
    },
    {"omega3": Symbol(r"$\omega_3$", "ω₃")},
)


class SymmetricTopPresentation(Presentation):
    """The precession over I3/I1 and the cones; a page with the rotating top."""

    appearance = APPEARANCE
    files = (*turning.FILES, Path(__file__).parent / "page/part.js")
    base_page = Page(files, keys="Space: play or pause.", facts=turning.FACTS)
    compared = (
        Compared(("precession_rate",), "precession of ω", "omega3"),
        Compared(("momentum_precession_rate",), "precession of L", "omega3"),
    )
    figure_paths = (("precession", "figure_tops.draw_precession"), ("cones", "figure_tops.draw_cones"))


PRESENTATION = SymmetricTopPresentation
