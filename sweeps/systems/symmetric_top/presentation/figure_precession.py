"""Precession of the symmetric top: the measured rate over I3/I1, and how far it keeps to the formula at any angle."""

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from kernels.statuses import STATUSES
from sweeps.figure import colors, style
from sweeps.systems.symmetric_top.presentation.look import LOOK

MOST = {"ratio": 160, "omega3": 12, "half_angle": 90}  # values a dimension that are drawn
PROMISED, NEAR_SPHERE = 1e-10, 1e-2  # what the measurement promises, relative, and how near a sphere no longer
LEAST_DRAWN = 1e-17
PROLATE, OBLATE = colors.UNSTABLE, colors.STABLE


def draw(ds: xr.Dataset, ax: Axes | None = None) -> Figure:
    """Draw the measured rate over I3/I1 with the formula, and its relative deviation over the half-angle."""
    part = thinned(ds)
    rows, columns, size = style.arranged(2, (4.2, 3.3))
    figure = style.canvas(*size, "Precession of the free symmetric top", _subtitle(ds, part), ax=ax)
    left, right = figure.subplots(rows, columns)
    handles = _rates(left, part)
    handles += _deviations(right, part)
    style.legend(figure, handles)
    return figure


def thinned(ds: xr.Dataset) -> xr.Dataset:
    """Return at most `MOST` values per dimension, with `relative` rate and `deviation` from the formula."""
    names = ["precession_rate", "precession_rate_theory", "status", "triangle_margin"]
    keep = {name: style.few(ds.sizes[name], most) for name, most in MOST.items()}
    part = ds[names].isel(keep).load().sortby(list(keep)).transpose("omega3", "half_angle", "ratio")
    theory = part["precession_rate_theory"]
    resolved = np.abs(part["ratio"] - 1.0) >= NEAR_SPHERE
    deviation = np.abs(part["precession_rate"] / theory.where(resolved) - 1.0)
    return part.assign(relative=part["precession_rate"] / part["omega3"], deviation=deviation)


def _subtitle(ds: xr.Dataset, part: xr.Dataset) -> str:
    points, drawn = int(np.prod(list(ds.sizes.values()))), part["status"].size
    shown = "all drawn" if drawn == points else f"{drawn:,} drawn"
    counts = np.bincount(part["status"].values.ravel(), minlength=len(STATUSES))
    words = " · ".join(f"{n:,} {LOOK.words(name)}" for name, n in zip(STATUSES, counts, strict=True) if n)
    worst = float(part["deviation"].max())
    found = f";  largest relative deviation of the rate: {style.number(worst, 2)}" if np.isfinite(worst) else ""
    return f"{ds.attrs.get('title', '')}:  {style.count(points, 'point', 'points')}, {shown}\nStatus:  {words}{found}"


def _rates(ax: Axes, part: xr.Dataset) -> list:
    """Measured rates of all spins and half-angles at each I3/I1, under the formula's line."""
    ratio = part["ratio"].values
    low, high = (float(end) for end in style.edges(ratio)[[0, -1]])
    span = np.linspace(low, high, 200)
    ax.axhline(0.0, color=colors.FAINT, linewidth=0.8, zorder=0)
    rates = part["relative"].values.reshape(-1, ratio.size)
    look = {"linestyle": "none", "marker": "o", "markersize": 3.6, "markeredgewidth": 0.0}
    for chosen, color in ((ratio < 1.0, PROLATE), (ratio == 1.0, colors.QUIET), (ratio > 1.0, OBLATE)):
        at = np.broadcast_to(ratio[chosen], rates[:, chosen].shape)
        unique = np.unique(np.column_stack([at.ravel(), rates[:, chosen].ravel().round(6)]), axis=0)
        ax.plot(*unique.T, color=color, gid="measured", **look)
    line = {"color": colors.INK, "linewidth": 0.9, "gid": "theory", "label": r"closed form, $I_3/I_1 - 1$"}
    handles = ax.plot(span, span - 1.0, **line)
    beyond = high > 2.0
    if beyond:
        look = {"facecolor": "none", "edgecolor": "#9a9da1", "hatch": "/////", "linewidth": 0}
        ax.axvspan(max(2.0, low), high, gid="impossible", **look)
        handles.append(Patch(label="impossible: $I_3 > 2 I_1$", **look))
    ax.set(xlim=(low, high), xlabel=r"$I_3/I_1$")
    ax.set_ylabel(r"measured precession rate $\Omega/\omega_3$")
    halo = {"transform": ax.transAxes, "path_effects": style.halo(), "fontweight": "bold"}
    if (ratio < 1.0).any():
        ax.text(0.03, 0.50, "prolate:\nagainst the spin", color=PROLATE, va="bottom", **halo)
    if (ratio > 1.0).any():
        ax.text(0.52, 0.93, "oblate:\nwith the spin", color=OBLATE, va="top", ha="right", **halo)
    return handles


def _deviations(ax: Axes, part: xr.Dataset) -> list:
    """The largest relative deviation of the rate at each half-angle, and the tolerance; single ones are rounding."""
    angle = part["half_angle"].values
    deviation = part["deviation"].transpose("half_angle", "ratio", "omega3").values.reshape(angle.size, -1)
    drawn = np.maximum(deviation, LEAST_DRAWN)
    known = np.isfinite(deviation).any(axis=1)
    handles = []
    if known.any():
        worst = np.nanmax(drawn[known], axis=1)
        line = {"color": colors.INK, "linewidth": 1.4, "marker": "o", "markersize": 3.0, "gid": "worst"}
        handles += ax.plot(angle[known], worst, label="largest deviation at each half-angle", **line)
    dashes = {"color": colors.UNSTABLE, "linewidth": 1.0, "linestyle": (0, (4, 2))}
    ax.axhline(PROMISED, gid="tolerance", **dashes)
    handles.append(Line2D([], [], label=f"tolerance: {style.number(PROMISED)}", **dashes))
    ax.set(yscale="log", ylim=(LEAST_DRAWN / 2, 1e-8), xlim=(0, 90), xticks=range(0, 91, 15))
    ticks = 10.0 ** np.arange(-16, -7, 2)
    ax.set_yticks([LEAST_DRAWN, *ticks], ["0", *(style.power(round(np.log10(t))) for t in ticks)])
    ax.minorticks_off()
    ax.set_xlabel(r"half-angle of $\omega$ to the figure axis  (degrees)")
    ax.set_ylabel(r"$|\,\Omega\,/\,(I_3/I_1 - 1)\,\omega_3 - 1\,|$")
    ax.grid(axis="y", color=colors.FAINT, linewidth=0.5, alpha=0.7)
    ax.set_axisbelow(True)
    return handles
