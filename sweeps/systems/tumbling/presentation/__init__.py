"""Presentation of tumbling bodies."""

from pathlib import Path

from sweeps.figure import colors
from sweeps.systems.bodies.presentation import MODES, SYMBOLS, on_triangle
from sweeps.systems.presentation import Presentation
from sweeps.systems.presentation.appearance import Appearance, Compared, Mark, Symbol
from sweeps.systems.tumbling.presentation.sentences import SENTENCES


class TumblingPresentation(Presentation):
    """The map of period ratios, and the herpolhode of one body; a page with the rotating body."""

    appearance = Appearance(
        MODES
        | {
            "separatrix": Mark("separatrix", "#", colors.UNSTABLE),
            "principal": Mark("principal spin", "o", colors.LIGHT_GREY),
            "impossible": Mark("energy out of range", "x", colors.GREY),
        },
        SYMBOLS | {"energy": Symbol("$2TI_3/L^2$", "2T I₃/L²")},
    )
    base_page = on_triangle(
        "How does a body tumble, with which periods, and how accurate are they?", Path(__file__).parent / "page/part.js"
    )
    compared = (Compared(("period_psi",), "period in the body"), Compared(("period_phi_encircled",), "period about L"))
    sentences = SENTENCES
    figure_paths = (("periods", "figure_tumbling.draw_periods"), ("herpolhode", "figure_tumbling.draw_herpolhode"))


PRESENTATION = TumblingPresentation
