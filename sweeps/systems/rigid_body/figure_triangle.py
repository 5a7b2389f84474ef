"""The inertia triangle: every shape of body there can be, its spin about each axis, and real bodies on it."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from sweeps import colors, style
from sweeps.schema.reading import file_text, plain, read_text
from sweeps.systems.rigid_body.fits import signed_rate
from sweeps.systems.rigid_body.look import LOOK

CELLS = 500  # a side of a panel
LEAST_FILLED = 100_000  # points; fewer are drawn as dots
BLOCK_POINTS = 2**19
COLOR_MAP = "RdBu"
BEYOND = 1e-9  # of a ratio: rounding
DEFINITIONS = Path(__file__).parents[2] / "definitions"
# Body in the definitions that ship → its name here, and where that stands: offset in points, alignment.
NAMED = {
    "bodies.yaml": {
        "Earth": ("Earth, Moon, Mars", (0, -15), "right"),
        "Moon": ("", (0, 0), "left"),
        "Mars": ("", (0, 0), "left"),
        "Tennis racket (Wilson T-2000)": ("tennis racket", (6, -3), "left"),
        "Telephone as a uniform box": ("telephone", (6, -3), "left"),
        "Thin plate": ("thin plate", (-6, -9), "right"),
        "Water molecule": ("water molecule", (-7, -8), "right"),
    },
    "tumblers.yaml": {
        "(5247) Krylov": ("asteroid Krylov", (6, -3), "left"),
        "2008 TC3 (illustration)": ("asteroid 2008 TC₃", (7, -9), "left"),
        "1I/'Oumuamua as an ellipsoid 6 to 1 to 1 (illustration)": ("'Oumuamua", (3, 6), "left"),
    },
}


def draw(ds: xr.Dataset) -> Figure | None:
    """A panel for each axis, the middle one's the largest; None where I3 is not the greatest moment of all points.

    Args:
        ds: a map with a dimension `point`, and the moments I1, I2 and I3.
    """
    if not _is_of_shapes(ds):
        return None
    rates = {int(axis): _gather(ds, int(axis)) for axis in ds["axis"].values}
    large = 2 if 2 in rates else next(iter(rates))
    others = [axis for axis in rates if axis != large]
    title = "All bodies there can be" if "ratios" in str(ds.attrs.get("definition", "")) else "Bodies by their shape"
    figure = style.canvas(8.6 if others else 5.6, 5.9, title, _subtitle(ds), footer=0.05)
    grid = figure.add_gridspec(2, 2 if others else 1, width_ratios=(1.9, 1.0) if others else (1.0,))
    axes = {large: figure.add_subplot(grid[:, 0])}
    axes |= {axis: figure.add_subplot(grid[k, 1]) for k, axis in enumerate(others[:2])}
    for axis, ax in axes.items():
        mesh = _panel(ax, rates[axis], axis, axis == large)
    _color_bar(figure, axes[large], mesh)
    return figure


def _is_of_shapes(ds: xr.Dataset) -> bool:
    if not {"I1", "I2", "I3", "omega_squared", "omega0"} <= set(ds.variables):
        return False
    ratios = (np.max(ds[name].values / ds["I3"].values) for name in ("I1", "I2") if _alike(ds, name))
    found = list(ratios)
    return len(found) == 2 and max(found) <= 1 + BEYOND


def _alike(ds: xr.Dataset, name: str) -> bool:
    """Whether a moment can be divided by I3 point by point."""
    return ds["I3"].size == 1 or (ds[name].dims == ds["I3"].dims)


def _subtitle(ds: xr.Dataset) -> str:
    points = f"{ds.sizes['point']:,} bodies, each spun about each axis, nudged and measured"
    return f"{points}.  Colour: the nudge's measured rate, in units of the spin"


def _gather(ds: xr.Dataset, axis: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """I1/I3, I2/I3 and the signed rate at every point about one axis."""
    fixed = {d: 0 for d in ds["omega_squared"].dims if d not in ("point", "axis")}
    part = ds["omega_squared"].isel(fixed).isel(axis=int(np.flatnonzero(ds["axis"].values == axis)[0]))
    rate = np.concatenate([part[k : k + BLOCK_POINTS].values for k in range(0, part.sizes["point"], BLOCK_POINTS)])
    omega0 = ds["omega0"].values if ds["omega0"].dims == ("point",) else ds["omega0"].values[0]
    x, y = (np.broadcast_to(ds[name].values / ds["I3"].values, rate.shape) for name in ("I1", "I2"))
    return x, y, signed_rate(rate, omega0)


def _panel(ax: Axes, found: tuple, axis: int, is_large: bool):
    x, y, rate = found
    norm = Normalize(-1, 1)
    if x.size >= LEAST_FILLED:
        edges = np.linspace(0, 1, (CELLS if is_large else CELLS // 2) + 1)
        known = np.isfinite(rate)
        total, _, _ = np.histogram2d(y[known], x[known], (edges, edges), weights=rate[known])
        count, _, _ = np.histogram2d(y[known], x[known], (edges, edges))
        cells = np.divide(total, count, out=np.full(total.shape, np.nan), where=count > 0)
        mesh = ax.pcolormesh(edges, edges, cells, cmap=COLOR_MAP, norm=norm, rasterized=True, gid="cells")
    else:
        mesh = ax.scatter(x, y, s=6, c=rate, cmap=COLOR_MAP, norm=norm, linewidths=0, rasterized=True, gid="cells")
    _frame(ax, axis, is_large)
    _words(ax, axis, is_large)
    if is_large:
        _name_bodies(ax)
    return mesh


def _frame(ax: Axes, axis: int, is_large: bool) -> None:
    """The triangle's sides, and the line on which the two lesser moments are equal."""
    ax.plot([0, 1, 1, 0], [1, 0, 1, 1], color=colors.INK, lw=1.2, clip_on=False, zorder=4)
    if axis != 3:
        ax.plot([0.5, 1], [0.5, 1], color=colors.INK, lw=1.4, zorder=3, gid="I1 = I2", path_effects=style.halo(2.6))
    ax.set(xlim=(-0.02, 1.02), ylim=(-0.02, 1.02), aspect="equal")
    ax.set_xlabel(r"$I_1 / I_3$")
    ax.set_ylabel(r"$I_2 / I_3$")
    ax.spines[["top", "right"]].set_visible(False)
    ticks = [0, 0.25, 0.5, 0.75, 1] if is_large else [0, 0.5, 1]
    ax.set_xticks(ticks, [f"{t:g}" for t in ticks])
    ax.set_yticks(ticks, [f"{t:g}" for t in ticks])
    ax.set_title(
        f"spun about axis {axis}",
        loc="left",
        fontweight="bold",
        fontsize=10 if is_large else 9,
        pad=18 if is_large else 6,
    )


def _words(ax: Axes, axis: int, is_large: bool) -> None:
    """What becomes of the spin, in each part, and what the triangle's sides are."""
    above, below = (0.66, 0.84), ((0.83, 0.45) if is_large else (0.78, 0.5))  # I1 < I2, I1 > I2
    kinds = {1: ("stable_minor", "unstable"), 2: ("unstable", "stable_minor"), 3: ("stable_major", "")}[axis]
    look = {"ha": "center", "va": "center", "path_effects": style.halo(2.4), "zorder": 5}
    for at, kind in zip((above, below) if axis != 3 else ((0.72, 0.75), below), kinds, strict=True):
        if kind:
            words = LOOK.words(kind).replace(", ", ",\n") if is_large else LOOK.words(kind).split(",")[0]
            ax.text(*at, words, fontsize=10 if is_large else 8.5, fontweight="bold", **look)
    if not is_large:
        return
    quiet = {"color": colors.QUIET, "fontsize": 8.5, "ha": "center", "va": "center"}
    ax.text(0.70, 0.25, r"flat:  $I_1 + I_2 = I_3$", rotation=-45, rotation_mode="anchor", **quiet)
    ax.text(0.25, 0.30, "no body has\nthese moments", **quiet)
    ax.annotate(
        r"$I_1 = I_2$",
        (0.6, 0.6),
        (7, -7),
        textcoords="offset points",
        ha="left",
        va="center",
        zorder=5,
        path_effects=style.halo(2.4),
    )
    ax.annotate("sphere", (1, 1), (0, 6), textcoords="offset points", **(quiet | {"ha": "right", "va": "bottom"}))


def bodies() -> Iterator[tuple[str, float, float, tuple, str]]:
    """Name, I1/I3, I2/I3, offset and alignment of each real body, as the definitions that ship have it."""
    for file, named in NAMED.items():
        listed = plain(read_text(file_text(DEFINITIONS / file)))["bodies"]
        for body in listed:
            if body["name"] in named:
                given = body.get("ratios", body)
                moments = [float(given[name]) for name in ("I1", "I2", "I3")]
                name, offset, side = named[body["name"]]
                yield name, moments[0] / moments[2], moments[1] / moments[2], offset, side


def _name_bodies(ax: Axes) -> None:
    for name, x, y, offset, side in bodies():
        ax.plot([x], [y], "o", ms=5.5, color=colors.INK, mec="white", mew=1.0, zorder=6, clip_on=False, gid="body")
        if name:
            look = {"ha": side, "fontsize": 8.5, "zorder": 7, "path_effects": style.halo(2.6)}
            ax.annotate(name, (x, y), offset, textcoords="offset points", **look)


def _color_bar(figure: Figure, ax: Axes, mesh) -> None:
    bar = figure.colorbar(mesh, ax=ax, orientation="horizontal", pad=0.02, fraction=0.05, aspect=34, shrink=0.72)
    bar.set_ticks([-1, -0.5, 0, 0.5, 1], labels=["1", "0.5", "0", "0.5", "1"])
    bar.outline.set_linewidth(0.8)
    look = {"transform": bar.ax.transAxes, "va": "top", "fontsize": 9}
    bar.ax.text(0.0, -2.25, r"grows:  rate / $\omega_0$", color=colors.UNSTABLE, ha="left", **look)
    bar.ax.text(1.0, -2.25, r"oscillates:  $\Omega$ / $\omega_0$", color=colors.STABLE, ha="right", **look)
