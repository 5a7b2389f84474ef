"""Figures of uncertain bodies: probability and rate of instability; one body's draws on the inertia triangle."""

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from kernels.free import linear
from sweeps.figure import canvas, colors, marks, sheets
from sweeps.systems.bodies.variables import MOMENTS
from sweeps.systems.presentation.sentences import head_texts
from sweeps.systems.uncertain_bodies.measuring import UNSTABLE
from sweeps.systems.uncertain_bodies.system import MINOR_AXIS_REMARK

MAX_BODIES = 40  # rows that fit a page
OFFSETS = {1: -0.22, 2: 0.0, 3: 0.22}
MAX_SHOWN = 4000  # draws of a panel
STEPS = 220  # cells per side of the background


def draw(dataset: xr.Dataset, ax: Axes | None = None) -> Figure:
    """Draw the probability of instability and the range of the growth rate, per body and axis."""
    rows = dataset.isel({dim: 0 for dim in ("omega0", "epsilon", "phase") if dim in dataset.dims})
    rows, bodies = rows.isel(body=slice(MAX_BODIES)).load(), dataset.sizes["body"]
    count_text = f"; the first {MAX_BODIES} of {bodies:,} bodies" if bodies > MAX_BODIES else ""
    words = f"each draw measured; right: median and 5 to 95 % of the draws{count_text}"
    least_axis = np.argmin(np.stack([rows[name].values for name in MOMENTS]), axis=0) + 1
    if np.isin(least_axis, rows["axis"].values).any():
        words += f"\nspin {MINOR_AXIS_REMARK}"
    cell, texts = (
        (4.3, 0.5 + 0.34 * rows.sizes["body"]),
        head_texts(dataset, "Probability that each spin is unstable", words),
    )
    figure, (table_ax, rate_ax) = canvas.make_panels(2, cell, *texts, ax, margins=(1.0, 1.4), sharey=True)
    _draw_table(table_ax, rows)
    for axis in rows["axis"].values.tolist():
        _draw_rates(rate_ax, rows.sel(axis=axis), axis)
    rate_ax.set(xlabel=r"growth rate over the spin rate, $\sigma/\omega_0$", xlim=(-0.02, None))
    table_ax.set_yticks(range(rows.sizes["body"]), [str(name)[:30] for name in rows["body"].values])
    table_ax.set_ylim(rows.sizes["body"] - 0.5, -0.5)
    marks.draw_grid(rate_ax, "x")
    canvas.draw_legend(figure)
    return figure


def _draw_table(panel, rows: xr.Dataset) -> None:
    """Draw the probability of instability of all bodies about each axis as a coloured table, in percent."""
    probability = rows["probability_unstable"].transpose("body", "axis").values
    props = {"cmap": sheets.color_map("signed"), "vmin": -1.3, "vmax": 0.3, "gid": "likely", "edgecolors": colors.PAPER}
    columns = np.arange(rows.sizes["axis"])
    panel.pcolormesh(columns, np.arange(rows.sizes["body"]), -probability, shading="nearest", **props)
    style = {"ha": "center", "va": "center", "fontsize": 8.5, "path_effects": marks.halo(2.0)}
    for (row, column), value in np.ndenumerate(100.0 * probability):
        panel.text(column, row, f"{value:.3g} %" if np.isfinite(value) else "?", **style)
    panel.set_xticks(columns, [f"axis {axis}" for axis in rows["axis"].values])
    panel.set(xlabel="probability that the spin is unstable")


def _draw_rates(rate_ax, bodies: xr.Dataset, axis: int) -> None:
    """Draw median growth rates, with 90 % ranges, of all bodies about one axis."""
    y = np.arange(bodies.sizes["body"]) + OFFSETS[axis]
    color = colors.SERIES_COLORS[axis - 1]
    quantiles = bodies["growth_rate_quantile"] / np.abs(bodies["omega0"])
    low, middle, high = (quantiles.sel(quantile=level).values for level in (0.05, 0.5, 0.95))
    rate_ax.hlines(y, low, high, color=color, lw=2)
    rate_ax.plot(middle, y, "o", ms=4, color=color, label=f"about axis {axis}")


def draw_cloud(name: str, subtitle: str, axes: dict[int, tuple[dict, dict]]) -> Figure:
    """Draw possible bodies over I1/I3 and I2/I3 with linear growth rates and the draws, one panel per axis.

    Args:
        name: name of the body.
        subtitle: line below the title.
        axes: axis → (summary, draws), as `sweeps.systems.uncertain_bodies.measuring.measure_spins` returns them.
    """
    figure = canvas.make_figure(1.0 + 3.6 * len(axes), 4.6, f"{name} with inertia uncertainty", subtitle)
    panels = np.atleast_1d(figure.subplots(1, len(axes), sharex=True, sharey=True))
    for ax, (axis, (summary, draws)) in zip(panels, axes.items(), strict=True):
        x, y = draws["I1"] / draws["I3"], draws["I2"] / draws["I3"]
        limit = max(1.15, 1.05 * float(np.quantile(x, 0.999)), 1.05 * float(np.quantile(y, 0.999)))
        mesh = _draw_background(ax, axis, limit)
        indices = np.linspace(0, x.size - 1, min(x.size, MAX_SHOWN)).astype(int)
        tints = np.where((draws["regime"] == UNSTABLE)[indices], colors.UNSTABLE, colors.STABLE)
        ax.scatter(x[indices], y[indices], s=2.5, c=tints, linewidths=0, alpha=0.5, gid="cloud", rasterized=True)
        p, error = summary["probability_unstable"], summary["probability_unstable_error"]
        ax.set_title(f"spun about axis {axis}: unstable {100 * p:.2f} ± {100 * error:.2f} %")
        ax.set(xlabel="$I_1/I_3$", xlim=(0, limit), ylim=(0, limit), aspect="equal")
    panels[0].set_ylabel("$I_2/I_3$")
    figure.colorbar(mesh, ax=list(panels), label=r"growth rate, linear theory, $\sigma/\omega_0$", shrink=0.8)
    entries = {"unstable": colors.UNSTABLE, "not unstable": colors.STABLE}
    handles = [marks.hatched_patch(), *(Patch(facecolor=c, label=f"sampled, {word}") for word, c in entries.items())]
    canvas.draw_legend(figure, handles)
    return figure


def _draw_background(ax, axis: int, limit: float):
    """Draw theory's growth rate over I1/I3 and I2/I3, with impossible bodies hatched; return the coloured cells."""
    values = (np.arange(STEPS) + 0.5) * limit / STEPS
    x, y = np.meshgrid(values, values)
    rate2 = linear.omega_squared(x, y, np.ones_like(x), 1.0, axis)
    possible = (x + y >= 1) & (np.abs(x - y) <= 1)
    rate = np.where(possible, np.sqrt(np.maximum(-rate2, 0.0)), np.nan)
    mesh = ax.pcolormesh(values, values, rate, cmap=sheets.color_map("backdrop"), vmin=0, vmax=1.2, rasterized=True)
    impossible = ax.contourf(x, y, np.where(possible, 1.0, -1.0), [-2, 0], colors="none", hatches=["////"])
    impossible.set(edgecolor=colors.QUIET, lw=0.0)
    for line in ([1, 1], [0, limit]), ([0, limit], [1, 1]), ([0, limit], [0, limit]):
        ax.plot(*line, color=colors.QUIET, lw=0.6)
    return mesh
