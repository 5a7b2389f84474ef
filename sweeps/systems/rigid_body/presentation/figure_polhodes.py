"""Figure of polhodes: curves of the angular velocity in a body, on an energy ellipsoid with a faint far side."""

from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure

from kernels.free import exact
from sweeps.figure import canvas, colors, marks, sheets, wording
from sweeps.schema.datasets import Dataset, along
from sweeps.schema.iteration import spaced_indices
from sweeps.systems.bodies.variables import MOMENTS
from sweeps.systems.rigid_body.presentation.appearance import APPEARANCE, moments_over
from sweeps.systems.rigid_body.presentation.figure_flip import racket

MAX_MOMENTS = 48  # values per dimension among which the most asymmetric body is selected
POINTS = 721  # points of a curve
PIXELS = 600  # pixels of the surface's image per side
SPACING = 0.14  # distance of neighbouring polhodes, relative to the ellipsoid's size
MIN_CURVES, MAX_CURVES = 3, 10  # bounds on the polhodes about one end of an axis
AXIS_NAMES = ("least", "middle", "greatest")
CURVE_NAMES = {
    "stable_minor": "about the axis of least inertia",
    "stable_major": "about the axis of greatest inertia",
    "unstable": "separatrix",
}
KINDS = ("stable_minor", "unstable", "stable_major")  # the regimes about those axes
# The octant of the three positive ends faces the reader, and mostly its middle axis, on which the separatrix crosses.
AZIMUTH, ELEVATION = np.radians(64.0), np.radians(29.0)
LIGHT = np.array([-0.42, 0.60, 0.68])  # direction of the source: right, up, towards the reader
TINT = 0.20  # weight of a regime's colour in that of the surface
HEAD = 0.055  # length of an arrow's head; this and the next two relative to the ellipsoid's size
REACH, MARGIN = 0.16, 0.30  # length of an axis beyond the outline, and margin for its label
MIN_FACING = 0.3  # cosine to the line of sight; arrows nearer to the outline are strongly foreshortened


class AsymmetricBody(NamedTuple):
    """A body with three different moments."""

    name: str  #: its name; "" on a grid of moments
    moments: np.ndarray  #: I1, I2, I3, shape (3,)
    units: str  #: "kg m²", or "" if only their ratios are known


class Scene:
    """An energy ellipsoid of a body with three different moments, and the direction of the view.

    Attributes:
        axes: the body's axes (0, 1, 2) along x, y and z: the middle one along y, right-handed as in the body.
        moments: principal moments along x, y and z over the middle one, shape (3,).
        semi: semi-axes √(I_mid/I) along x, y and z, shape (3,).
        kinds: regimes about x, y and z.
        view: unit vectors to the right, up and towards the reader, as rows, shape (3, 3).
        form: the matrix F of the ellipsoid x·F·x = 1 in the reader's directions, shape (3, 3).
        shadow: the matrix S of its outline x·S·x = 1, shape (2, 2).
        half: half its width and half its height on the page.
        size: unit of lengths in the picture, the mean of these.
    """

    def __init__(self, moments: np.ndarray):
        minor, middle, greatest = (int(axis) for axis in np.argsort(moments))
        self.axes = (minor, middle, greatest) if (middle - minor) % 3 == 1 else (greatest, middle, minor)
        self.moments = moments[list(self.axes)] / moments[middle]
        self.semi = 1.0 / np.sqrt(self.moments)
        self.kinds = KINDS if self.moments[0] < self.moments[2] else KINDS[::-1]
        (sa, ca), (se, ce) = ((np.sin(x), np.cos(x)) for x in (AZIMUTH, ELEVATION))
        self.view = np.array([[-sa, ca, 0.0], [-se * ca, -se * sa, ce], [ce * ca, ce * sa, se]])
        self.form = (self.view * self.moments) @ self.view.T
        self.shadow = self.form[:2, :2] - np.outer(self.form[:2, 2], self.form[2, :2]) / self.form[2, 2]
        self.half = np.sqrt(np.diag(np.linalg.inv(self.shadow)))
        self.size = float(self.half.mean())

    def crossing_angle(self) -> float:
        """Return the eccentric angle θ at which the separatrix meets the ellipse (semi_x cos θ, 0, semi_z sin θ).

        There I_max (I_max − I_mid) ω_max² = I_min (I_mid − I_min) ω_min², the condition L² = 2E·I_mid.
        """
        weight = self.semi * np.sqrt(self.moments * np.abs(self.moments - self.moments[1]))
        return float(np.arctan2(weight[0], weight[2]))

    def facing_cosine(self, points: np.ndarray) -> np.ndarray:
        """Return the cosine of the angle between the ellipsoid's normal at points (n, 3) and the line of sight."""
        normal = points * self.moments
        return normal @ self.view[2] / np.linalg.norm(normal, axis=1)


def draw(ds: Dataset, ax: Axes | None = None) -> Figure | None:
    """Draw the polhodes of the most asymmetric possible body of a map; return None if all have two equal moments."""
    body = most_asymmetric_body(ds)
    if body is None:
        return None
    figure = canvas.make_figure(7.6, 6.3, "Polhodes", _subtitle(ds, body), ax=ax)
    ax, scene = figure.subplots(), Scene(body.moments)
    ax.set_axis_off()
    _draw_surface(ax, scene)
    _draw_axes(ax, scene, body)
    for kind, curve in polhodes(scene):
        _draw_curve(ax, scene, kind, curve)
    (right, up), margin = scene.half, MARGIN * scene.size
    ax.set(aspect="equal", xlim=(-right - margin, right + margin), ylim=(-up - margin, up + margin))
    for kind, words in CURVE_NAMES.items():
        ax.plot([], [], color=APPEARANCE.color(kind), lw=2.0 if kind == "unstable" else 1.4, label=words)
    canvas.draw_legend(figure)
    return figure


def most_asymmetric_body(ds: Dataset) -> AsymmetricBody | None:
    """Return the body of a map with the greatest `asymmetry`; None if no body has three different moments."""
    if "body" in ds.dims:
        table = np.column_stack([ds[name].values for name in MOMENTS])
        names, ratios = ds["body"].values.tolist(), ds["moments_are_ratios"].values
    elif point := racket(ds):
        table, names, ratios = np.array([[point[name] for name in MOMENTS]]), [point["body"]], np.array([False])
    else:
        table = _sample_moments(ds)
        names, ratios = [""] * len(table), np.zeros(len(table), bool)
    score = asymmetry(table)
    best = int(np.argmax(score))
    return AsymmetricBody(names[best], table[best], "" if ratios[best] else "kg m²") if score[best] > 1.0 else None


def _sample_moments(ds: Dataset) -> np.ndarray:
    """Return moments of bodies of a grid, thinned along each dimension, shape (n, 3)."""
    dims, columns = moments_over(ds), []
    for name in MOMENTS:
        values = along(ds[name], dims)
        for k, size in enumerate(values.shape):
            values = np.take(values, spaced_indices(size, MAX_MOMENTS), axis=k)
        columns.append(values)
    return np.stack(np.broadcast_arrays(*columns), axis=-1).reshape(-1, 3)


def asymmetry(moments: np.ndarray) -> np.ndarray:
    """Return the smaller of I_mid/I_min and I_max/I_mid of moments (n, 3): 1 for a top, 0 where physically impossible.

    At most the golden number, by the triangle inequality.
    """
    minor, middle, greatest = np.sort(moments, axis=1).T
    return np.where(greatest - middle <= minor, np.minimum(middle / minor, greatest / middle), 0.0)


def _subtitle(ds: Dataset, body: AsymmetricBody) -> str:
    """Return the map's title with name and moments of the body drawn."""
    pairs = zip(MOMENTS, body.moments, strict=True)
    values = ",  ".join(f"${name[0]}_{name[1]}$ = {wording.format_number(x, 4)}" for name, x in pairs)
    units = f" {body.units}" if body.units else "  (ratios)"
    name = f"{body.name}:  " if body.name else "the most asymmetric body of this map:    "
    words = "Polhodes: intersections of the energy ellipsoid with momentum ellipsoids"
    return f"{ds.attrs.get('title', '')};  {name}{values}{units}\n{words}"


# -- the curves


def polhodes(scene: Scene) -> list[tuple[str, np.ndarray]]:
    """Return evenly spaced polhodes about both ends of both stable axes, and the two branches of the separatrix.

    These are plane ellipses that cross at the ends of the middle axis.

    Returns:
        (regime, closed curve of shape (POINTS, 3)) of each polhode; the separatrix last.
    """
    curves = []
    for kind, axis_angle in ((scene.kinds[0], 0.0), (scene.kinds[2], np.pi / 2)):
        for angle in _spaced_angles(scene, axis_angle):
            start = np.array([scene.semi[0] * np.cos(angle), 0.0, scene.semi[2] * np.sin(angle)])
            curves += [(kind, exact.polhode(scene.moments, end * start, POINTS)) for end in (1.0, -1.0)]
    phase, crossing_angle = np.linspace(0.0, 2 * np.pi, POINTS), scene.crossing_angle()
    x, z = (scene.semi[k] * f(crossing_angle) * np.cos(phase) for k, f in ((0, np.cos), (2, np.sin)))
    return curves + [("unstable", np.column_stack([x, np.sin(phase), side * z])) for side in (1.0, -1.0)]


def _spaced_angles(scene: Scene, start: float) -> np.ndarray:
    """Return eccentric angles between one axis and the separatrix, at arcs of about `SPACING`, without the ends."""
    angles = np.linspace(start, scene.crossing_angle(), 2001)
    arc = np.hypot(np.diff(scene.semi[0] * np.cos(angles)), np.diff(scene.semi[2] * np.sin(angles))).cumsum()
    count = int(np.clip(round(arc[-1] / (SPACING * scene.size)), MIN_CURVES, MAX_CURVES))
    return np.interp(arc[-1] * (np.arange(count) + 0.5) / (count + 0.1), arc, angles[1:])


def _draw_curve(ax: Axes, scene: Scene, kind: str, curve: np.ndarray) -> None:
    """Draw a curve with a faint far side, and an arrow at its point nearest to the reader."""
    cosine = scene.facing_cosine(curve)
    is_near = cosine >= 0.0
    right, up, depth = scene.view @ curve.T
    color, is_separatrix = APPEARANCE.color(kind), kind == "unstable"
    props = {"color": color, "solid_capstyle": "round"}
    far_props = props | {"lw": 0.9 if is_separatrix else 0.55, "alpha": 0.30, "zorder": 2, "gid": f"{kind} far"}
    near_props = props | {
        "lw": 2.0 if is_separatrix else 1.15,
        "zorder": 5 if is_separatrix else 4,
        "gid": f"{kind} near",
    }
    for mask, side_props in ((~is_near, far_props), (is_near, near_props)):
        ax.plot(np.where(mask, right, np.nan), np.where(mask, up, np.nan), **side_props)
    nearest = int(np.argmax(depth[:-1]))
    if (
        not is_separatrix
        and cosine[nearest] > MIN_FACING
        and np.hypot(np.ptp(right), np.ptp(up)) > 5 * HEAD * scene.size
    ):
        _draw_arrow_head(ax, right, up, nearest, color, HEAD * scene.size)


def _draw_arrow_head(ax: Axes, right: np.ndarray, up: np.ndarray, index: int, color: str, size: float) -> None:
    """Draw an arrow's head on a curve, in the direction of motion."""
    next_index = (index + 1) % (len(right) - 1)
    middle = np.array([right[index], up[index]])
    direction = np.array([right[next_index] - right[index], up[next_index] - up[index]])
    direction *= size / np.hypot(*direction)
    across = 0.36 * np.array([-direction[1], direction[0]])
    corners = [middle + 0.5 * direction, middle - 0.5 * direction + across, middle - 0.5 * direction - across]
    ax.fill(*np.transpose(corners), facecolor=color, edgecolor=colors.PAPER, lw=0.4, zorder=4.5, gid="direction")


# -- the ellipsoid and its axes


def _draw_surface(ax: Axes, scene: Scene) -> None:
    """Draw the near side of the ellipsoid, shaded, tinted by the regime of each point's polhode, with its outline."""
    form, shadow, half = scene.form, scene.shadow, scene.half
    pixels = np.linspace(-1.0, 1.0, PIXELS)
    right, up = np.meshgrid(half[0] * pixels, half[1] * pixels)
    inside = 1.0 - (shadow[0, 0] * right**2 + 2 * shadow[0, 1] * right * up + shadow[1, 1] * up**2)
    toward = (np.sqrt(np.maximum(inside, 0.0) * form[2, 2]) - form[2, 0] * right - form[2, 1] * up) / form[2, 2]
    points = np.stack([right, up, toward], axis=-1) @ scene.view
    image = np.dstack([sheets.surface_brightness() * _surface_colors(scene, points), np.clip(inside * 250.0, 0.0, 1.0)])
    extent = (-half[0], half[0], -half[1], half[1])
    ax.imshow(image, extent=extent, origin="lower", interpolation="bilinear", zorder=1, gid="surface")
    angle = np.linspace(0.0, 2 * np.pi, POINTS)
    outline = np.linalg.cholesky(np.linalg.inv(shadow)) @ [np.cos(angle), np.sin(angle)]
    ax.plot(*outline, color=colors.QUIET, lw=0.8, zorder=3, gid="outline")


def _surface_colors(scene: Scene, points: np.ndarray) -> np.ndarray:
    """Return colours of points of the ellipsoid, shape (…, 3): diffuse light, tinted in the regime's colour."""
    normal = (points * scene.moments) @ scene.view.T
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    light = np.clip(normal @ (LIGHT / np.linalg.norm(LIGHT)), 0.0, 1.0)[..., None]
    excess = (points**2 * scene.moments * (scene.moments - scene.moments[1])).sum(axis=-1)
    major, minor = (
        np.array(to_rgb(colors.in_light(APPEARANCE.color(name)))) for name in ("stable_major", "stable_minor")
    )
    tint = np.where((excess > 0)[..., None], major, minor)
    return ((1 - TINT) + TINT * tint) * (0.80 + 0.20 * light)


def _draw_axes(ax: Axes, scene: Scene, body: AsymmetricBody) -> None:
    """Draw each axis, faint inside the ellipsoid, with an arrow, its name and its moment beyond the outline."""
    rank = {axis: AXIS_NAMES[i] for i, axis in enumerate(np.argsort(body.moments).tolist())}
    line: dict[str, Any] = {"color": colors.INK, "solid_capstyle": "butt"}
    for i, axis in enumerate(scene.axes):
        direction, end = scene.view[:2, i], scene.semi[i]
        to_outline = 1.0 / np.sqrt(direction @ scene.shadow @ direction)
        extra_length = REACH * scene.size / np.hypot(*direction)
        ax.plot(*np.outer(direction, [-to_outline - 0.5 * extra_length, -end]), lw=0.9, zorder=0, **line)
        ax.plot(*np.outer(direction, [-end, end]), lw=0.6, alpha=0.3, ls=(0, (4, 3)), zorder=2, **line)
        arrow = {"arrowstyle": "-|>", "lw": 1.1, "shrinkA": 0, "shrinkB": 0, "color": colors.INK}
        ax.annotate("", direction * (to_outline + extra_length), direction * end, arrowprops=arrow, zorder=6)
        dot: dict[str, Any] = {"marker": "o", "ms": 6.0, "mec": colors.PAPER, "mew": 0.9, "gid": "spin"}
        ax.plot(*(direction * end)[:, None], color=APPEARANCE.color(scene.kinds[i]), zorder=7, **dot)
        text = f"axis {axis + 1}: {rank[axis]}\n$I_{axis + 1}$ = {wording.format_number(body.moments[axis], 4)}"
        _label_axis(ax, direction * (to_outline + extra_length), direction, text, is_tall=scene.half[1] > scene.half[0])


def _label_axis(ax: Axes, tip: np.ndarray, direction: np.ndarray, text: str, is_tall: bool) -> None:
    """Write a text at an arrow's tip: to its right if it points up, else beyond it in a tall figure, else below."""
    if abs(direction[0]) < 0.3 * abs(direction[1]):
        alignment, offset = {"ha": "left", "va": "center"}, (7, -2)
    elif is_tall:
        alignment = {"ha": "left" if direction[0] > 0 else "right", "va": "center"}
        offset = (5 * np.sign(direction[0]), -4)
    else:
        alignment, offset = {"ha": "center", "va": "top"}, (0, -5)
    props = {"fontsize": 9, "linespacing": 1.35, "zorder": 8, "path_effects": marks.halo(2.0)}
    marks.annotate(ax, text, tip, offset, **alignment, **props)
