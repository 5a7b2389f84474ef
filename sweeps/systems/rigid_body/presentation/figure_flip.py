"""The flip as an animation: a tennis racket or the most unstable body, turning in space, above the trace of its spin.

The angular momentum L stands upright; the angular velocity goes round it, and the line is the trail of the handle, the
axis of least moment. Attitude and angular velocity are those of the closed forms.
"""

from collections.abc import Iterator
from contextlib import suppress
from typing import NamedTuple

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection

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

BLOCK_POINTS = 2**18  # of a map that are looked at together
FRAMES = 90
INCHES, WIDE = (4.8, 4.6), (9.6, 5.4)  # of a GIF and of a film
DOTS = 100  # per inch
TOWARDS = np.array([0.78, -0.52, 0.35])  # where the viewer stands
SCREEN = animation.screen_axes(TOWARDS)
LIGHT = np.array([0.35, -0.2, 0.91])
RACKET = {"I1": 0.00121, "I2": 0.01638, "I3": 0.01748, "axis": 2}  # Brody 1985: shown where it stands on the grid
PARAMETERS = ("I1", "I2", "I3", "axis", "omega0", "epsilon", "phase")
THROW = 10.0  # rad/s, near which it is thrown
TRAIL = 24  # frames
FINER = 8  # points of the trail a frame
MOST_ROTATIONS = 8.0  # of a picture: slower flips are shown from just before to just after
COMPONENTS = tuple(colors.SERIES_COLORS[:3])
INDICES = "₁₂₃"


def most_unstable(ds: Dataset) -> dict[str, float] | None:
    """Return the physically possible point whose perturbation grows fastest for its spin rate; None without one.

    Its parameters by name, with `body` where the map has it.
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


def racket(ds: Dataset) -> dict[str, float] | None:
    """Return the point of a tennis racket thrown about its axis 2; None where none is on the grid."""
    at = racket_at(ds)
    if at is None:
        return None
    values = {name: ds[name].isel({dim: at[dim] for dim in ds[name].dims}).values.item() for name in PARAMETERS}
    return {"body": "Tennis racket"} | {name: float(value) for name, value in values.items()}


def racket_at(ds: Dataset) -> dict[str, int] | None:
    """Return dimension → index of that point."""
    if "body" in ds.dims or not {*PARAMETERS} <= set(ds.coords) or not all(ds[name].ndim for name in PARAMETERS):
        return None
    wanted = RACKET | {"omega0": THROW}
    at = {n: int(np.argmin(np.abs(np.abs(ds[n].values) - v))) for n, v in wanted.items() if n in ds.dims}
    at |= {name: 0 for name in ("epsilon", "phase")}
    at |= nearest_by(ds, {name: value for name, value in RACKET.items() if name not in ds.dims}, at)
    near = [ds[name].isel({dim: at[dim] for dim in ds[name].dims}).values.item() for name in RACKET]
    return at if np.allclose(near, list(RACKET.values()), rtol=1e-9, atol=0.0) else None


def attitudes(moments: np.ndarray, omega: np.ndarray, times: np.ndarray) -> np.ndarray:
    """Return matrices body → space (n, 3, 3) at times (s), L along z; moments in kg m2, omega at time 0 in rad/s."""
    turned = rotate_vectors(exact.attitude(moments, omega, times)[:, None], np.eye(3)).transpose(0, 2, 1)
    z = moments * omega / np.linalg.norm(moments * omega)
    x = np.cross(np.eye(3)[int(np.argmin(np.abs(z)))], z)
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(z, x), z]) @ turned


def frames(ds: Dataset) -> Iterator[np.ndarray]:
    """Yield the frames of one flip of the racket, or of the most unstable body; none where nothing flips."""
    point = racket(ds) or most_unstable(ds)
    if point is None:
        return
    moments, omega = initial_state(point)
    period = exact.flip_period(exact.set_up(*moments, *omega))
    if not np.isfinite(period):
        return
    moving = None
    with suppress(ArithmeticError, ValueError):  # plain kernels stop where compiled ones go on with NaN
        times = _window(moments, omega, int(point["axis"]), period, abs(point["omega0"]))
        moving = _moving(moments, omega, times)
    if moving is None:  # moments beyond doubles' products
        return
    axis, name = int(point["axis"]), f"{point['body']}, " if "body" in point else ""
    words = settings({n: point[n] for n in ("I1", "I2", "I3", "omega0", "epsilon")})
    yield from _drawn(_Shown(f"{name}spin about axis {axis}", words, axis, solid_of(moments)), moments, times, *moving)


def film(motion: Dataset) -> Iterator[np.ndarray]:
    """Yield the frames of a free body's motion, from `sweeps.motion`, with its mesh where it has one."""
    moments = np.array([float(motion[name]) for name in ("I1", "I2", "I3")])
    omega = np.array([float(motion[f"omega{i}"][0]) for i in (1, 2, 3)])
    times, pace = animation.frame_times(float(motion["time"][-1] - motion["time"][0]))
    inertia, start = (", ".join(wording.format_number(value, 3) for value in values) for values in (moments, omega))
    words = f"I = ({inertia}) kg m², starts with ω = ({start}) {wording.format_units('rad s-1')}; {pace}"
    outline = next(iter(outlines.read(motion.attrs).values()), None)
    faces = of_mesh(outline["vertices"], outline["faces"]) if outline else solid_of(moments)
    axis = int(np.abs(omega).argmax()) + 1
    moving = _moving(moments, omega, times)
    yield from _drawn(_Shown(str(motion.attrs["title"]), words, axis, faces), moments, times, *moving)


def _moving(moments: np.ndarray, omega: np.ndarray, times: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
    """Return angular velocities at the frames, and attitudes `FINER` times as many; None where doubles overflow."""
    fine = np.linspace(times[0], times[-1], FINER * (times.size - 1) + 1)
    omegas, turned = exact.rotation(moments, omega, times), attitudes(moments, omega, fine)
    return (omegas, turned) if np.isfinite(omegas).all() and np.isfinite(turned).all() else None


def _window(moments, omega, axis: int, period: float, omega0: float) -> np.ndarray:
    """Return times of the frames: one flip period with the flip inside, or as much of it as an eye can follow.

    The spin changes sign, or is least, in their middle, to some 1e-5 of the period.
    """
    low, high = 0.0, period
    for _ in range(2):
        times = np.linspace(low, high, 321)
        spin = exact.rotation(moments, omega, times)[:, axis - 1]
        (changes,) = np.nonzero(np.signbit(spin[1:]) != np.signbit(spin[:-1]))
        at = int(changes[0]) if changes.size else max(int(np.argmin(np.abs(spin))) - 1, 0)
        low, high = times[at], times[min(at + (1 if changes.size else 2), times.size - 1)]
    flip, length = 0.5 * (low + high), min(period, MOST_ROTATIONS * 2.0 * np.pi / omega0)
    return np.linspace(flip - 0.5 * length, flip + 0.5 * length, FRAMES * sheets.current_film.get().frame_factor)


class _Shown(NamedTuple):
    """The text over an animation, the spin axis that is drawn, and the body's surface."""

    title: str
    words: str
    axis: int
    faces: list[Face]


def _drawn(shown: _Shown, moments, times, omegas, turned) -> Iterator[np.ndarray]:
    """Yield the pictures; attitudes `FINER` times as many."""
    wide = sheets.current_film.get().width is not None
    figure = animation.empty_stage(WIDE if wide else INCHES, DOTS, *shown[:2], (14.0, 8.5) if wide else (11.0, 7.0))
    place = figure.add_axes((0.0, 0.02, 0.62, 0.82) if wide else (0.0, 0.33, 1.0, 0.56))
    scene = FilmStage(place, 1.68 if wide else 2.3, shown.faces, shown.axis)
    dots = _trace(figure.add_axes((0.69, 0.2, 0.28, 0.5) if wide else (0.13, 0.105, 0.84, 0.22)), omegas, times)
    handle, trail = int(np.argmin(moments)), FINER * TRAIL * sheets.current_film.get().frame_factor

    def frames() -> Iterator[list[Artist]]:
        for k, matrix in enumerate(turned[::FINER]):
            for dot, component in zip(dots, omegas[k], strict=True):
                dot.set_data([times[k]], [component])
            yield [*scene.turn(matrix, omegas[k], turned[max(0, FINER * k - trail) : FINER * k + 1, :, handle]), *dots]

    yield from animation.draw_frames(figure, frames())


def _trace(ax: Axes, omegas, times) -> list[Artist]:
    """Draw the components of the angular velocity over time; return a dot for each."""
    dots = []
    for k, color in enumerate(COMPONENTS):
        ax.plot(times, omegas[:, k], color=color, lw=1.6, label=f"ω{INDICES[k]}")
        dots += ax.plot([], [], "o", color=color, ms=5, animated=True)
    ax.set(xlim=(times[0], times[-1]), xlabel="time (s)", ylabel=f"ω ({wording.format_units('rad s-1')})")
    ax.legend(ncols=3, loc="lower right", bbox_to_anchor=(1.0, 0.98), borderaxespad=0.0, handlelength=1.2)
    ax.spines[["top", "right"]].set_visible(False)
    return dots


class FilmStage:
    """Turning things, as artists that are drawn in the order in which they are seen, and L, which stands still.

    The panel is so wide to both sides; the body, of these faces, is spun about an axis.
    """

    def __init__(self, ax: Axes, across: float, faces: list[Face], axis: int):
        self.axis, self.solid = axis, _Solid(faces)
        ax.set(xlim=(-across, across), ylim=(-1.25, 1.25), aspect="equal")
        ax.axis("off")
        upright = np.outer([1.0, 1.22], SCREEN[2])
        ax.plot(*upright.T, color=colors.QUIET, lw=1.8)
        ax.plot(*upright[1], marker="^", color=colors.QUIET, ms=5)
        marks.annotate(ax, "L", upright[1], (7, -2), color=colors.QUIET, fontweight="bold")
        ax.add_collection(self.solid.artist, autolim=False)
        line = {"lw": 1.5, "animated": True}
        self.far, self.near = (ax.plot([], [], color=colors.SERIES_COLORS[4], alpha=0.8, **line)[0] for _ in range(2))
        (self.tip,) = ax.plot([], [], color=colors.INK, **line)
        (self.arrow,) = ax.plot([], [], "o-", color=colors.UNSTABLE, ms=4, markevery=[1], **line | {"lw": 2.0})
        props = {"color": colors.UNSTABLE, "fontweight": "bold", "path_effects": marks.halo()}
        self.name = ax.text(0.0, 0.0, "ω", ha="right", animated=True, **props)

    def turn(self, matrix: np.ndarray, omega: np.ndarray, trail: np.ndarray) -> list[Artist]:
        """Return the trail's far part, the body with its spin axis, the trail's near part, and ω with its name.

        In an attitude (3, 3), with ω in the body's axes (3,) and the trail's places in space (n, 3).
        """
        behind, seen = (trail @ TOWARDS <= 0.0)[:, None], trail @ SCREEN
        end, spin = 1.15 * matrix[:, self.axis - 1], matrix @ omega
        arrow = 1.2 * spin / np.linalg.norm(spin) @ SCREEN
        self.far.set_data(*np.where(behind, seen, np.nan).T)
        self.near.set_data(*np.where(behind, np.nan, seen).T)
        self.tip.set_data(*np.outer(end @ SCREEN, [0.0, 1.0]))
        self.arrow.set_data(*np.outer(arrow, [0.0, 1.0]))
        self.name.set_position(arrow + np.array([-0.08, 0.02]))
        self.solid.turn(matrix)
        body = [self.tip, self.solid.artist]
        return [self.far, *(body if end @ TOWARDS <= 0.0 else reversed(body)), self.near, self.arrow, self.name]


class _Solid:
    """The faces of a body that look at the viewer, shaded, the farthest first."""

    def __init__(self, faces: list[Face]):
        self.cover(faces)
        edge = (1.0, 1.0, 1.0, 0.6 if len(faces) == 6 else 0.0)
        self.artist = PolyCollection([], edgecolors=[edge], linewidths=0.6, animated=True)

    def cover(self, faces: list[Face]) -> None:
        """Take other faces."""
        most = max(len(face.corners) for face in faces)
        # faces of fewer corners end in their last one again
        self.corners = np.array([[*face.corners, *[face.corners[-1]] * (most - len(face.corners))] for face in faces])
        self.normals = np.array([face.normal for face in faces])
        self.colors = np.array([face.color for face in faces])
        self.veils = np.array([face.veil for face in faces], float)

    def turn(self, matrix: np.ndarray) -> None:
        """Show the body in an attitude."""
        outward = self.normals @ matrix.T
        front = np.flatnonzero(outward @ TOWARDS > 0.0)
        depth = self.corners[front].mean(axis=1) @ (matrix.T @ TOWARDS)
        front = front[np.argsort(depth, kind="stable")]
        light = 0.55 + 0.45 * (0.5 + 0.5 * outward[front] @ LIGHT)
        shades = np.clip(self.colors[front] * light[:, None], 0.0, 1.0)
        self.artist.set_verts(self.corners[front] @ (matrix.T @ SCREEN))
        self.artist.set_facecolor(np.column_stack([shades, self.veils[front]]))
