"""Stability maps of relative equilibria: measured regimes and growth in colours, theory's boundary on top."""

import math

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from kernels.statuses import STATUSES
from sweeps.figure import colors, style
from sweeps.systems.presentation.regimes import Regimes, at_most
from sweeps.systems.relative_equilibrium.presentation.look import LOOK
from sweeps.systems.relative_equilibrium.variables import REGIMES

MOST_DRAWN = 400  # values a dimension
MOST_PANELS = 6
MOST_POINTS = 40_000
LEAST_DRAWN = 1e-17
ROUNDING = 1e-12  # of a margin's largest: what is below is no sign
SHADED = ("asymptotically_stable", "unstable", "flutter")  # regimes that have a rate
STEADY = ("asymptotically_stable", "stable", "marginal")  # regimes inside theory's boundary


def draw(ds: xr.Dataset, ax: Axes | None = None) -> Figure:
    """Draw a panel for every equilibrium and for the ends of the range of a third parameter."""
    x, y, third = _axes_of(ds)
    part = _thinned(ds, x, y, third)
    others = part[third].values if third else [None]
    panels = [(e, z) for e in part["equilibrium"].values for z in others][:MOST_PANELS]
    rows, columns, size = style.arranged(len(panels), (3.9, 3.2))
    figure = style.canvas(*size, ds.attrs.get("title", ""), _subtitle(ds, part, third), ax=ax)
    axes = np.ravel(figure.subplots(rows, columns))
    regimes = Regimes(REGIMES, LOOK, at_most(np.abs(part["relative"].values)) if y else 0.0)
    for ax, (e, z) in zip(axes, panels, strict=False):
        one = part.sel(equilibrium=e)
        one = one.sel({third: z}) if third else one
        told = [str(e).replace("_", " ")] if part.sizes["equilibrium"] > 1 else []
        told += [style.fixed_at(ds, third, z)] if third else []
        ax.set_title(",  ".join(told), loc="left")
        if y:
            _map(ax, one, x, y, regimes)
        else:
            _lines(ax, one, x)
    for ax in axes[len(panels) :]:
        ax.set_axis_off()
    regimes.explain(figure, axes[: len(panels)], "growth or decay / rate scale")
    return figure


def _axes_of(ds):
    """The dimensions of the picture: the two longest parameters, the later one along x, and a third if one varies."""
    names = [d for d in ds["growth_rate"].dims if d not in ("equilibrium", "eigenvalue")]
    varied = sorted((d for d in names if ds.sizes[d] > 1), key=lambda d: -ds.sizes[d])
    if not varied:
        return names[0], None, None
    if len(varied) == 1:
        return varied[0], None, None
    y, x = sorted(varied[:2], key=names.index)
    return x, y, varied[2] if len(varied) > 2 else None


def _thinned(ds, x, y, third):
    """What is drawn: the middle of every other dimension, at most MOST_DRAWN values of these, both ends of a third."""
    names = ["growth_rate", "growth_rate_theory", "rate_scale", "regime", "regime_theory", "status"]
    kept = (x, y, third, "equilibrium", "eigenvalue")
    few = {d: style.few(ds.sizes[d], MOST_DRAWN) for d in (x, y) if d}
    few |= {d: ds.sizes[d] // 2 for d in ds["growth_rate"].dims if d not in kept}
    if third:
        few[third] = sorted({0, ds.sizes[third] // 2, ds.sizes[third] - 1})
    part = ds[names].isel(few | {"eigenvalue": 0}).load()
    shaded = np.isin(part["regime"].values, [REGIMES.index(name) - 1 for name in SHADED])
    real, imag = (ds[f"eigenvalue_{name}_theory"].isel(few) for name in ("real", "imag"))
    relative = (part["growth_rate"] / part["rate_scale"]).where(shaded, 0.0)
    return part.assign(relative=relative, eigenvalues=real + 1j * imag)


def _subtitle(ds, part, third):
    motions = ds["status"].isel(eigenvalue=0)
    counts = np.bincount(motions.values.ravel(), minlength=len(STATUSES))
    words = " · ".join(f"{n:,} {LOOK.words(name)}" for name, n in zip(STATUSES, counts, strict=True) if n)
    fixed = [d for d in ds["growth_rate"].dims if d not in part.dims and d != "eigenvalue"]
    values = ", ".join(style.fixed_at(ds, d, float(ds[d].values[ds.sizes[d] // 2])) for d in fixed if d != "epsilon")
    text = f"{style.count(int(motions.size), 'equilibrium', 'equilibria')}:  {words}"
    return f"{text}\nDrawn at  {values}" if values else text


def _map(ax, one, x, y, regimes):
    """Measured regimes in colours, the deeper the faster they grow or decay; theory's boundary as a line."""
    one = one.transpose(..., y, x)
    values = (one[name].values for name in (x, y, "regime", "relative", "status"))
    regimes.paint(ax, *values)
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


def _margins(one):
    """Numbers of theory that change sign where it stops being stable, smooth where they can be.

    With eigenvalues in pairs ±λ the motion is stable where all λ² are real and negative. Power sums of λ² are smooth
    where single ones are not, and the determinant of their Hankel matrix is the discriminant.
    """
    growth = one["growth_rate_theory"].values / one["rate_scale"].values
    if np.nanmin(growth, initial=0.0) < -1e-9:
        return [-growth]
    steady = np.isin(one["regime_theory"].values, [REGIMES.index(name) - 1 for name in STEADY])
    eigenvalues = one["eigenvalues"].values / one["rate_scale"].values
    m = len(eigenvalues) // 2
    sums = np.array([(eigenvalues ** (2 * k)).sum(axis=0).real / 2 for k in range(2 * m - 1)])
    hankel = sums[np.add.outer(np.arange(m), np.arange(m))]
    margins = [eigenvalues.prod(axis=0).real, np.linalg.det(np.moveaxis(hankel, (0, 1), (-2, -1)))]
    beside = np.lib.stride_tricks.sliding_window_view(np.pad(steady, 2), (5, 5)).any((2, 3))
    return [np.where(beside, margin, np.nan) for margin in margins]


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
    figure = style.canvas(6.4, 4.6, ds.attrs.get("title", ""), f"Measured eigenvalues against theory;  {told}", ax=ax)
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
    ax.set_xlabel("reported error / rate scale ")
    ax.set_ylabel("distance from theory / rate scale ")
    ax.grid(axis="y", color=colors.FAINT, linewidth=0.5, alpha=0.7)
    ax.set_axisbelow(True)
    style.legend(figure)
    return figure
