"""Animation of the flip: a tennis racket, or the most unstable body, rotating in space, above its angular velocity.

The angular momentum L is vertical, and the angular velocity moves about it; the line is the trail of the handle, the
axis of least moment. Attitude and angular velocity are those of the closed forms.
"""

import itertools
import math
from collections.abc import Iterator
from contextlib import suppress
from typing import Any, NamedTuple

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.lines import Line2D

from kernels.free import exact
from sweeps.figure import colors, marks, sheets, wording
from sweeps.schema.datasets import Dataset, along, dimensions, nearest_by
from sweeps.schema.iteration import blocks
from sweeps.systems.bodies import outline as outlines
from sweeps.systems.bodies.solid import Face, of_mesh
from sweeps.systems.bodies.solid import solid as solid_of
from sweeps.systems.motion import rotate_vectors
from sweeps.systems.presentation import animation
from sweeps.systems.rigid_body.presentation.appearance import settings
from sweeps.systems.rigid_body.system import initial_state

BLOCK_POINTS = 2**18  # points of a map that are read at a time
FRAMES = 90  # frames of a GIF
INCHES, WIDE = (4.8, 4.6), (9.6, 5.4)  # sizes of a GIF and of a film
DOTS = 100  # pixels per inch
TOWARDS = np.array([0.78, -0.52, 0.35])  # direction of the viewer
SCREEN = animation.screen_axes(TOWARDS)
LIGHT = np.array([0.35, -0.2, 0.91])  # direction of the light
RACKET = {"I1": 0.00121, "I2": 0.01638, "I3": 0.01748, "axis": 2}  # Brody 1985; shown if it is on the grid
PARAMETERS = ("I1", "I2", "I3", "axis", "omega0", "epsilon", "phase")
THROW_RATE = 10.0  # rad/s, a thrown racket's spin rate; the nearest rate of the grid is shown
TRAIL = 24  # length of the trail, frames
FINER = 8  # points of the trail per frame
MAX_ROTATIONS = 8.0  # rotations of a film; of a slower flip only this part is shown, with the flip in its middle
COMPONENTS = tuple(colors.SERIES_COLORS[:3])
INDICES = "₁₂₃"
LETTER_TURNS = np.pi / 4 * np.array([0, 1, -1, 2, -2, 3, -3, 4])  # rad, from a line's direction to that of its letter


def most_unstable(ds: Dataset) -> dict[str, Any] | None:
    """Return the physically possible point with the largest growth rate over its spin rate; None if none grows.

    The point is a mapping of parameters by name, and `body` if the map has bodies.
    """
    max_rate, best = 0.0, None
    for box in blocks(dimensions(ds), BLOCK_POINTS):
        block = ds.isel(box)
        dims = block["growth_rate"].dims
        growth, spin, margin = (along(block[name], dims) for name in ("growth_rate", "omega0", "triangle_margin"))
        rate = np.where(margin >= 0, growth / np.abs(spin), np.nan)
        if np.nanmax(rate, initial=0.0) > max_rate:
            place = tuple(map(int, np.unravel_index(int(np.nanargmax(rate)), rate.shape)))
            max_rate, best = float(rate[place]), block.isel(dict(zip(dims, place, strict=True)))
    names = ("body", *PARAMETERS)
    return None if best is None else {name: best[name].values.item() for name in names if name in best.coords}


def racket(ds: Dataset) -> dict[str, Any] | None:
    """Return the point of a tennis racket thrown about its axis 2; None if it is not on the grid."""
    indices = racket_at(ds)
    if indices is None:
        return None
    values = {
        name: ds[name].isel({dim: indices[str(dim)] for dim in ds[name].dims}).values.item() for name in PARAMETERS
    }
    return {"body": "Tennis racket"} | {name: float(value) for name, value in values.items()}


def racket_at(ds: Dataset) -> dict[str, int] | None:
    """Return dimension → index of the point of `racket`; None if it is not on the grid."""
    if "body" in ds.dims or not {*PARAMETERS} <= set(ds.coords) or not all(ds[name].ndim for name in PARAMETERS):
        return None
    target = RACKET | {"omega0": THROW_RATE}
    indices = {n: int(np.argmin(np.abs(np.abs(ds[n].values) - v))) for n, v in target.items() if n in ds.dims}
    indices |= {name: 0 for name in ("epsilon", "phase")}
    indices |= nearest_by(ds, {name: value for name, value in RACKET.items() if name not in ds.dims}, indices)
    nearest = [ds[name].isel({dim: indices[str(dim)] for dim in ds[name].dims}).values.item() for name in RACKET]
    return indices if np.allclose(nearest, list(RACKET.values()), rtol=1e-9, atol=0.0) else None


def attitudes(moments: np.ndarray, omega: np.ndarray, times: np.ndarray) -> np.ndarray:
    """Return the attitudes, matrices from body to space with L along z, shape (n, 3, 3).

    Args:
        moments: principal moments, kg m2, shape (3,).
        omega: initial angular velocity in the body, rad/s, shape (3,).
        times: s, shape (n,).
    """
    rotations = rotate_vectors(exact.attitude(moments, omega, times)[:, None], np.eye(3)).transpose(0, 2, 1)
    z = moments * omega / np.linalg.norm(moments * omega)
    x = np.cross(np.eye(3)[int(np.argmin(np.abs(z)))], z)
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(z, x), z]) @ rotations


def frames(ds: Dataset) -> Iterator[np.ndarray]:
    """Yield the frames of one flip of the racket, or of the most unstable body; none if it does not flip."""
    point = racket(ds) or most_unstable(ds)
    if point is None:
        return
    moments, omega = initial_state(point)
    period = exact.flip_period(exact.set_up(*moments, *omega))
    if not np.isfinite(period):
        return
    rotation = None
    with suppress(ArithmeticError, ValueError):  # plain kernels raise errors for which compiled kernels return NaN
        times = _frame_times(moments, omega, int(point["axis"]), period, abs(point["omega0"]))
        rotation = _rotation(moments, omega, times)
    if rotation is None:  # products of the moments overflow
        return
    axis, name = int(point["axis"]), f"{point['body']}, " if "body" in point else ""
    words = settings({n: point[n] for n in ("I1", "I2", "I3", "omega0", "epsilon")})
    yield from _draw(
        _Captions(f"{name}spin about axis {axis}", words, axis, solid_of(moments)), moments, times, *rotation
    )


def film(motion: Dataset) -> Iterator[np.ndarray]:
    """Yield the frames of a free body's motion, from `sweeps.motion`, with its mesh if it has one."""
    moments = np.array([float(motion[name]) for name in ("I1", "I2", "I3")])
    axes = motion["principal_axes"].values
    is_principal = np.array_equal(axes, np.eye(3))
    omega = axes @ [float(motion[f"omega{i}"][0]) for i in (1, 2, 3)]
    times, pace = animation.frame_times(float(motion["time"][-1] - motion["time"][0]))
    inertia, start = ([wording.format_number(value, 3) for value in values] for values in (moments, omega))
    frame = "" if is_principal else " about the principal axes"
    inertia = (
        f"I₁ : I₂ : I₃ = {' : '.join(inertia)}" if "ratios" in motion.attrs else f"I = ({', '.join(inertia)}) kg m²"
    )
    words = f"{inertia}, starts with ω = ({', '.join(start)}) {wording.format_units('rad s-1')}{frame}; {pace}"
    mesh = next(iter(outlines.read(motion.attrs).values()), None)
    faces = of_mesh(mesh["vertices"], mesh["faces"]) if mesh else solid_of(moments)
    axis = int(np.abs(omega).argmax()) + 1
    rotation = _rotation(moments, omega, times)
    yield from _draw(_Captions(str(motion.attrs["title"]), words, axis, faces), moments, times, *rotation)


def _rotation(moments: np.ndarray, omega: np.ndarray, times: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
    """Return angular velocities at the frames and `FINER` attitudes per frame; None if they overflow."""
    fine = np.linspace(times[0], times[-1], FINER * (times.size - 1) + 1)
    omegas, attitude_matrices = exact.rotation(moments, omega, times), attitudes(moments, omega, fine)
    return (omegas, attitude_matrices) if np.isfinite(omegas).all() and np.isfinite(attitude_matrices).all() else None


def _frame_times(moments, omega, axis: int, period: float, omega0: float) -> np.ndarray:
    """Return the times of the frames: one flip period, or `MAX_ROTATIONS` of it, with the flip in the middle.

    At the flip the spin changes sign, or has its least size; its time is exact to some 1e-5 of the period.
    """
    start, end = 0.0, period
    for _ in range(2):
        times = np.linspace(start, end, 321)
        spins = exact.rotation(moments, omega, times)[:, axis - 1]
        (changes,) = np.nonzero(np.signbit(spins[1:]) != np.signbit(spins[:-1]))
        before = int(changes[0]) if changes.size else max(int(np.argmin(np.abs(spins))) - 1, 0)
        start, end = times[before], times[min(before + (1 if changes.size else 2), times.size - 1)]
    flip, length = 0.5 * (start + end), min(period, MAX_ROTATIONS * 2.0 * np.pi / omega0)
    return np.linspace(flip - 0.5 * length, flip + 0.5 * length, FRAMES * sheets.current_film.get().frame_factor)


class _Captions(NamedTuple):
    """Title of an animation, line below it, spin axis that is drawn, and faces of the body."""

    title: str
    words: str
    axis: int
    faces: list[Face]


def _draw(captions: _Captions, moments, times, omegas, attitude_matrices) -> Iterator[np.ndarray]:
    """Yield the pictures; there are `FINER` attitudes per frame."""
    is_film = sheets.current_film.get().width is not None
    figure = animation.empty_stage(
        WIDE if is_film else INCHES, DOTS, *captions[:2], (14.0, 8.5) if is_film else (11.0, 7.0)
    )
    stage_ax = figure.add_axes((0.0, 0.02, 0.62, 0.82) if is_film else (0.0, 0.33, 1.0, 0.56))
    scene = FilmStage(stage_ax, 1.68 if is_film else 2.3, captions.faces, captions.axis)
    dots = _draw_omega(figure.add_axes((0.69, 0.2, 0.28, 0.5) if is_film else (0.13, 0.105, 0.84, 0.22)), omegas, times)
    handle, trail_length = int(np.argmin(moments)), FINER * TRAIL * sheets.current_film.get().frame_factor

    def frames() -> Iterator[list[Artist]]:
        """Yield the artists of each frame: the body with its trail, and a dot on each component of ω."""
        for k, matrix in enumerate(attitude_matrices[::FINER]):
            for dot, component in zip(dots, omegas[k], strict=True):
                dot.set_data([times[k]], [component])
            yield [
                *scene.set_attitude(
                    matrix, omegas[k], attitude_matrices[max(0, FINER * k - trail_length) : FINER * k + 1, :, handle]
                ),
                *dots,
            ]

    yield from animation.draw_frames(figure, frames())


def _draw_omega(ax: Axes, omegas, times) -> list[Line2D]:
    """Draw the components of the angular velocity over time; return a dot for each."""
    dots: list[Line2D] = []
    for k, color in enumerate(COMPONENTS):
        ax.plot(times, omegas[:, k], color=color, lw=1.6, label=f"ω{INDICES[k]}")
        dots += ax.plot([], [], "o", color=color, ms=5, animated=True)
    ax.set(xlim=(times[0], times[-1]), xlabel="time (s)", ylabel=f"ω ({wording.format_units('rad s-1')})")
    ax.legend(ncols=3, loc="lower right", bbox_to_anchor=(1.0, 0.98), borderaxespad=0.0, handlelength=1.2)
    ax.spines[["top", "right"]].set_visible(False)
    return dots


class FilmStage:
    """A rotating body with trail and angular velocity, as artists from the farthest to the nearest, and the fixed L.

    `half_width` is that of the panel; the body has `faces` and is spun about `axis`; `vertical_name` is that of the
    fixed vertical line.
    """

    def __init__(self, ax: Axes, half_width: float, faces: list[Face], axis: int, vertical_name: str = "L"):
        self.axis, self.solid = axis, _Solid(faces)
        ax.set(xlim=(-half_width, half_width), ylim=(-1.25, 1.5), aspect="equal")
        ax.axis("off")
        vertical = np.outer([1.0, 1.22], SCREEN[2])
        ax.plot(*vertical.T, color=colors.QUIET, lw=1.8)
        ax.plot(*vertical[1], marker="^", color=colors.QUIET, ms=5)
        self.vertical = marks.annotate(ax, vertical_name, vertical[1], (7, -2), color=colors.QUIET, fontweight="bold")
        ax.add_collection(self.solid.artist, autolim=False)
        line: dict[str, Any] = {"lw": 1.5, "animated": True}
        self.far, self.near = (ax.plot([], [], color=colors.SERIES_COLORS[4], alpha=0.8, **line)[0] for _ in range(2))
        (self.tip,) = ax.plot([], [], color=colors.INK, **line)
        (self.arrow,) = ax.plot([], [], "o-", color=colors.UNSTABLE, ms=4, markevery=[1], **line | {"lw": 2.0})
        props: dict[str, Any] = {"fontweight": "bold", "path_effects": marks.halo(), "ha": "center", "va": "center"}
        pairs = ((str(axis), colors.INK), ("ω", colors.UNSTABLE))
        self.letters = [ax.text(0.0, 0.0, text, color=color, animated=True, **props) for text, color in pairs]

    def _place_letters(self, tips) -> None:
        """Write the axis' number and ω near the tips of their lines: in the stage, and not on another name."""
        boxes = [self.vertical.get_window_extent()]
        for letter, tip in zip(self.letters, tips, strict=True):
            outward = math.atan2(tip[1], tip[0])
            for distance, turn in itertools.product((0.14, 0.28), LETTER_TURNS):
                letter.set_position(tip + distance * np.array([math.cos(outward + turn), math.sin(outward + turn)]))
                box = letter.get_window_extent()
                if box.y1 <= letter.axes.bbox.y1 and not any(box.overlaps(other) for other in boxes):
                    break
            boxes.append(box)

    def set_attitude(self, matrix: np.ndarray, omega: np.ndarray, trail: np.ndarray) -> list[Artist]:
        """Set an attitude. Return the trail behind the body, body and spin axis, the trail before it, ω, and letters.

        Args:
            matrix: attitude, from body to space, shape (3, 3).
            omega: angular velocity in the body's axes, rad/s, shape (3,).
            trail: points of the handle in space, shape (n, 3).
        """
        is_behind, on_screen = (trail @ TOWARDS <= 0.0)[:, None], trail @ SCREEN
        end, spin = 1.15 * matrix[:, self.axis - 1], matrix @ omega
        arrow = 1.2 * spin / np.linalg.norm(spin) @ SCREEN
        self.far.set_data(*np.where(is_behind, on_screen, np.nan).T)
        self.near.set_data(*np.where(is_behind, np.nan, on_screen).T)
        self.tip.set_data(*np.outer(end @ SCREEN, [0.0, 1.0]))
        self.arrow.set_data(*np.outer(arrow, [0.0, 1.0]))
        self._place_letters((end @ SCREEN, arrow))
        self.solid.set_attitude(matrix)
        body = [self.tip, self.solid.artist]
        return [self.far, *(body if end @ TOWARDS <= 0.0 else reversed(body)), self.near, self.arrow, *self.letters]


class _Solid:
    """The visible faces of a body, shaded, the farthest first."""

    def __init__(self, faces: list[Face]):
        self.set_faces(faces)
        edge = (1.0, 1.0, 1.0, 0.6 if len(faces) == 6 else 0.0)
        self.artist = PolyCollection([], edgecolors=[edge], linewidths=0.6, animated=True)

    def set_faces(self, faces: list[Face]) -> None:
        """Set the faces."""
        max_corners = max(len(face.corners) for face in faces)
        # faces with fewer corners repeat the last one
        self.corners = np.array(
            [[*face.corners, *[face.corners[-1]] * (max_corners - len(face.corners))] for face in faces]
        )
        self.normals = np.array([face.normal for face in faces])
        self.colors = np.array([face.color for face in faces])
        self.veils = np.array([face.opacity for face in faces], float)

    def set_attitude(self, matrix: np.ndarray) -> None:
        """Set the attitude of the body."""
        outward = self.normals @ matrix.T
        front = np.flatnonzero(outward @ TOWARDS > 0.0)
        depth = self.corners[front].mean(axis=1) @ (matrix.T @ TOWARDS)
        front = front[np.argsort(depth, kind="stable")]
        light = 0.55 + 0.45 * (0.5 + 0.5 * outward[front] @ LIGHT)
        shades = np.clip(self.colors[front] * light[:, None], 0.0, 1.0)
        self.artist.set_verts(self.corners[front] @ (matrix.T @ SCREEN))
        self.artist.set_facecolor(np.column_stack([shades, self.veils[front]]))
