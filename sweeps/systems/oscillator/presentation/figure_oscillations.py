"""Figure of small oscillations: signed ω² of every equilibrium and mode over the parameters, against theory."""

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
from sweeps.systems.presentation import longest_parameters, planes
from sweeps.systems.presentation.appearance import Appearance, Mark, missing_words
from sweeps.systems.presentation.regimes import draw_points
from sweeps.systems.presentation.sentences import head_texts

MAX_PANELS = 8  # panels of equilibria and modes that fit a page
APPEARANCE = Appearance(marks={"marginal": Mark("marginal", "=", colors.INK)})
ROUNDING = 1e-12  # rounding error of ω²/scale²; the sign of smaller values is not drawn
MAX_DOTS = 1000  # marginal points of a panel; more are thinned to a coarser lattice
GREEK = re.compile(r"^(theta|phi|psi|alpha|beta)$")
EQUILIBRIA_WIDTH = 5.2  # inches, panel of the equilibria
MAX_FLAT_VARIATION = 1e-6  # relative; what varies less over a parameter is drawn as curves, not as a flat colour
MIN_LABEL_SPACING = 0.08  # distance of the labels of curves, relative to the panel's height
MAX_CURVES = 4  # curves of a panel, which the eye can still assign to their labels


def draw(ds: xr.Dataset, ax: Axes | None = None) -> Figure:
    """Draw a panel for every equilibrium and mode, and for one coordinate the positions of the equilibria.

    Equal panels are drawn once; a mode that is marginal everywhere is named only.
    """
    x, y, _ = longest_parameters(ds["omega_squared"], ("equilibrium", "mode"))
    subset = _select(ds, x, y)
    panels, marginal = _panels(subset)
    coordinates = [name for name in map(str, ds.data_vars) if name.endswith("_equilibrium")]
    has_equilibria = len(coordinates) == 1 and ds.sizes["equilibrium"] > 1 and _moves_over(subset[coordinates[0]], x)
    count = len(panels)
    is_above = has_equilibria and sheets.is_narrow()  # the equilibria above the panels, and not next to them
    rows, columns, size = canvas.arrange_panels(
        count, (3.3, 2.7), (1.0 + EQUILIBRIA_WIDTH * (has_equilibria and not is_above), 1.5 + 2.7 * is_above)
    )
    subtitle = "\n".join([planes.subtitle(ds, subset, ds["omega_squared"], APPEARANCE), *marginal])
    figure = canvas.make_figure(*size, *head_texts(ds, words=subtitle), ax=ax)
    num_left = int(has_equilibria and not is_above)
    ratios_of_width = [EQUILIBRIA_WIDTH / 3.3] * num_left + [1.0] * columns
    grid = figure.add_gridspec(rows + is_above, columns + num_left, width_ratios=ratios_of_width)
    axes = [figure.add_subplot(grid[is_above + k // columns, num_left + k % columns]) for k in range(rows * columns)]
    image, num_maps = None, 0
    max_value = float(np.nanmax(np.abs([panel["measured"].values for _, panel in panels]), initial=0.0)) or 1.0
    for ax, (title, panel) in zip(axes, panels, strict=False):
        ax.set_title(title, loc="left")
        if not y:
            _draw_over_one(ax, panel, x)
        elif _is_level(panel, x) and _is_level(panel, y):
            _draw_rate_curves(ax, panel, x, y)
        elif flat_name := next((name for name in (x, y) if _is_level(panel, name)), None):
            _draw_over_one(ax, panel.isel({flat_name: panel.sizes[flat_name] // 2}), y if flat_name == x else x)
        else:
            image, num_maps = _draw_map(ax, panel, x, y, max_value), num_maps + 1
    if has_equilibria:
        _draw_equilibria(figure.add_subplot(grid[0, :] if is_above else grid[:, 0]), subset, coordinates[0], x, y)
    for ax in axes[count:]:
        ax.set_axis_off()
    if len(axes) == count == num_maps:
        for ax in axes:
            ax.label_outer()
    if image is not None:
        bar = figure.colorbar(image, ax=axes[:count], shrink=0.9, aspect=30, pad=0.02)
        bar.set_label("measured $\\omega^2$ / rate scale$^2$\nabove 0 stable, below unstable")
    canvas.draw_legend(figure, _missing_entries(figure, subset))
    return figure


def _panels(subset):
    """Return (title, content) of each panel, equal panels once, and a line for each mode marginal everywhere."""
    all_modes = [{"equilibrium": e, "mode": m} for e in subset["equilibrium"].values for m in subset["mode"].values]
    panels = planes.merge_equal(
        ((_panel_title(subset, *mode_of.values()), subset.sel(mode_of)) for mode_of in all_modes),
        ("measured", "regime"),
    )
    is_marginal = [
        (panel["regime"].values == REGIMES.index("marginal") - 1).all() and len(panels) > 1 for _, panel in panels
    ]
    marginal = [f"{title}: marginal everywhere" for (title, _), hide in zip(panels, is_marginal, strict=True) if hide]
    return [panel for panel, hide in zip(panels, is_marginal, strict=True) if not hide][:MAX_PANELS], marginal


def _select(ds, x, y):
    """Select the middle of every dimension except x and y, and at most `planes.MAX_DRAWN` values of these."""
    names = ["omega_squared", "omega_squared_theory", "rate_scale", "regime", "status"]
    names += [name for name in map(str, ds.data_vars) if name.endswith("_equilibrium") or name == "regime_theory"]
    subset = ds[names].isel(planes.cut_indices(ds["omega_squared"], (x, y), ("equilibrium", "mode"))).load()
    rate_scale_squared = subset["rate_scale"] ** 2
    return subset.assign(
        measured=subset["omega_squared"] / rate_scale_squared,
        theory=subset["omega_squared_theory"] / rate_scale_squared,
    )


def _panel_title(subset, equilibrium, mode):
    name = str(equilibrium).replace("_", " ")
    name = f"equilibrium {name}" if name.isdigit() else name
    return name if subset.sizes["mode"] == 1 else f"{name}, mode {mode}"


def _draw_map(ax, panel, x, y, max_value):
    """Draw measured signed ω² in colours, theory's zero as a line, marginal points as dots."""
    panel = panel.transpose(y, x)
    palette = sheets.color_map("signed").with_extremes(bad=colors.MISSING)
    values = np.ma.masked_invalid(panel["measured"].values)
    edges = axis_scales.cell_edges(panel[x].values), axis_scales.cell_edges(panel[y].values)
    image = ax.pcolormesh(
        *edges, values, cmap=palette, norm=Normalize(-max_value, max_value), rasterized=True, gid="measured"
    )
    planes.boundary(ax, panel[x].values, panel[y].values, panel["theory"].values, ROUNDING, r"theory: $\omega^2 = 0$")
    rows, columns = np.nonzero(panel["regime"].values == REGIMES.index("marginal") - 1)
    if rows.size:
        step = max(1, math.ceil(math.sqrt(rows.size / MAX_DOTS)))
        on_lattice = (rows % step == 0) & (columns % step == 0)
        rows, columns = rows[on_lattice], columns[on_lattice]
        props = {"color": colors.INK, "gid": "marginal", "label": "marginal"}
        ax.plot(panel[x].values[columns], panel[y].values[rows], "o", ms=2.0, mew=0.0, **props)
    planes.label_axes(ax, panel, x, y)
    return image


def _moves_over(position, x):
    """Return True if an equilibrium moves with x, so that a panel of the equilibria is informative."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # NaN where an equilibrium does not exist
        span = (position.max(x) - position.min(x)).max()
    return bool(span > MAX_FLAT_VARIATION * np.abs(position).max())


def _is_level(panel, name):
    """Return True if ω² over its scale does not depend on a parameter, so that curves are clearer than colours."""
    values = panel["measured"].values
    span = np.nan_to_num((panel["measured"].max(name) - panel["measured"].min(name)).values)
    return bool(np.isfinite(values).any() and span.max() <= MAX_FLAT_VARIATION * np.nanmax(np.abs(values)))


def _draw_rate_curves(ax, panel, x, y):
    """Draw the measured rate as dots on theory's curves over x, for a few values of y, which label the ends.

    x and y are exchanged if theory's rate hardly changes over x.
    """
    with np.errstate(all="ignore"):
        logs = np.log(np.abs(panel["omega_squared_theory"]))
        spans = [float((logs.max(name) - logs.min(name)).max()) for name in (x, y)]
    x, y = (x, y) if spans[0] > 0.1 * spans[1] else (y, x)
    curves = np.unique(np.linspace(0, panel.sizes[y] - 1, MAX_CURVES).round().astype(int))
    dots = spaced_indices(panel.sizes[x], 24)
    rates = np.sqrt(np.abs(panel["omega_squared_theory"].isel({y: curves}).transpose(y, x).values))
    if np.ptp(rates, axis=0).max() <= MAX_FLAT_VARIATION * rates.max():
        curves, rates = curves[:1], rates[:1]
    for order, (k, theory) in enumerate(zip(curves, rates, strict=True)):
        row = panel.isel({y: int(k)})
        regime = REGIMES[1 + int(np.bincount(np.maximum(row["regime"].values, 0)).argmax())]
        names = ("theory", regime) if not order else (None, None)
        line = {"color": colors.INK, "lw": 0.9, "gid": "theory", "label": names[0]}
        ax.plot(row[x].values, theory, **line)
        measured = np.sqrt(np.abs(row["omega_squared"].values[dots]))
        props = {"color": APPEARANCE.color(regime), "label": names[1], "gid": regime}
        ax.plot(row[x].values[dots], measured, "o", ms=3.4, mew=0.0, **props)
    if axis_scales.is_logarithmic(panel[x].values):
        ax.set(yscale="log")
    axis_scales.set_scale(ax.xaxis, panel[x].values)
    ax.set(xlabel=wording.axis_label(panel, x), ylabel=f"measured rate  ({wording.format_units('rad s-1')})")
    heights = marks.spread_heights(ax, panel[x].values[-1], rates[:, -1], MIN_LABEL_SPACING)
    for k, height in zip(curves, heights, strict=True):
        text = wording.with_unit(wording.format_number(float(panel[y].values[k]), 3), panel[y].attrs.get("units", "1"))
        props = {"xycoords": "axes fraction", "va": "center", "fontsize": 7.5}
        marks.annotate(ax, text if len(curves) > 1 else "all", (1.0, height), (4, 0), **props)
    ax.set_title(f"{ax.get_title(loc='left')}, by {y.replace('_', ' ')}", loc="left")


def _draw_over_one(ax, panel, x):
    """Draw measured signed ω² as dots on theory's line over the only parameter that varies."""
    values = panel[x].values
    theory, measured, regime = (panel[name].values.ravel() for name in ("theory", "measured", "regime"))
    ax.axhline(0.0, color=colors.FAINT, lw=0.8)
    ax.plot(values, theory, color=colors.INK, lw=0.9, gid="theory", label="theory")
    draw_points(ax, values, measured, regime, REGIMES[1:], APPEARANCE, ms=3.0)
    axis_scales.set_scale(ax.xaxis, values)
    ax.set(xlabel=wording.axis_label(panel, x), ylabel=r"$\omega^2$ / rate scale$^2$")


def _draw_equilibria(ax, subset, name, x, y):
    """Draw the equilibria over x, at the middle of y, in the colours of their regimes."""
    row = (subset.isel({y: subset.sizes[y] // 2}) if y else subset).isel(mode=0)
    line = {"color": colors.INK, "lw": 1.0, "gid": "place"}
    line_styles = (("-", "stable"), ((0, (4, 2)), "unstable")) if "regime_theory" in row else ()
    for k, (line_style, regime) in enumerate(line_styles):
        for e in row["equilibrium"].values:
            branch = row.sel(equilibrium=e)
            position = np.where(branch["regime_theory"].values == k, branch[name].values, np.nan)
            if np.isfinite(position).any():
                ax.plot(
                    *_extend_to_bifurcation(branch[x].values, position),
                    ls=line_style,
                    label=f"equilibrium, {regime}",
                    **line,
                )
    positions, regimes = row[name].transpose("equilibrium", x).values, row["regime"].transpose("equilibrium", x).values
    draw_points(ax, np.broadcast_to(row[x].values, regimes.shape), positions, regimes, REGIMES[1:], APPEARANCE, ms=2.6)
    axis_scales.set_scale(ax.xaxis, row[x].values)
    fixed_text = f", {wording.format_coordinate(subset, y, subset[y].values[subset.sizes[y] // 2])}" if y else ""
    ax.set_title(f"equilibria{fixed_text}", loc="left")
    symbol, unit = GREEK.sub(r"$\\\1$", name.removesuffix("_equilibrium")), subset[name].attrs.get("units", "1")
    ax.set(xlabel=wording.axis_label(subset, x), ylabel=wording.with_unit(symbol, unit, "  ({})"))


def _extend_to_bifurcation(x, position):
    """Return a branch of equilibria, extended by a square root back to its bifurcation at 0, if within one step."""
    first = np.flatnonzero(np.isfinite(position))[:2]
    if first.size < 2 or first[0] == 0:
        return x, position
    first_square, second_square = position[first] ** 2
    step = x[first[1]] - x[first[0]]
    start = (
        x[first[0]] - first_square * step / (second_square - first_square) if second_square > first_square else -np.inf
    )
    if start < x[first[0] - 1] - step / 2:  # half a step, as the square is only nearly linear
        return x, position
    start = max(start, x[first[0] - 1])
    root = np.sign(position[first[0]]) * np.sqrt(first_square) * np.linspace(0.0, 1.0, 20)
    branch_x = start + (x[first[0]] - start) * np.linspace(0.0, 1.0, 20) ** 2
    return np.concatenate([branch_x, x[first[0] :]]), np.concatenate([root, position[first[0] :]])


def _missing_entries(figure, subset):
    """Return the legend's entry for cells without a value; [] without such cells."""
    meshes = [artist for ax in figure.axes for artist in ax.collections if artist.get_gid() == "measured"]
    if any(np.ma.getmaskarray(mesh.get_array()).any() for mesh in meshes):
        codes = np.unique(subset["status"].values[np.isnan(subset["measured"].values)])
        return [Patch(facecolor=colors.MISSING, label=missing_words(codes))]
    return []
