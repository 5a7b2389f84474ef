"""Presentation of pumped bodies."""

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING

from sweeps.systems.presentation import Presentation
from sweeps.systems.pumped_body.presentation.look import LOOK

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure


class PumpedBodyPresentation(Presentation):
    """Figures of the regimes."""

    look = LOOK

    def figures(self, ds: "xr.Dataset") -> "dict[str, Callable[..., Figure | None]]":
        """Return the regimes over two parameters, for each axis, with the exact boundary."""
        from sweeps.systems.pumped_body.presentation import figure_tongues

        return {f"tongues_axis_{axis}": partial(figure_tongues.draw, ds, axis) for axis in ds["axis"].values.tolist()}


PRESENTATION = PumpedBodyPresentation
