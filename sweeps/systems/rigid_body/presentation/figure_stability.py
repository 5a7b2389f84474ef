"""Stability maps: the measured signed rate over two moments of inertia, under the boundaries of linear theory."""

from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.text import Annotation

from kernels.free import linear
from kernels.free.rigid_body import cyclic
from kernels.free.triangle import triangle_margin
from sweeps.figure import axis_scales, canvas, colors, marks, sheets, wording
from sweeps.reading.definitions import file_text, plain, read_text
from sweeps.schema.datasets import Dataset, along
from sweeps.schema.iteration import spaced_indices
from sweeps.systems.presentation.regimes import draw_points
from sweeps.systems.rigid_body.fits import signed_rate
from sweeps.systems.rigid_body.presentation.appearance import APPEARANCE, axis_label, settings
from sweeps.systems.rigid_body.system import REGIMES, STATUSES

MOMENTS = ("I1", "I2", "I3")
MAX_CELLS = 1200  # cells per side; a print cannot show more
MAX_COMPARED = 48  # values per dimension that are compared to choose the slice
NAME_OFFSET = (6, -8)  # points, from a body's mark to its name
MISSING = "#8f8f8f"
# Body in a shipped definition → (its short name, offset from its mark in points, alignment).
BODY_LABELS = {
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


def plane_and_cuts(ds: Dataset) -> tuple[tuple[str, ...], dict[str, float]]:
    """Return the moments that a map's stability figures show, and the fixed values of all further parameters.

    The moments are the two longest dimensions, one or none, in storage order. The fixed values are the least epsilon
    (theory is about small perturbations), the middle omega0 and phase, and the third moment at which the possible
    bodies are most evenly distributed over the regimes.
    """
    longest = sorted(MOMENTS, key=lambda name: -ds.sizes[name])[:2]
    sides = tuple(name for name in MOMENTS if name in longest and ds.sizes[name] > 1)
    fixed_values = {name: _middle(ds[name].values) for name in (*MOMENTS, "omega0", "phase") if name not in sides}
    fixed_values["epsilon"] = float(ds["epsilon"].values.min())
    if len(sides) == 2:
        (third,) = set(MOMENTS) - set(sides)
        fixed_values[third] = _most_balanced_value(ds, sides, third)
    order = (*MOMENTS, "omega0", "epsilon", "phase")
    return sides, {name: fixed_values[name] for name in order if name in fixed_values}


def _middle(values: np.ndarray) -> float:
    return float(np.sort(values)[(values.size - 1) // 2])


def _most_balanced_value(ds: Dataset, sides: tuple[str, str], third: str) -> float:
    """Return the third moment at which the rarest regime about any axis has the largest fraction of the bodies."""
    values, best, best_fraction = np.sort(ds[third].values), _middle(ds[third].values), 0.0
    samples = {name: ds[name].values[spaced_indices(ds.sizes[name], MAX_COMPARED)] for name in sides}
    for value in values[spaced_indices(values.size, MAX_COMPARED)]:
        moments = np.meshgrid(*((samples | {third: value})[name] for name in MOMENTS), indexing="ij")
        possible = [m.reshape(-1)[triangle_margin(*moments).reshape(-1) >= 0] for m in moments]
        regimes = [linear.regime(*possible, axis) for axis in ds["axis"].values.tolist()]
        codes = (linear.STABLE_MINOR, linear.STABLE_MAJOR, linear.UNSTABLE) if possible[0].size else ()
        fraction = min((float(np.mean(regime == code)) for regime in regimes for code in codes), default=0.0)
        best, best_fraction = (float(value), fraction) if fraction > best_fraction else (best, best_fraction)
    return best


def boundaries(axis: int, window: Mapping[str, tuple[float, float]], fixed_values: Mapping[str, float]) -> dict:
    """Return the curves on which linear theory has Ω² = 0 about an axis: I_a = I_b and I_a = I_c.

    Args:
        axis: spin axis a, 1 to 3.
        window: moment → (least, greatest) value shown, of one moment or two, kg m2.
        fixed_values: moment → value of each moment that is not in the window, kg m2.

    Returns:
        Pair of moments ("I1", "I2") → moment → values along the boundary (a constant, or 200 points of a line), for
        each boundary that crosses the window.
    """
    a, *partners = (MOMENTS[i] for i in cyclic(axis))
    lines = {}
    for partner in partners:
        pair = (a, partner)
        in_window = [name for name in pair if name in window]
        if len(in_window) == 2:
            low, high = (f(window[a][i], window[partner][i]) for i, f in enumerate((max, min)))
            if low < high:
                lines[pair] = dict.fromkeys(pair, np.linspace(low, high, 200))
        elif len(in_window) == 1:
            (third,) = set(pair) - set(in_window)
            low, high = window[in_window[0]]
            if low < fixed_values[third] < high:
                lines[pair] = {in_window[0]: np.full(200, fixed_values[third])}
    return lines


# -- the pictures


def draw(ds: Dataset, axis: int, ax: Axes | None = None) -> Figure | None:
    """Draw the stability about one axis: a map over two moments, or a curve over one; return None if none varies."""
    sides, fixed_values = plane_and_cuts(ds)
    if not sides:
        return None
    plane = _select_plane(ds, axis, sides, fixed_values)
    title = f"Spin about axis {axis}: measured stability"
    subtitle = f"{ds.attrs.get('title', '')}\n{settings(fixed_values)}".strip()
    if len(sides) == 2:
        figure = canvas.make_figure(6.4, 5.9, title, subtitle, ax=ax)
        return _draw_map(figure, plane, axis, sides, fixed_values)
    return _draw_curve(canvas.make_figure(6.4, 4.8, title, subtitle, ax=ax), plane, axis, sides, fixed_values)


def _select_plane(
    ds: Dataset, axis: int, sides: tuple[str, ...], fixed_values: Mapping[str, float]
) -> Mapping[str, np.ndarray]:
    """Return the columns of a picture's plane (or line) and `signed_rate`, shape (…, x), at most `MAX_CELLS`²."""
    indices: dict[str, int | slice] = {
        name: int(np.flatnonzero(ds[name].values == value)[0]) for name, value in fixed_values.items()
    }
    indices |= {"axis": int(np.flatnonzero(ds["axis"].values == axis)[0])}
    indices |= {name: slice(None, None, -(-ds.sizes[name] // MAX_CELLS)) for name in sides}
    columns = {name: ds[name].values[indices[name]] for name in sides}
    order = {name: np.argsort(values, kind="stable") for name, values in columns.items()}
    columns = {name: values[order[name]] for name, values in columns.items()}
    for name in ("omega_squared", "triangle_margin", "status", "regime"):
        variable = ds[name].isel({dim: indices[dim] for dim in ds[name].dims if dim in indices})
        columns[name] = along(variable, sides[::-1])[np.ix_(*(order[dim] for dim in reversed(sides)))]
    return columns | {"signed_rate": signed_rate(columns["omega_squared"], fixed_values["omega0"])}


def _draw_map(figure, plane, axis, sides, fixed_values) -> Figure:
    """Draw signed rates over a plane of two moments, with statuses, boundaries, regions and bodies.

    Args:
        figure: the empty figure.
        plane: columns of `_select_plane`.
        axis: spin axis, 1 to 3.
        sides: names of the moments along x and y.
        fixed_values: value of each further parameter by name.
    """
    ax = figure.add_subplot()
    x, y = (axis_scales.cell_edges(plane[name]) for name in sides)
    mesh = _draw_cells(ax, x, y, plane)
    _set_axes(ax, plane, sides, x, y)
    (third,) = set(MOMENTS) - set(sides)
    _hatch_impossible(ax, x, y, plane, fixed_values[third])
    mark_statuses(ax, *np.meshgrid(plane[sides[0]], plane[sides[1]]), plane["status"])
    window = {name: (e[0], e[-1]) for name, e in zip(sides, (x, y), strict=True)}
    lines = boundaries(axis, window, fixed_values)
    _draw_boundaries(ax, lines, sides)
    text_points = _mark_bodies(ax, sides, window, fixed_values[third])
    _name_regions(ax, plane, sides, lines, text_points)
    draw_color_bar(figure, ax, mesh)
    canvas.draw_legend(figure, list(_legend_patches(plane)))
    return figure


def _draw_cells(ax: Axes, x, y, plane: Mapping[str, np.ndarray]):
    """Draw signed rates as coloured cells, with a colour range symmetric about 0 and fitted to possible bodies."""
    rate = np.ma.masked_invalid(plane["signed_rate"])
    possible = np.ma.masked_where(plane["triangle_margin"] < 0, rate)
    scale = possible if possible.count() else rate
    limit = float(np.abs(scale).max()) if scale.count() else 1.0
    limit = limit if limit > 0 else 1.0
    ax.set_facecolor(MISSING)
    return ax.pcolormesh(x, y, rate, cmap=sheets.color_map("signed"), norm=Normalize(-limit, limit), rasterized=True)


def _set_axes(ax: Axes, plane: Mapping[str, np.ndarray], sides, x, y) -> None:
    ax.set(xlim=(x[0], x[-1]), ylim=(y[0], y[-1]), xlabel=axis_label(sides[0]), ylabel=axis_label(sides[1]))
    for direction, name in zip((ax.xaxis, ax.yaxis), sides, strict=True):
        axis_scales.set_scale(direction, plane[name])


def _hatch_impossible(ax: Axes, x, y, plane: Mapping[str, np.ndarray], third: float) -> None:
    """Hatch impossible bodies, up to the line on which one moment is the sum of the two remaining moments.

    For moments p and q along the sides and a third moment r: q < |p − r| and q > p + r.
    """
    if not (plane["triangle_margin"] < 0).any():
        return
    p = np.unique(np.append(_spaced_values(ax.get_xscale(), x[0], x[-1]), np.clip(third, x[0], x[-1])))
    lower, upper = np.clip(np.abs(p - third), y[0], y[-1]), np.clip(p + third, y[0], y[-1])
    look: dict[str, Any] = {"facecolor": colors.PAPER, "edgecolor": colors.OUTLINE, "lw": 0.0, "hatch": "/////"}
    label = "impossible: one moment exceeds the sum of the others"
    for edge, frame_edge in ((lower, y[0]), (upper, y[-1])):
        ax.fill_between(p, edge, frame_edge, label=label, gid="impossible", **look)
        visible = np.where((edge > y[0]) & (edge < y[-1]), edge, np.nan)
        ax.plot(p, visible, color=colors.OUTLINE, lw=0.9, gid="triangle")


def _spaced_values(scale: str, low: float, high: float) -> np.ndarray:
    return (np.geomspace if scale == "log" else np.linspace)(low, high, 400)


def _legend_patches(plane: Mapping[str, np.ndarray]) -> Iterator[Patch]:
    """Yield the legend's entries for regions that are not named in the panel."""
    if np.isin(plane["regime"], (linear.MARGINAL, linear.SPHERE)).any():
        yield Patch(facecolor="#f7f7f7", edgecolor=colors.QUIET, lw=0.7, label=r"marginal: $\Omega^2 = 0$")
    if num_missing := int(np.count_nonzero(~np.isfinite(plane["signed_rate"]))):
        yield Patch(facecolor=MISSING, label=f"no value ({num_missing:,})")


def mark_statuses(ax: Axes, x: np.ndarray, y: np.ndarray, status: np.ndarray) -> None:
    """Mark points with a status other than ok, each status by its own marker.

    Args:
        ax: the panel.
        x: coordinates, of any shape.
        y: coordinates, of the same shape.
        status: status codes, of the same shape.
    """
    for number, marker in ((1, "."), (2, "x"), (3, "+")):
        if (has_status := status == number).any():
            label = f"{APPEARANCE.words(STATUSES[number])} ({np.count_nonzero(has_status):,})"
            look: dict[str, Any] = {"ms": 4, "color": colors.INK, "alpha": 0.8, "zorder": 5}
            ax.plot(x[has_status], y[has_status], marker, label=label, gid=f"status {number}", **look)


def _mark_bodies(ax: Axes, sides, window: Mapping[str, tuple[float, float]], third: float) -> list:
    """Mark real bodies by name, each scaled to the third moment, which does not change rates in units of the spin.

    Returns:
        Points of the frame that are covered by text, as fractions of the frame.
    """
    side_indices = [MOMENTS.index(name) for name in sides]
    (third_index,) = {0, 1, 2} - {MOMENTS.index(name) for name in sides}
    text_points = []
    for name, ratios, *_ in real_bodies("bodies.yaml"):
        xy = [third * ratios[k] / ratios[third_index] for k in side_indices]
        if not all(window[m][0] < v < window[m][1] for m, v in zip(sides, xy, strict=True)):
            continue
        dot: dict[str, Any] = {"ms": 5.0, "mec": colors.PAPER, "mew": 0.9, "color": colors.INK}
        ax.plot(*([v] for v in xy), marker="o", zorder=6, gid="body", **dot)
        if name:
            props = {"fontsize": 8, "zorder": 7, "path_effects": marks.halo(2.2), "gid": "body"}
            marks.annotate(ax, name, xy, NAME_OFFSET, **props)
        u, v = marks.axes_fractions(ax, *xy)[0]
        text_points += [(u + step, v - 0.01) for step in np.linspace(0.0, 0.2 if name else 0.0, 5)]
    return text_points


@cache
def real_bodies(*files: str) -> tuple[tuple[str, tuple[float, ...], tuple, str], ...]:
    """Return label, moments in units of I3, offset and alignment of real bodies in `files`, or in all definitions."""
    bodies: list[tuple[str, tuple[float, ...], tuple, str]] = []
    for file, labels in BODY_LABELS.items():
        if files and file not in files:
            continue
        for body in plain(read_text(file_text(Path(__file__).parents[3] / "definitions" / file)))["bodies"]:
            if body["name"] in labels:
                entry = body.get("ratios", body)
                moments = [float(entry[name]) for name in MOMENTS]
                name, offset, side = labels[body["name"]]
                bodies.append((name, tuple(moment / moments[2] for moment in moments), offset, side))
    return tuple(bodies)


def _pair_text(pair: tuple[str, str]) -> str:
    return " = ".join(APPEARANCE.symbol(name) for name in sorted(pair))


def _draw_boundaries(ax: Axes, lines: Mapping, sides) -> None:
    """Draw each boundary with its name: along a diagonal one, at the frame's edge of a vertical or horizontal one."""
    for pair, line in lines.items():
        is_vertical, is_horizontal = sides[1] not in line, sides[0] not in line
        xs, ys = _boundary_points(ax, line, sides)
        ax.plot(xs, ys, color=colors.INK, lw=1.5, gid=_pair_text(pair), path_effects=marks.halo(2.6))
        if is_vertical:
            _label_at_edge(ax, pair, (xs[0], 1.0), ax.get_xaxis_transform(), (0, 3), ha="center", va="bottom")
        elif is_horizontal:
            _label_at_edge(ax, pair, (1.0, ys[0]), ax.get_yaxis_transform(), (4, 0), ha="left", va="center")
        else:
            diagonals = [diagonal for diagonal in lines.values() if diagonal is not line]
            crossings = [int(np.searchsorted(xs, next(iter(diagonal.values()))[0])) for diagonal in diagonals]
            # near the end, unless another boundary crosses there
            end = 176 if all(abs(end - 176) > 40 for end in crossings) else 80
            ax.add_artist(_LineLabel(_pair_text(pair), xs[[end - 24, end]], ys[[end - 24, end]]))


class _LineLabel(Annotation):
    """A text along a line through two points, ending at the second. Its angle depends on the scale when it is drawn."""

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


def _label_at_edge(ax: Axes, pair, xy, transform, offset, **alignment) -> None:
    marks.annotate(ax, _pair_text(pair), xy, offset, xycoords=transform, **alignment)


def _name_regions(ax: Axes, plane: Mapping[str, np.ndarray], sides, lines: Mapping, text_points: list) -> None:
    """Write each regime's name in the widest place of its region, if it fits."""
    samples = [spaced_indices(plane[name].size, 40) for name in sides]
    points = marks.axes_fractions(ax, *np.meshgrid(*(plane[name][at] for name, at in zip(sides, samples, strict=True))))
    regimes = plane["regime"][np.ix_(*reversed(samples))]
    possible = plane["triangle_margin"][np.ix_(*reversed(samples))] >= 0
    obstacles = [marks.axes_fractions(ax, *_boundary_points(ax, line, sides)) for line in lines.values()]
    obstacles += [np.array(text_points)] if text_points else []
    for code in (linear.STABLE_MINOR, linear.STABLE_MAJOR, linear.UNSTABLE):
        in_region = (possible & (regimes == code)).reshape(-1)
        if in_region.any():
            text = APPEARANCE.words(REGIMES[code + 1]).replace(", ", "\n")
            _write_inside(ax, text, points[in_region], np.concatenate([points[~in_region], *obstacles]))


def _write_inside(ax: Axes, text: str, points: np.ndarray, obstacles: np.ndarray) -> None:
    """Write the text at the point farthest from frame and obstacles, in axes coordinates; skip it without room."""
    lines = text.split("\n")
    half_size = np.array([0.011 * max(map(len, lines)) + 0.012, 0.02 * len(lines) + 0.02])  # half width and height
    frame_distance = np.min(np.minimum(points, 1.0 - points) / half_size, axis=1)
    obstacle_distance = np.max(np.abs(points[:, None] - obstacles[None]) / half_size, axis=2)
    # factor by which the box can grow until it meets the frame or an obstacle
    clearance = np.minimum(frame_distance, obstacle_distance.min(axis=1, initial=np.inf))
    best = int(np.argmax(clearance))
    if clearance[best] >= 1.0:
        props: dict[str, Any] = {
            "ha": "center",
            "va": "center",
            "fontsize": 8.5,
            "fontweight": "bold",
            "linespacing": 1.15,
        }
        ax.text(*points[best], text, transform=ax.transAxes, path_effects=marks.halo(2.2), gid="region", **props)


def _boundary_points(ax: Axes, line: Mapping[str, np.ndarray], sides) -> list[np.ndarray]:
    """Return points of a boundary; a vertical or horizontal one extends from end to end of the frame."""
    ends = (ax.get_xlim(), ax.get_ylim())
    return [line[name] if name in line else np.linspace(*end, 200) for name, end in zip(sides, ends, strict=True)]


def draw_color_bar(figure: Figure, ax: Axes, mesh) -> None:
    """Draw the scale of a signed rate, growth below zero and frequency above, next to the panel `ax` of `figure`.

    `mesh` has the colours and their range.
    """
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


def _draw_curve(figure, line_values, axis, sides, fixed_values) -> Figure:
    """Draw measured signed rates over the only moment that varies, with theory, boundaries and impossible ranges.

    See `_draw_map` for the arguments; `sides` has the name of this moment alone.
    """
    (name,) = sides
    ax = figure.add_subplot()
    cells = axis_scales.cell_edges(line_values[name])
    ax.set(xlim=(cells[0], cells[-1]), xlabel=axis_label(name), ylabel=r"measured rate $/\,|\omega_0|$")
    axis_scales.set_scale(ax.xaxis, line_values[name])
    side_labels = ((0.97, "top", "oscillates", colors.STABLE), (0.03, "bottom", "grows", colors.UNSTABLE))
    for y, va, word, color in side_labels:
        ax.text(0.015, y, word, transform=ax.transAxes, va=va, color=color, path_effects=marks.halo())
    theory_x = _spaced_values(ax.get_xscale(), cells[0], cells[-1])
    moments = [theory_x if m == name else fixed_values[m] for m in MOMENTS]
    rate = signed_rate(linear.omega_squared(*moments, fixed_values["omega0"], axis), fixed_values["omega0"])
    ax.axhline(0.0, color=colors.FAINT, lw=0.8, zorder=0)
    ax.plot(theory_x, rate, color=colors.QUIET, lw=1.2, label="linear theory", gid="theory")
    finite = np.isfinite(line_values["signed_rate"])
    x, y, codes = (line_values[column][finite] for column in (name, "signed_rate", "regime"))
    draw_points(ax, x, y, codes + 1, REGIMES, APPEARANCE, ms=4.5, mec=colors.PAPER, mew=0.5, gid="measured")
    props = {"facecolor": "none", "edgecolor": "#9a9da1", "hatch": "/////", "lw": 0, "zorder": 0, "gid": "impossible"}
    switches = np.flatnonzero(np.diff(line_values["triangle_margin"] < 0, prepend=False, append=False))
    for first, end in switches.reshape(-1, 2):
        ax.axvspan(cells[first], cells[end], label="physically impossible", **props)
    for pair, line in boundaries(axis, {name: (cells[0], cells[-1])}, fixed_values).items():
        ax.axvline(line[name][0], color=colors.INK, lw=1.2, gid=_pair_text(pair))
        _label_at_edge(ax, pair, (line[name][0], 1.0), ax.get_xaxis_transform(), (0, 3), ha="center", va="bottom")
    canvas.draw_legend(figure)
    return figure
