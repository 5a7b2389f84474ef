"""Bodies in rows, how likely and how fast each spin is unstable; one body's draws on the triangle of inertia."""

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from kernels.free import linear
from sweeps.figure import canvas, colors, marks, sheets
from sweeps.systems.bodies.variables import MOMENTS
from sweeps.systems.uncertain_bodies.measuring import UNSTABLE
from sweeps.systems.uncertain_bodies.system import LEAST_INERTIA

MOST_BODIES = 40
OFFSETS = {1: -0.22, 2: 0.0, 3: 0.22}
MOST_SHOWN = 4000  # draws of a panel
STEPS = 220


def draw(ds: xr.Dataset, ax: Axes | None = None) -> Figure:
    """Draw the probability of instability and the range of the growth rate, per body and axis."""
    part = ds.isel({dim: 0 for dim in ("omega0", "epsilon", "phase") if dim in ds.dims})
    part, bodies = part.isel(body=slice(MOST_BODIES)).load(), ds.sizes["body"]
    more = f"; the first {MOST_BODIES} of {bodies:,} bodies" if bodies > MOST_BODIES else ""
    bars = "bars: standard errors (left), 5 to 95 % of the draws about their median (right)"
    subtitle = f"{ds.attrs.get('title', '')}\neach draw measured; {bars}{more}"
    least = np.argmin(np.stack([part[name].values for name in MOMENTS]), axis=0) + 1
    if np.isin(least, part["axis"].values).any():
        subtitle += f"\nspin {LEAST_INERTIA}"
    cell, title = (4.3, 0.5 + 0.42 * part.sizes["body"]), "Probability that each spin is unstable"
    figure, (likely, rates) = canvas.make_panels(2, cell, title, subtitle, ax, margins=(1.0, 1.4), sharey=True)
    for axis in part["axis"].values.tolist():
        _axis(likely, rates, part.sel(axis=axis), axis)
    likely.set(xlim=(-0.03, 1.03), xlabel="probability that the spin is unstable")
    rates.set(xlabel=r"growth rate over the spin rate, $\sigma/\omega_0$", xlim=(-0.02, None))
    likely.set_yticks(range(part.sizes["body"]), [str(name)[:30] for name in part["body"].values])
    likely.set_ylim(part.sizes["body"] - 0.5, -0.5)
    for ax in (likely, rates):
        marks.draw_grid(ax, "x")
    canvas.draw_legend(figure)
    return figure


def _axis(likely, rates, part: xr.Dataset, axis: int) -> None:
    rows = np.arange(part.sizes["body"]) + OFFSETS[axis]
    color = colors.SERIES_COLORS[axis - 1]
    p = part["probability_unstable"].values
    likely.errorbar(p, rows, xerr=part["probability_unstable_error"].values, fmt="o", ms=4, color=color, gid="likely")
    quantiles = part["growth_rate_quantile"] / np.abs(part["omega0"])
    low, middle, high = (quantiles.sel(quantile=level).values for level in (0.05, 0.5, 0.95))
    rates.hlines(rows, low, high, color=color, lw=2)
    rates.plot(middle, rows, "o", ms=4, color=color, label=f"about axis {axis}")


def draw_cloud(name: str, subtitle: str, axes: dict[int, tuple[dict, dict]]) -> Figure:
    """Draw possible bodies over I1/I3 and I2/I3 with linear growth rates and the draws, one panel per axis.

    `axes` has for each axis its summary and its draws, from `sweeps.systems.uncertain_bodies.measuring.measured`.
    """
    figure = canvas.make_figure(1.0 + 3.6 * len(axes), 4.6, f"{name} with inertia uncertainty", subtitle)
    panels = np.atleast_1d(figure.subplots(1, len(axes), sharex=True, sharey=True))
    for ax, (axis, (summary, draws)) in zip(panels, axes.items(), strict=True):
        x, y = draws["I1"] / draws["I3"], draws["I2"] / draws["I3"]
        most = max(1.15, 1.05 * float(np.quantile(x, 0.999)), 1.05 * float(np.quantile(y, 0.999)))
        mesh = _background(ax, axis, most)
        some = np.linspace(0, x.size - 1, min(x.size, MOST_SHOWN)).astype(int)
        props = np.where((draws["regime"] == UNSTABLE)[some], colors.UNSTABLE, colors.STABLE)
        ax.scatter(x[some], y[some], s=2.5, c=props, linewidths=0, alpha=0.5, gid="cloud", rasterized=True)
        p, error = summary["probability_unstable"], summary["probability_unstable_error"]
        ax.set_title(f"spun about axis {axis}: unstable {100 * p:.2f} ± {100 * error:.2f} %")
        ax.set(xlabel="$I_1/I_3$", xlim=(0, most), ylim=(0, most), aspect="equal")
    panels[0].set_ylabel("$I_2/I_3$")
    figure.colorbar(mesh, ax=list(panels), label=r"growth rate, linear theory, $\sigma/\omega_0$", shrink=0.8)
    drawn = {"unstable": colors.UNSTABLE, "not unstable": colors.STABLE}
    handles = [
        marks.hatched_patch(),
        *(Patch(facecolor=c, label=f"sampled, {word}") for word, c in drawn.items()),
    ]
    canvas.draw_legend(figure, handles)
    return figure


def _background(ax, axis: int, most: float):
    along = (np.arange(STEPS) + 0.5) * most / STEPS
    x, y = np.meshgrid(along, along)
    rate2 = linear.omega_squared(x, y, np.ones_like(x), 1.0, axis)
    possible = (x + y >= 1) & (np.abs(x - y) <= 1)
    rate = np.where(possible, np.sqrt(np.maximum(-rate2, 0.0)), np.nan)
    mesh = ax.pcolormesh(along, along, rate, cmap=sheets.color_map("backdrop"), vmin=0, vmax=1.2, rasterized=True)
    impossible = ax.contourf(x, y, np.where(possible, 1.0, -1.0), [-2, 0], colors="none", hatches=["////"])
    impossible.set(edgecolor=colors.QUIET, lw=0.0)
    for line in ([1, 1], [0, most]), ([0, most], [1, 1]), ([0, most], [0, most]):
        ax.plot(*line, color=colors.QUIET, lw=0.6)
    return mesh
