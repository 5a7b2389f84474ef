"""The flip as an animation: a tennis racket or the most unstable body, turning in space, above the trace of its spin.

The angular momentum L stands upright; the angular velocity goes round it, and the line is the trail of the handle, the
axis of least moment. Attitude and angular velocity are those of the closed forms.
"""

from collections.abc import Iterator
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties
from matplotlib.path import Path
from matplotlib.textpath import TextPath
from matplotlib.transforms import Affine2D

from kernels import exact
from kernels.rigid_body import cyclic
from sweeps.figure import colors, style
from sweeps.schema.boxes import along, blocks, dimensions, nearest_by
from sweeps.systems.bodies import outline as outlines
from sweeps.systems.bodies.solid import Face, of_mesh
from sweeps.systems.bodies.solid import solid as solid_of
from sweeps.systems.rigid_body.presentation.look import settings

if TYPE_CHECKING:
    import xarray as xr

BLOCK_POINTS = 2**18  # of a map that are looked at together
FRAMES = 90
INCHES, WIDE = (4.8, 4.6), (9.6, 5.4)  # of a GIF and of a film
DOTS = 100  # per inch
TOWARDS = np.array([0.78, -0.52, 0.35])  # where the viewer stands
LIGHT = np.array([0.35, -0.2, 0.91])
RACKET = {"I1": 0.00121, "I2": 0.01638, "I3": 0.01748, "axis": 2}  # Brody 1985: shown where it stands on the grid
PARAMETERS = ("I1", "I2", "I3", "axis", "omega0", "epsilon", "phase")
THROW = 10.0  # rad/s, near which it is thrown
TRAIL = 24  # frames
SHOWN_SECONDS = (6.0, 20.0)  # of a film: motions are shown in real time where they take as long
FINER = 8  # points of the trail a frame
MOST_ROTATIONS = 8.0  # of a picture: slower flips are shown from just before to just after
COMPONENTS = tuple(colors.SERIES_COLORS[:3])
INDICES = "₁₂₃"


def most_unstable(ds: "xr.Dataset") -> dict[str, float] | None:
    """Return the physically possible point whose perturbation grows fastest for its spin rate.

    Args:
        ds: a map with I1, I2, I3, axis, omega0, epsilon and phase.

    Returns:
        Its parameters by name, with `body` where the map has it; None where nothing is unstable.
    """
    most, best = 0.0, None
    for box in blocks(dimensions(ds), BLOCK_POINTS):
        part = ds.isel(box)
        dims = part["growth_rate"].dims
        growth, spin, margin = (along(part[name], dims) for name in ("growth_rate", "omega0", "triangle_margin"))
        rate = np.where(margin >= 0, growth / np.abs(spin), np.nan)
        if np.nanmax(rate, initial=0.0) > most:
            place = tuple(map(int, np.unravel_index(int(np.nanargmax(rate)), rate.shape)))
            most, best = float(rate[place]), part.isel(dict(zip(dims, place, strict=True)))
    names = ("body", *PARAMETERS)
    return None if best is None else {name: best[name].values.item() for name in names if name in best.coords}


def racket(ds: "xr.Dataset") -> dict[str, float] | None:
    """Return the point of a tennis racket thrown about its axis 2; None where none is on the grid."""
    at = racket_at(ds)
    if at is None:
        return None
    values = {name: ds[name].isel({dim: at[dim] for dim in ds[name].dims}).values.item() for name in PARAMETERS}
    return {"body": "Tennis racket"} | {name: float(value) for name, value in values.items()}


def racket_at(ds: "xr.Dataset") -> dict[str, int] | None:
    """Return dimension → index of that point."""
    if "body" in ds.dims or not {*PARAMETERS} <= set(ds.coords) or not all(ds[name].ndim for name in PARAMETERS):
        return None
    wanted = RACKET | {"omega0": THROW}
    at = {n: int(np.argmin(np.abs(np.abs(ds[n].values) - v))) for n, v in wanted.items() if n in ds.dims}
    at |= {name: 0 for name in ("epsilon", "phase")}
    at |= nearest_by(ds, {name: value for name, value in RACKET.items() if name not in ds.dims}, at)
    near = [ds[name].isel({dim: at[dim] for dim in ds[name].dims}).values.item() for name in RACKET]
    return at if np.allclose(near, list(RACKET.values()), rtol=1e-9, atol=0.0) else None


def start(point: dict[str, float]) -> np.ndarray:
    """Return the angular velocity at time zero, rad/s: ω0 (1, ε cos φ, ε sin φ) on the axes a, b, c."""
    omega = np.empty(3)
    a, b, c = cyclic(int(point["axis"]))
    nudge = point["epsilon"] * point["omega0"]
    omega[a], omega[b], omega[c] = point["omega0"], nudge * np.cos(point["phase"]), nudge * np.sin(point["phase"])
    return omega


def attitudes(moments: np.ndarray, omega: np.ndarray, times: np.ndarray) -> np.ndarray:
    """Return attitudes at some times as matrices body → space, shape (n, 3, 3), with the angular momentum along z.

    Args:
        moments: principal moments, kg m2, shape (3,).
        omega: angular velocity at time zero, rad/s, shape (3,).
        times: s, shape (n,).
    """
    w, x, y, z = exact.attitude(moments, omega, times).T
    turned = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
    return _upright(moments * omega) @ turned.transpose(2, 0, 1)


def _upright(L: np.ndarray) -> np.ndarray:
    """A rotation that takes a vector onto the z axis."""
    z = L / np.linalg.norm(L)
    x = np.cross(np.eye(3)[int(np.argmin(np.abs(z)))], z)
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(z, x), z])


def frames(ds: "xr.Dataset") -> Iterator[np.ndarray]:
    """Yield the frames of one flip of the racket, or of the most unstable body; none where nothing flips.

    Args:
        ds: a map of rigid bodies.
    """
    point = racket(ds) or most_unstable(ds)
    if point is None:
        return
    moments, omega = np.array([point[name] for name in ("I1", "I2", "I3")]), start(point)
    period = exact.flip_period(exact.set_up(*moments, *omega))
    if not np.isfinite(period):
        return
    try:
        times = _window(moments, omega, int(point["axis"]), period, abs(point["omega0"]))
        moving = _moving(moments, omega, times)
    except (ArithmeticError, ValueError):  # plain kernels stop where compiled ones go on with NaN
        return
    if moving is None:  # moments beyond doubles' products
        return
    axis, name = int(point["axis"]), f"{point['body']}, " if "body" in point else ""
    words = settings({n: point[n] for n in ("I1", "I2", "I3", "omega0", "epsilon")})
    yield from _drawn(_Shown(f"{name}spin about axis {axis}", words, axis, solid_of(moments)), moments, times, *moving)


def film(motion: "xr.Dataset") -> Iterator[np.ndarray]:
    """Yield the frames of a free body's motion, with its mesh where it has one.

    Args:
        motion: of `sweeps.motion`: omega1 … omega3 over time, I1 … I3, and the attribute `outlines` of a mesh.
    """
    moments = np.array([float(motion[name]) for name in ("I1", "I2", "I3")])
    omega = np.array([float(motion[f"omega{i}"][0]) for i in (1, 2, 3)])
    duration, look = float(motion["time"][-1] - motion["time"][0]), style.film.get()
    shown = min(max(duration, SHOWN_SECONDS[0]), SHOWN_SECONDS[1])
    times = np.linspace(0.0, duration, round(shown * look.rate) + 1)
    speed = duration / shown
    pace = "real time" if 0.99 < speed < 1.01 else f"{style.number(max(speed, 1 / speed), 2)} times "
    pace += "" if pace == "real time" else "faster" if speed > 1 else "slower"
    inertia, start = (", ".join(style.number(value, 3) for value in values) for values in (moments, omega))
    words = f"I = ({inertia}) kg m², starts with ω = ({start}) {style.units('rad s-1')}; {pace}"
    outline = next(iter(outlines.read(motion.attrs).values()), None)
    faces = of_mesh(outline["vertices"], outline["faces"]) if outline else solid_of(moments)
    axis = int(np.abs(omega).argmax()) + 1
    moving = _moving(moments, omega, times)
    yield from _drawn(_Shown(str(motion.attrs["title"]), words, axis, faces), moments, times, *moving)


def _moving(moments: np.ndarray, omega: np.ndarray, times: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
    """Angular velocities at the frames, and attitudes `FINER` times as many; None where doubles cannot hold them."""
    fine = np.linspace(times[0], times[-1], FINER * (times.size - 1) + 1)
    omegas, turned = exact.rotation(moments, omega, times), attitudes(moments, omega, fine)
    return (omegas, turned) if np.isfinite(omegas).all() and np.isfinite(turned).all() else None


def _window(moments, omega, axis: int, period: float, omega0: float) -> np.ndarray:
    """Times of the frames: one flip period with the flip inside, or as much of it as an eye can follow."""
    flip = _flip(moments, omega, axis, period)
    length = min(period, MOST_ROTATIONS * 2.0 * np.pi / omega0)
    return np.linspace(flip - 0.5 * length, flip + 0.5 * length, FRAMES * style.film.get().finer)


def _flip(moments, omega, axis: int, period: float) -> float:
    """When in one flip period the spin changes sign, or is least; to some 1e-5 of the period, s."""
    low, high = 0.0, period
    for _ in range(2):
        times = np.linspace(low, high, 321)
        spin = exact.rotation(moments, omega, times)[:, axis - 1]
        (changes,) = np.nonzero(np.signbit(spin[1:]) != np.signbit(spin[:-1]))
        at = int(changes[0]) if changes.size else max(int(np.argmin(np.abs(spin))) - 1, 0)
        low, high = times[at], times[min(at + (1 if changes.size else 2), times.size - 1)]
    return 0.5 * (low + high)


class _Shown(NamedTuple):
    """The text over an animation, the spin axis that is drawn, and the body's surface."""

    title: str
    words: str
    axis: int
    faces: list[Face]


def _drawn(shown: _Shown, moments, times, omegas, turned) -> Iterator[np.ndarray]:
    """The pictures; attitudes `FINER` times as many."""
    figure, ax, dots = _stage(shown, omegas, times)
    scene, handle = FilmStage(ax, shown.faces, shown.axis), int(np.argmin(moments))
    figure.canvas.draw()  # what stands still, drawn once: all but what is animated
    still, trail = figure.canvas.copy_from_bbox(figure.bbox), TRAIL * style.film.get().finer
    for k, matrix in enumerate(turned[::FINER]):
        figure.canvas.restore_region(still)
        scene.draw(matrix, omegas[k], turned[FINER * max(0, k - trail) : FINER * k + 1, :, handle])
        for dot, component in zip(dots, omegas[k], strict=True):
            dot.set_data([times[k]], [component])
            dot.axes.draw_artist(dot)
        yield np.array(figure.canvas.buffer_rgba())


def _stage(shown: _Shown, omegas, times):
    wide = style.film.get().across is not None
    inches = WIDE if wide else INCHES
    figure = Figure(figsize=inches, dpi=style.film.get().dots(inches, DOTS), facecolor="white")
    FigureCanvasAgg(figure)
    figure.text(0.03, 0.965, shown.title, fontsize=14 if wide else 11, fontweight="bold", va="top", parse_math=False)
    figure.text(0.03, 0.9 if wide else 0.915, shown.words, fontsize=8.5 if wide else 7, color=colors.QUIET, va="top")
    scene = figure.add_axes((0.0, 0.02, 0.62, 0.82) if wide else (0.0, 0.33, 1.0, 0.56))
    set_stage(scene, 1.68 if wide else 2.3)
    trace = figure.add_axes((0.69, 0.2, 0.28, 0.5) if wide else (0.13, 0.105, 0.84, 0.22))
    dots = []
    for k, color in enumerate(COMPONENTS):
        trace.plot(times, omegas[:, k], color=color, linewidth=1.6, label=f"ω{INDICES[k]}")
        dots += trace.plot([], [], "o", color=color, markersize=5, animated=True)
    trace.set(xlim=(times[0], times[-1]), xlabel="time (s)", ylabel=f"ω ({style.units('rad s-1')})")
    trace.legend(ncols=3, loc="lower right", bbox_to_anchor=(1.0, 0.98), borderaxespad=0.0, handlelength=1.2)
    for side in ("top", "right"):
        trace.spines[side].set_visible(False)
    return figure, scene, dots


def set_stage(scene, across: float) -> None:
    """Draw the angular momentum upright, in a panel that is so wide to both sides."""
    scene.set(xlim=(-across, across), ylim=(-1.25, 1.25), aspect="equal")
    scene.axis("off")
    (upright,) = scene.plot(*seen(np.array([[0.0, 0.0, 1.0], [0.0, 0.0, 1.22]])).T, color=colors.QUIET, linewidth=1.8)
    top = upright.get_xydata()[-1]
    scene.plot(*top, marker="^", color=colors.QUIET, markersize=5)
    scene.annotate("L", top, (7, -2), textcoords="offset points", color=colors.QUIET, fontweight="bold")


def _screen() -> np.ndarray:
    """The viewer's right and up, as columns, shape (3, 2)."""
    towards = TOWARDS / np.linalg.norm(TOWARDS)
    right = np.array([-towards[1], towards[0], 0.0]) / np.hypot(*towards[:2])
    return np.stack([right, np.cross(towards, right)], axis=1)


SCREEN = _screen()


def seen(points: np.ndarray) -> np.ndarray:
    """Return points of space, shape (…, 3), on the screen, shape (…, 2)."""
    return points @ SCREEN


class FilmStage:
    """Draw what turns, frame by frame in the order in which it is seen, by pens that stay and no artist of lines.

    Args:
        ax: where.
        faces: surface of the body.
        axis: that it is spun about: 1, 2 or 3.
    """

    def __init__(self, ax, faces: list[Face], axis: int):
        self.ax, self.axis, self.solid = ax, axis, _Solid(faces)
        self.renderer = ax.figure.canvas.get_renderer()
        self.trail = self._pen(colors.SERIES_COLORS[4], 1.5, 0.8)
        self.tip, self.shaft = self._pen(colors.INK, 1.6), self._pen(colors.UNSTABLE, 2.0)
        self.head, self.fill = self._pen(colors.UNSTABLE, 1.0), self._pen(colors.UNSTABLE, 0.0)
        self.halo = self._pen("white", 2.5)
        name = TextPath((0.0, 0.0), "ω", size=9.0 * ax.figure.dpi / 72, prop=FontProperties(weight="bold"))
        self.name = name.transformed(Affine2D().translate(-name.get_extents().x1, 0.0))
        self.dot = Path.unit_circle().transformed(Affine2D().scale(2.0 * ax.figure.dpi / 72))
        ax.add_collection(self.solid.artist, autolim=False)
        self.solid.artist.set_animated(True)

    def _pen(self, color: str, points: float, alpha: float = 1.0):
        pen = self.renderer.new_gc()
        pen.set_foreground((*to_rgb(color), alpha), isRGBA=True)
        pen.set_linewidth(points)
        pen.set_capstyle("projecting")
        pen.set_clip_rectangle(self.ax.bbox)
        return pen

    def draw(self, matrix: np.ndarray, omega: np.ndarray, trail: np.ndarray) -> None:
        """Draw the trail's far part, the body with its spin axis, the trail's near part, and ω with its name.

        Args:
            matrix: attitude, shape (3, 3).
            omega: angular velocity in body axes, shape (3,).
            trail: places in space, shape (n, 3).
        """
        behind = trail @ TOWARDS <= 0.0
        end = 1.15 * matrix[:, self.axis - 1]
        tip = seen(np.stack([np.zeros(3), end]))
        spin = matrix @ omega
        arrow = seen(np.stack([np.zeros(3), 1.2 * spin / np.linalg.norm(spin)]))
        self.solid.turn(matrix)
        self._line(self.trail, np.where(behind[:, None], seen(trail), np.nan))
        if end @ TOWARDS <= 0.0:
            self._line(self.tip, tip)
        self.ax.draw_artist(self.solid.artist)
        if end @ TOWARDS > 0.0:
            self._line(self.tip, tip)
        self._line(self.trail, np.where(behind[:, None], np.nan, seen(trail)))
        self._line(self.shaft, arrow)
        self._filled(self.dot, arrow[1], self.head)
        place = arrow[1] + np.array([-0.08, 0.02])
        self._filled(self.name, place, self.halo)
        self._filled(self.name, place, self.fill)

    def _line(self, pen, points: np.ndarray) -> None:
        self.renderer.draw_path(pen, Path(points), self.ax.transData)

    def _filled(self, path: Path, place: np.ndarray, pen) -> None:
        """A shape in pixels about a place, filled and outlined in the colour of a pen."""
        at = Affine2D().translate(*self.ax.transData.transform(place))
        self.renderer.draw_path(pen, path, at, pen.get_rgb())


class _Solid:
    """The faces of a body that look at the viewer, shaded, the farthest first."""

    def __init__(self, faces: list[Face]):
        self.cover(faces)
        edge = (1.0, 1.0, 1.0, 0.6 if len(faces) == 6 else 0.0)
        self.artist = PolyCollection([], edgecolors=[edge], linewidths=0.6)

    def cover(self, faces: list[Face]) -> None:
        """Take other faces."""
        most = max(len(face.corners) for face in faces)
        # faces of fewer corners end in their last one again
        self.corners = np.array([[*face.corners, *[face.corners[-1]] * (most - len(face.corners))] for face in faces])
        self.normals = np.array([face.normal for face in faces])
        self.colors = np.array([face.color for face in faces])
        self.veils = np.array([face.veil for face in faces], float)

    def turn(self, matrix: np.ndarray) -> None:
        """Shows the body in an attitude."""
        outward = self.normals @ matrix.T
        front = np.flatnonzero(outward @ TOWARDS > 0.0)
        depth = self.corners[front].mean(axis=1) @ (matrix.T @ TOWARDS)
        front = front[np.argsort(depth, kind="stable")]
        light = 0.55 + 0.45 * (0.5 + 0.5 * outward[front] @ LIGHT)
        shades = np.clip(self.colors[front] * light[:, None], 0.0, 1.0)
        self.artist.set_verts(self.corners[front] @ (matrix.T @ SCREEN))
        self.artist.set_facecolor(np.column_stack([shades, self.veils[front]]))
