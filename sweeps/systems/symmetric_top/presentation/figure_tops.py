"""Figures of symmetric tops: the measured rate of precession over I3/I1, and body cone and space cone.

The body cone, fixed in the body, rolls on the space cone, fixed in the inertial frame.
"""

import math
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Polygon
from scipy.spatial import ConvexHull

from sweeps.figure import axis_scales, canvas, colors, marks, wording
from sweeps.schema.iteration import spaced_indices
from sweeps.systems.presentation import planes
from sweeps.systems.symmetric_top.presentation import APPEARANCE

MAX_DRAWN = {"ratio": 160, "omega3": 12, "half_angle": 90}  # values per dimension that are drawn
PROLATE, OBLATE = colors.UNSTABLE, colors.STABLE
SHOWN_RATIOS = (0.5, 1.8)  # I3/I1 of a long and of a flat top; the nearest tops of the grid are drawn
ANGLE = 25.0  # degrees; the nearest half-angle of the grid is drawn
TOWARDS = (math.cos(0.3), math.sin(0.3))  # direction of the viewer: before the plane of L and the axis, and above it
BODY, SPACE = colors.STABLE, colors.UNSTABLE


def draw_precession(ds: xr.Dataset, ax: Axes | None = None) -> Figure:
    """Draw the measured rate over I3/I1 with the formula's line."""
    subset = (
        ds[["precession_rate"]]
        .isel({name: spaced_indices(ds.sizes[name], max_count) for name, max_count in MAX_DRAWN.items()})
        .load()
    )
    drawn_count = "" if subset.sizes == ds.sizes else f", {math.prod(subset.sizes.values()):,} drawn"
    points = wording.format_count(math.prod(ds.sizes.values()), "point", "points")
    cut = planes.subtitle(ds, subset, subset["precession_rate"], APPEARANCE)
    subtitle = f"{ds.attrs.get('title', '')}:  {points}{drawn_count}\nat all half-angles and spins;  {cut}"
    figure = canvas.make_figure(6.6, 4.9, "Precession of the free symmetric top", subtitle, ax=ax)
    _draw_rates(figure.subplots(), subset.sortby("ratio").transpose("omega3", "half_angle", "ratio"))
    canvas.draw_legend(figure)
    return figure


def _draw_rates(ax: Axes, subset: xr.Dataset) -> None:
    """Draw measured rates of all spins and half-angles at each I3/I1, under the formula's line."""
    ratio = subset["ratio"].values
    low, high = (float(end) for end in axis_scales.cell_edges(ratio)[[0, -1]])
    span = np.linspace(low, high, 200)
    ax.axhline(0.0, color=colors.FAINT, lw=0.8, zorder=0)
    rates = (subset["precession_rate"] / subset["omega3"]).transpose(..., "ratio").values.reshape(-1, ratio.size)
    for is_kind, color in ((ratio < 1.0, PROLATE), (ratio == 1.0, colors.QUIET), (ratio > 1.0, OBLATE)):
        ratios = np.broadcast_to(ratio[is_kind], rates[:, is_kind].shape)
        unique = np.unique(np.column_stack([ratios.ravel(), rates[:, is_kind].ravel().round(6)]), axis=0)
        ax.plot(*unique.T, "o", ms=3.6, mew=0.0, color=color, gid="measured")
    ax.plot(span, span - 1.0, color=colors.INK, lw=0.9, gid="theory", label=r"closed form, $I_3/I_1 - 1$")
    if high > 2.0:
        props: dict[str, Any] = {"facecolor": "none", "edgecolor": "#9a9da1", "hatch": "/////", "lw": 0}
        ax.axvspan(max(2.0, low), high, gid="impossible", label="impossible: $I_3 > 2 I_1$", **props)
    ax.set(xlim=(low, high), xlabel=r"$I_3/I_1$", ylabel=r"measured precession rate $\Omega/\omega_3$")
    halo = {"transform": ax.transAxes, "path_effects": marks.halo(), "fontweight": "bold"}
    if (ratio < 1.0).any():
        ax.text(0.03, 0.50, "prolate:\nagainst the spin", color=PROLATE, va="bottom", **halo)
    if (ratio > 1.0).any():
        ax.text(0.52, 0.93, "oblate:\nwith the spin", color=OBLATE, va="top", ha="right", **halo)


def cone_angles(ratio: float, half_angle: float) -> tuple[float, float]:
    """Return the angles of the figure axis and of the angular velocity to L, positive away from the axis, rad.

    ``tan(theta) = tan(half_angle) I1/I3``: L is on the far side of the angular velocity from the axis for I3 < I1.
    """
    theta = math.atan2(math.tan(half_angle), ratio)
    return theta, half_angle - theta


def draw_cones(ds: xr.Dataset, ax: Axes | None = None) -> Figure | None:
    """Draw both cones of a long and of a flat top; return None if the map has no such top."""
    ratios = ds["ratio"].values
    sides = ratios[(ratios > 0) & (ratios < 0.99)], ratios[(ratios > 1.01) & (ratios <= 2.0)]
    tops = [float(s[np.argmin(np.abs(s - target))]) for s, target in zip(sides, SHOWN_RATIOS, strict=True) if s.size]
    if not tops:
        return None
    angle = float(ds["half_angle"].values[np.argmin(np.abs(ds["half_angle"].values - ANGLE))])
    subtitle = f"{ds.attrs.get('title', '')}\nthe body cone rolls on the space cone; they touch along ω"
    figure, axes = canvas.make_panels(
        len(tops), (4.4, 3.6), "Body cone and space cone", subtitle, ax, margins=(0.0, 1.4)
    )
    for ax, ratio in zip(axes, tops, strict=True):
        _draw_cones(ax, ratio, math.radians(angle))
        shape, side = ("flat", "inside") if ratio > 1.0 else ("long", "outside")
        moments, degrees = wording.format_number(ratio, 3), wording.format_number(angle, 3)
        ax.set_title(f"{shape}: $I_3/I_1$ = {moments}, ω at {degrees}° to the axis")
        words = f"the space cone lies {side} the body cone"
        ax.text(0.5, -0.03, words, transform=ax.transAxes, ha="center", color=colors.QUIET)
    canvas.draw_legend(figure)
    return figure


def _project(points: np.ndarray) -> np.ndarray:
    """Project points (n, 3) onto the screen (n, 2): x towards the side to which the figure axis leans, z along L."""
    return np.column_stack([points[:, 0], TOWARDS[0] * points[:, 2] + TOWARDS[1] * points[:, 1]])


def _cone_rim(tilt: float, opening: float) -> np.ndarray:
    """Return the rim of a cone of slant height 1 with its axis at the angle `tilt` from L."""
    angle = np.linspace(0.0, 2.0 * np.pi, 200)
    axis = np.array([math.sin(tilt), 0.0, math.cos(tilt)])
    transverse = np.array([math.cos(tilt), 0.0, -math.sin(tilt)])
    ring = np.outer(np.cos(angle), transverse) + np.outer(np.sin(angle), [0.0, 1.0, 0.0])
    return math.cos(opening) * axis + math.sin(opening) * ring


def _draw_cones(ax: Axes, ratio: float, half_angle: float) -> None:
    """Draw space and body cone of a top from the side, with L, ω and axis 3; angles in rad, `ratio` is I3/I1."""
    theta, omega_angle = cone_angles(ratio, half_angle)
    space = (0.0, abs(omega_angle), SPACE, "space cone, about L")
    for tilt, opening, color, label in (space, (theta, half_angle, BODY, "body cone, about the figure axis")):
        rim = _project(_cone_rim(tilt, opening))
        corners = np.vstack([[0.0, 0.0], rim])
        hull = corners[ConvexHull(corners).vertices]
        ax.add_patch(Polygon(hull, facecolor=color, alpha=0.2, edgecolor="none", label=label))
        ax.plot(*rim.T, color=color, lw=1.4)
        ax.add_patch(Polygon(hull, facecolor="none", edgecolor=color, lw=0.8))
    path = _project(1.12 * _cone_rim(0.0, theta))
    ax.plot(*path.T, color=colors.QUIET, lw=0.8, ls=(0, (4, 3)), gid="path of the axis")
    for tilt, length, color, name in (
        (0.0, 1.3, colors.INK, "L"),
        (theta, 1.12, BODY, "axis 3"),
        (-omega_angle, 1.22, colors.SERIES_COLORS[3], "ω"),
    ):
        end = _project(length * np.array([[math.sin(tilt), 0.0, math.cos(tilt)]]))[0]
        ax.annotate("", end, (0, 0), arrowprops={"arrowstyle": "-|>", "color": color, "lw": 1.6, "shrinkA": 0})
        ax.text(*(end * 1.05), name, color=color, ha="center", va="bottom", weight="bold", path_effects=marks.halo())
    ax.set(aspect="equal", xlim=(-1.15, 1.15), ylim=(-0.25, 1.5))
    ax.axis("off")
