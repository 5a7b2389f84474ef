"""The inertia triangle while the moments change: measured regimes in colours, under the exact boundary of stability."""

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from kernels.codes import REGIMES
from sweeps.figure import colors, style
from sweeps.systems.bodies.presentation import triangle
from sweeps.systems.periodic.presentation.figure_tongues import DEEPEST
from sweeps.systems.presentation.look import Look
from sweeps.systems.presentation.regimes import MISSING, Regimes
from sweeps.systems.rigid_body.presentation.figure_triangle import about, fixed_at

NAMES = ("regime", "growth_per_period", "status", "triangle_margin", "trace_theory")


def draw(ds: xr.Dataset, look: Look, ax: Axes | None = None) -> Figure:
    """Draw a panel for each axis of a map over a grid of shapes.

    Args:
        ds: a map of pumped bodies.
        look: of regimes and parameters.
        ax: where; left out, on a figure of its own.
    """
    at = fixed_at(ds)
    fixed = {name: ds[name].values[i] for name, i in at.items() if name not in ("epsilon", "phase", "multiplier")}
    words = ", ".join(style.fixed_at(ds, name, value, look.symbols) for name, value in fixed.items() if value)
    axes = ds["axis"].values.tolist()
    figure, places = style.panels(len(axes), (4.2, 4.2), ds.attrs.get("title", ""), words, ax)
    regimes = Regimes(REGIMES, look, DEEPEST)
    for place, axis in zip(places, axes, strict=True):
        regime, growth, status, margin, trace = (about(ds, name, axis) for name in NAMES)
        regimes.paint(place, *triangle.places(ds, style.edges), regime, growth, status)
        place.contour(*triangle.places(ds), np.abs(trace), [2.0], colors=colors.INK, linewidths=0.8)
        place.plot([], [], color=colors.INK, linewidth=0.8, label="boundary by linear theory")
        place.contourf(*triangle.places(ds), margin, [-1.0, 0.0], colors=[MISSING])
        triangle.frame(place, axis, True)
        place.set_title(f"spun about axis {axis}", loc="left", fontweight="bold", pad=18)
    more = [Patch(facecolor=MISSING, label="physically impossible for a part of the period")]
    regimes.explain(figure, places, "growth per period", more)
    return figure
