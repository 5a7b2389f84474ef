"""Precession of the symmetric top: the measured rate over I3/I1, and how far it keeps to the formula at any angle."""

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from kernels.statuses import STATUSES
from sweeps.figure import colors, style
from sweeps.systems.symmetric_top.presentation import LOOK

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
    _rates(left, part)
    _deviations(right, part)
    style.legend(figure)
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
    count = "all drawn" if drawn == points else f"{drawn:,} drawn"
    counts = np.bincount(part["status"].values.ravel(), minlength=len(STATUSES))
    words = " · ".join(f"{n:,} {LOOK.words(name)}" for name, n in zip(STATUSES, counts, strict=True) if n)
    worst = float(part["deviation"].max())
    off = f";  largest relative deviation of the rate: {style.number(worst, 2)}" if np.isfinite(worst) else ""
    return f"{ds.attrs.get('title', '')}:  {style.count(points, 'point', 'points')}, {count}\nStatus:  {words}{off}"


def _rates(ax: Axes, part: xr.Dataset) -> None:
    """Draw measured rates of all spins and half-angles at each I3/I1, under the formula's line."""
    ratio = part["ratio"].values
    low, high = (float(end) for end in style.edges(ratio)[[0, -1]])
    span = np.linspace(low, high, 200)
    ax.axhline(0.0, color=colors.FAINT, lw=0.8, zorder=0)
    rates = part["relative"].values.reshape(-1, ratio.size)
    for chosen, color in ((ratio < 1.0, PROLATE), (ratio == 1.0, colors.QUIET), (ratio > 1.0, OBLATE)):
        at = np.broadcast_to(ratio[chosen], rates[:, chosen].shape)
        unique = np.unique(np.column_stack([at.ravel(), rates[:, chosen].ravel().round(6)]), axis=0)
        ax.plot(*unique.T, "o", ms=3.6, mew=0.0, color=color, gid="measured")
    ax.plot(span, span - 1.0, color=colors.INK, lw=0.9, gid="theory", label=r"closed form, $I_3/I_1 - 1$")
    if high > 2.0:
        look = {"facecolor": "none", "edgecolor": "#9a9da1", "hatch": "/////", "lw": 0}
        ax.axvspan(max(2.0, low), high, gid="impossible", label="impossible: $I_3 > 2 I_1$", **look)
    ax.set(xlim=(low, high), xlabel=r"$I_3/I_1$", ylabel=r"measured precession rate $\Omega/\omega_3$")
    halo = {"transform": ax.transAxes, "path_effects": style.halo(), "fontweight": "bold"}
    if (ratio < 1.0).any():
        ax.text(0.03, 0.50, "prolate:\nagainst the spin", color=PROLATE, va="bottom", **halo)
    if (ratio > 1.0).any():
        ax.text(0.52, 0.93, "oblate:\nwith the spin", color=OBLATE, va="top", ha="right", **halo)


def _deviations(ax: Axes, part: xr.Dataset) -> None:
    """Draw the rate's largest relative deviation at each half-angle, and the tolerance; single ones are rounding."""
    angle = part["half_angle"].values
    deviation = part["deviation"].transpose("half_angle", "ratio", "omega3").values.reshape(angle.size, -1)
    drawn = np.maximum(deviation, LEAST_DRAWN)
    finite = np.isfinite(deviation).any(axis=1)
    if finite.any():
        look = {"color": colors.INK, "gid": "worst", "label": "largest deviation at each half-angle"}
        ax.plot(angle[finite], np.nanmax(drawn[finite], axis=1), "o-", lw=1.4, ms=3.0, **look)
    dashes = {"color": colors.UNSTABLE, "lw": 1.0, "ls": (0, (4, 2)), "label": f"tolerance: {style.number(PROMISED)}"}
    ax.axhline(PROMISED, gid="tolerance", **dashes)
    ax.set(yscale="log", ylim=(LEAST_DRAWN / 2, 1e-8), xlim=(0, 90), xticks=range(0, 91, 15))
    style.log_ticks_above_zero(ax.yaxis, LEAST_DRAWN, range(-16, -7, 2))
    ax.set_xlabel(r"half-angle of $\omega$ to the figure axis  (degrees)")
    ax.set_ylabel(r"$|\,\Omega\,/\,(I_3/I_1 - 1)\,\omega_3 - 1\,|$")
    style.grid(ax, "y")
