"""Presentation of the tennis racket's twist."""

from pathlib import Path

import numpy as np

from sweeps.figure import colors
from sweeps.schema.datasets import Dataset
from sweeps.systems.bodies.presentation import SYMBOLS, on_triangle
from sweeps.systems.presentation import Presentation
from sweeps.systems.presentation.appearance import Appearance, Compared, Mark, Symbol


def sentence(dataset: Dataset) -> str:
    """Return the largest twist of the first body, a racket in the sweep `rackets`, and its throw."""
    throws = dataset.isel(body=0, theta=0, omega0=0).load()
    best = throws.isel(chi=int(np.nanargmax(np.abs(throws["twist"].values))))
    twist, angle = np.degrees([np.abs(best["twist"].item()), best["chi"].item()])
    name = str(best["body"].item()).partition(" (")[0]
    return f"{name}: at most {twist:.1f}° of the half twist, thrown {angle:.1f}° off its axis"


SENTENCES = {"twist": sentence}


class TwistPresentation(Presentation):
    """The map of twists, and over the angle of the throw; a page with the rotating body."""

    appearance = Appearance(
        {"reversed": Mark("reversed", "#", colors.UNSTABLE), "same_side": Mark("same side", "+", colors.STABLE)},
        SYMBOLS | {"chi": Symbol(r"$\chi$", "χ"), "theta": Symbol(r"$\theta$", "θ")},
    )
    base_page = on_triangle("How far does a thrown body twist?", Path(__file__).parent / "page/part.js")
    compared = (Compared(("twist",), "twist"), Compared(("time_of_turn",), "time of a revolution"))
    sentences = SENTENCES
    figure_paths = (("twist", "figure_twist.draw_map"), ("defect", "figure_twist.draw_defect"))


PRESENTATION = TwistPresentation
