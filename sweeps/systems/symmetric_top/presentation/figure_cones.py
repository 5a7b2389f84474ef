"""Body cone and space cone of a symmetric top: the one, fixed in the body, rolls on the other, fixed in space."""

import math

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Polygon
from scipy.spatial import ConvexHull

from sweeps.figure import colors, style

SHOWN = (0.5, 1.8)  # I3/I1 of the tops that are drawn, or the grid's nearest: one long, one flat
ANGLE = 25.0  # degrees: the half-angle, or the grid's nearest
TOWARDS = (math.cos(0.3), math.sin(0.3))  # where the viewer stands: before the plane of L and the axis, and above it
BODY, SPACE = colors.STABLE, colors.UNSTABLE


def cones(ratio: float, half_angle: float) -> tuple[float, float]:
    """Return the angles of the figure axis and of the angular velocity to L, positive away from the axis, rad.

    ``tan(theta) = tan(half_angle) I1/I3``: L is on the far side of the angular velocity from the axis for I3 < I1.
    """
    theta = math.atan2(math.tan(half_angle), ratio)
    return theta, half_angle - theta


def draw(ds: xr.Dataset, ax: Axes | None = None) -> Figure | None:
    """Draw both cones of a long and of a flat top; None where no such top is in the map."""
    ratios = ds["ratio"].values
    sides = ratios[(ratios > 0) & (ratios < 0.99)], ratios[(ratios > 1.01) & (ratios <= 2.0)]
    tops = [float(s[np.argmin(np.abs(s - wanted))]) for s, wanted in zip(sides, SHOWN, strict=True) if s.size]
    if not tops:
        return None
    angle = float(ds["half_angle"].values[np.argmin(np.abs(ds["half_angle"].values - ANGLE))])
    subtitle = f"{ds.attrs.get('title', '')}\nthe body cone rolls on the space cone; they touch along ω"
    figure, axes = style.panels(len(tops), (4.4, 3.6), "Body cone and space cone", subtitle, ax, beside=(0.0, 1.4))
    for ax, ratio in zip(axes, tops, strict=True):
        _cones(ax, ratio, math.radians(angle))
        shape, where = ("flat", "inside") if ratio > 1.0 else ("long", "outside")
        ax.set_title(f"{shape}: $I_3/I_1$ = {style.number(ratio, 3)}, ω at {style.number(angle, 3)}° to the axis")
        words = f"the space cone lies {where} the body cone"
        ax.text(0.5, -0.03, words, transform=ax.transAxes, ha="center", color=colors.QUIET)
    style.legend(figure)
    return figure


def _seen(points: np.ndarray) -> np.ndarray:
    """Project points (n, 3) onto the screen (n, 2): x towards the side to which the figure axis leans, z along L."""
    return np.column_stack([points[:, 0], TOWARDS[0] * points[:, 2] + TOWARDS[1] * points[:, 1]])


def _rim(tilt: float, opening: float) -> np.ndarray:
    """Return the rim of a cone whose axis leans by `tilt` from L, of slant height one."""
    turn = np.linspace(0.0, 2.0 * np.pi, 200)
    axis = np.array([math.sin(tilt), 0.0, math.cos(tilt)])
    across = np.array([math.cos(tilt), 0.0, -math.sin(tilt)])
    ring = np.outer(np.cos(turn), across) + np.outer(np.sin(turn), [0.0, 1.0, 0.0])
    return math.cos(opening) * axis + math.sin(opening) * ring


def _cones(ax: Axes, ratio: float, half_angle: float) -> None:
    theta, beyond = cones(ratio, half_angle)
    space = (0.0, abs(beyond), SPACE, "space cone, about L")
    for tilt, opening, color, label in (space, (theta, half_angle, BODY, "body cone, about the figure axis")):
        rim = _seen(_rim(tilt, opening))
        around = np.vstack([[0.0, 0.0], rim])
        hull = around[ConvexHull(around).vertices]
        ax.add_patch(Polygon(hull, facecolor=color, alpha=0.2, edgecolor="none", label=label))
        ax.plot(*rim.T, color=color, lw=1.4)
        ax.add_patch(Polygon(hull, facecolor="none", edgecolor=color, lw=0.8))
    path = _seen(1.12 * _rim(0.0, theta))
    ax.plot(*path.T, color=colors.QUIET, lw=0.8, ls=(0, (4, 3)), gid="path of the axis")
    for tilt, length, color, name in (
        (0.0, 1.3, colors.INK, "L"),
        (theta, 1.12, BODY, "axis 3"),
        (-beyond, 1.22, colors.SERIES_COLORS[3], "ω"),
    ):
        end = _seen(length * np.array([[math.sin(tilt), 0.0, math.cos(tilt)]]))[0]
        ax.annotate("", end, (0, 0), arrowprops={"arrowstyle": "-|>", "color": color, "lw": 1.6, "shrinkA": 0})
        ax.text(*(end * 1.05), name, color=color, ha="center", va="bottom", weight="bold", path_effects=style.halo())
    ax.set(aspect="equal", xlim=(-1.15, 1.15), ylim=(-0.25, 1.5))
    ax.axis("off")
