"""Presentation of the tennis racket's twist."""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from sweeps.systems.bodies.presentation import on_triangle
from sweeps.systems.presentation import Presentation
from sweeps.systems.twist.presentation.look import LOOK

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure


class TwistPresentation(Presentation):
    """Figures and page of twists."""

    look = LOOK
    part = on_triangle("How far does a thrown body twist?", Path(__file__).parent / "page" / "part.js")

    def figures(self, ds: "xr.Dataset") -> "dict[str, Callable[..., Figure | None]]":
        """Return the map of twists, and the defect against the growth rate with the law."""
        from sweeps.systems.twist.presentation import figure_twist

        return {"twist": partial(figure_twist.draw_map, ds), "defect": partial(figure_twist.draw_defect, ds)}


PRESENTATION = TwistPresentation
