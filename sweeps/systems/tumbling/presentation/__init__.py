"""Presentation of tumbling bodies."""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from sweeps.systems.bodies.presentation import on_triangle
from sweeps.systems.presentation import Presentation
from sweeps.systems.tumbling.presentation.look import LOOK

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure


class TumblingPresentation(Presentation):
    """Figures and page of tumbling bodies."""

    look = LOOK
    part = on_triangle(
        "How does a body tumble, with which periods, and how accurate are they?",
        Path(__file__).parent / "page" / "part.js",
    )

    def figures(self, ds: "xr.Dataset") -> "dict[str, Callable[..., Figure | None]]":
        """Return the map of period ratios, and the herpolhode of one body."""
        from sweeps.systems.tumbling.presentation import figure_herpolhode, figure_periods

        return {"periods": partial(figure_periods.draw, ds), "herpolhode": partial(figure_herpolhode.draw, ds)}


PRESENTATION = TumblingPresentation
