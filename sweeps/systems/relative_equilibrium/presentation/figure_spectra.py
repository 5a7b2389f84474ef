"""Stability maps of relative equilibria: measured regimes and growth in colours, with theory's boundary."""

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm, Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from sweeps.figure import axis_scales, canvas, colors, marks, sheets, wording
from sweeps.systems.bodies.presentation import attitude_regions
from sweeps.systems.presentation import longest_parameters, planes
from sweeps.systems.presentation.appearance import missing_words
from sweeps.systems.presentation.regimes import Regimes, draw_points, regimes_with_rate, round_up
from sweeps.systems.presentation.sentences import head_texts
from sweeps.systems.relative_equilibrium.presentation import APPEARANCE
from sweeps.systems.relative_equilibrium.system import REGIMES

MAX_PANELS = 6  # panels that fit a page
MAX_LINEAR_RATIO = 20.0  # largest frequency over the least; beyond, colours are spaced by ratio
MIN_GROWTH = 1e-9  # growth over the rate scale that is drawn; less is rounding
ROUNDING = 1e-12  # rounding error of a margin, relative to its largest value
MISSING_WORDS = {"steady_precession": "too slow: no steady precession"}  # system → reason for points without a value
GUIDES = {  # (system, parameter of the ordinate) → further parameter, at the value of which a line is drawn → its words
    ("gyrostat", "I2"): {"I1": "$I_2 = I_1$, below: least", "I3": "$I_2 = I_3$, above: greatest"}
}
STABLE_REGIMES = ("asymptotically_stable", "stable", "marginal")  # regimes inside theory's boundary
STABLE_CODES = [REGIMES.index(name) - 1 for name in STABLE_REGIMES]  # codes in a map, which begin at -1


def draw(ds: xr.Dataset, ax: Axes | None = None) -> Figure:
    """Draw a panel for each equilibrium and for both ends and the middle of a third parameter, without equal panels.

    If nothing grows or decays in any panel, colours are angular frequencies; a panel of one colour is described in
    words.
    """
    x, y, third = longest_parameters(ds["growth_rate"], ("equilibrium", "eigenvalue"))
    subset = _select_planes(ds, x, y, third)
    top = round_up(np.abs(subset["growth"].values)) if y else 0.0
    panels, uniform_panels = _split_panels(ds, subset, third, top)
    words = "\n".join([planes.subtitle(ds, subset, ds["growth_rate"], APPEARANCE), *uniform_panels])
    texts = (ds.attrs.get("title", ""), words) if ds.attrs["system"] == "foucault" else head_texts(ds, words=words)
    figure, axes = canvas.make_panels(len(panels), (3.9, 3.2), *texts, ax)
    regimes = Regimes(REGIMES, APPEARANCE, top)
    for ax, (title, panel) in zip(axes, panels, strict=True):
        ax.set_title(title, loc="left")
        if not y:
            _draw_over_one(ax, panel, x)
        elif top:
            _draw_map(ax, panel, x, y, regimes)
        else:
            mesh = _draw_frequencies(ax, panel, x, y, subset["frequencies"].values)
    handles = []
    if y and not top:
        words = f"measured angular frequency  ({wording.format_units('rad s-1')})"
        figure.colorbar(mesh, ax=list(axes), label=words, aspect=30, pad=0.02)
        if (codes := np.unique(subset["status"].values[np.isnan(subset["frequencies"].values)])).size:
            handles = [
                Patch(facecolor=colors.MISSING, label=MISSING_WORDS.get(ds.attrs["system"]) or missing_words(codes))
            ]
    regimes.explain(figure, axes, f"growth or decay rate  ({wording.format_units('s-1')})", handles)
    return figure


def _split_panels(ds, subset, third, top):
    """Return (title, content) of the panels, equal panels once, and lines of words for panels of one colour."""
    panels = []
    for e in subset["equilibrium"].values:
        for z in subset[third].values if third else [None]:
            panel = subset.sel(equilibrium=e) if z is None else subset.sel({"equilibrium": e, third: z})
            names = [str(e).replace("_", " ")] if subset.sizes["equilibrium"] > 1 else []
            panels.append((",  ".join(names + ([wording.format_coordinate(ds, third, z)] if third else [])), panel))
    drawn_panels, uniform_panels = [], []
    for title, panel in planes.merge_equal(panels, ("regime", "shade")):
        codes = np.unique(panel["regime"].values)
        if top and codes.size == 1 and not panel["growth"].values.any():
            uniform_panels.append(f"{title}: {APPEARANCE.words(REGIMES[int(codes[0]) + 1])} everywhere")
        else:
            drawn_panels.append((title, panel))
    return drawn_panels[:MAX_PANELS], uniform_panels


def _select_planes(ds, x, y, third):
    """Select both ends and the middle of a third dimension, and the middle of every dimension but x and y."""
    names = ["growth_rate", "growth_rate_theory", "rate_scale", "regime", "regime_theory", "status"]
    indices = planes.cut_indices(ds["growth_rate"], (x, y), (third, "equilibrium", "eigenvalue"))
    if third:
        indices[third] = sorted({0, ds.sizes[third] // 2, ds.sizes[third] - 1})
    subset = ds[names].isel(indices | {"eigenvalue": 0}).load()
    real, imag = (ds[f"eigenvalue_{name}_theory"].isel(indices) for name in ("real", "imag"))
    frequencies = np.abs(ds["eigenvalue_imag"].isel(indices)).max("eigenvalue")
    is_drawn = np.abs(subset["growth_rate"]) > MIN_GROWTH * subset["rate_scale"]
    growth = subset["growth_rate"].where(is_drawn & np.isin(subset["regime"], regimes_with_rate(REGIMES)), 0.0)
    shade = (frequencies + growth) / (np.nanmax(frequencies.values, initial=0.0) or 1.0)
    return subset.assign(growth=growth, frequencies=frequencies, shade=shade, eigenvalues=real + 1j * imag)


def _draw_frequencies(ax, panel, x, y, all_frequencies):
    """Draw measured frequencies in colours, whose scale suits the frequencies of all panels."""
    edges = axis_scales.cell_edges(panel[x].values), axis_scales.cell_edges(panel[y].values)
    values = np.ma.masked_invalid(panel["frequencies"].transpose(y, x).values)
    palette = sheets.color_map("size").with_extremes(bad=colors.MISSING)
    low, high = (f(all_frequencies, initial=start) for f, start in ((np.nanmin, np.inf), (np.nanmax, 0.0)))
    norm = LogNorm(low, high) if high > MAX_LINEAR_RATIO * low > 0.0 else Normalize(0.0, round_up(high))
    planes.label_axes(ax, panel, x, y)
    return ax.pcolormesh(*edges, values, cmap=palette, norm=norm, rasterized=True, gid="frequency")


def _draw_map(ax, panel, x, y, regimes):
    """Draw measured regimes in colours, deeper for faster growth or decay, and theory's boundary as a line."""
    panel = panel.transpose(..., y, x)
    edges = axis_scales.cell_edges(panel[x].values), axis_scales.cell_edges(panel[y].values)
    regimes.paint(ax, *edges, *(panel[name].values for name in ("regime", "growth", "status")))
    planes.label_axes(ax, panel, x, y)
    if panel.attrs["system"] in ("gravity_gradient", "gravity_gradient_damped"):
        return attitude_regions.draw(ax, x, panel.attrs["system"] == "gravity_gradient_damped")
    for margin in _stability_functions(panel):
        rounding = ROUNDING * np.nanmax(np.abs(margin), initial=0.0)
        planes.boundary(ax, panel[x].values, panel[y].values, margin, rounding, "boundary by theory")
    for name, words in GUIDES.get((panel.attrs["system"], y), {}).items():
        ax.axhline(float(panel[name]), color=colors.INK, lw=0.9, ls=":", gid="guide")
        props = {"xycoords": ax.get_yaxis_transform(), "path_effects": marks.halo(), "fontsize": 8}
        marks.annotate(ax, words, (0.0, float(panel[name])), (4, 3), **props)


def _stability_functions(panel):
    """Return two arrays of the panel's shape that change sign, smoothly, at theory's boundary of stability.

    Both are NaN at points that are neither stable by theory nor a neighbour, in the grid, of a stable point.
    The first is the product of all eigenvalues. The second is the product of the sums of two of them (Orlando's
    formula); for pairs ±λ it is the discriminant of λ², a determinant of power sums.
    """
    is_stable = np.isin(panel["regime_theory"].values, STABLE_CODES)
    growth, scale = panel["growth_rate_theory"].values, panel["rate_scale"].values
    eigenvalues = panel["eigenvalues"].transpose("eigenvalue", ...).values / scale
    n = len(eigenvalues)
    if np.nanmin(growth / scale, initial=0.0) < -1e-9:
        pair_product = np.prod([eigenvalues[i] + eigenvalues[j] for i in range(n) for j in range(i)], axis=0).real
    else:
        sums = np.array([(eigenvalues ** (2 * k)).sum(axis=0).real / 2 for k in range(n - 1)])
        hankel = sums[np.add.outer(np.arange(n // 2), np.arange(n // 2))]
        pair_product = np.linalg.det(np.moveaxis(hankel, (0, 1), (-2, -1)))
    neighbourhood = (3,) * is_stable.ndim
    near_stable = np.lib.stride_tricks.sliding_window_view(np.pad(is_stable, 1), neighbourhood).any(
        tuple(range(-is_stable.ndim, 0))
    )
    return [np.where(near_stable, margin, np.nan) for margin in (eigenvalues.prod(axis=0).real, pair_product)]


def _draw_over_one(ax, panel, x):
    """Draw the measured growth rate as dots on theory's line over the only parameter that varies."""
    values = panel[x].values
    ax.axhline(0.0, color=colors.FAINT, lw=0.8)
    ax.plot(values, panel["growth_rate_theory"].values, color=colors.INK, lw=0.9, gid="theory", label="theory")
    for margin in _stability_functions(panel):
        for k in np.flatnonzero(margin[1:] * margin[:-1] < 0.0):
            limit = values[k] - margin[k] * (values[k + 1] - values[k]) / (margin[k + 1] - margin[k])
            ax.axvline(limit, color=colors.QUIET, lw=0.9, ls=(0, (4, 2)), gid="limit")
            props = {"xycoords": ax.get_xaxis_transform(), "va": "top", "ha": "right"}
            marks.annotate(ax, f"theory: {wording.format_number(limit, 4)}", (limit, 0.97), (-5, 0), **props)
    draw_points(ax, values, panel["growth_rate"].values, panel["regime"].values, REGIMES[1:], APPEARANCE, ms=3.0)
    axis_scales.set_scale(ax.xaxis, values)
    ax.set(xlabel=wording.axis_label(panel, x), ylabel=f"growth rate, below 0 decay  ({wording.format_units('s-1')})")
