"""Maps of multipliers: measured regimes in colours, under the exact boundary of stability."""

import math
from collections.abc import Mapping, Sequence

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.linalg import eigvalsh_tridiagonal

from kernels.flow.codes import REGIMES
from sweeps.figure import axis_scales, canvas, colors, wording
from sweeps.systems.presentation import planes
from sweeps.systems.presentation.appearance import Appearance
from sweeps.systems.presentation.regimes import Regimes

DEEPEST = 1.0  # growth in a period that has the full colour
MOST_PANELS = 4
SIZE = 60  # of the tridiagonal matrices
BOUNDS = ("det_minus_identity", "det_plus_identity", "krein_discriminant")  # positive inside, of two degrees of freedom
ROUNDING = 1e-9  # of what is positive inside: so little is none

Curves = Sequence[tuple[np.ndarray, np.ndarray]]  # (x, y) of each
EXACT, THEORY = "Mathieu's curves, exact", "boundary by linear theory"


def draw(
    ds: xr.Dataset, at: Mapping, what: str, appearance: Appearance, curves=None, ax: Axes | None = None
) -> Figure | None:
    """Draw regimes over the two longest parameters, a panel for each value of a third.

    There is no picture where one parameter varies at most, and where all of it would be of one colour. The figure is of
    one value of each dimension in `at`; `what` is perturbed. `curves`, of a panel's map and the names along its sides,
    returns a label and curves, or None; those with the label EXACT stand for the boundary by linear theory.
    """
    part = ds[["regime", "growth_per_period", "status", *_margins(ds)]].sel(at)
    x, y, third = planes.sides(part["regime"], ())
    if y is None:
        return None
    part = part.isel(planes.cut_indices(part["regime"], (x, y), (third,))).load()
    if np.unique(part["regime"]).size == 1 and not (part["growth_per_period"] > 0.0).any():
        return None  # all would be of one colour
    values = part[third].values[:MOST_PANELS] if third else [None]
    figure, axes = canvas.make_panels(len(values), (4.2, 3.4), ds.attrs.get("title", ""), what, ax)
    regimes = Regimes(REGIMES, appearance, DEEPEST)
    for place, value in zip(axes, values, strict=True):
        one = part.sel({third: value}) if third else part
        if third:
            place.set_title(wording.format_coordinate(ds, third, value), loc="left")
        upright = one.transpose(y, x, ...)
        regime, growth, status = (upright[n].values for n in ("regime", "growth_per_period", "status"))
        edges = (axis_scales.cell_edges(one[name].values) for name in (x, y))
        regimes.paint(place, *edges, regime, np.maximum(growth, 0.0), status)
        label, pairs = (curves(one, x, y) if curves else None) or ("", ())
        if label != EXACT:
            _contour(place, upright, x, y)
        for number, pair in enumerate(pairs):
            dashes = "-" if label == EXACT else "--"
            place.plot(*pair, dashes, gid="law", label="" if number else label, color=colors.INK, linewidth=1.0)
        planes.label_axes(place, one, x, y, appearance.symbols)
        place.set(xlim=ends(one, x), ylim=ends(one, y))
    regimes.explain(figure, axes, "growth per period")
    return figure


def ends(one: xr.Dataset, name: str) -> np.ndarray:
    """Return both ends of a panel's side."""
    return axis_scales.cell_edges(one[name].values)[[0, -1]]


def _margins(ds: xr.Dataset) -> list[str]:
    """Return names of the variables by which linear theory decides stability, smooth where it can be."""
    two = [f"{name}_theory" for name in (*BOUNDS, "trace") if f"{name}_theory" in ds]
    return ["growth_per_period_theory", *two]


def _contour(ax: Axes, one: xr.Dataset, x: str, y: str) -> None:
    """Draw where linear theory's multipliers leave the unit circle."""
    growth, trace = (one[name].values for name in ("growth_per_period_theory", "trace_theory"))
    if np.nanmin(growth, initial=0.0) < -1e-9:
        margin = -growth
    elif len(_margins(one)) == 2:
        margin = 2.0 - np.abs(trace)
    else:
        margin = np.min([4.0 - np.abs(trace), *(one[f"{name}_theory"].values for name in BOUNDS)], axis=0)
    margin = np.where(np.abs(margin) < ROUNDING, ROUNDING, margin)
    planes.boundary(ax, one[x].values, one[y].values, margin, 0.0, THEORY, 1.0, halo=0.0)


def chart(one: xr.Dataset, x: str, y: str) -> tuple[str, Curves] | None:
    """Return Mathieu's characteristic curves in a map of a and q; None in another, and with damping."""
    if {x, y} != {"a", "q"} or one["growth_per_period_theory"].min() < -1e-9:
        return None
    q = np.linspace(*ends(one, "q"), 400)
    pairs = [(a, q) if x == "a" else (q, a) for a in characteristic(np.abs(q))]
    low, high = ends(one, "a")
    return EXACT, [pair for pair in pairs if (pair[x != "a"] < high).any() and (pair[x != "a"] > low).any()]


def averaged(one: xr.Dataset, x: str, y: str) -> tuple[str, Curves] | None:
    """Return Kapitza's law, that the inverted pendulum stands from A nu = sqrt(2 g l) on; None where it is another."""
    if {x, y} != {"amplitude", "frequency"} or one["equilibrium"] != "inverted" or one["direction"].values.any():
        return None
    across = np.linspace(*ends(one, x), 400)
    with np.errstate(divide="ignore"):
        law = np.sqrt(2.0 * float(one["gravity"]) * float(one["length"])) / across
    return "averaged: √2 law", [(across, np.where(law <= ends(one, y)[1], law, np.nan))]


def characteristic(q: np.ndarray, count: int = 12) -> np.ndarray:
    """Return Mathieu's characteristic values a_0 < b_1 < a_1 < b_2 … of each q ≥ 0, shape (count, q.size).

    They are eigenvalues of two tridiagonal matrices, of the Fourier series of solutions with periods pi and 2 pi.
    """
    most = SIZE + 8 * math.ceil(math.sqrt(np.max(q)))
    even = 2.0 * np.arange(-(most // 2), most // 2 + 1)
    values = [
        [
            eigvalsh_tridiagonal(np.square(k), np.full(k.size - 1, one), select="i", select_range=(0, count - 1))
            for one in q
        ]
        for k in (even, even + 1.0)
    ]
    return np.sort(np.concatenate(values, axis=1), axis=1)[:, :count].T
