"""Presentation of the tennis racket's twist."""

from pathlib import Path

from sweeps.figure import colors
from sweeps.systems.bodies.presentation import SYMBOLS, on_triangle
from sweeps.systems.presentation import Presentation
from sweeps.systems.presentation.appearance import Appearance, Compared, Mark, Symbol


class TwistPresentation(Presentation):
    """The map of twists, and the defect against the growth rate with the law; a page with the rotating body."""

    appearance = Appearance(
        {"reversed": Mark("reversed", "#", colors.UNSTABLE), "same_side": Mark("same side", "+", colors.STABLE)},
        SYMBOLS | {"chi": Symbol(r"$\chi$", "χ"), "theta": Symbol(r"$\theta$", "θ")},
    )
    base_page = on_triangle("How far does a thrown body twist?", Path(__file__).parent / "page/part.js")
    compared = (Compared(("twist",), "twist"), Compared(("time_of_turn",), "time of a revolution"))
    figure_paths = (("twist", "figure_twist.draw_map"), ("defect", "figure_twist.draw_defect"))


PRESENTATION = TwistPresentation
