"""Sampled or listed points over two of their coordinates, and the distribution of a measured variable."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from sweeps.figure import canvas, colors, wording
from sweeps.schema.datasets import dimensions, flags, own_of_points, spreads_by_ratio
from sweeps.schema.iteration import coprime_stride
from sweeps.schema.variables import Role, Variable, of_role

if TYPE_CHECKING:
    from sweeps.systems.presentation.appearance import Appearance

MAX_DRAWN = 20_000  # points of a panel
MAX_PANELS = 4
MAX_NAMED = 20  # points up to which their names are drawn next to them
BINS = 60


def draw(
    ds: xr.Dataset, specs: Mapping[str, Variable], appearance: "Appearance", ax: Axes | None = None
) -> Figure | None:
    """Draw scatter plots coloured by the leading flag, and below each the histogram of a measured variable.

    Args:
        ds: the map, with dimension `point`.
        specs: the system's table of variables.
        appearance: words, symbols and colours of the system.
        ax: place of the figure within another one.

    Returns:
        The figure; None if no coordinate varies, or without a flag.
    """
    names = [name for name in own_of_points(ds) if np.ptp(ds[name].values) > 0][:2]
    map_specs = {name: spec for name, spec in specs.items() if name in ds.data_vars}
    flag, measured = of_role(map_specs, Role.HEADLINE), of_role(map_specs, Role.MEASUREMENT)
    flag = flag or next((str(name) for name in ds.data_vars if flags(ds[name])), "")
    if not names or not flag:
        return None
    stride = coprime_stride([ds.sizes["point"]], MAX_DRAWN)
    variables = [flag, *([measured] if measured else [])]
    points, along, panels = _panels(ds[variables].isel(point=slice(None, None, stride)))
    shown_count = "all shown" if stride == 1 else f"one in {stride:,} shown"
    subtitle = f"{ds.attrs.get('title', '')}:  {ds.sizes['point']:,} points, {shown_count}".strip()
    width = 0.8 + 2.9 * len(panels)
    figure = canvas.make_figure(width, 6.4 if measured else 4.2, "Sampled points", subtitle, ax=ax)
    heights = (1.6, 1.0) if measured else (1.0,)
    axes = figure.subplots(len(heights), len(panels), squeeze=False, height_ratios=heights)
    flag_colors = {value: appearance.color(meaning) or colors.GREY for value, meaning in flags(ds[flag]).items()}
    for column, (panel_number, panel) in zip(axes.T, enumerate(panels), strict=True):
        _scatter(column[0], panel, names, flag, flag_colors, appearance)
        if along:
            column[0].set_title(f"{along} {ds[along].values[panel_number]}", loc="left", fontweight="bold")
        if measured:
            _histogram(column[1], ds[measured], panel, flag, flag_colors)
    used_flags = set(np.unique(points[flag].values).tolist())
    dot: dict[str, Any] = {"ls": "none", "marker": "o", "ms": 4}
    words = {value: appearance.words(meaning) for value, meaning in flags(ds[flag]).items() if value in used_flags}
    canvas.draw_legend(figure, [Line2D([], [], color=flag_colors[v], label=text, **dot) for v, text in words.items()])
    return figure


def _panels(points: xr.Dataset) -> tuple[xr.Dataset, str, list[xr.Dataset]]:
    """Return the map in memory, the dimension that has a panel for each value ("" for none), and the panels."""
    panel_dims = [d for d, n in dimensions(points).items() if d != "point" and 1 < n <= MAX_PANELS]
    panel_dim = next((d for d in panel_dims if points[d].dtype.kind in "iuOU"), next(iter(panel_dims), ""))
    middle = {d: (n - 1) // 2 for d, n in dimensions(points).items() if d not in ("point", panel_dim)}
    points = points.isel(middle).load()
    return (
        points,
        panel_dim,
        [points.isel({panel_dim: k}) for k in range(points.sizes[panel_dim])] if panel_dim else [points],
    )


def _scatter(ax: Axes, panel: xr.Dataset, names, flag: str, flag_colors, appearance: "Appearance") -> None:
    """Draw the points in storage order, later points over earlier points."""
    x = panel[names[0]].values
    y = panel[names[1]].values if len(names) > 1 else np.zeros(x.shape)
    tints = np.array([flag_colors.get(int(value), colors.GREY) for value in panel[flag].values])
    size = float(np.clip(30_000 / max(x.size, 1), 1.0, 16.0))
    ax.scatter(x, y, s=size, c=tints, linewidths=0, alpha=0.8, rasterized=True, gid="points")
    if "name" in panel.coords and x.size <= MAX_NAMED:
        for text, *place in zip(panel["name"].values, x, y, strict=True):
            ax.annotate(str(text), tuple(place), (3, 3), textcoords="offset points", fontsize="x-small", gid="name")
    for side, values, name in zip("xy", (x, y), names, strict=False):
        label = wording.with_unit(appearance.symbol(name), str(panel[name].attrs.get("units", "1")), "  ({})")
        ax.set(**{f"{side}label": label, f"{side}scale": "log" if spreads_by_ratio(values) else "linear"})
    if len(names) == 1:
        ax.set_yticks([])


def _histogram(ax: Axes, measured: xr.DataArray, panel: xr.Dataset, flag: str, flag_colors) -> None:
    """Draw the histogram of a variable, stacked by flag, without its lowest and highest 0.5 %."""
    values = panel[measured.name].values
    finite = np.isfinite(values)
    if finite.any():
        low, high = np.percentile(values[finite], (0.5, 99.5))
        bins = np.linspace(low, high if high > low else low + (abs(low) or 1.0), BINS)
        used_flags = [value for value in flag_colors if (panel[flag].values[finite] == value).any()]
        groups = [values[finite & (panel[flag].values == value)] for value in used_flags]
        ax.hist(
            groups, bins.tolist(), stacked=True, color=[flag_colors[value] for value in used_flags], gid="histogram"
        )
    name = str(measured.name).replace("_", " ")
    ax.set(xlabel=wording.with_unit(name, str(measured.attrs.get("units", "1")), "  ({})"), ylabel="points")
