"""Maps of pumped bodies: measured regimes in colours, under the exact boundary of stability."""

import math

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from scipy.interpolate import CubicSpline
from scipy.linalg import eigvalsh_tridiagonal

from sweeps.figure import colors, style
from sweeps.reading.definitions import mapping_of
from sweeps.systems.pumped_body.presentation.look import LOOK
from sweeps.systems.pumped_body.variables import REGIMES

SHADES = 6  # of a regime's colour, by the growth in a period
DEEPEST = 1.0  # growth in a period that has the full colour
MOST_PANELS, MOST_DRAWN = 4, 600
MISSING = "#e6e6e6"
SIZE = 60  # of the tridiagonal matrices


def draw(ds: xr.Dataset, axis: int, ax: Axes | None = None) -> Figure | None:
    """Draw regimes about one axis over the two longest parameters, a panel for each value of a third.

    Args:
        ds: a map of `pumped_body`.
        axis: the spin axis.
        ax: where; left out, on a figure of its own.
    """
    part = ds[["regime", "growth_per_period", "trace_theory"]].sel(axis=axis)
    names = [name for name in part["regime"].dims if part.sizes[name] > 1]
    longest = sorted(names, key=lambda name: -part.sizes[name])[:2]
    if len(longest) < 2:
        return None
    y, x = sorted(longest, key=names.index)
    third = next((name for name in names if name not in longest), None)
    few = {name: style.few(part.sizes[name], MOST_DRAWN) for name in longest}
    part = part.isel(few | {name: 0 for name in part["regime"].dims if name not in (x, y, third)}).load()
    values = part[third].values[:MOST_PANELS] if third else [None]
    title = f"Spin about axis {axis} with moments that change periodically"
    figure = style.canvas(1.4 + 4.2 * len(values), 4.9, title, ds.attrs.get("title", ""), 0.36, ax=ax)
    for place, value in zip(np.atleast_1d(figure.subplots(1, len(values))), values, strict=True):
        one = part.sel({third: value}) if third else part
        if third:
            place.set_title(f"{LOOK.symbol(third)} = {style.number(float(value), 5)}", loc="left")
        _paint(place, one.transpose(y, x, ...), x, y)
        _boundary(place, ds, one, axis, x, y)
        place.set(xlabel=_label(ds, x), ylabel=_label(ds, y), xlim=_ends(one, x), ylim=_ends(one, y))
    seen = [name for k, name in enumerate(REGIMES) if (part["regime"].values == k - 1).any()]
    style.legend(figure, [Patch(facecolor=LOOK.color(name) or MISSING, label=LOOK.words(name)) for name in seen])
    return figure


def _label(ds: xr.Dataset, name: str) -> str:
    return style.with_unit(LOOK.symbol(name), ds[name].attrs.get("units", "1"), "  ({})")


def _ends(one: xr.Dataset, name: str) -> np.ndarray:
    return style.edges(one[name].values)[[0, -1]]


def _paint(ax: Axes, one: xr.Dataset, x: str, y: str) -> None:
    shades = style.Shades([LOOK.color(name) for name in REGIMES[1:]], SHADES).with_extremes(bad=MISSING)
    regime, growth = one["regime"].values, np.nan_to_num(one["growth_per_period"].values)
    depth = np.where(growth > 0.0, np.sqrt(np.minimum(growth / DEEPEST, 1.0)), 1.0)
    code = regime * SHADES + np.minimum((depth * SHADES).astype(int), SHADES - 1)
    norm = BoundaryNorm(np.arange(shades.N + 1) - 0.5, shades.N)
    edges = style.edges(one[x].values), style.edges(one[y].values)
    ax.pcolormesh(*edges, np.ma.masked_where(regime < 0, code), cmap=shades, norm=norm, rasterized=True, gid="measured")


def _boundary(ax: Axes, ds: xr.Dataset, one: xr.Dataset, axis: int, x: str, y: str) -> None:
    """Draw where linear theory has multipliers 1 and -1: Mathieu's curves where they hold, else the contours."""
    look = {"color": colors.INK, "linewidth": 1.0}
    curves = _curves(ds, one, axis, y) if x == "frequency" else None
    if curves is None:
        trace = np.abs(one["trace_theory"].transpose(y, x).values)
        ax.contour(one[x].values, one[y].values, trace, [2.0], colors=colors.INK, linewidths=1.0)
        return
    for number, (frequency, depth) in enumerate(curves):
        ax.plot(frequency, depth, gid="mathieu", label="Mathieu's curves, exact" if number == 0 else "", **look)


def _curves(ds: xr.Dataset, one: xr.Dataset, axis: int, depth: str) -> list | None:
    """Return (frequency, depth) along Mathieu's characteristic curves; None where the equation is another.

    With the inverse of one transverse moment I_j modulated, ``y'' + (a - 2 q cos 2 tau) y = 0`` in tau = nu t/2, where
    ``a = 4 L^2 c (1/I_j - 1/I_k)/nu^2``, ``q = 2 L^2 c d_j/(I_j nu^2)`` and ``c = 1/I_i - 1/I_k``.
    """
    others = [i for i in (1, 2, 3) if i != axis]
    modulated = {f"depth{i}" for i in (1, 2, 3) if one[f"depth{i}"].values.any()}
    inverse = mapping_of(ds.attrs["definition"]).get("modulation") == "inverse"
    if not inverse or modulated != {depth} or depth == f"depth{axis}":
        return None
    j = int(depth[-1])
    (i,) = set(others) - {j}
    if any(one[name].size > 1 for name in ("I1", "I2", "I3", "omega0")):
        return None
    Ii, Ij, Ik, spin = (float(one[name]) for name in (f"I{i}", f"I{j}", f"I{axis}", "omega0"))
    scale, mean = 4.0 * (spin * Ik) ** 2 * (1.0 / Ii - 1.0 / Ik), 1.0 / Ij - 1.0 / Ik
    found = []
    for sign in (1.0, -1.0):
        few, many = np.geomspace(1e-3, 1e3, 300), np.geomspace(1e-3, 1e3, 20_000)
        q = sign * many
        for a in CubicSpline(np.log(few), characteristic(few), axis=1)(np.log(many)):
            with np.errstate(invalid="ignore", divide="ignore"):
                square = scale * mean / a
                frequency, at = np.sqrt(square), 2.0 * q * square * Ij / scale
            found.append((np.where(square > 0.0, frequency, np.nan), at))
    low, high = _ends(one, depth)
    return [(f, np.where((d >= low) & (d <= high), d, np.nan)) for f, d in found if ((d >= low) & (d <= high)).any()]


def characteristic(q: np.ndarray, count: int = 12) -> np.ndarray:
    """Return Mathieu's characteristic values a_0, b_1, a_1, b_2, … of each q ≥ 0, shape (count, q.size).

    They are eigenvalues of four tridiagonal matrices, of the Fourier series of solutions with periods pi and 2 pi.
    """
    k = np.arange(SIZE + 8 * math.ceil(math.sqrt(np.max(q))), dtype=float)
    found = np.empty((q.size, count))
    for row, one in zip(found, q, strict=True):
        couplings = np.full(k.size - 1, one)
        even_first = couplings.copy()
        even_first[0] *= math.sqrt(2.0)
        odd = np.square(2.0 * k + 1.0)
        a_odd, b_odd = odd.copy(), odd.copy()
        a_odd[0], b_odd[0] = 1.0 + one, 1.0 - one
        most = (0, count // 2)
        classes = [(4.0 * k**2, even_first), (b_odd, couplings), (a_odd, couplings), (4.0 * (k + 1.0) ** 2, couplings)]
        values = [eigvalsh_tridiagonal(*matrix, select="i", select_range=most) for matrix in classes]
        even_a, odd_b, odd_a, even_b = values
        ordered = [even_a[0]]
        for n in range(count // 2):
            ordered += [odd_b[n], odd_a[n], even_b[n], even_a[n + 1]]
        row[:] = ordered[:count]
    return found.T
