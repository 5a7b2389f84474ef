"""Stability maps of relative equilibria: measured regimes and growth in colours, theory's boundary on top."""

import math
from functools import partial

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from kernels.statuses import STATUSES
from sweeps.figure import colors, style
from sweeps.systems.presentation.look import missing_words
from sweeps.systems.relative_equilibrium.presentation.look import LOOK
from sweeps.systems.relative_equilibrium.variables import REGIMES

MOST_DRAWN = 400  # values a dimension
MOST_PANELS = 6
MOST_POINTS = 40_000
SHADES = 6  # of a regime's colour, by the size of the growth rate
MISSING = "#e6e6e6"
LEAST_DRAWN = 1e-17
ROUNDING = 1e-12  # of a margin's largest: what is below is no sign
HATCHES = {"asymptotically_stable": "....", "unstable": "////", "flutter": "xxxx"}  # on paper: shades tell the rates
STEADY = ("asymptotically_stable", "stable", "marginal")  # regimes inside theory's boundary


def draw(ds: xr.Dataset, ax: Axes | None = None) -> Figure:
    """Draw a panel for every equilibrium and for the ends of the range of a third parameter."""
    x, y, third = _axes_of(ds)
    part = _thinned(ds, x, y, third)
    others = part[third].values if third else [None]
    panels = [(e, z) for e in part["equilibrium"].values for z in others][:MOST_PANELS]
    columns = min(3 if len(panels) in (3, 5, 6) else 2, len(panels))
    rows = math.ceil(len(panels) / columns)
    size = (1.2 + 3.9 * columns, 1.6 + 3.2 * rows)
    subtitle = style.wrapped(_subtitle(ds, part, third), size[0])
    figure = style.canvas(*size, ds.attrs.get("title", ""), subtitle, 0.36, ax=ax)
    axes = np.atleast_1d(figure.subplots(rows, columns)).ravel()
    for ax, (e, z) in zip(axes, panels, strict=False):
        one = part.sel(equilibrium=e)
        one = one.sel({third: z}) if third else one
        told = [str(e).replace("_", " ")] if part.sizes["equilibrium"] > 1 else []
        told += [style.fixed_at(ds, third, z)] if third else []
        ax.set_title(",  ".join(told), loc="left")
        if y:
            _map(ax, one, x, y)
        else:
            _lines(ax, one, x)
    for ax in axes[len(panels) :]:
        ax.set_axis_off()
    style.legend(figure, _kinds(figure, part))
    return figure


def _axes_of(ds):
    """The dimensions of the picture: the two longest parameters, as the page has them, and a third if one varies."""
    names = [d for d in ds["growth_rate"].dims if d not in ("equilibrium", "eigenvalue")]
    varied = sorted((d for d in names if ds.sizes[d] > 1), key=lambda d: -ds.sizes[d])
    if not varied:
        return names[0], None, None
    if len(varied) == 1:
        return varied[0], None, None
    x, y = sorted(varied[:2], key=names.index)
    return x, y, varied[2] if len(varied) > 2 else None


def _thinned(ds, x, y, third):
    """What is drawn: the middle of every other dimension, at most MOST_DRAWN values of these, both ends of a third."""
    names = ["growth_rate", "growth_rate_theory", "rate_scale", "regime", "regime_theory", "status"]
    names += [n for n in ("sum_of_squares_theory", "product_of_squares_theory", "discriminant_theory") if n in ds]
    kept = (x, y, third, "equilibrium", "eigenvalue")
    few = {d: style.few(ds.sizes[d], MOST_DRAWN) for d in (x, y) if d}
    few |= {d: ds.sizes[d] // 2 for d in ds["growth_rate"].dims if d not in kept}
    if third:
        few[third] = sorted({0, ds.sizes[third] // 2, ds.sizes[third] - 1})
    return ds[names].isel(few | {"eigenvalue": 0}).load()


def _subtitle(ds, part, third):
    motions = ds["status"].isel(eigenvalue=0)
    counts = np.bincount(motions.values.ravel(), minlength=len(STATUSES))
    words = " · ".join(f"{n:,} {LOOK.words(name)}" for name, n in zip(STATUSES, counts, strict=True) if n)
    fixed = [d for d in ds["growth_rate"].dims if d not in part.dims and d != "eigenvalue"]
    values = ", ".join(style.fixed_at(ds, d, float(ds[d].values[ds.sizes[d] // 2])) for d in fixed if d != "epsilon")
    text = f"{style.count(int(motions.size), 'equilibrium', 'equilibria')}:  {words}"
    return f"{text}\nDrawn at  {values}" if values else text


def _map(ax, one, x, y):
    """Measured regimes in colours, the deeper the faster they grow or decay; theory's boundary as a line."""
    one = one.transpose(y, x)
    table = style.Shades([LOOK.color(name) for name in REGIMES[1:]], SHADES).with_extremes(bad=MISSING)
    regime = one["regime"].values
    with np.errstate(all="ignore"):
        size = np.abs(one["growth_rate"].values) / one["rate_scale"].values
        depth = size / np.nanmax(np.where(regime >= 0, size, 0.0), initial=1e-300)
    depth = np.where(np.isin(regime, (1, 4)), 1.0, np.sqrt(np.nan_to_num(depth)))  # stable, marginal: no rate
    code = np.ma.masked_where(regime < 0, regime * SHADES + np.minimum((depth * SHADES).astype(int), SHADES - 1))
    edges = style.edges(one[x].values), style.edges(one[y].values)
    norm = BoundaryNorm(np.arange(table.N + 1) - 0.5, table.N)
    ax.pcolormesh(*edges, code, cmap=table, norm=norm, rasterized=True, gid="measured")
    style.on_paper(ax.figure, partial(_hatch, ax, one[x].values, one[y].values, regime))
    for margin in _margins(one):
        rounding = ROUNDING * np.nanmax(np.abs(margin), initial=0.0)
        if np.nanmin(margin, initial=0.0) < -rounding and np.nanmax(margin, initial=0.0) > rounding:
            look = {"levels": [0.0], "colors": colors.INK, "linewidths": 1.1}
            line = ax.contour(one[x].values, one[y].values, margin, **look)
            line.set(gid="theory", path_effects=style.halo(2.2))
            ax.plot([], [], color=colors.INK, linewidth=1.1, label="theory's boundary")
    style.scale_as_spread(ax.xaxis, one[x].values)
    style.scale_as_spread(ax.yaxis, one[y].values)
    ax.set(xlabel=style.label_of(one, x), ylabel=style.label_of(one, y))


def _hatch(ax, x, y, regime):
    """Hatches regimes, in a panel and in the legend: in grey, a colour's shades are those of any other."""
    told = {LOOK.words(name): hatch for name, hatch in HATCHES.items()}
    for k, name in enumerate(REGIMES[1:]):
        chosen = (regime == k).astype(float)
        if name in HATCHES and chosen.any() and min(chosen.shape) > 1:
            ax.contourf(x, y, chosen, [0.5, 1.5], colors="none", hatches=[HATCHES[name]])
    for legend in ax.figure.legends:
        for text, handle in zip(legend.get_texts(), legend.legend_handles, strict=True):
            if text.get_text() in told and isinstance(handle, Patch):
                handle.set(hatch=told[text.get_text()], edgecolor=colors.INK, linewidth=0.0)


def _margins(one):
    """Numbers of theory that change sign where it stops being stable, smooth where they can be."""
    steady = np.isin(one["regime_theory"].values, [REGIMES.index(name) - 1 for name in STEADY])
    if "discriminant_theory" in one:
        total, product, discriminant = (
            one[f"{name}_theory"].values for name in ("sum_of_squares", "product_of_squares", "discriminant")
        )
        by_pairs = (total < 0) & (product > 0) & (discriminant > 0)
        if (by_pairs == steady).mean() > 0.95:  # D = 0 or S² = 4D bounds what is stable, and no more beyond it
            beside = np.lib.stride_tricks.sliding_window_view(np.pad(by_pairs, 2), (5, 5)).any((2, 3))
            return [np.where(beside, part, np.nan) for part in (product, discriminant)]
    growth = one["growth_rate_theory"].values / one["rate_scale"].values
    if np.nanmin(growth, initial=0.0) < -1e-9:
        return [-growth]
    return [np.where(one["regime_theory"].values < 0, np.nan, np.where(steady, 1.0, -1.0))]


def _lines(ax, one, x):
    """The measured growth rate as dots on theory's line, where one parameter varies."""
    at = one[x].values
    ax.axhline(0.0, color=colors.FAINT, linewidth=0.8)
    ax.plot(at, one["growth_rate_theory"].values, color=colors.INK, linewidth=0.9, gid="theory", label="theory")
    for k, name in enumerate(REGIMES[1:]):
        chosen = one["regime"].values == k
        look = {"linestyle": "none", "marker": "o", "markersize": 3.0, "markeredgewidth": 0.0}
        if chosen.any():
            look |= {"color": LOOK.color(name), "gid": name, "label": LOOK.words(name)}
            ax.plot(at[chosen], one["growth_rate"].values[chosen], **look)
    style.scale_as_spread(ax.xaxis, at)
    ax.set(xlabel=style.label_of(one, x), ylabel=f"growth rate, below 0 decay  ({style.units('s-1')})")


def _kinds(figure, part):
    """What stands for each regime in the maps, and for cells without one."""
    meshes = [artist for ax in figure.axes for artist in ax.collections if artist.get_gid() == "measured"]
    codes = [np.ma.asarray(mesh.get_array()) for mesh in meshes]
    drawn = {REGIMES[1 + int(code) // SHADES] for mesh in codes for code in np.unique(mesh.compressed())}
    handles = [Patch(facecolor=LOOK.color(name), label=LOOK.words(name)) for name in REGIMES[1:] if name in drawn]
    if any(np.ma.getmaskarray(mesh).any() for mesh in codes):
        codes = np.unique(part["status"].values[part["regime"].values < 0])
        handles.append(Patch(facecolor=MISSING, label=missing_words(codes)))
    return handles


def draw_agreement(ds: xr.Dataset, ax: Axes | None = None) -> Figure | None:
    """Draw the distance of measured eigenvalues from theory against their errors; None without a point."""
    names = ("eigenvalue_real", "eigenvalue_imag")
    stride = max(1, math.ceil(ds["regime"].size / MOST_POINTS))
    at = {n: ds[n].values.ravel()[::stride] for m in names for n in (m, f"{m}_theory", f"{m}_error")}
    scale, regime = (ds[n].values.ravel()[::stride] for n in ("rate_scale", "regime"))
    with np.errstate(all="ignore"):
        off = np.hypot(*(at[n] - at[f"{n}_theory"] for n in names)) / scale
        error = np.hypot(*(at[f"{n}_error"] for n in names)) / scale
    known = np.isfinite(off) & np.isfinite(error) & (error > 0)
    if not known.any():
        return None
    covered = float((off[known] <= error[known]).mean())
    told = f"{100 * covered:.2f} % of {known.sum():,} within their errors"
    figure = style.canvas(
        6.4, 4.6, ds.attrs.get("title", ""), f"Measured eigenvalues against theory;  {told}", 0.36, ax=ax
    )
    ax: Axes = figure.subplots()
    for k, name in enumerate(REGIMES[1:]):
        chosen = known & (regime == k)
        look = {"linestyle": "none", "marker": "o", "markersize": 2.2, "markeredgewidth": 0.0, "alpha": 0.4}
        if chosen.any():
            look |= {"color": LOOK.color(name), "gid": name, "label": LOOK.words(name), "rasterized": True}
            ax.plot(error[chosen], np.maximum(off[chosen], LEAST_DRAWN), **look)
    ends = (error[known].min() / 2, error[known].max() * 2)
    ax.plot(ends, ends, color=colors.INK, linewidth=1.0, linestyle=(0, (4, 2)), gid="bar", label="reported error")
    ax.set(xscale="log", yscale="log", xlim=ends, ylim=(LEAST_DRAWN / 2, max(ends[1], 1e-12)))
    ax.set_xlabel("reported error / rate scale  (dimensionless)")
    ax.set_ylabel("distance from theory / rate scale  (dimensionless)")
    ax.grid(axis="y", color=colors.FAINT, linewidth=0.5, alpha=0.7)
    ax.set_axisbelow(True)
    style.legend(figure)
    return figure
