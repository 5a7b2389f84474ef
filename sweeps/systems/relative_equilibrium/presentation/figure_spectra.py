"""Stability maps of relative equilibria: measured regimes and growth in colours, theory's boundary on top."""

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sweeps.figure import axis_scales, canvas, colors, marks, sheets, wording
from sweeps.systems.presentation import planes
from sweeps.systems.presentation.regimes import Regimes, draw_points, regimes_with_rate, round_up
from sweeps.systems.relative_equilibrium.presentation import APPEARANCE
from sweeps.systems.relative_equilibrium.system import REGIMES

MOST_PANELS = 6
ROUNDING = 1e-12  # of a margin's largest: what is below is no sign
STEADY = ("asymptotically_stable", "stable", "marginal")  # regimes inside theory's boundary


def draw(ds: xr.Dataset, ax: Axes | None = None) -> Figure:
    """Draw a panel for every equilibrium and for the ends of the range of a third parameter, without equal panels.

    Where nothing grows or decays in any panel, colours are angular frequencies; a panel of one colour is left out.
    """
    x, y, third = planes.sides(ds["growth_rate"], ("equilibrium", "eigenvalue"))
    part = _thinned(ds, x, y, third)
    top = round_up(np.abs(part["relative"].values)) if y else 0.0
    panels, plain = _panels(ds, part, third, top)
    subtitle = "\n".join([planes.subtitle(ds, part, ds["growth_rate"], APPEARANCE), *plain])
    figure, axes = canvas.make_panels(len(panels), (3.9, 3.2), ds.attrs.get("title", ""), subtitle, ax)
    regimes = Regimes(REGIMES, APPEARANCE, top)
    for ax, (title, one) in zip(axes, panels, strict=True):
        ax.set_title(title, loc="left")
        if not y:
            _lines(ax, one, x)
        elif top:
            _map(ax, one, x, y, regimes)
        else:
            mesh = _frequencies(ax, one, x, y, float(np.nanmax(part["frequencies"].values, initial=0.0)))
    if y and not top:
        words = f"measured angular frequency  ({wording.format_units('rad s-1')})"
        figure.colorbar(mesh, ax=list(axes), label=words, aspect=30, pad=0.02)
    regimes.explain(figure, axes, "growth or decay / rate scale")
    return figure


def _panels(ds, part, third, top):
    """Return titles and contents of the panels: equal ones once, those of one colour in words."""
    titled = []
    for e in part["equilibrium"].values:
        for z in part[third].values if third else [None]:
            one = part.sel(equilibrium=e) if z is None else part.sel({"equilibrium": e, third: z})
            named = [str(e).replace("_", " ")] if part.sizes["equilibrium"] > 1 else []
            titled.append((",  ".join(named + ([wording.format_coordinate(ds, third, z)] if third else [])), one))
    panels, plain = [], []
    for title, one in planes.merge_equal(titled, ("regime", "relative", "shade")):
        kinds = np.unique(one["regime"].values)
        if top and kinds.size == 1 and not one["relative"].values.any():
            plain.append(f"{title}: {APPEARANCE.words(REGIMES[int(kinds[0]) + 1])} everywhere")
        else:
            panels.append((title, one))
    return panels[:MOST_PANELS], plain


def _thinned(ds, x, y, third):
    """Select the middle of every other dimension, a few values of these, both ends of a third."""
    names = ["growth_rate", "growth_rate_theory", "rate_scale", "regime", "regime_theory", "status"]
    few = planes.cut_indices(ds["growth_rate"], (x, y), (third, "equilibrium", "eigenvalue"))
    if third:
        few[third] = sorted({0, ds.sizes[third] // 2, ds.sizes[third] - 1})
    part = ds[names].isel(few | {"eigenvalue": 0}).load()
    real, imag = (ds[f"eigenvalue_{name}_theory"].isel(few) for name in ("real", "imag"))
    frequencies = np.abs(ds["eigenvalue_imag"].isel(few)).max("eigenvalue")
    relative = (part["growth_rate"] / part["rate_scale"]).where(
        np.isin(part["regime"], regimes_with_rate(REGIMES)), 0.0
    )
    shade = frequencies / (np.nanmax(frequencies.values, initial=0.0) or 1.0)
    return part.assign(relative=relative, frequencies=frequencies, shade=shade, eigenvalues=real + 1j * imag)


def _frequencies(ax, one, x, y, most):
    """Draw measured frequencies in colours, of points that grow and decay nowhere; `most` is that of all panels."""
    edges = axis_scales.cell_edges(one[x].values), axis_scales.cell_edges(one[y].values)
    values = np.ma.masked_invalid(one["frequencies"].transpose(y, x).values)
    palette = sheets.color_map("size").with_extremes(bad=colors.MISSING)
    props = {"vmin": 0.0, "vmax": round_up(most) or most, "rasterized": True, "gid": "frequency"}
    planes.label_axes(ax, one, x, y)
    return ax.pcolormesh(*edges, values, cmap=palette, **props)


def _map(ax, one, x, y, regimes):
    """Draw measured regimes in colours, the deeper the faster they grow or decay; theory's boundary as a line."""
    one = one.transpose(..., y, x)
    edges = axis_scales.cell_edges(one[x].values), axis_scales.cell_edges(one[y].values)
    regimes.paint(ax, *edges, *(one[name].values for name in ("regime", "relative", "status")))
    for margin in _margins(one):
        rounding = ROUNDING * np.nanmax(np.abs(margin), initial=0.0)
        planes.boundary(ax, one[x].values, one[y].values, margin, rounding, "theory's boundary")
    planes.label_axes(ax, one, x, y)


def _margins(one):
    """Return numbers of theory that change sign where it stops being stable, smooth where single eigenvalues are not.

    One is the product of all eigenvalues. The other is that of the sums of two of them (Orlando's formula); where they
    come in pairs ±λ it is the discriminant of λ², a determinant of power sums.
    """
    steady = np.isin(one["regime_theory"].values, [REGIMES.index(name) - 1 for name in STEADY])
    growth, scale = one["growth_rate_theory"].values, one["rate_scale"].values
    eigenvalues = one["eigenvalues"].transpose("eigenvalue", ...).values / scale
    n = len(eigenvalues)
    if np.nanmin(growth / scale, initial=0.0) < -1e-9:
        second = np.prod([eigenvalues[i] + eigenvalues[j] for i in range(n) for j in range(i)], axis=0).real
    else:
        sums = np.array([(eigenvalues ** (2 * k)).sum(axis=0).real / 2 for k in range(n - 1)])
        hankel = sums[np.add.outer(np.arange(n // 2), np.arange(n // 2))]
        second = np.linalg.det(np.moveaxis(hankel, (0, 1), (-2, -1)))
    window = (3,) * steady.ndim
    beside = np.lib.stride_tricks.sliding_window_view(np.pad(steady, 1), window).any(tuple(range(-steady.ndim, 0)))
    return [np.where(beside, margin, np.nan) for margin in (eigenvalues.prod(axis=0).real, second)]


def _lines(ax, one, x):
    """Draw the measured growth rate as draw_points on theory's line, where one parameter varies."""
    at = one[x].values
    ax.axhline(0.0, color=colors.FAINT, lw=0.8)
    ax.plot(at, one["growth_rate_theory"].values, color=colors.INK, lw=0.9, gid="theory", label="theory")
    for margin in _margins(one):
        for k in np.flatnonzero(margin[1:] * margin[:-1] < 0.0):
            limit = at[k] - margin[k] * (at[k + 1] - at[k]) / (margin[k + 1] - margin[k])
            ax.axvline(limit, color=colors.QUIET, lw=0.9, ls=(0, (4, 2)), gid="limit")
            props = {"xycoords": ax.get_xaxis_transform(), "va": "top", "ha": "right"}
            marks.annotate(ax, f"theory: {wording.format_number(limit, 4)}", (limit, 0.97), (-5, 0), **props)
    draw_points(ax, at, one["growth_rate"].values, one["regime"].values, REGIMES[1:], APPEARANCE, ms=3.0)
    axis_scales.set_scale(ax.xaxis, at)
    ax.set(xlabel=wording.axis_label(one, x), ylabel=f"growth rate, below 0 decay  ({wording.format_units('s-1')})")
