"""Figure of the breakdown of linear theory: the deviation of the measured trace over the size of the perturbation."""

from itertools import product
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from kernels.flow.codes import REGIMES
from sweeps.figure import canvas, colors, marks, wording
from sweeps.schema.iteration import spaced_indices
from sweeps.systems.presentation.appearance import Appearance
from sweeps.systems.rigid_body.fits import deviation_floor, power_law

MIN_SIZES = 6  # sizes of the perturbation that the fit of a power law needs
MAX_SERIES = 12  # points of the map that are drawn
MIN_DRAWN = 1e-16  # deviation that is drawn, the rounding unit


def draw(ds: xr.Dataset, appearance: Appearance, ax: Axes | None = None) -> Figure:
    """Draw |trace - theory| over max(1, |theory|) against epsilon for points of `ds`, with fitted exponents.

    `appearance` has the words and symbols, `ax` is the place of the figure within another one.
    """
    subset = ds[["trace", "trace_theory", "trace_error", "regime_theory"]].sortby("epsilon")
    free_dims = [name for name in map(str, subset["trace"].dims) if name != "epsilon" and ds.sizes[name] > 1]
    subset = subset.isel({name: 0 for name in subset["trace"].dims if name not in (*free_dims, "epsilon")}).load()
    combinations = list(product(*(range(ds.sizes[name]) for name in free_dims)))
    figure = canvas.make_figure(6.8, 4.6, "How far linear theory holds", ds.attrs.get("title", ""), ax=ax)
    axes, epsilon = figure.subplots(), subset["epsilon"].values
    for order, k in enumerate(spaced_indices(len(combinations), MAX_SERIES)):
        series = subset.isel(dict(zip(free_dims, combinations[k], strict=True)))
        size = np.maximum(1.0, np.abs(series["trace_theory"].values))
        deviation = abs(series["trace"] - series["trace_theory"]).values / size
        error = series["trace_error"].values / size
        slope, _, _ = power_law(epsilon, deviation, deviation_floor(epsilon, deviation, MIN_DRAWN * size))
        label = [f"{appearance.symbol(name)} = {wording.format_number(float(series[name]), 3)}" for name in free_dims]
        label += [appearance.words(REGIMES[1 + int(series["regime_theory"][0])])]
        label += [f"exponent {slope:.2f}"] if np.isfinite(slope) else []
        line: dict[str, Any] = {"color": colors.SERIES_COLORS[order % len(colors.SERIES_COLORS)], "linewidth": 1.5}
        line["marker"], line["markevery"] = marks.SERIES_MARKERS[order % len(marks.SERIES_MARKERS)], 6
        visible = np.where(deviation > MIN_DRAWN, deviation, np.nan)
        axes.plot(epsilon, visible, label=", ".join(label), gid="series", **line)
        axes.plot(epsilon, error, color=line["color"], linewidth=0.7, linestyle=":", gid="error")
    axes.plot([], [], color=colors.QUIET, linewidth=0.7, linestyle=":", label="reported error")
    axes.set(xscale="log", yscale="log", xlabel=r"perturbation $\varepsilon$", ylabel="relative deviation of the trace")
    canvas.draw_legend(figure, axes.get_legend_handles_labels()[0])
    return figure
