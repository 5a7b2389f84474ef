"""Common parts of the figures of described systems: parameters along the sides, subtitles, boundaries of theory."""

from collections.abc import Collection, Iterable, Mapping

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.path import Path

from kernels.estimator.statuses import STATUSES
from sweeps.figure import axis_scales, colors, marks, wording
from sweeps.schema.iteration import spaced_indices
from sweeps.systems.presentation.appearance import Appearance

MAX_DRAWN = 400  # values per dimension of a panel


def cut_indices(values: xr.DataArray, panel_sides: Iterable[str | None], full_dims: Collection[str | None]) -> dict:
    """Return dimension → indices at which a figure cuts a variable.

    Args:
        values: the variable.
        panel_sides: dimensions along the sides of a panel, with at most `MAX_DRAWN` drawn values.
        full_dims: dimensions that are not cut; all remaining dimensions are cut in their middle.
    """
    middle = {name: values.sizes[name] // 2 for name in values.dims if name not in (*panel_sides, *full_dims)}
    return middle | {name: spaced_indices(values.sizes[name], MAX_DRAWN) for name in panel_sides if name}


def subtitle(ds: xr.Dataset, panel: xr.Dataset, values: xr.DataArray, appearance: Appearance) -> str:
    """Return the line below a title: the values at which the map is cut, and the number of points that are not ok.

    Args:
        ds: the map.
        panel: the part of the map that a figure shows.
        values: the variable that is drawn.
        appearance: words of the statuses.
    """
    counts = np.bincount(ds["status"].values.ravel(), minlength=len(STATUSES))
    words = [f"{n:,} of {counts.sum():,} {appearance.words(STATUSES[k])}" for k, n in enumerate(counts) if n and k]
    cut_dims = [
        name for name in values.dims if name not in panel.dims and name not in ("eigenvalue", "epsilon", "phase")
    ]
    cut_values = ", ".join(
        wording.format_coordinate(ds, name, ds[name].values[ds.sizes[name] // 2]) for name in cut_dims
    )
    return ";  ".join(filter(None, [cut_values, *words])) or "as measured"


def boundary(ax: Axes, x, y, values: np.ndarray, rounding: float, label: str, lw: float = 1.1, halo=2.2) -> None:
    """Draw the boundary of theory, on which values change sign, if they do so by more than rounding.

    Loops within a row or column of the grid are left out: they are parts of a region narrower than its cells.

    Args:
        ax: the panel.
        x: coordinate, shape (x,) or (y, x).
        y: coordinate, shape (y,) or (y, x).
        values: shape (y, x).
        rounding: rounding error of the values.
        label: words in the legend.
        lw: width of the line, points.
        halo: width of a bright edge that sets the line off, points; 0 leaves narrow regions their colour.
    """
    if np.nanmin(values, initial=0.0) < -rounding and np.nanmax(values, initial=0.0) > rounding:
        line = ax.contour(x, y, values, [0.0], colors=colors.INK, linewidths=lw)
        cell = [np.abs(np.diff(side, axis=k)).max() for side, k in ((np.asarray(x), -1), (np.asarray(y), 0))]
        pieces = [piece for piece in line.allsegs[0] if len(piece)]
        spans = ([np.ptp(piece, axis=0), np.abs(piece[0] - piece[-1])] for piece in pieces)
        is_wide = [(span > cell).all() or (gap > cell).any() for span, gap in spans]
        pieces = [Path(piece) for piece, is_drawn in zip(pieces, is_wide, strict=True) if is_drawn]
        line.set_paths([Path.make_compound_path(*pieces)])
        line.set(gid="theory", path_effects=marks.halo(halo) if halo else [])
        ax.plot([], [], color=colors.INK, lw=lw, label=label)


def label_axes(ax: Axes, panel: xr.Dataset, x: str, y: str, symbols: Mapping = {}) -> None:
    """Set the labels of the axes to x and y, and scales to logarithmic if values of `panel` are spaced by ratio.

    `symbols` has the symbols of parameters by name.
    """
    axis_scales.set_scale(ax.xaxis, panel[x].values)
    axis_scales.set_scale(ax.yaxis, panel[y].values)
    ax.set(xlabel=wording.axis_label(panel, x, symbols), ylabel=wording.axis_label(panel, y, symbols))


def merge_equal(panels: Iterable[tuple[str, xr.Dataset]], names: Iterable[str]) -> list[tuple[str, xr.Dataset]]:
    """Return (title, panel) pairs; panels with equal variables `names` are merged, and their titles joined."""
    unique_panels: list[tuple[str, xr.Dataset]] = []
    for title, panel in panels:
        for k, (titles, earlier) in enumerate(unique_panels):
            if all(np.allclose(panel[name].values, earlier[name].values, 1e-3, 1e-3, equal_nan=True) for name in names):
                unique_panels[k] = (f"{titles};  {title}", earlier)
                break
        else:
            unique_panels.append((title, panel))
    return unique_panels
