"""Small oscillations: signed ω² of every equilibrium and mode over what is varied, and how far it keeps to theory."""

import math
import re
import warnings

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from sweeps.figure import axis_scales, canvas, colors, marks, sheets, wording
from sweeps.schema.iteration import spaced_indices
from sweeps.systems.oscillator.system import REGIMES
from sweeps.systems.presentation import planes
from sweeps.systems.presentation.appearance import Appearance, Mark, missing_words
from sweeps.systems.presentation.regimes import dots

MOST_PANELS = 8
APPEARANCE = Appearance(marks={"marginal": Mark("marginal", "=", colors.INK)})
ROUNDING = 1e-12  # of ω²/scale²: what is below is no sign
MOST_DOTS = 1000  # marginal points of a panel; more stand on a coarser lattice
GREEK = re.compile(r"^(theta|phi|psi|alpha|beta)$")
LARGE = 5.2  # inches, of the picture of places
LEVEL = 1e-6  # of a value: what differs by less is drawn as a law, not as a flat colour
LEAST_ROOM = 0.08  # of a panel's height, between names of curves
MOST_CURVES = 4  # of a law


def draw(ds: xr.Dataset, ax: Axes | None = None) -> Figure:
    """Draw a panel for every equilibrium and mode, and for one coordinate the positions of the equilibria.

    Equal panels are drawn once; a mode that is marginal everywhere is named only.
    """
    x, y, _ = planes.sides(ds["omega_squared"], ("equilibrium", "mode"))
    part = _thinned(ds, x, y)
    panels, marginal = _panels(part)
    coordinates = [name for name in ds.data_vars if name.endswith("_equilibrium")]
    places = len(coordinates) == 1 and ds.sizes["equilibrium"] > 1 and _moves(part[coordinates[0]], x)
    count = len(panels)
    below = places and sheets.is_narrow()  # the positions above the panels, and not beside
    rows, columns, size = canvas.arrange_panels(
        count, (3.3, 2.7), (1.0 + LARGE * (places and not below), 1.5 + 2.7 * below)
    )
    subtitle = "\n".join([planes.subtitle(ds, part, ds["omega_squared"], APPEARANCE), *marginal])
    figure = canvas.make_figure(*size, ds.attrs.get("title", ""), subtitle, ax=ax)
    beside = int(places and not below)
    ratios_of_width = [LARGE / 3.3] * beside + [1.0] * columns
    grid = figure.add_gridspec(rows + below, columns + beside, width_ratios=ratios_of_width)
    axes = [figure.add_subplot(grid[below + k // columns, beside + k % columns]) for k in range(rows * columns)]
    image, maps = None, 0
    most = float(np.nanmax(np.abs([one["measured"].values for _, one in panels]), initial=0.0)) or 1.0
    for ax, (title, one) in zip(axes, panels, strict=False):
        ax.set_title(title, loc="left")
        if not y:
            _lines(ax, one, x)
        elif _is_level(one, x) and _is_level(one, y):
            _law(ax, one, x, y)
        elif level := next((name for name in (x, y) if _is_level(one, name)), None):
            _lines(ax, one.isel({level: one.sizes[level] // 2}), y if level == x else x)
        else:
            image, maps = _map(ax, one, x, y, most), maps + 1
    if places:
        _places(figure.add_subplot(grid[0, :] if below else grid[:, 0]), part, coordinates[0], x, y)
    for ax in axes[count:]:
        ax.set_axis_off()
    if len(axes) == count == maps:
        for ax in axes:
            ax.label_outer()
    if image is not None:
        bar = figure.colorbar(image, ax=axes[:count], shrink=0.9, aspect=30, pad=0.02)
        bar.set_label("measured $\\omega^2$ / rate scale$^2$\nabove 0 stable, below unstable")
    canvas.draw_legend(figure, _missing(figure, part))
    return figure


def _panels(part):
    """Return titles and contents of the panels, equal ones once, and a line on modes that are marginal everywhere."""
    every = [{"equilibrium": e, "mode": m} for e in part["equilibrium"].values for m in part["mode"].values]
    panels = planes.once(((_name(part, *at.values()), part.sel(at)) for at in every), ("measured", "regime"))
    still = [(one["regime"].values == REGIMES.index("marginal") - 1).all() and len(panels) > 1 for _, one in panels]
    marginal = [f"{title}: marginal everywhere" for (title, _), is_still in zip(panels, still, strict=True) if is_still]
    return [panel for panel, is_still in zip(panels, still, strict=True) if not is_still][:MOST_PANELS], marginal


def _thinned(ds, x, y):
    """Select the middle of every other dimension, and a few values of these."""
    names = ["omega_squared", "omega_squared_theory", "rate_scale", "regime", "status"]
    names += [name for name in ds.data_vars if name.endswith("_equilibrium") or name == "regime_theory"]
    part = ds[names].isel(planes.few(ds["omega_squared"], (x, y), ("equilibrium", "mode"))).load()
    square = part["rate_scale"] ** 2
    return part.assign(measured=part["omega_squared"] / square, theory=part["omega_squared_theory"] / square)


def _name(part, equilibrium, mode):
    name = str(equilibrium).replace("_", " ")
    name = f"equilibrium {name}" if name.isdigit() else name
    return name if part.sizes["mode"] == 1 else f"{name}, mode {mode}"


def _map(ax, one, x, y, most):
    """Draw measured signed ω² in colours, theory's zero as a line, marginal points as dots."""
    one = one.transpose(y, x)
    palette = sheets.color_map("signed").with_extremes(bad=colors.MISSING)
    values = np.ma.masked_invalid(one["measured"].values)
    edges = axis_scales.cell_edges(one[x].values), axis_scales.cell_edges(one[y].values)
    image = ax.pcolormesh(*edges, values, cmap=palette, norm=Normalize(-most, most), rasterized=True, gid="measured")
    planes.boundary(ax, one[x].values, one[y].values, one["theory"].values, ROUNDING, r"theory: $\omega^2 = 0$")
    rows, columns = np.nonzero(one["regime"].values == REGIMES.index("marginal") - 1)
    if rows.size:
        every = max(1, math.ceil(math.sqrt(rows.size / MOST_DOTS)))
        kept = (rows % every == 0) & (columns % every == 0)
        rows, columns = rows[kept], columns[kept]
        props = {"color": colors.INK, "gid": "marginal", "label": "marginal"}
        ax.plot(one[x].values[columns], one[y].values[rows], "o", ms=2.0, mew=0.0, **props)
    planes.name_sides(ax, one, x, y)
    return image


def _moves(place, x):
    """Return whether an equilibrium moves with x, so that a picture of places says more than its name."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # of equilibria that are nowhere
        span = (place.max(x) - place.min(x)).max()
    return bool(span > LEVEL * np.abs(place).max())


def _is_level(one, name):
    """Return whether ω² over its scale does not depend on a parameter, so that curves say more than colours."""
    values = one["measured"].values
    span = np.nan_to_num((one["measured"].max(name) - one["measured"].min(name)).values)
    return bool(np.isfinite(values).any() and span.max() <= LEVEL * np.nanmax(np.abs(values)))


def _law(ax, one, x, y):
    """Draw the measured rate as dots on theory's lines over x, at a few values of y that stand beside their ends.

    The other way round where theory's rate hardly changes over x.
    """
    with np.errstate(all="ignore"):
        logs = np.log(np.abs(one["omega_squared_theory"]))
        spans = [float((logs.max(name) - logs.min(name)).max()) for name in (x, y)]
    x, y = (x, y) if spans[0] > 0.1 * spans[1] else (y, x)
    some = np.unique(np.linspace(0, one.sizes[y] - 1, MOST_CURVES).round().astype(int))
    every = spaced_indices(one.sizes[x], 24)
    rates = np.sqrt(np.abs(one["omega_squared_theory"].isel({y: some}).transpose(y, x).values))
    if np.ptp(rates, axis=0).max() <= LEVEL * rates.max():
        some, rates = some[:1], rates[:1]
    for number, (k, theory) in enumerate(zip(some, rates, strict=True)):
        row = one.isel({y: int(k)})
        regime = REGIMES[1 + int(np.bincount(np.maximum(row["regime"].values, 0)).argmax())]
        names = ("theory", regime) if not number else (None, None)
        line = {"color": colors.INK, "lw": 0.9, "gid": "theory", "label": names[0]}
        ax.plot(row[x].values, theory, **line)
        measured = np.sqrt(np.abs(row["omega_squared"].values[every]))
        props = {"color": APPEARANCE.color(regime), "label": names[1], "gid": regime}
        ax.plot(row[x].values[every], measured, "o", ms=3.4, mew=0.0, **props)
    if axis_scales.is_logarithmic(one[x].values):
        ax.set(yscale="log")
    axis_scales.set_scale(ax.xaxis, one[x].values)
    ax.set(xlabel=wording.axis_label(one, x), ylabel=f"measured rate  ({wording.format_units('rad s-1')})")
    heights = marks.spread_heights(ax, one[x].values[-1], rates[:, -1], LEAST_ROOM)
    for k, height in zip(some, heights, strict=True):
        text = wording.with_unit(wording.format_number(float(one[y].values[k]), 3), one[y].attrs.get("units", "1"))
        props = {"xycoords": "axes fraction", "va": "center", "fontsize": 7.5}
        marks.annotate(ax, text if len(some) > 1 else "all", (1.0, height), (4, 0), **props)
    ax.set_title(f"{ax.get_title(loc='left')}, by {y.replace('_', ' ')}", loc="left")


def _lines(ax, one, x):
    """Draw measured signed ω² as dots on theory's line, where one parameter varies."""
    at = one[x].values
    theory, measured, regime = (one[name].values.ravel() for name in ("theory", "measured", "regime"))
    ax.axhline(0.0, color=colors.FAINT, lw=0.8)
    ax.plot(at, theory, color=colors.INK, lw=0.9, gid="theory", label="theory")
    dots(ax, at, measured, regime, REGIMES[1:], APPEARANCE, ms=3.0)
    axis_scales.set_scale(ax.xaxis, at)
    ax.set(xlabel=wording.axis_label(one, x), ylabel=r"$\omega^2$ / rate scale$^2$")


def _places(ax, part, name, x, y):
    """Draw the equilibria over x in the middle of y: stable ones in one colour, unstable ones in another."""
    row = (part.isel({y: part.sizes[y] // 2}) if y else part).isel(mode=0)
    line = {"color": colors.INK, "lw": 1.0, "gid": "place"}
    styles = (("-", "stable"), ((0, (4, 2)), "unstable")) if "regime_theory" in row else ()
    for k, (dash, word) in enumerate(styles):
        for e in row["equilibrium"].values:
            one = row.sel(equilibrium=e)
            there = np.where(one["regime_theory"].values == k, one[name].values, np.nan)
            if np.isfinite(there).any():
                ax.plot(*_forked(one[x].values, there), ls=dash, label=f"equilibrium, {word}", **line)
    places, at = row[name].transpose("equilibrium", x).values, row["regime"].transpose("equilibrium", x).values
    dots(ax, np.broadcast_to(row[x].values, at.shape), places, at, REGIMES[1:], APPEARANCE, ms=2.6)
    axis_scales.set_scale(ax.xaxis, row[x].values)
    cut = f", {wording.format_coordinate(part, y, part[y].values[part.sizes[y] // 2])}" if y else ""
    ax.set_title(f"equilibria{cut}", loc="left")
    symbol, unit = GREEK.sub(r"$\\\1$", name.removesuffix("_equilibrium")), part[name].attrs.get("units", "1")
    ax.set(xlabel=wording.axis_label(part, x), ylabel=wording.with_unit(symbol, unit, "  ({})"))


def _forked(x, place):
    """Return a branch of equilibria, extended back to where it leaves place 0 as a root, if within one step."""
    first = np.flatnonzero(np.isfinite(place))[:2]
    if first.size < 2 or first[0] == 0:
        return x, place
    near, far = place[first] ** 2
    step = x[first[1]] - x[first[0]]
    start = x[first[0]] - near * step / (far - near) if far > near else -np.inf
    if start < x[first[0] - 1] - step / 2:  # half a step: the square is no straight line
        return x, place
    start = max(start, x[first[0] - 1])
    root = np.sign(place[first[0]]) * np.sqrt(near) * np.linspace(0.0, 1.0, 20)
    along = start + (x[first[0]] - start) * np.linspace(0.0, 1.0, 20) ** 2
    return np.concatenate([along, x[first[0] :]]), np.concatenate([root, place[first[0] :]])


def _missing(figure, part):
    """Return the legend's entry for cells without a value, where there are any."""
    meshes = [artist for ax in figure.axes for artist in ax.collections if artist.get_gid() == "measured"]
    if any(np.ma.getmaskarray(mesh.get_array()).any() for mesh in meshes):
        codes = np.unique(part["status"].values[np.isnan(part["measured"].values)])
        return [Patch(facecolor=colors.MISSING, label=missing_words(codes))]
    return []
