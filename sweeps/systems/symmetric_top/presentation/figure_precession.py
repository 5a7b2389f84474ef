"""Precession of the symmetric top: the measured rate over I3/I1, at all spins and half-angles, on the closed form."""

import math

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sweeps.figure import colors, style
from sweeps.systems.presentation import planes
from sweeps.systems.symmetric_top.presentation import LOOK

MOST = {"ratio": 160, "omega3": 12, "half_angle": 90}  # values a dimension that are drawn
PROLATE, OBLATE = colors.UNSTABLE, colors.STABLE


def draw(ds: xr.Dataset, ax: Axes | None = None) -> Figure:
    """Draw the measured rate over I3/I1 with the formula's line."""
    part = ds[["precession_rate"]].isel({name: style.few(ds.sizes[name], most) for name, most in MOST.items()}).load()
    shown = "" if part.sizes == ds.sizes else f", {math.prod(part.sizes.values()):,} drawn"
    points = f"{ds.attrs.get('title', '')}:  {style.count(math.prod(ds.sizes.values()), 'point', 'points')}{shown}"
    subtitle = f"{points}\nat all half-angles and spins;  {planes.subtitle(ds, part, part['precession_rate'], LOOK)}"
    figure = style.canvas(6.6, 4.9, "Precession of the free symmetric top", subtitle, ax=ax)
    _rates(figure.subplots(), part.sortby("ratio").transpose("omega3", "half_angle", "ratio"))
    style.legend(figure)
    return figure


def _rates(ax: Axes, part: xr.Dataset) -> None:
    """Draw measured rates of all spins and half-angles at each I3/I1, under the formula's line."""
    ratio = part["ratio"].values
    low, high = (float(end) for end in style.edges(ratio)[[0, -1]])
    span = np.linspace(low, high, 200)
    ax.axhline(0.0, color=colors.FAINT, lw=0.8, zorder=0)
    rates = (part["precession_rate"] / part["omega3"]).transpose(..., "ratio").values.reshape(-1, ratio.size)
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
