"""Marks on panels: texts with outlines, grid lines, hatching, and places for labels."""

from collections.abc import Sequence
from typing import Any, Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap, to_rgb
from matplotlib.patches import Patch
from matplotlib.patheffects import withStroke
from matplotlib.text import Annotation

from sweeps.figure.colors import FAINT, PAPER, QUIET

SERIES_MARKERS = ("o", "s", "^", "D", "v", "P")


class Shades(ListedColormap):
    """Shades of several colours in sequence, `number` of each, from nearly the paper's colour to the full colour."""

    PALEST = 0.3

    def __init__(self, bases: Sequence, number: int):
        paper, full = np.array(to_rgb(PAPER)), [np.array(to_rgb(base)) for base in bases]
        shares = np.linspace(self.PALEST, 1.0, number)
        super().__init__([tuple(paper + share * (base - paper)) for base in full for share in shares], "shades")


def halo(width: float = 2.5):
    """Return an outline that keeps text and lines readable on any colour."""
    return [withStroke(linewidth=width, foreground=PAPER)]


def draw_grid(ax: Axes, axis: Literal["both", "x", "y"] = "both") -> None:
    """Draw faint lines at the ticks of one axis or both, behind everything else."""
    ax.grid(axis=axis, color=FAINT, lw=0.5, alpha=0.7)
    ax.set_axisbelow(True)


def annotate(ax: Axes, text: str, place, offset: tuple[float, float], **style) -> Annotation:
    """Write a text at an offset from a point, and return it.

    Args:
        ax: the panel.
        text: the text.
        place: coordinates of the point in the panel.
        offset: from the point to the text, in points of type.
        style: options of Matplotlib's `annotate`.
    """
    return ax.annotate(text, place, offset, textcoords="offset points", **style)


def axes_fractions(ax: Axes, x, y) -> np.ndarray:
    """Return places as fractions of a panel `ax`, shape (n, 2), scaled to everything that is drawn so far.

    Args:
        ax: the panel.
        x: abscissas, any shape.
        y: ordinates, of the same shape.
    """
    ax.get_xlim(), ax.get_ylim()  # Matplotlib scales axes when their limits are read, not in transData
    places = np.column_stack([np.ravel(x), np.ravel(y)])
    return ax.transAxes.inverted().transform(ax.transData.transform(places))


def spread_heights(ax: Axes, x: float, values: np.ndarray, min_gap: float) -> np.ndarray:
    """Return heights for the labels of values in a panel, which do not overlap, as fractions of its height.

    Args:
        ax: the panel.
        x: abscissa of all values.
        values: ordinates, shape (n,).
        min_gap: smallest difference of two heights, as a fraction of the panel's height.
    """
    ends = np.clip(np.nan_to_num(axes_fractions(ax, np.full(len(values), x), values)[:, 1]), 0.0, 1.0)
    order, steps = np.argsort(ends), min_gap * np.arange(ends.size)
    heights = np.maximum.accumulate(ends[order] - steps) + steps
    return (heights - max(heights[-1] - 1.0 + min_gap / 2, 0.0))[np.argsort(order)]


def hatched_patch(label: str = "physically impossible", **style) -> Patch:
    """Return the legend's entry of a hatched region."""
    props: dict[str, Any] = {"facecolor": "none", "edgecolor": QUIET, "hatch": "////", "lw": 0, "label": label}
    return Patch(**props | style)
