"""The inertia triangle: every shape of body there can be, its spin about each axis, and real bodies on it."""

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from sweeps.figure import colors, style
from sweeps.schema.boxes import along, dimensions
from sweeps.systems.rigid_body.fits import signed_rate
from sweeps.systems.rigid_body.presentation.figure_stability import color_bar, mark_untrusted, real_bodies
from sweeps.systems.rigid_body.presentation.look import LOOK, SHAPE, cut_at, is_of_shapes, settings

if TYPE_CHECKING:
    import xarray as xr

CELLS = 500  # a side of a panel
LEAST_FILLED = 100_000  # points; fewer are drawn as dots
BLOCK_POINTS = 2**19
COLOR_MAP = "RdBu"
BEYOND = 1e-9  # of a ratio: rounding


def draw(ds: "xr.Dataset", ax: Axes | None = None) -> Figure | None:
    """Draw a panel for each axis, that of axis 2 largest; None where I3 is not the greatest moment of all points."""
    if not _is_on_triangle(ds):
        return None
    spun = ds["axis"].values.tolist()
    large = 2 if 2 in spun else spun[0]
    others = [axis for axis in spun if axis != large]
    title = "All possible rigid bodies" if "ratios" in str(ds.attrs.get("definition", "")) else "Bodies by shape"
    upright = style.is_narrow()  # the others below, and not beside
    size = (4.2, 6.2) if upright else (8.6, 5.9) if others else (5.6, 5.9)
    figure = style.canvas(*size, title, _subtitle(ds), ax=ax)
    shares = (1.9, 1.0) if others else (1.0,)
    shape = (len(shares), 2, None, shares) if upright else (2, len(shares), shares, None)
    grid = figure.add_gridspec(*shape[:2], width_ratios=shape[2], height_ratios=shape[3])
    axes = {large: figure.add_subplot(grid[0, :] if upright else grid[:, 0])}
    axes |= {axis: figure.add_subplot(grid[1, k] if upright else grid[k, 1]) for k, axis in enumerate(others[:2])}
    for axis, ax in axes.items():
        mesh = _panel(ax, ds, axis, axis == large)
        ax.set_title(f"spun about axis {axis}", **_heading(axis == large))
    color_bar(figure, axes[large], mesh)
    return figure


def draw_axis(ds: "xr.Dataset", axis: int, ax: Axes | None = None) -> Figure | None:
    """Draw the stability about one axis, as `figure_stability.draw`, of a map over a grid of shapes."""
    fixed = {name: float(ds[name].values[i]) for name, i in cut_at(ds).items()}
    subtitle = f"{ds.attrs.get('title', '')}\n{settings(fixed)}".strip()
    figure = style.canvas(6.4, 5.9, f"Spin about axis {axis}: measured stability", subtitle, ax=ax)
    ax = figure.subplots()
    mesh = _panel(ax, ds, axis, True)
    color_bar(figure, ax, mesh)
    x, t = np.meshgrid(ds["I1_over_I3"].values, ds["thickness"].values, indexing="ij")
    mark_untrusted(ax, x, 1.0 - x * (1.0 - t), _of_axis(ds, "status", axis))
    style.legend(figure)
    return figure


def _is_on_triangle(ds: "xr.Dataset") -> bool:
    """Return whether the map is of shapes, or of points whose greatest moment is the third, and no other grid."""
    if "axis" not in ds.dims or is_of_shapes(ds):
        return is_of_shapes(ds)
    names = {"I1", "I2", "I3", "omega_squared", "omega0"}
    alone = {("point",), *((name,) for name in ("I3", "omega0") if ds.sizes.get(name, 1) == 1)}
    if not names <= set(ds.variables) or any(ds[name].dims not in alone for name in ("I1", "I2", "I3", "omega0")):
        return False
    return all(max(x.max(), y.max()) <= 1 + BEYOND for x, y, _ in _blocks(ds, None))


def _subtitle(ds: "xr.Dataset") -> str:
    bodies = math.prod(ds.sizes[dim] for dim in ("point", *SHAPE) if dim in ds.sizes)
    points = f"{bodies:,} bodies, spun about each axis, perturbed and measured"
    return f"{points}.  Colour: measured rate of the perturbation over the spin rate"


def fixed_at(ds: "xr.Dataset") -> dict[str, int]:
    """Return the indices at which figures of a grid of shapes cut its other dimensions."""
    return {dim: (n - 1) // 2 for dim, n in dimensions(ds).items() if dim not in (*SHAPE, "axis")} | cut_at(ds)


def cell_numbers(ds: "xr.Dataset", x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the indices along I1_over_I3 and thickness of the cells of a grid that hold shapes; -1 where none does.

    Args:
        ds: a map over a grid of shapes.
        x: I1/I3.
        y: I2/I3.
    """
    t = 1.0 - (1.0 - y) / x
    numbers = []
    for name, place in zip(SHAPE, np.broadcast_arrays(x, t), strict=True):
        values = ds[name].values
        order = np.argsort(values, kind="stable")
        edges = style.edges(values[order])
        edges = np.clip(edges, 0.0, 1.0) if name == "thickness" else edges
        at = np.clip(np.searchsorted(edges, place) - 1, 0, values.size - 1)
        numbers.append(np.where((edges[0] <= place) & (place <= edges[-1]), order[at], -1))
    return numbers[0], numbers[1]


def _of_axis(ds: "xr.Dataset", name: str, axis: int) -> np.ndarray:
    """Return a variable of a grid of shapes about an axis, over (I1_over_I3, thickness)."""
    at = fixed_at(ds) | {"axis": int(np.flatnonzero(ds["axis"].values == axis)[0])}
    return along(ds[name].isel({dim: i for dim, i in at.items() if dim in ds[name].dims}), SHAPE)


def _raster(ds: "xr.Dataset", axis: int, edges: np.ndarray) -> np.ndarray:
    """Return the signed rate in each cell of the triangle: of the shape whose grid cell holds its middle."""
    middle = 0.5 * (edges[1:] + edges[:-1])
    i, j = cell_numbers(ds, middle[None, :], middle[:, None])
    rate = signed_rate(_of_axis(ds, "omega_squared", axis), ds["omega0"].values[fixed_at(ds)["omega0"]])
    return np.where((i >= 0) & (j >= 0), rate[i, j], np.nan)


def _blocks(ds: "xr.Dataset", axis: int | None) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray | None]]:
    """Yield I1/I3, I2/I3 and, about an axis, the signed rate, block after block of points."""
    fixed = {d: 0 for d in ds["omega_squared"].dims if d not in ("point", "axis")}
    for first in range(0, ds.sizes["point"], BLOCK_POINTS):
        part = ds.isel(fixed | {"point": slice(first, first + BLOCK_POINTS)})
        x, y = (part[name].values / part["I3"].values for name in ("I1", "I2"))
        squared = None if axis is None else part["omega_squared"].sel(axis=axis).values
        yield x, y, None if squared is None else signed_rate(squared, part["omega0"].values)


def _binned(ds: "xr.Dataset", axis: int, edges: np.ndarray) -> np.ndarray:
    """Return mean signed rate in each cell of the triangle, NaN in those without a point."""
    total = count = 0.0
    for x, y, rate in _blocks(ds, axis):
        finite = np.isfinite(rate)
        total = total + np.histogram2d(y[finite], x[finite], (edges, edges), weights=rate[finite])[0]
        count = count + np.histogram2d(y[finite], x[finite], (edges, edges))[0]
    return np.divide(total, count, out=np.full(total.shape, np.nan), where=count > 0)


def _panel(ax: Axes, ds: "xr.Dataset", axis: int, is_large: bool):
    norm = Normalize(-1, 1)
    if is_of_shapes(ds) or ds.sizes["point"] >= LEAST_FILLED:
        edges = np.linspace(0, 1, (CELLS if is_large else CELLS // 2) + 1)
        cells = (_raster if is_of_shapes(ds) else _binned)(ds, axis, edges)
        look = {"interpolation": "nearest", "interpolation_stage": "rgba"}  # a tenth of the time that a mesh takes
        mesh = ax.imshow(cells, COLOR_MAP, norm, origin="lower", extent=(0, 1, 0, 1), gid="cells", zorder=0, **look)
    else:
        x, y, rate = (np.concatenate(part) for part in zip(*_blocks(ds, axis), strict=True))
        mesh = ax.scatter(x, y, s=6, c=rate, cmap=COLOR_MAP, norm=norm, linewidths=0, rasterized=True, gid="cells")
    frame(ax, axis, is_large)
    _words(ax, axis, is_large)
    if is_large and not style.is_narrow():
        _name_bodies(ax)
    return mesh


def _heading(is_large: bool) -> dict:
    return {"loc": "left", "fontweight": "bold", "fontsize": 10 if is_large else 9, "pad": 18 if is_large else 6}


def frame(ax: Axes, axis: int, is_large: bool) -> None:
    """Draw the triangle's sides, the line on which both lesser moments are equal, and what the sides are in words."""
    ax.plot([0, 1, 1, 0], [1, 0, 1, 1], color=colors.INK, lw=1.2, clip_on=False, zorder=4)
    if axis != 3:
        ax.plot([0.5, 1], [0.5, 1], color=colors.INK, lw=1.4, zorder=3, gid="I1 = I2", path_effects=style.halo(2.6))
    ax.set(xlim=(-0.02, 1.02), ylim=(-0.02, 1.02), aspect="equal", xlabel=r"$I_1 / I_3$", ylabel=r"$I_2 / I_3$")
    ax.spines[["top", "right"]].set_visible(False)
    ticks = [0, 0.25, 0.5, 0.75, 1] if is_large else [0, 0.5, 1]
    ax.set_xticks(ticks, [f"{t:g}" for t in ticks])
    ax.set_yticks(ticks, [f"{t:g}" for t in ticks])
    if not is_large:
        return
    quiet = {"color": colors.QUIET, "fontsize": 8.5, "ha": "center", "va": "center"}
    ax.text(0.70, 0.25, r"flat:  $I_1 + I_2 = I_3$", rotation=-45, rotation_mode="anchor", **quiet)
    ax.text(0.25, 0.30, "physically\nimpossible", **quiet)
    if axis != 3:
        style.note(ax, "$I_1 = I_2$", (0.6, 0.6), (7, -7), va="center", zorder=5, path_effects=style.halo(2.4))
    style.note(ax, "sphere", (1, 1), (0, 6), **(quiet | {"ha": "right", "va": "bottom"}))


def _words(ax: Axes, axis: int, is_large: bool) -> None:
    """Write the stability of the spin in each part."""
    above, below = (0.62, 0.78), ((0.83, 0.45) if is_large else (0.78, 0.5))  # I1 < I2, I1 > I2
    kinds = {1: ("stable_minor", "unstable"), 2: ("unstable", "stable_minor"), 3: ("stable_major", "")}[axis]
    look = {"ha": "center", "va": "center", "path_effects": style.halo(2.4), "zorder": 5}
    for at, kind in zip((above, below) if axis != 3 else ((0.72, 0.75), below), kinds, strict=True):
        if kind:
            words = LOOK.words(kind).replace(", ", ",\n") if is_large else LOOK.words(kind).split(",")[0]
            ax.text(*at, words, fontsize=10 if is_large else 8.5, fontweight="bold", **look)


def _name_bodies(ax: Axes) -> None:
    for name, (x, y, _), offset, side in real_bodies():
        ax.plot([x], [y], "o", ms=5.5, color=colors.INK, mec="white", mew=1.0, zorder=6, clip_on=False, gid="body")
        if name:
            look = {"ha": side, "fontsize": 8.5, "zorder": 7, "path_effects": style.halo(2.6)}
            style.note(ax, name, (x, y), offset, **look)
