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
        from sweeps.systems.periodic.presentation import figure_tongues
        from sweeps.systems.pumped_body.presentation.curves import mathieu

        def about(axis: int):
            title = f"Spin about axis {axis} with moments that change periodically"
            curves = lambda one, x, y: mathieu(ds, one, axis, y) if x == "frequency" else None  # noqa: E731
            return partial(figure_tongues.draw, ds, {"axis": axis}, title, LOOK, curves)

        return {f"tongues_axis_{axis}": about(axis) for axis in ds["axis"].values.tolist()}


PRESENTATION = PumpedBodyPresentation
