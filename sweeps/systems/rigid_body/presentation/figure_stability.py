"""Stability maps: the measured signed rate over two moments of inertia, under the boundaries of linear theory."""

from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.text import Annotation

from kernels import linear
from kernels.rigid_body import cyclic
from kernels.triangle import triangle_margin
from sweeps.figure import axis_scales, canvas, colors, marks, sheets, wording
from sweeps.reading.definitions import file_text, plain, read_text
from sweeps.schema.datasets import Dataset, along
from sweeps.schema.iteration import spaced_indices
from sweeps.systems.presentation.regimes import dots
from sweeps.systems.rigid_body.fits import signed_rate
from sweeps.systems.rigid_body.presentation.appearance import APPEARANCE, axis_label, settings
from sweeps.systems.rigid_body.system import REGIMES, STATUSES

MOMENTS = ("I1", "I2", "I3")
MOST_CELLS = 1200  # a side; more than a print can show
MOST_COMPARED = 48  # values a dimension that the choice of the slice looks at
BESIDE = (6, -8)  # points: where a body's name stands
MISSING = "#8f8f8f"
# Body in the definitions that ship → its name here, and where that stands: offset in points, alignment.
NAMED = {
    "bodies.yaml": {
        "Earth": ("Earth, Moon, Mars", (0, -15), "right"),
        "Moon": ("", (0, 0), "left"),
        "Mars": ("", (0, 0), "left"),
        "Tennis racket (Wilson T-2000)": ("tennis racket", (6, -3), "left"),
        "Telephone as a uniform box": ("telephone", (6, -3), "left"),
        "Thin plate": ("thin plate", (-6, -9), "right"),
        "Water molecule": ("water molecule", (-7, -8), "right"),
    },
    "tumblers.yaml": {
        "(5247) Krylov": ("asteroid Krylov", (6, -3), "left"),
        "2008 TC3 (illustration)": ("asteroid 2008 TC₃", (7, -9), "left"),
        "1I/'Oumuamua as an ellipsoid 6 to 1 to 1 (illustration)": ("'Oumuamua", (3, 6), "left"),
    },
}


def planes(ds: Dataset) -> tuple[tuple[str, ...], dict[str, float]]:
    """Return the moments that a map's stability figures show, and the fixed values of the other parameters.

    The moments are two, one or none: the longest dimensions first, in order. Fixed are the least epsilon (theory is
    about small perturbations), the middle omega0 and phase, and the third moment where the bodies that can exist are
    shared most evenly among the regimes.
    """
    longest = sorted(MOMENTS, key=lambda name: -ds.sizes[name])[:2]
    sides = tuple(name for name in MOMENTS if name in longest and ds.sizes[name] > 1)
    fixed = {name: _middle(ds[name].values) for name in (*MOMENTS, "omega0", "phase") if name not in sides}
    fixed["epsilon"] = float(ds["epsilon"].values.min())
    if len(sides) == 2:
        (third,) = set(MOMENTS) - set(sides)
        fixed[third] = _most_telling(ds, sides, third)
    order = (*MOMENTS, "omega0", "epsilon", "phase")
    return sides, {name: fixed[name] for name in order if name in fixed}


def _middle(values: np.ndarray) -> float:
    return float(np.sort(values)[(values.size - 1) // 2])


def _most_telling(ds: Dataset, sides: tuple[str, str], third: str) -> float:
    """Return the third moment at which the rarest regime about any axis has the largest share of the bodies."""
    values, best, most = np.sort(ds[third].values), _middle(ds[third].values), 0.0
    thinned = {name: ds[name].values[spaced_indices(ds.sizes[name], MOST_COMPARED)] for name in sides}
    for value in values[spaced_indices(values.size, MOST_COMPARED)]:
        moments = np.meshgrid(*((thinned | {third: value})[name] for name in MOMENTS), indexing="ij")
        possible = [m.reshape(-1)[triangle_margin(*moments).reshape(-1) >= 0] for m in moments]
        regimes = [linear.regime(*possible, axis) for axis in ds["axis"].values.tolist()]
        kinds = (linear.STABLE_MINOR, linear.STABLE_MAJOR, linear.UNSTABLE) if possible[0].size else ()
        share = min((float(np.mean(regime == kind)) for regime in regimes for kind in kinds), default=0.0)
        best, most = (float(value), share) if share > most else (best, most)
    return best


def boundaries(axis: int, window: Mapping[str, tuple[float, float]], fixed: Mapping[str, float]) -> dict:
    """Return the curves on which linear theory has Ω² = 0 about an axis: I_a = I_b and I_a = I_c.

    `window` is moment → (least, greatest) value shown, of two moments or of one (kg m2); the others are fixed. Returned
    is pair of moments ("I1", "I2") → moment → values along the boundary (a constant, or 200 points of a line), for the
    boundaries that cross the window.
    """
    a, *partners = (MOMENTS[i] for i in cyclic(axis))
    lines = {}
    for partner in partners:
        pair = (a, partner)
        inside = [name for name in pair if name in window]
        if len(inside) == 2:
            low, high = (f(window[a][i], window[partner][i]) for i, f in enumerate((max, min)))
            if low < high:
                lines[pair] = dict.fromkeys(pair, np.linspace(low, high, 200))
        elif len(inside) == 1:
            (outside,) = set(pair) - set(inside)
            low, high = window[inside[0]]
            if low < fixed[outside] < high:
                lines[pair] = {inside[0]: np.full(200, fixed[outside])}
    return lines


# ---------------------------------------------------------------------------------------------------------
# The pictures


def draw(ds: Dataset, axis: int, ax: Axes | None = None) -> Figure | None:
    """Draw the stability about one axis: a map over two moments, a curve over one, None where none varies."""
    sides, fixed = planes(ds)
    if not sides:
        return None
    part = _slice(ds, axis, sides, fixed)
    title = f"Spin about axis {axis}: measured stability"
    subtitle = f"{ds.attrs.get('title', '')}\n{settings(fixed)}".strip()
    if len(sides) == 2:
        figure = canvas.make_figure(6.4, 5.9, title, subtitle, ax=ax)
        return _map(figure, part, axis, sides, fixed)
    return _curve(canvas.make_figure(6.4, 4.8, title, subtitle, ax=ax), part, axis, sides, fixed)


def _slice(ds: Dataset, axis: int, sides: tuple[str, ...], fixed: Mapping[str, float]) -> Mapping[str, np.ndarray]:
    """Return the plane (or line) of a picture, at most `MOST_CELLS` a side, with its `signed_rate`; (…, x) last."""
    at = {name: int(np.flatnonzero(ds[name].values == value)[0]) for name, value in fixed.items()}
    at |= {"axis": int(np.flatnonzero(ds["axis"].values == axis)[0])}
    at |= {name: slice(None, None, -(-ds.sizes[name] // MOST_CELLS)) for name in sides}
    part = {name: ds[name].values[at[name]] for name in sides}
    order = {name: np.argsort(values, kind="stable") for name, values in part.items()}
    part = {name: values[order[name]] for name, values in part.items()}
    for name in ("omega_squared", "triangle_margin", "status", "regime"):
        variable = ds[name].isel({dim: at[dim] for dim in ds[name].dims if dim in at})
        part[name] = along(variable, sides[::-1])[np.ix_(*(order[dim] for dim in reversed(sides)))]
    return part | {"signed_rate": signed_rate(part["omega_squared"], fixed["omega0"])}


def _map(figure, part, axis, sides, fixed) -> Figure:
    ax = figure.add_subplot()
    x, y = (axis_scales.cell_edges(part[name]) for name in sides)
    mesh = _paint(ax, x, y, part)
    _set_axes(ax, part, sides, x, y)
    (third,) = set(MOMENTS) - set(sides)
    _hatch(ax, x, y, part, fixed[third])
    mark_untrusted(ax, *np.meshgrid(part[sides[0]], part[sides[1]]), part["status"])
    window = {name: (e[0], e[-1]) for name, e in zip(sides, (x, y), strict=True)}
    lines = boundaries(axis, window, fixed)
    _draw_boundaries(ax, lines, sides)
    taken = _mark_bodies(ax, sides, window, fixed[third])
    _name_regions(ax, part, sides, lines, taken)
    color_bar(figure, ax, mesh)
    canvas.draw_legend(figure, list(_unnamed(part)))
    return figure


def _paint(ax: Axes, x, y, part: Mapping[str, np.ndarray]):
    rate = np.ma.masked_invalid(part["signed_rate"])
    possible = np.ma.masked_where(part["triangle_margin"] < 0, rate)
    scale = possible if possible.count() else rate
    limit = float(np.abs(scale).max()) if scale.count() else 1.0
    limit = limit if limit > 0 else 1.0
    ax.set_facecolor(MISSING)
    return ax.pcolormesh(x, y, rate, cmap=sheets.color_map("signed"), norm=Normalize(-limit, limit), rasterized=True)


def _set_axes(ax: Axes, part: Mapping[str, np.ndarray], sides, x, y) -> None:
    ax.set(xlim=(x[0], x[-1]), ylim=(y[0], y[-1]), xlabel=axis_label(sides[0]), ylabel=axis_label(sides[1]))
    for direction, name in zip((ax.xaxis, ax.yaxis), sides, strict=True):
        axis_scales.set_scale(direction, part[name])


def _hatch(ax: Axes, x, y, part: Mapping[str, np.ndarray], third: float) -> None:
    """Hatch impossible bodies, up to the line on which one moment is the sum of both others.

    Of two moments p and q and a third, r: q below |p − r|, and q above p + r.
    """
    if not (part["triangle_margin"] < 0).any():
        return
    at = np.unique(np.append(_between(ax.get_xscale(), x[0], x[-1]), np.clip(third, x[0], x[-1])))
    low, high = np.clip(np.abs(at - third), y[0], y[-1]), np.clip(at + third, y[0], y[-1])
    props = {"facecolor": colors.PAPER, "edgecolor": colors.OUTLINE, "lw": 0.0, "hatch": "/////", "gid": "impossible"}
    label = "impossible: one moment exceeds the sum of the others"
    for edge, end in ((low, y[0]), (high, y[-1])):
        ax.fill_between(at, edge, end, label=label, **props)
        inside = np.where((edge > y[0]) & (edge < y[-1]), edge, np.nan)
        ax.plot(at, inside, color=colors.OUTLINE, lw=0.9, gid="triangle")


def _between(scale: str, low: float, high: float) -> np.ndarray:
    return (np.geomspace if scale == "log" else np.linspace)(low, high, 400)


def _unnamed(part: Mapping[str, np.ndarray]) -> Iterator[Patch]:
    """Yield the legend's entries for regions that are not named in the panel."""
    if np.isin(part["regime"], (linear.MARGINAL, linear.SPHERE)).any():
        yield Patch(facecolor="#f7f7f7", edgecolor=colors.QUIET, lw=0.7, label=r"marginal: $\Omega^2 = 0$")
    if missing := int(np.count_nonzero(~np.isfinite(part["signed_rate"]))):
        yield Patch(facecolor=MISSING, label=f"no value ({missing:,})")


def mark_untrusted(ax: Axes, x: np.ndarray, y: np.ndarray, status: np.ndarray) -> None:
    """Mark points whose status is not ok, one kind of mark a status; `x` and `y` are of the points' shape."""
    for number, mark in ((1, "."), (2, "x"), (3, "+")):
        if (at := status == number).any():
            label = f"{APPEARANCE.words(STATUSES[number])} ({np.count_nonzero(at):,})"
            props = {"ms": 4, "color": colors.INK, "alpha": 0.8, "gid": f"status {number}", "label": label}
            ax.plot(x[at], y[at], mark, zorder=5, **props)


def _mark_bodies(ax: Axes, sides, window: Mapping[str, tuple[float, float]], third: float) -> list:
    """Mark real bodies by name, each scaled to the third moment: rates in units of the spin do not change by that.

    Returns:
        Where in the frame something is written now, as fractions.
    """
    at, (other,) = [MOMENTS.index(name) for name in sides], {0, 1, 2} - {MOMENTS.index(name) for name in sides}
    taken = []
    for name, ratios, *_ in real_bodies("bodies.yaml"):
        xy = [third * ratios[k] / ratios[other] for k in at]
        if not all(window[m][0] < v < window[m][1] for m, v in zip(sides, xy, strict=True)):
            continue
        dot = {"ms": 5.0, "mec": colors.PAPER, "mew": 0.9, "color": colors.INK}
        ax.plot(*([v] for v in xy), marker="o", zorder=6, gid="body", **dot)
        if name:
            props = {"fontsize": 8, "zorder": 7, "path_effects": marks.halo(2.2), "gid": "body"}
            marks.annotate(ax, name, xy, BESIDE, **props)
        u, v = marks.axes_fractions(ax, *xy)[0]
        taken += [(u + step, v - 0.01) for step in np.linspace(0.0, 0.2 if name else 0.0, 5)]
    return taken


@cache
def real_bodies(*files: str) -> tuple[tuple[str, tuple[float, float, float], tuple, str], ...]:
    """Return name, moments in units of the third, offset and alignment of real bodies, of some or all definitions."""
    bodies = []
    for file, named in NAMED.items():
        if files and file not in files:
            continue
        for body in plain(read_text(file_text(Path(__file__).parents[3] / "definitions" / file)))["bodies"]:
            if body["name"] in named:
                given = body.get("ratios", body)
                moments = [float(given[name]) for name in MOMENTS]
                name, offset, side = named[body["name"]]
                bodies.append((name, tuple(moment / moments[2] for moment in moments), offset, side))
    return tuple(bodies)


def _pair_text(pair: tuple[str, str]) -> str:
    return " = ".join(APPEARANCE.symbol(name) for name in sorted(pair))


def _draw_boundaries(ax: Axes, lines: Mapping, sides) -> None:
    """Draw each boundary with its name: a diagonal's along it, the others' where they leave the frame."""
    for pair, line in lines.items():
        upright, level = sides[1] not in line, sides[0] not in line
        xs, ys = _course(ax, line, sides)
        ax.plot(xs, ys, color=colors.INK, lw=1.5, gid=_pair_text(pair), path_effects=marks.halo(2.6))
        if upright:
            _outside(ax, pair, (xs[0], 1.0), ax.get_xaxis_transform(), (0, 3), ha="center", va="bottom")
        elif level:
            _outside(ax, pair, (1.0, ys[0]), ax.get_yaxis_transform(), (4, 0), ha="left", va="center")
        else:
            others = [other for other in lines.values() if other is not line]
            crossings = [int(np.searchsorted(xs, next(iter(other.values()))[0])) for other in others]
            at = 176 if all(abs(at - 176) > 40 for at in crossings) else 80  # near the end, if no other crosses there
            ax.add_artist(_Along(_pair_text(pair), xs[[at - 24, at]], ys[[at - 24, at]]))


class _Along(Annotation):
    """A text along a line through two points, that ends at the second: its angle is known once it is drawn."""

    def __init__(self, text: str, xs: np.ndarray, ys: np.ndarray):
        props = {"ha": "right", "va": "bottom", "rotation_mode": "anchor", "path_effects": marks.halo()}
        super().__init__(text, (xs[1], ys[1]), (-4, 4), textcoords="offset points", gid="along", **props)
        self._line = np.column_stack([xs, ys])

    def get_rotation(self) -> float:
        """Return the label's angle on the screen in degrees."""
        if self.axes is None:
            return 0.0
        (x, y), (u, v) = self.axes.transData.transform(self._line)
        return float(np.degrees(np.arctan2(v - y, u - x)))


def _outside(ax: Axes, pair, xy, transform, offset, **alignment) -> None:
    marks.annotate(ax, _pair_text(pair), xy, offset, xycoords=transform, **alignment)


def _name_regions(ax: Axes, part: Mapping[str, np.ndarray], sides, lines: Mapping, taken: list) -> None:
    """Write each regime's name where its region has most room, if there is enough."""
    keep = [spaced_indices(part[name].size, 40) for name in sides]
    points = marks.axes_fractions(ax, *np.meshgrid(*(part[name][at] for name, at in zip(sides, keep, strict=True))))
    regimes = part["regime"][np.ix_(*reversed(keep))]
    possible = part["triangle_margin"][np.ix_(*reversed(keep))] >= 0
    drawn = [marks.axes_fractions(ax, *_course(ax, line, sides)) for line in lines.values()]
    drawn += [np.array(taken)] if taken else []
    for kind in (linear.STABLE_MINOR, linear.STABLE_MAJOR, linear.UNSTABLE):
        inside = (possible & (regimes == kind)).reshape(-1)
        if inside.any():
            text = APPEARANCE.words(REGIMES[kind + 1]).replace(", ", "\n")
            _write_inside(ax, text, points[inside], np.concatenate([points[~inside], *drawn]))


def _write_inside(ax: Axes, text: str, points: np.ndarray, others: np.ndarray) -> None:
    lines = text.split("\n")
    box = np.array([0.011 * max(map(len, lines)) + 0.012, 0.02 * len(lines) + 0.02])  # half width and height
    frame = np.min(np.minimum(points, 1.0 - points) / box, axis=1)
    apart = np.max(np.abs(points[:, None] - others[None]) / box, axis=2)
    room = np.minimum(frame, apart.min(axis=1, initial=np.inf))  # how many times a box can grow until it meets either
    best = int(np.argmax(room))
    if room[best] >= 1.0:
        props = {"ha": "center", "va": "center", "fontsize": 8.5, "fontweight": "bold", "linespacing": 1.15}
        ax.text(*points[best], text, transform=ax.transAxes, path_effects=marks.halo(2.2), gid="region", **props)


def _course(ax: Axes, line: Mapping[str, np.ndarray], sides) -> list[np.ndarray]:
    """Return points of a boundary: from end to end of the frame where it is upright or level."""
    ends = (ax.get_xlim(), ax.get_ylim())
    return [line[name] if name in line else np.linspace(*end, 200) for name, end in zip(sides, ends, strict=True)]


def color_bar(figure: Figure, ax: Axes, mesh) -> None:
    """Draw the scale of a signed rate beside a panel: growth below zero, frequency above."""
    bar = figure.colorbar(mesh, ax=ax, pad=0.03, fraction=0.06, aspect=30, extend="neither")
    ticks = [tick for tick in bar.get_ticks() if abs(tick) <= mesh.norm.vmax]
    decimals = max(len(f"{abs(tick):.6g}".partition(".")[2]) for tick in ticks)
    bar.set_ticks(
        ticks, labels=[f"{abs(t):.{decimals}f}" if decimals <= 4 else wording.format_number(abs(t), 3) for t in ticks]
    )
    bar.outline.set_linewidth(0.8)
    props = {"xycoords": "axes fraction", "rotation": 90, "ha": "left", "va": "center"}
    marks.annotate(bar.ax, r"growth rate / $|\omega_0|$", (1.0, 0.25), (36, 0), color=colors.UNSTABLE, **props)
    marks.annotate(bar.ax, r"frequency $\Omega$ / $|\omega_0|$", (1.0, 0.75), (36, 0), color=colors.STABLE, **props)


def _curve(figure, part, axis, varied, fixed) -> Figure:
    (name,) = varied
    ax = figure.add_subplot()
    cells = axis_scales.cell_edges(part[name])
    ax.set(xlim=(cells[0], cells[-1]), xlabel=axis_label(name), ylabel=r"measured rate $/\,|\omega_0|$")
    axis_scales.set_scale(ax.xaxis, part[name])
    sides = ((0.97, "top", "oscillates", colors.STABLE), (0.03, "bottom", "grows", colors.UNSTABLE))
    for y, va, word, color in sides:
        ax.text(0.015, y, word, transform=ax.transAxes, va=va, color=color, path_effects=marks.halo())
    xs = _between(ax.get_xscale(), cells[0], cells[-1])
    moments = [xs if m == name else fixed[m] for m in MOMENTS]
    rate = signed_rate(linear.omega_squared(*moments, fixed["omega0"], axis), fixed["omega0"])
    ax.axhline(0.0, color=colors.FAINT, lw=0.8, zorder=0)
    ax.plot(xs, rate, color=colors.QUIET, lw=1.2, label="linear theory", gid="theory")
    finite = np.isfinite(part["signed_rate"])
    x, y, codes = (part[which][finite] for which in (name, "signed_rate", "regime"))
    dots(ax, x, y, codes + 1, REGIMES, APPEARANCE, ms=4.5, mec=colors.PAPER, mew=0.5, gid="measured")
    props = {"facecolor": "none", "edgecolor": "#9a9da1", "hatch": "/////", "lw": 0, "zorder": 0, "gid": "impossible"}
    change = np.flatnonzero(np.diff(part["triangle_margin"] < 0, prepend=False, append=False))
    for first, after in change.reshape(-1, 2):
        ax.axvspan(cells[first], cells[after], label="physically impossible", **props)
    for pair, line in boundaries(axis, {name: (cells[0], cells[-1])}, fixed).items():
        ax.axvline(line[name][0], color=colors.INK, lw=1.2, gid=_pair_text(pair))
        _outside(ax, pair, (line[name][0], 1.0), ax.get_xaxis_transform(), (0, 3), ha="center", va="bottom")
    canvas.draw_legend(figure)
    return figure
