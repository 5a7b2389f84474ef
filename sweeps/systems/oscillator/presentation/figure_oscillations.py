"""Small oscillations: signed ω² of every equilibrium and mode over what is varied, and how far it keeps to theory."""

import math
import warnings

import matplotlib
import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from kernels.statuses import STATUSES
from sweeps.figure import colors, style
from sweeps.systems.oscillator.variables import REGIMES
from sweeps.systems.presentation import ratios
from sweeps.systems.presentation.look import missing_words

MOST_DRAWN = 400  # values a dimension
MOST_PANELS = 8
MOST_POINTS = 40_000
PROMISED, LEAST_RATE = 1e-6, 1e-3  # relative, and how small ω² may be beside the scale's square
LEAST_DRAWN = 1e-17
COLORS = {"stable": colors.STABLE, "unstable": colors.UNSTABLE, "marginal": colors.INK}
MISSING = "#e6e6e6"
MOST_DEVIATION = 1e9  # larger ones stand at the edge
ROUNDING = 1e-12  # of ω²/scale²: what is below is no sign
MOST_DOTS = 1000  # marginal points of a panel; more stand on a coarser lattice
LARGE = 5.2  # inches, of the picture of places
LEVEL = 1e-6  # of a value: what differs by less is drawn as a law, not as a flat colour
LEAST_ROOM = 0.12  # of a panel's height, between two curves with a name between
MOST_CURVES = 4  # of a law
LEAST_WIDTH = 5.4  # inches, for the title


def draw(ds: xr.Dataset, ax: Axes | None = None) -> Figure:
    """Draw a panel for every equilibrium and mode, and for one coordinate the positions of the equilibria."""
    x, y = _axes_of(ds)
    part = _thinned(ds, x, y)
    panels = [(e, m) for e in part["equilibrium"].values for m in part["mode"].values][:MOST_PANELS]
    coordinates = [name for name in ds.data_vars if name.endswith("_equilibrium")]
    places = len(coordinates) == 1 and ds.sizes["equilibrium"] > 1 and _moves(part[coordinates[0]], x)
    count = len(panels)
    columns = math.ceil(count / 3) if places else min(3 if count in (3, 5, 6, 9) else 4 if count > 4 else 2, count)
    rows = math.ceil(count / columns)
    width = max(LEAST_WIDTH, 1.0 + 3.3 * columns + LARGE * places)
    figure = style.canvas(width, 1.5 + 2.7 * rows, ds.attrs.get("title", ""), _subtitle(ds, part), 0.36, ax=ax)
    ratios_of_width = [LARGE / 3.3] * places + [1.0] * columns
    grid = figure.add_gridspec(rows, columns + places, width_ratios=ratios_of_width)
    axes = [figure.add_subplot(grid[k // columns, places + k % columns]) for k in range(rows * columns)]
    image = None
    for ax, (e, m) in zip(axes, panels, strict=False):
        one = part.sel(equilibrium=e, mode=m)
        ax.set_title(_name(part, e, m), loc="left")
        if not y:
            _lines(ax, one, x)
        elif _is_level(one):
            _law(ax, one, x, y)
        else:
            image = _map(ax, one, x, y)
    if places:
        _places(figure.add_subplot(grid[:, 0]), part, coordinates[0], x, y)
    for ax in axes[count:]:
        ax.set_axis_off()
    if image is not None:
        bar = figure.colorbar(image, ax=axes[:count], shrink=0.9, aspect=30, pad=0.02)
        bar.set_label("measured $\\omega^2$ / rate scale$^2$\nabove 0 stable, below unstable", fontsize=8)
    style.legend(figure, _missing(figure, part))
    return figure


def _axes_of(ds):
    """The dimensions of the pictures: the two longest of the parameters, x the later one; y None where one varies."""
    names = [d for d in ds["omega_squared"].dims if d not in ("equilibrium", "mode")]
    varied = sorted((d for d in names if ds.sizes[d] > 1), key=lambda d: -ds.sizes[d])[:2]
    if not varied:
        return names[0], None
    if len(varied) == 1:
        return varied[0], None
    y, x = sorted(varied, key=names.index)
    return x, y


def _thinned(ds, x, y):
    """What is drawn: the middle of every other dimension, at most MOST_DRAWN values of these."""
    names = ["omega_squared", "omega_squared_theory", "rate_scale", "regime", "status"]
    names += [name for name in ("regime_theory",) if name in ds]
    names += [name for name in ds.data_vars if name.endswith("_equilibrium")]
    kept = (x, y, "equilibrium", "mode")
    middle = {d: ds.sizes[d] // 2 for d in ds["omega_squared"].dims if d not in kept}
    few = {d: style.few(ds.sizes[d], MOST_DRAWN) for d in (x, y) if d}
    part = ds[names].isel(middle | few).load()
    square = part["rate_scale"] ** 2
    return part.assign(measured=part["omega_squared"] / square, theory=part["omega_squared_theory"] / square)


def _subtitle(ds, part):
    counts = np.bincount(ds["status"].values.ravel(), minlength=len(STATUSES))
    words = " · ".join(f"{n:,} {name.replace('_', ' ')}" for name, n in zip(STATUSES, counts, strict=True) if n)
    fixed = [d for d in ds["omega_squared"].dims if d not in part.dims]
    values = ", ".join(_fixed(ds, d) for d in fixed)
    points = style.count(int(ds["status"].size), "point", "points")
    return f"{points}:  {words}\nDrawn at  {values}" if values else f"{points}:  {words}"


def _fixed(ds, dim):
    return style.fixed_at(ds, dim, ds[dim].values[ds.sizes[dim] // 2])


def _name(part, equilibrium, mode):
    name = str(equilibrium).replace("_", " ")
    name = f"equilibrium {name}" if name.isdigit() else name
    return name if part.sizes["mode"] == 1 else f"{name}, mode {mode}"


def _map(ax, one, x, y):
    """Measured signed ω² in colours, theory's zero as a line, marginal points as dots."""
    one = one.transpose(y, x)
    palette = matplotlib.colormaps["PuOr"].with_extremes(bad=MISSING)
    values = np.ma.masked_invalid(one["measured"].values)
    edges = style.edges(one[x].values), style.edges(one[y].values)
    image = ax.pcolormesh(*edges, values, cmap=palette, norm=Normalize(-1, 1), rasterized=True, gid="measured")
    theory = one["theory"].values
    if np.nanmin(theory, initial=0.0) < -ROUNDING and np.nanmax(theory, initial=0.0) > ROUNDING:
        line = ax.contour(one[x].values, one[y].values, theory, levels=[0.0], colors=colors.INK, linewidths=1.0)
        line.set(gid="theory", path_effects=style.halo(2.2))
        ax.plot([], [], color=colors.INK, linewidth=1.0, label=r"theory: $\omega^2 = 0$")
    rows, columns = _few_dots(*np.nonzero(one["regime"].values == REGIMES.index("marginal") - 1))
    look = {"linestyle": "none", "marker": "o", "markersize": 2.0, "color": colors.INK, "markeredgewidth": 0.0}
    if rows.size:
        ax.plot(one[x].values[columns], one[y].values[rows], gid="marginal", label="marginal", **look)
    style.scale_as_spread(ax.xaxis, one[x].values)
    style.scale_as_spread(ax.yaxis, one[y].values)
    ax.set(xlabel=style.label_of(one, x), ylabel=style.label_of(one, y))
    return image


def _moves(place, x):
    """Whether an equilibrium is elsewhere for another x, so that a picture of places says more than its name."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # of equilibria that are nowhere
        span = (place.max(x) - place.min(x)).max()
    return bool(span > LEVEL * np.abs(place).max())


def _is_level(one):
    """Whether ω² is the same everywhere in units of its scale, so that colours would say nothing."""
    known = one["measured"].values[np.isfinite(one["measured"].values)]
    return known.size > 0 and np.ptp(known) <= LEVEL * np.abs(known).max()


def _law(ax, one, x, y):
    """The measured rate as dots on theory's lines over x, at a few values of y: where ω² over its scale is constant."""
    some = np.unique(np.linspace(0, one.sizes[y] - 1, MOST_CURVES).round().astype(int))
    every = style.few(one.sizes[x], 24)
    logarithmic = style.is_logarithmic(one[x].values)
    ends = np.abs(one["omega_squared_theory"].isel({y: some, x: [0, -1]}).transpose(x, y).values)
    with np.errstate(all="ignore"):
        spread = np.nan_to_num(ends.max(axis=1) / ends.min(axis=1))
    side, end = ("left", 0) if spread[0] > spread[1] else ("right", -1)  # where the curves are farther apart
    for number, k in enumerate(some):
        row = one.isel({y: int(k)})
        measured, theory = (np.sqrt(np.abs(row[name].values)) for name in ("omega_squared", "omega_squared_theory"))
        ax.plot(
            row[x].values, theory, color=colors.INK, linewidth=0.9, gid="theory", label="theory" if not number else None
        )
        regime = REGIMES[1 + int(np.bincount(np.maximum(row["regime"].values, 0)).argmax())]
        look = {"linestyle": "none", "marker": "o", "markersize": 3.4, "markeredgewidth": 0.0, "gid": regime}
        ax.plot(
            row[x].values[every], measured[every], color=COLORS[regime], label=regime if not number else None, **look
        )
        text = style.with_unit(f"{y} = {style.number(float(row[y]), 3)}", one[y].attrs.get("units", "1"))
        look = {"textcoords": "offset points", "ha": side, "fontsize": 7, "path_effects": style.halo()}
        is_below = _crowded(np.sqrt(ends[end]), number, logarithmic)
        offset = (2 if side == "left" else -2, -3 if is_below else 3)
        look |= {"va": "top" if is_below else "bottom"}
        ax.annotate(text, (row[x].values[end], theory[end]), offset, **look)
    if logarithmic:
        ax.set(yscale="log")
    ax.margins(y=0.12)
    style.scale_as_spread(ax.xaxis, one[x].values)
    ax.set(xlabel=style.label_of(one, x), ylabel=f"measured rate  ({style.units('rad s-1')})")


def _crowded(values, number, logarithmic):
    """Whether a curve's end is so near to the one above it, and not to one below, that a name has no room between."""
    with np.errstate(all="ignore"):
        at = np.log(values) if logarithmic else values
    away = (at - at[number]) / (np.ptp(at) or 1.0)
    above, below = away[away > 0].min(initial=np.inf), -away[away < 0].max(initial=-np.inf)
    return bool(above < LEAST_ROOM < below)


def _few_dots(rows, columns):
    """Places of at most some `MOST_DOTS` dots: all, or those on every k-th row and column."""
    every = math.ceil(math.sqrt(rows.size / MOST_DOTS)) if rows.size > MOST_DOTS else 1
    kept = (rows % every == 0) & (columns % every == 0)
    return rows[kept], columns[kept]


def _lines(ax, one, x):
    """Measured signed ω² as dots on theory's line, where one parameter varies."""
    at, (theory, measured, regime) = (
        one[x].values,
        (one[name].values.ravel() for name in ("theory", "measured", "regime")),
    )
    ax.axhline(0.0, color=colors.FAINT, linewidth=0.8)
    ax.plot(at, theory, color=colors.INK, linewidth=0.9, gid="theory", label="theory")
    for k, name in enumerate(REGIMES[1:]):
        chosen = regime == k
        look = {"linestyle": "none", "marker": "o", "markersize": 3.0, "markeredgewidth": 0.0}
        if chosen.any():
            ax.plot(at[chosen], measured[chosen], color=COLORS[name], gid=name, label=name, **look)
    style.scale_as_spread(ax.xaxis, at)
    ax.set(xlabel=style.label_of(one, x), ylabel=r"$\omega^2$ / rate scale$^2$")
    return None


def _places(ax, part, name, x, y):
    """Where the equilibria are, over x in the middle of y: stable ones in one colour, unstable ones in another."""
    row = part.isel({y: part.sizes[y] // 2}) if y else part
    row = row.isel(mode=0)
    line = {"color": colors.INK, "linewidth": 1.0, "gid": "place"}
    told = (("-", "stable"), ((0, (4, 2)), "unstable")) if "regime_theory" in row else ()
    for k, (dash, word) in enumerate(told):
        for e in row["equilibrium"].values:
            one = row.sel(equilibrium=e)
            there = np.where(one["regime_theory"].values == k, one[name].values, np.nan)
            if np.isfinite(there).any():
                ax.plot(one[x].values, there, linestyle=dash, label=f"theory: {word}", **line)
    for k, regime in enumerate(REGIMES[1:]):
        for e in row["equilibrium"].values:
            one = row.sel(equilibrium=e)
            chosen = one["regime"].values == k
            look = {"linestyle": "none", "marker": "o", "markersize": 2.6, "markeredgewidth": 0.0}
            if chosen.any():
                look |= {"color": COLORS[regime], "gid": regime, "label": regime}
                ax.plot(one[x].values[chosen], one[name].values[chosen], **look)
    style.scale_as_spread(ax.xaxis, row[x].values)
    title = "places" if not y else f"equilibria, {_fixed(part, y)}"
    ax.set_title(title, loc="left")
    unit = style.units(part[name].attrs.get("units", "1"))
    ax.set(xlabel=style.label_of(part, x), ylabel=name.removesuffix("_equilibrium") + (f"  ({unit})" if unit else ""))


def _missing(figure, part):
    """What stands for cells without a value, where there are any."""
    meshes = [artist for ax in figure.axes for artist in ax.collections if artist.get_gid() == "measured"]
    if any(np.ma.getmaskarray(mesh.get_array()).any() for mesh in meshes):
        codes = np.unique(part["status"].values[np.isnan(part["measured"].values)])
        return [Patch(facecolor=MISSING, label=missing_words(codes))]
    return []


def draw_agreement(ds: xr.Dataset, ax: Axes | None = None) -> Figure | None:
    """Draw deviations of the measured ω² from theory: over their errors (top), relative (bottom); None without a point.

    Below over the size of ω² beside the scale, each with its error as a dash.
    """
    names = ("omega_squared", "omega_squared_theory", "omega_squared_error", "rate_scale", "regime")
    stride = max(1, math.ceil(ds["omega_squared"].size / MOST_POINTS))
    measured, theory, error, scale, regime = (ds[name].values.ravel()[::stride] for name in names)
    epsilon = ds["epsilon"].broadcast_like(ds["omega_squared"]).transpose(*ds["omega_squared"].dims)
    with np.errstate(all="ignore"):
        size, deviation = np.abs(theory) / scale**2, np.abs(measured / theory - 1.0)
        ratio = np.where(measured == theory, 0.0, np.abs(measured - theory) / error)
    known = np.isfinite(size) & np.isfinite(deviation) & (size > 1e-12)
    if not known.any():
        return None
    promised = known & (size >= LEAST_RATE)
    worst = deviation[promised].max() if promised.any() else math.nan
    found = f"largest where ω² ≥ 10⁻³ scale²: {style.number(float(worst), 2)}" if promised.any() else ""
    figure = style.canvas(6.4, 6.6, ds.attrs.get("title", ""), f"Measured ω² against theory;  {found}", 0.36, ax=ax)
    upper, ax = figure.subplots(2, 1, height_ratios=(1.0, 1.5))
    upper.set(xscale="log", ylabel="points", xlabel="deviation from theory / error  (dimensionless)")
    ratios.draw(upper, ratio[known], epsilon.values.ravel()[::stride][known], colors.STABLE)
    with np.errstate(all="ignore"):
        bars = np.maximum(error / np.abs(theory), LEAST_DRAWN)
    dash = {"linestyle": "none", "marker": "_", "markersize": 4, "color": ratios.ERROR, "rasterized": True}
    ax.plot(size[known], bars[known], gid="error", label="error", zorder=1, **dash)
    _draw_deviations(ax, size, deviation, known, regime)
    style.legend(figure)
    return figure


def _draw_deviations(ax: Axes, size, deviation, known, regime) -> None:
    """Relative deviations over the size of ω², and their tolerance."""
    for k, name in enumerate(REGIMES[1:]):
        chosen = known & (regime == k)
        look = {"linestyle": "none", "marker": "o", "markersize": 2.2, "markeredgewidth": 0.0, "alpha": 0.4}
        drawn = np.clip(deviation[chosen], LEAST_DRAWN, MOST_DEVIATION)
        if chosen.any():
            ax.plot(size[chosen], drawn, color=COLORS[name], gid=name, label=name, rasterized=True, **look)
    ends = (LEAST_RATE, max(2.0, size[known].max()))
    ax.plot(
        ends, (PROMISED, PROMISED), color=colors.INK, linewidth=1.0, linestyle=(0, (4, 2)), gid="bar", label="tolerance"
    )
    most = min(max(1e-5, 3 * deviation[known].max()), MOST_DEVIATION)
    ax.set(xscale="log", yscale="log", ylim=(LEAST_DRAWN / 2, most))
    ax.set_xlabel(r"$|\omega^2|$ of theory / rate scale$^2$  (dimensionless)")
    ax.set_ylabel(r"$|\,\omega^2\,/\,\omega^2_\mathrm{theory} - 1\,|$  (dimensionless)")
    ax.grid(axis="y", color=colors.FAINT, linewidth=0.5, alpha=0.7)
    ax.set_axisbelow(True)
