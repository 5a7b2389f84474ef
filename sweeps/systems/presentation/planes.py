"""What figures of described systems have in common: the parameters along their sides, and the line above them."""

from collections.abc import Collection, Iterable, Mapping

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from kernels.statuses import STATUSES
from sweeps.figure import axis_scales, colors, marks, wording
from sweeps.schema.iteration import spaced_indices
from sweeps.systems.presentation.appearance import Appearance

MOST_DRAWN = 400  # values a dimension


def sides(values: xr.DataArray, panels: Collection[str]) -> tuple[str, str | None, str | None]:
    """Return the two longest parameters, the later one along x, and a third that varies; None where there is none.

    `panels` are the dimensions that have a panel for each value.
    """
    names = [str(name) for name in values.dims if name not in panels]
    varied = sorted((name for name in names if values.sizes[name] > 1), key=lambda name: -values.sizes[name])
    if len(varied) < 2:
        return (*varied, names[0])[0], None, None
    y, x = sorted(varied[:2], key=names.index)
    return x, y, varied[2] if len(varied) > 2 else None


def few(values: xr.DataArray, panel_sides: Iterable[str | None], whole: Collection[str | None]) -> dict:
    """Return the indices at which a figure cuts a variable: at most `MOST_DRAWN` of the sides, the middle of others."""
    middle = {name: values.sizes[name] // 2 for name in values.dims if name not in (*panel_sides, *whole)}
    return middle | {name: spaced_indices(values.sizes[name], MOST_DRAWN) for name in panel_sides if name}


def subtitle(ds: xr.Dataset, part: xr.Dataset, values: xr.DataArray, appearance: Appearance) -> str:
    """Return where a map is cut, and how many points are not ok, for the line below a title."""
    counts = np.bincount(ds["status"].values.ravel(), minlength=len(STATUSES))
    words = [f"{n:,} of {counts.sum():,} {appearance.words(STATUSES[k])}" for k, n in enumerate(counts) if n and k]
    fixed = [name for name in values.dims if name not in part.dims and name not in ("eigenvalue", "epsilon", "phase")]
    cut = ", ".join(wording.format_coordinate(ds, name, ds[name].values[ds.sizes[name] // 2]) for name in fixed)
    return ";  ".join(filter(None, [cut, *words])) or "as measured"


def boundary(ax: Axes, x, y, values: np.ndarray, rounding: float, label: str, lw: float = 1.1, halo=2.2) -> None:
    """Draw theory's boundary, where values of shape (y, x) change sign by more than rounding, named in the legend.

    A halo sets it off from what it divides; without one it leaves narrow regions their colour.
    """
    if np.nanmin(values, initial=0.0) < -rounding and np.nanmax(values, initial=0.0) > rounding:
        line = ax.contour(x, y, values, [0.0], colors=colors.INK, linewidths=lw)
        line.set(gid="theory", path_effects=marks.halo(halo) if halo else [])
        ax.plot([], [], color=colors.INK, lw=lw, label=label)


def name_sides(ax: Axes, one: xr.Dataset, x: str, y: str, symbols: Mapping = {}) -> None:
    """Set scales and labels of a plane's axes, logarithmic where values spread by ratio."""
    axis_scales.set_scale(ax.xaxis, one[x].values)
    axis_scales.set_scale(ax.yaxis, one[y].values)
    ax.set(xlabel=wording.axis_label(one, x, symbols), ylabel=wording.axis_label(one, y, symbols))


def once(titled: Iterable[tuple[str, xr.Dataset]], names: Iterable[str]) -> list[tuple[str, xr.Dataset]]:
    """Return titles and contents of panels; one that would look like another, by `names`, gives it its title only."""
    panels: list[tuple[str, xr.Dataset]] = []
    for title, one in titled:
        for k, (before, other) in enumerate(panels):
            if all(np.allclose(one[name].values, other[name].values, 1e-3, 1e-3, equal_nan=True) for name in names):
                panels[k] = (f"{before};  {title}", other)
                break
        else:
            panels.append((title, one))
    return panels
