"""Figures of multipliers: measured regimes in colours, with the exact boundary of stability."""

import math
from collections.abc import Mapping, Sequence

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.linalg import eigvalsh_tridiagonal

from kernels.flow.codes import REGIMES
from sweeps.figure import axis_scales, canvas, colors, wording
from sweeps.reading.definitions import definition_of
from sweeps.systems.periodic.presentation.sentences import resonances
from sweeps.systems.presentation import longest_parameters, planes
from sweeps.systems.presentation.appearance import Appearance
from sweeps.systems.presentation.regimes import Regimes
from sweeps.systems.presentation.sentences import head_texts

FULL_COLOR_GROWTH = 1.0  # growth per period with the full colour
MAX_PANELS = 6  # values of a third parameter that are drawn
MATRIX_SIZE = 60  # size of the tridiagonal matrices for q = 0
# positive for stable motions of two degrees of freedom
BOUNDS = ("det_minus_identity", "det_plus_identity", "krein_discriminant")
ROUNDING = 1e-9  # rounding error of these bounds and of the growth

Curves = Sequence[tuple[np.ndarray, np.ndarray]]  # coordinates (x, y) of curves
EXACT, THEORY = "Mathieu's curves, exact", "boundary by linear theory"


def draw(
    dataset: xr.Dataset, at: Mapping, subtitle: str, appearance: Appearance, curves=None, ax: Axes | None = None
) -> Figure | None:
    """Draw regimes over the two longest parameters, a panel for each value of a third.

    Args:
        dataset: the map.
        at: dimension → value at which the map is cut.
        subtitle: the perturbed motion.
        appearance: words, symbols and colours of the system.
        curves: function of a panel's map and the names along its sides that returns a label and curves, or None;
            curves with the label EXACT replace the boundary by linear theory.
        ax: place of the figure within another one.

    Returns:
        The figure; None if fewer than two parameters vary, or if it had a single colour.
    """
    growth_name = "growth_per_orbit" if "growth_per_orbit" in dataset else "growth_per_period"
    names = [name for name in ("regime", growth_name, "status", "exponent_imag") if name in dataset]
    subset = dataset[[*names, *_margins(dataset)]].sel(at)
    x, y, third = longest_parameters(subset["regime"], ())
    if y is None:
        return None
    subset = subset.isel(planes.cut_indices(subset["regime"], (x, y), (third,))).load()
    if np.unique(subset["regime"]).size == 1 and not (subset[growth_name] > 0.0).any():
        return None
    values = subset[third].values[:MAX_PANELS] if third else [None]
    figure, axes = canvas.make_panels(len(values), (4.2, 3.4), *head_texts(dataset, words=subtitle), ax)
    regimes = Regimes(REGIMES, appearance, FULL_COLOR_GROWTH)
    for panel_ax, value in zip(axes, values, strict=True):
        panel = subset.sel({third: value}) if third else subset
        if third:
            panel_ax.set_title(wording.format_coordinate(dataset, third, value), loc="left")
        rows = panel.transpose(y, x, ...)
        regime, growth, status = (rows[n].values for n in ("regime", growth_name, "status"))
        edges = (axis_scales.cell_edges(panel[name].values) for name in (x, y))
        regimes.paint(panel_ax, *edges, regime, np.maximum(growth, 0.0), status)
        label, pairs = (curves(panel, x, y) if curves else None) or ("", ())
        if label != EXACT:
            _draw_boundary(panel_ax, rows, x, y)
        for order, pair in enumerate(pairs):
            dashes = "-" if label == EXACT else "--"
            panel_ax.plot(*pair, dashes, gid="law", label="" if order else label, color=colors.INK, linewidth=1.0)
        planes.label_axes(panel_ax, panel, x, y, appearance.symbols)
        panel_ax.set(xlim=side_ends(panel, x), ylim=side_ends(panel, y))
        _mark_start(panel_ax, panel, (x, y), appearance.symbols)
        if (places := resonances(panel, y, x)) and not third:
            props = {"color": colors.QUIET, "lw": 0.7, "ls": ":", "gid": "resonance"}
            for place in places:
                panel_ax.axvline(place, **props)
            panel_ax.secondary_xaxis("top").set_xticks([*places], [*places.values()], rotation=50, ha="left")
    regimes.explain(figure, axes, growth_name.replace("_", " "))
    return figure


def side_ends(panel: xr.Dataset, name: str) -> np.ndarray:
    """Return both ends of a panel's side, along parameter `name`."""
    return axis_scales.cell_edges(panel[name].values)[[0, -1]]


def _mark_start(axes: Axes, panel: xr.Dataset, sides: tuple[str, str], symbols: Mapping) -> None:
    """Draw a ring at the point at which the page starts, if the definition names it."""
    start = definition_of(panel.attrs).get("start_at") or {}
    if {*sides} <= {*start}:
        words = ", ".join(wording.format_coordinate(panel, name, start[name], symbols) for name in sides)
        style = {"markeredgecolor": colors.INK, "markerfacecolor": "none", "markersize": 8, "linestyle": "none"}
        axes.plot(*(start[name] for name in sides), "o", label=words, gid="start", **style)


def _margins(dataset: xr.Dataset) -> list[str]:
    """Return the names of the variables by which linear theory decides stability."""
    multiplier_bounds = [f"{name}_theory" for name in (*BOUNDS, "trace") if f"{name}_theory" in dataset]
    return ["growth_per_period_theory", *multiplier_bounds]


def _draw_boundary(ax: Axes, panel: xr.Dataset, x: str, y: str) -> None:
    """Draw the boundary at which linear theory's multipliers leave the unit circle."""
    growth, trace = (panel[name].values for name in ("growth_per_period_theory", "trace_theory"))
    if np.nanmin(growth, initial=0.0) < -1e-9:
        bounds = np.array([-growth])
    elif len(_margins(panel)) == 2:
        bounds = np.array([2.0 - np.abs(trace)])
    else:
        bounds = np.array([4.0 - np.abs(trace), *(panel[f"{name}_theory"].values for name in BOUNDS)])
    bounds = np.where(np.abs(bounds) < ROUNDING, ROUNDING, bounds)
    margins = np.sign(bounds) * np.arcsinh(0.5 * np.sqrt(np.abs(bounds))) ** 2  # near the square of a rate: smooth
    for number, margin in enumerate(margins):  # each line separates stable points from others
        others = np.delete(bounds, number, axis=0).min(axis=0, initial=np.inf)
        values = np.where((margin > 0.0) & (others < 0.0), np.nan, margin)
        label = "" if THEORY in ax.get_legend_handles_labels()[1] else THEORY
        planes.boundary(ax, panel[x].values, panel[y].values, values, 0.0, label, 1.0, halo=0.0)


def mathieu_curves(panel: xr.Dataset, x: str, y: str) -> tuple[str, Curves] | None:
    """Return Mathieu's curves in `panel`, a map of a and q along x and y; None otherwise, or with damping."""
    if {x, y} != {"a", "q"} or panel["growth_per_period_theory"].min() < -1e-9:
        return None
    q = np.linspace(*side_ends(panel, "q"), 400)
    pairs = [(a, q) if x == "a" else (q, a) for a in characteristic_values(np.abs(q))]
    low, high = side_ends(panel, "a")
    return EXACT, [pair for pair in pairs if (pair[x != "a"] < high).any() and (pair[x != "a"] > low).any()]


def kapitza_law(panel: xr.Dataset, x: str, y: str) -> tuple[str, Curves] | None:
    """Return Kapitza's law: the inverted pendulum is stable above A nu = sqrt(2 g l).

    None if `panel`, over x and y, is not a map of the vertically shaken inverted pendulum over amplitude and frequency.
    """
    if {x, y} != {"amplitude", "frequency"} or panel["equilibrium"] != "inverted" or panel["direction"].values.any():
        return None
    values = np.linspace(*side_ends(panel, x), 400)
    with np.errstate(divide="ignore"):
        threshold = np.sqrt(2.0 * float(panel["gravity"]) * float(panel["length"])) / values
    return "averaged: √2 law", [(values, np.where(threshold <= side_ends(panel, y)[1], threshold, np.nan))]


def characteristic_values(q: np.ndarray, count: int = 12) -> np.ndarray:
    """Return Mathieu's characteristic values a_0 < b_1 < a_1 < b_2 … of each q ≥ 0, shape (count, q.size).

    They are eigenvalues of two tridiagonal matrices, for the Fourier series of solutions with periods pi and 2 pi.
    """
    size = MATRIX_SIZE + 8 * math.ceil(math.sqrt(np.max(q)))
    even = 2.0 * np.arange(-(size // 2), size // 2 + 1)
    values = [
        [
            eigvalsh_tridiagonal(np.square(k), np.full(k.size - 1, value), select="i", select_range=(0, count - 1))
            for value in q
        ]
        for k in (even, even + 1.0)
    ]
    return np.sort(np.concatenate(values, axis=1), axis=1)[:, :count].T
