"""Breakdown of linear theory over the size of the perturbation: the deviation of the measured trace."""

from itertools import product

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from kernels.flow.codes import REGIMES
from sweeps.figure import canvas, colors, marks, wording
from sweeps.schema.iteration import spaced_indices
from sweeps.systems.presentation.appearance import Appearance
from sweeps.systems.rigid_body.fits import deviation_floor, power_law

LEAST_SIZES = 6  # of the perturbation that a power law needs
MOST_SERIES = 12
SMALLEST = 1e-16


def draw(ds: xr.Dataset, appearance: Appearance, ax: Axes | None = None) -> Figure:
    """Draw |trace - theory| over max(1, |theory|) against epsilon for points of a map, with fitted exponents."""
    part = ds[["trace", "trace_theory", "trace_error", "regime_theory"]].sortby("epsilon")
    varied = [name for name in part["trace"].dims if name != "epsilon" and ds.sizes[name] > 1]
    part = part.isel({name: 0 for name in part["trace"].dims if name not in (*varied, "epsilon")}).load()
    places = list(product(*(range(ds.sizes[name]) for name in varied)))
    figure = canvas.make_figure(6.8, 4.6, "How far linear theory holds", ds.attrs.get("title", ""), ax=ax)
    axes, epsilon = figure.subplots(), part["epsilon"].values
    for number, k in enumerate(spaced_indices(len(places), MOST_SERIES)):
        one = part.isel(dict(zip(varied, places[k], strict=True)))
        size = np.maximum(1.0, np.abs(one["trace_theory"].values))
        deviation, error = np.abs(one["trace"] - one["trace_theory"]).values / size, one["trace_error"].values / size
        slope, _, _ = power_law(epsilon, deviation, deviation_floor(epsilon, deviation, SMALLEST * size))
        label = [f"{appearance.symbol(name)} = {wording.format_number(float(one[name]), 3)}" for name in varied]
        label += [appearance.words(REGIMES[1 + int(one["regime_theory"][0])])]
        label += [f"exponent {slope:.2f}"] if np.isfinite(slope) else []
        line = {"color": colors.SERIES_COLORS[number % len(colors.SERIES_COLORS)], "linewidth": 1.5}
        line["marker"], line["markevery"] = marks.SERIES_MARKERS[number % len(marks.SERIES_MARKERS)], 6
        drawn = np.where(deviation > SMALLEST, deviation, np.nan)
        axes.plot(epsilon, drawn, label=", ".join(label), gid="series", **line)
        axes.plot(epsilon, error, color=line["color"], linewidth=0.7, linestyle=":", gid="error")
    axes.plot([], [], color=colors.QUIET, linewidth=0.7, linestyle=":", label="reported error")
    axes.set(xscale="log", yscale="log", xlabel=r"perturbation $\varepsilon$", ylabel="relative deviation of the trace")
    canvas.draw_legend(figure, axes.get_legend_handles_labels()[0])
    return figure
