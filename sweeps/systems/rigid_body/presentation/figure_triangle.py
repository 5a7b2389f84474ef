"""Figure of the inertia triangle: all possible shapes of bodies, the rates of their spins, and real bodies."""

import math
from collections.abc import Iterator
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from sweeps.figure import axis_scales, canvas, colors, marks, sheets
from sweeps.schema.datasets import Dataset, dimensions
from sweeps.systems.bodies.presentation import triangle
from sweeps.systems.presentation.sentences import head_texts
from sweeps.systems.rigid_body.fits import signed_rate
from sweeps.systems.rigid_body.presentation.appearance import APPEARANCE, SHAPE, cut_at, is_of_shapes, settings
from sweeps.systems.rigid_body.presentation.figure_stability import draw_color_bar, mark_statuses, real_bodies

CELLS = 500  # cells per side of a panel
MIN_BINNED = 100_000  # points; fewer are drawn as dots
BLOCK_POINTS = 2**19
MIN_COVERED_THICKNESS = 0.98  # largest thickness of a grid that leaves a strip of the triangle, which the picture names
RATIO_ROUNDING = 1e-9  # rounding error of a ratio of moments


def draw(ds: Dataset, ax: Axes | None = None) -> Figure | None:
    """Draw a panel for each axis, axis 2 largest; return None unless I3 is the greatest moment of all points."""
    if not _is_on_triangle(ds):
        return None
    axes_of_spin = ds["axis"].values.tolist()
    main_axis = 2 if 2 in axes_of_spin else axes_of_spin[0]
    small_axes = [axis for axis in axes_of_spin if axis != main_axis]
    title = head_texts(ds, "All possible rigid bodies" if is_of_shapes(ds) else "Bodies by shape")[0]
    is_narrow = sheets.is_narrow()  # the small panels below, and not next to the large one
    size = (4.2, 7.2) if is_narrow else (8.6, 5.9) if small_axes else (5.6, 5.9)
    bodies = math.prod(ds.sizes[dim] for dim in ("point", *SHAPE) if dim in ds.sizes)
    points = f"{bodies:,} bodies, spun about each axis, perturbed and measured"
    subtitle = f"{points}.  Colour: measured rate of the perturbation over the spin rate"
    if is_of_shapes(ds) and not is_narrow and ds["thickness"].max() < MIN_COVERED_THICKNESS:
        subtitle += "\ngrey: shapes nearer to I2 = I3, or thinner, than the map has"
    figure = canvas.make_figure(*size, title, subtitle, ax=ax)
    ratios = (1.9, 1.0) if small_axes else (1.0,)
    shape = (len(ratios), 2, None, ratios) if is_narrow else (2, len(ratios), ratios, None)
    grid = figure.add_gridspec(*shape[:2], width_ratios=shape[2], height_ratios=shape[3])
    axes = {main_axis: figure.add_subplot(grid[0, :] if is_narrow else grid[:, 0])}
    axes |= {axis: figure.add_subplot(grid[1, k] if is_narrow else grid[k, 1]) for k, axis in enumerate(small_axes[:2])}
    for axis, ax in axes.items():
        mesh = _draw_panel(ax, ds, axis, axis == main_axis)
        size, pad = (10, 18) if axis == main_axis else (9, 6)
        ax.set_title(f"spun about axis {axis}", loc="left", fontweight="bold", fontsize=size, pad=pad)
    draw_color_bar(figure, axes[main_axis], mesh)
    return figure


def draw_axis(ds: Dataset, axis: int, ax: Axes | None = None) -> Figure | None:
    """Draw the stability about one axis (as `figure_stability.draw`) of `ds`, a map over a grid of shapes."""
    fixed_values = {name: float(ds[name].values[i]) for name, i in cut_at(ds).items()}
    title, subtitle = f"Spin about axis {axis}: measured stability", settings(fixed_values)
    texts = (
        head_texts(ds, title, subtitle) if axis == 2 else (title, f"{ds.attrs.get('title', '')}\n{subtitle}".strip())
    )
    figure = canvas.make_figure(6.4, 5.9, *texts, ax=ax)
    ax = figure.subplots()
    mesh = _draw_panel(ax, ds, axis, True)
    draw_color_bar(figure, ax, mesh)
    mark_statuses(ax, *triangle.places(ds), values_about(ds, "status", axis))
    canvas.draw_legend(figure)
    return figure


def _is_on_triangle(ds: Dataset) -> bool:
    """Return True for a map of shapes, or of points with I3 as greatest moment and no further dimension."""
    if "axis" not in ds.dims or is_of_shapes(ds):
        return is_of_shapes(ds)
    names = {"I1", "I2", "I3", "omega_squared", "omega0"}
    allowed_dims = {("point",), *((name,) for name in ("I3", "omega0") if ds.sizes.get(name, 1) == 1)}
    if not names <= set(ds.variables) or any(
        ds[name].dims not in allowed_dims for name in ("I1", "I2", "I3", "omega0")
    ):
        return False
    return all(max(x.max(), y.max()) <= 1 + RATIO_ROUNDING for x, y, _ in _blocks(ds, None))


def fixed_at(ds: Dataset) -> dict[str, int]:
    """Return the indices at which figures of a grid of shapes cut its further dimensions."""
    return {dim: (n - 1) // 2 for dim, n in dimensions(ds).items() if dim not in (*SHAPE, "axis")} | cut_at(ds)


def values_about(ds: Dataset, name: str, axis: int) -> np.ndarray:
    """Return the variable `name` of `ds`, a grid of shapes, about an axis, in the order of `triangle.places`."""
    return triangle.values(ds, name, fixed_at(ds) | {"axis": int(np.flatnonzero(ds["axis"].values == axis)[0])})


def _blocks(ds: Dataset, axis: int | None) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray | None]]:
    """Yield I1/I3, I2/I3 and the signed rate about an axis (None without one), for each block of points."""
    cut = {d: 0 for d in ds["omega_squared"].dims if d not in ("point", "axis")}
    for first in range(0, ds.sizes["point"], BLOCK_POINTS):
        block = ds.isel(cut | {"point": slice(first, first + BLOCK_POINTS)})
        x, y = (block[name].values / block["I3"].values for name in ("I1", "I2"))
        omega_squared = None if axis is None else block["omega_squared"].sel(axis=axis).values
        yield x, y, None if omega_squared is None else signed_rate(omega_squared, block["omega0"].values)


def _bin_rates(ds: Dataset, axis: int, edges: np.ndarray) -> np.ndarray:
    """Return the mean signed rate in each cell of the triangle, NaN in cells without a point."""
    total = count = np.zeros((len(edges) - 1, len(edges) - 1))
    for x, y, rate in _blocks(ds, axis):
        finite = np.isfinite(rate)
        total = total + np.histogram2d(y[finite], x[finite], (edges, edges), weights=rate[finite])[0]
        count = count + np.histogram2d(y[finite], x[finite], (edges, edges))[0]
    return np.divide(total, count, out=np.full(total.shape, np.nan), where=count > 0)


def _draw_panel(ax: Axes, ds: Dataset, axis: int, is_large: bool):
    """Draw signed rates about one axis on the triangle of inertia, as cells, binned rates or dots; return them."""
    props: dict[str, Any] = {
        "cmap": sheets.color_map("signed"),
        "norm": Normalize(-1, 1),
        "rasterized": True,
        "gid": "cells",
    }
    if is_of_shapes(ds):
        rate = signed_rate(values_about(ds, "omega_squared", axis), ds["omega0"].values[fixed_at(ds)["omega0"]])
        ax.fill([0, 1, 1], [1, 1, 0], color=colors.MISSING, zorder=-1, gid="missing")
        mesh = ax.pcolormesh(*triangle.places(ds, axis_scales.cell_edges), rate, zorder=0, **props)
    elif ds.sizes["point"] >= MIN_BINNED:
        edges = np.linspace(0, 1, (CELLS if is_large else CELLS // 2) + 1)
        mesh = ax.pcolormesh(edges, edges, _bin_rates(ds, axis, edges), zorder=0, **props)
    else:
        x, y, rate = (np.concatenate(columns) for columns in zip(*_blocks(ds, axis), strict=True))
        mesh = ax.scatter(x, y, s=6, c=rate, linewidths=0, **props)
    triangle.frame(ax, axis, is_large)
    _name_regions(ax, axis, is_large)
    if is_large and not sheets.is_narrow():
        _name_bodies(ax)
    return mesh


def _name_regions(ax: Axes, axis: int, is_large: bool) -> None:
    """Write the stability of the spin on each side of the line I1 = I2."""
    above_line, below_line = (0.62, 0.78), ((0.83, 0.45) if is_large else (0.78, 0.5))  # I1 < I2, I1 > I2
    regimes = {1: ("stable_minor", "unstable"), 2: ("unstable", "stable_minor"), 3: ("stable_major", "")}[axis]
    props = {"ha": "center", "va": "center", "path_effects": marks.halo(2.4), "zorder": 5}
    for place, regime in zip(
        (above_line, below_line) if axis != 3 else ((0.72, 0.75), below_line), regimes, strict=True
    ):
        if regime:
            words = (
                APPEARANCE.words(regime).replace(", ", ",\n") if is_large else APPEARANCE.words(regime).split(",")[0]
            )
            ax.text(*place, words, fontsize=10 if is_large else 8.5, fontweight="bold", **props)


def _name_bodies(ax: Axes) -> None:
    """Mark known bodies by dots with their names."""
    for name, (x, y, _), offset, alignment in real_bodies():
        ax.plot([x], [y], "o", ms=5.5, color=colors.INK, mec=colors.PAPER, mew=1.0, zorder=6, clip_on=False, gid="body")
        if name:
            props = {"ha": alignment, "fontsize": 8.5, "zorder": 7, "path_effects": marks.halo(2.6)}
            marks.annotate(ax, name, (x, y), offset, **props)
