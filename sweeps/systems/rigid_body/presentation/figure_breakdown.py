"""Figure of the breakdown of linear theory: the deviation of the measured Ω² against ε, with its fitted exponent."""

from itertools import product
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sweeps.figure import canvas, colors, marks, wording
from sweeps.schema.iteration import spaced_indices
from sweeps.schema.refusals import cut_text
from sweeps.systems.bodies.variables import MOMENTS
from sweeps.systems.rigid_body.fits import MAX_FIT_DEVIATION, MIN_FIT_DEVIATION, fit_breakdown
from sweeps.systems.rigid_body.presentation.appearance import LINES, cut_at, moments_over

MAX_BODIES = 14  # rows of the table
EXPECTED, TOLERANCE = 2.0, 0.1  # exponent of the deviation, and its deviation that is marked
MIN_DRAWN = 1e-16  # deviation, the rounding unit
NUM_COLORED = 3  # bodies in colours; the remaining bodies are grey
GREY = "#b5b9bf"
NAME_LENGTH = 29  # characters of a name in the table


def draw(ds: xr.Dataset, ax: Axes | None = None) -> Figure:
    """Draw |Ω²/Ω²_theory − 1| against ε for each body and axis, with a table of fitted exponents."""
    subset, total = select_bodies(ds)
    fits = fit_breakdown(subset).assign(theory=subset["omega_squared_theory"].isel(epsilon=0))
    rows = subset.sizes["body"]
    lines, columns, size = canvas.arrange_panels(3, (3.6, max(3.3, 0.8 + 0.27 * rows)), (1.0, 1.6))
    figure = canvas.make_figure(*size, "How far linear theory holds", _subtitle(ds, total, fits), ax=ax)
    # relative to a panel's: the same number of inches in each figure
    table_width = 7.4 / max(figure.get_size_inches()[0] - 4.7, 2.0)
    ratios: dict[str, Any] = {"width_ratios": (1.0, 1.0, table_width)} if lines == 1 else {}
    stable_ax, unstable_ax, table = np.ravel(figure.subplots(lines, columns, **ratios))[:3]
    unstable_ax.sharey(stable_ax)
    unstable_ax.sharex(stable_ax)
    num_fits = np.isfinite(fits["slope"].transpose("body", "axis").values).sum(axis=1)
    best = np.flatnonzero(num_fits == num_fits.max())  # a few of these are coloured, far apart
    colored_bodies = best[np.unique(np.linspace(0, best.size - 1, NUM_COLORED).round().astype(int))].tolist()
    _draw_panel(stable_ax, fits, fits["theory"] > 0, colored_bodies)
    _draw_panel(unstable_ax, fits, fits["theory"] < 0, colored_bodies)
    stable_ax.set_ylabel(r"$|\,\Omega^2_{\rm measured}\,/\,\Omega^2_{\rm theory} - 1\,|$")
    stable_ax.set_title("stable (linear theory)", loc="left", color=colors.STABLE, fontweight="bold")
    unstable_ax.set_title("unstable (linear theory)", loc="left", color=colors.UNSTABLE, fontweight="bold")
    unstable_ax.tick_params(labelleft=False)
    _draw_table(table, fits, colored_bodies)
    return figure


def _subtitle(ds: xr.Dataset, total: int, fits: xr.Dataset) -> str:
    """Return title, number of bodies, the count of exponents near the expected one, and the range of the fit."""
    rows = fits.sizes["body"]
    bodies = (f"{rows} of " if rows < total else "") + wording.format_count(total, "body", "bodies")
    slopes = fits["slope"].values[np.isfinite(fits["slope"].values)]
    num_expected = int(np.count_nonzero(np.abs(slopes - EXPECTED) <= TOLERANCE))
    exponents = f"{num_expected} of {slopes.size} fitted exponents lie within {EXPECTED} ± {TOLERANCE}"
    low, high = (wording.power_of_ten(round(np.log10(bound))) for bound in (MIN_FIT_DEVIATION, MAX_FIT_DEVIATION))
    return (
        f"{ds.attrs.get('title', '')}:  {bodies};  {exponents if slopes.size else 'no exponent can be fitted'}\n"
        f"Fitted over the shaded range, {low} to {high}, where a deviation is at least ten times its value for "
        "the smallest perturbations (fainter elsewhere)"
    )


def select_bodies(ds: xr.Dataset) -> tuple[xr.Dataset, int]:
    """Return at most `MAX_BODIES` bodies of a map over (body, axis, epsilon), evenly spaced, and the number in the map.

    Dimensions omega0 and phase are cut in their middle. On a grid each triple of moments is a body, and names it.
    """
    middle = {dim: at for dim, at in cut_at(ds).items() if dim != "epsilon"}
    names = ["omega_squared", "omega_squared_theory", "omega_squared_reduced_error", "status"]
    ds = ds[names].isel(middle).sortby("epsilon")
    if "body" in ds.dims:
        total = ds.sizes["body"]
        return ds.isel(body=spaced_indices(total, MAX_BODIES)), total
    dims, columns = moments_over(ds), []
    places = list(product(*(range(ds.sizes[dim]) for dim in dims)))
    for place in (places[n] for n in spaced_indices(len(places), MAX_BODIES)):
        column = ds.isel(dict(zip(dims, place, strict=True))).load()
        label = ", ".join(wording.format_number(float(column[name]), 3) for name in MOMENTS)
        columns.append(column.drop_vars({*MOMENTS, *dims}).assign_coords(body=f"({label}) kg m²"))
    return xr.concat(columns, dim="body", coords="minimal", compat="override"), len(places)


def _line_props(body: int, colored_bodies: list[int]) -> dict:
    """Return colour and marker of a body's curve: grey without a marker unless the body is highlighted."""
    if body not in colored_bodies:
        return {"color": GREY, "marker": "none"}
    index = colored_bodies.index(body)
    return {"color": colors.SERIES_COLORS[index], "marker": marks.SERIES_MARKERS[index]}


def _draw_panel(ax: Axes, fits: xr.Dataset, mask: xr.DataArray, colored_bodies: list[int]) -> None:
    """Draw deviations over ε of each (body, axis) in the mask, the fitted range and a line of the expected slope."""
    ax.set(xscale="log", yscale="log", xlabel=r"perturbation $\varepsilon$, relative to $\omega_0$")
    epsilon = fits["epsilon"].values
    ax.axhspan(MIN_FIT_DEVIATION, MAX_FIT_DEVIATION, color=colors.BAND, zorder=0, lw=0)
    for i, j in np.argwhere(mask.transpose("body", "axis").values):
        _draw_series(ax, fits.isel(body=i, axis=j), int(i), colored_bodies)
    _draw_reference(ax, fits.where(mask), epsilon)
    ax.set(ylim=(3e-15, 5.0), xlim=(epsilon[0] / 1.3, epsilon[-1] * 1.3))


def _draw_series(ax: Axes, series: xr.Dataset, index: int, colored_bodies: list[int]) -> None:
    """Draw the deviation of one body about one axis, faint below its floor."""
    epsilon, deviation, axis = series["epsilon"].values, series["deviation"].values, int(series["axis"])
    visible = np.where(deviation > MIN_DRAWN, deviation, np.nan)
    above = np.where(visible >= max(float(series["floor"]), MIN_FIT_DEVIATION), visible, np.nan)
    props = _line_props(index, colored_bodies) | {"ls": LINES[axis], "zorder": 3 if index in colored_bodies else 2}
    ax.plot(epsilon, visible, lw=0.7, alpha=0.35, gid=f"{index} {axis}", **(props | {"marker": "none"}))
    spacing, width = max(1, epsilon.size // 7), 1.6 if index in colored_bodies else 0.9
    markers: dict[str, Any] = {"markevery": ((index * 3 + axis) % spacing, spacing), "ms": 3.8, "mew": 0.4}
    ax.plot(epsilon, above, lw=width, mec=colors.PAPER, **props, **markers)


def _draw_reference(ax: Axes, fits: xr.Dataset, epsilon: np.ndarray) -> None:
    """Draw a labelled line of slope 2 below the curves."""
    with np.errstate(invalid="ignore"):
        coefficients = fits["deviation"].where(fits["deviation"] >= fits["floor"]) / fits["epsilon"] ** 2
    ratios = coefficients.where(fits["slope"].notnull()).median("epsilon").values
    height = 0.2 * float(np.nanmin(ratios)) if np.isfinite(ratios).any() else 1e-2
    ends = np.array([epsilon[0], epsilon[-1]])
    ax.plot(ends, height * ends**2, color=colors.INK, lw=1.4, gid="slope 2")
    x = float(np.clip(np.sqrt(1e-11 / height), ends[0], ends[-1] / 30))
    marks.annotate(ax, "slope 2", (x, height * x**2), (9, -4), va="top", fontsize=10)


def _draw_table(ax: Axes, fits: xr.Dataset, colored_bodies: list[int]) -> None:
    """Draw the fitted exponents, a row per body and a column per axis, coloured by theory's regime."""
    ax.set_axis_off()
    axes, rows = fits["axis"].values.tolist(), fits.sizes["body"]
    ax.set(xlim=(0, 1), ylim=(rows + 0.4, -2.4))
    columns = np.linspace(0.69, 0.95, len(axes)) if len(axes) > 1 else [0.82]
    head: dict[str, Any] = {"va": "center", "fontsize": 8.5, "color": colors.QUIET}
    ax.text(float(np.mean(columns)), -2.05, "fitted exponent about axis", ha="center", **head)
    for x, axis in zip(columns, axes, strict=True):
        ax.text(x, -1.25, str(axis), ha="center", va="center", fontsize=9, fontweight="bold")
        ax.plot([x - 0.05, x + 0.05], [-0.72, -0.72], color=colors.INK, lw=1.1, ls=LINES[axis])
    ax.axhline(-0.45, color=colors.FAINT, lw=0.8)
    for i in range(rows):
        ax.plot([0.0, 0.05], [i, i], lw=1.6, ms=4.2, markevery=[1], **_line_props(i, colored_bodies))
        ax.text(0.085, i, cut_text(str(fits["body"].values[i]), NAME_LENGTH), va="center", fontsize=8.0)
        for j, x in enumerate(columns):
            text, color = _cell_text(fits.isel(body=i, axis=j))
            ax.text(x, i, text, ha="center", va="center", fontsize=8.5, color=color)
    ax.axhline(rows - 0.45, color=colors.FAINT, lw=0.8)
    if "no law" in {text.get_text() for text in ax.texts}:
        ax.text(0.0, rows + 0.1, "no law: too few deviations above rounding", **(head | {"fontsize": 7.8}))


def _cell_text(fit: xr.Dataset) -> tuple[str, str]:
    """Return text and colour of a fitted exponent: "!" marks an unexpected one, "no law" a missing fit."""
    theory, slope = float(fit["theory"]), float(fit["slope"])
    if not theory:
        return r"$\Omega^2=0$", colors.QUIET
    color = colors.STABLE if theory > 0 else colors.UNSTABLE
    if np.isfinite(slope):
        return f"{slope:.3f}" + ("" if abs(slope - EXPECTED) <= TOLERANCE else " !"), color
    return "no law", colors.QUIET
