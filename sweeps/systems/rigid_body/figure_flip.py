"""The flip as an animation: the most unstable body that can exist, turning in space, above the trace of its spin."""

import numpy as np
import xarray as xr
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from PIL import Image

from kernels import exact
from kernels.rigid_body import cyclic
from sweeps import colors, style
from sweeps.boxes import blocks, dimensions
from sweeps.systems.rigid_body.look import settings

BLOCK_POINTS = 2**18  # of a map that are looked at together
FRAMES = 90
INCHES = (4.8, 4.6)
DOTS = 100  # per inch
TOWARDS = np.array([0.78, -0.52, 0.35])  # where the viewer stands
LIGHT = np.array([0.35, -0.2, 0.91])
FRONT, BACK, EDGE = ((0.835, 0.369, 0.0), (0.0, 0.447, 0.698), (0.69, 0.706, 0.729))
MOST_ROTATIONS = 8.0  # of a picture: slower flips are shown from just before to just after
COMPONENTS = tuple(colors.SERIES_COLORS[:3])


def most_unstable(ds: xr.Dataset) -> dict[str, float] | None:
    """The point whose nudge grows fastest for its spin rate, among bodies that can exist.

    Args:
        ds: a map with I1, I2, I3, axis, omega0, epsilon and phase.

    Returns:
        Its parameters by name, with `body` where the map has it; None where nothing is unstable.
    """
    most, best = 0.0, None
    for box in blocks(dimensions(ds), BLOCK_POINTS):
        part = ds.isel(box)
        rate = (part["growth_rate"] / np.abs(part["omega0"])).where(part["triangle_margin"] >= 0)
        if np.nanmax(rate.values, initial=0.0) > most:
            place = np.unravel_index(int(np.nanargmax(rate.values)), rate.shape)
            most, best = float(rate.values[place]), part.isel(dict(zip(rate.dims, place, strict=True)))
    names = ("body", "I1", "I2", "I3", "axis", "omega0", "epsilon", "phase")
    return None if best is None else {name: best[name].item() for name in names if name in best.coords}


def start(point: dict[str, float]) -> np.ndarray:
    """Angular velocity at time zero, rad/s: ω0 (1, ε cos φ, ε sin φ) on the axes a, b, c."""
    omega = np.empty(3)
    a, b, c = cyclic(int(point["axis"]))
    nudge = point["epsilon"] * point["omega0"]
    omega[a], omega[b], omega[c] = point["omega0"], nudge * np.cos(point["phase"]), nudge * np.sin(point["phase"])
    return omega


def box(moments: np.ndarray) -> np.ndarray:
    """Half edges of the uniform box with the given ratios of moments, the largest one: h_i² ∝ I_j + I_k − I_i."""
    squares = np.maximum(moments.sum() - 2.0 * moments, 1e-3 * moments.max())
    return np.sqrt(squares / squares.max())


def attitudes(moments: np.ndarray, omega: np.ndarray, times: np.ndarray, steps: int = 200) -> np.ndarray:
    """Attitudes at some times as matrices body → space, shape (n, 3, 3), with the angular momentum along z.

    Args:
        moments: principal moments, kg m2, shape (3,).
        omega: angular velocity at the first of the times, rad/s, shape (3,).
        times: evenly spaced, s, shape (n,).
        steps: midpoint steps between two of them; error of order (|ω| Δt/steps)².
    """
    h = (times[1] - times[0]) / steps
    middles = (np.arange((times.size - 1) * steps) + 0.5) * h
    matrix = _upright(moments * omega)
    found = [matrix]
    for k, spin in enumerate(exact.rotation(moments, omega, middles)):
        matrix = matrix @ _turn(spin * h)
        if (k + 1) % steps == 0:
            found.append(matrix)
    return np.stack(found)


def _upright(L: np.ndarray) -> np.ndarray:
    """A rotation that takes a vector onto the z axis."""
    z = L / np.linalg.norm(L)
    x = np.cross(np.eye(3)[int(np.argmin(np.abs(z)))], z)
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(z, x), z])


def _turn(vector: np.ndarray) -> np.ndarray:
    """Rodrigues' formula: the matrix of a rotation vector, rad."""
    angle = np.linalg.norm(vector)
    if angle == 0.0:
        return np.eye(3)
    x, y, z = vector / angle
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + np.sin(angle) * K + (1.0 - np.cos(angle)) * (K @ K)


def frames(ds: xr.Dataset) -> list[Image.Image]:
    """The pictures of the animation, one flip of the most unstable body; none where nothing in the map flips.

    Args:
        ds: a map of rigid bodies.
    """
    point = most_unstable(ds)
    if point is None:
        return []
    moments, omega = np.array([point[name] for name in ("I1", "I2", "I3")]), start(point)
    period = exact.flip_period(*moments, *omega)
    if not np.isfinite(period):
        return []
    times = _window(moments, omega, int(point["axis"]), period, abs(point["omega0"]))
    omegas = exact.rotation(moments, omega, times)
    return (
        _frames(point, moments, omegas, times) if np.isfinite(omegas).all() else []
    )  # moments beyond doubles' products


def _window(moments, omega, axis: int, period: float, omega0: float) -> np.ndarray:
    """Times of the frames: one flip period with the flip inside, or as much of it as an eye can follow."""
    fine = np.linspace(0.0, period, 20_001)
    spin = exact.rotation(moments, omega, fine)[:, axis - 1]
    flip = fine[int(np.argmin(np.abs(spin)))]
    length = min(period, MOST_ROTATIONS * 2.0 * np.pi / omega0)
    return np.linspace(flip - 0.5 * length, flip + 0.5 * length, FRAMES)


def _frames(point, moments, omegas, times) -> list[Image.Image]:
    """The pictures, all in the same 256 colours, which is what a GIF holds."""
    turned = attitudes(moments, omegas[0], times)
    figure, solid, tip, dots = _stage(point, moments, omegas, times)
    figure.canvas.draw()  # what stands still, drawn once: all but what is animated
    still = figure.canvas.copy_from_bbox(figure.bbox)
    images = []
    for k, matrix in enumerate(turned):
        figure.canvas.restore_region(still)
        faces = _draw_solid(solid, box(moments), matrix, tip, int(point["axis"]))
        for artist in sorted((faces, tip), key=lambda artist: artist.get_zorder()):
            solid.draw_artist(artist)
        for dot, component in zip(dots, omegas[k], strict=True):
            dot.set_data([times[k]], [component])
            dot.axes.draw_artist(dot)
        images.append(Image.fromarray(np.asarray(figure.canvas.buffer_rgba())).convert("RGB"))
    palette = _montage(images[:: max(1, len(images) // 12)]).quantize(256)
    return [image.quantize(palette=palette, dither=Image.Dither.NONE) for image in images]


def _montage(images: list[Image.Image]) -> Image.Image:
    """Pictures one below the other."""
    whole = Image.new("RGB", (images[0].width, images[0].height * len(images)))
    for k, image in enumerate(images):
        whole.paste(image, (0, k * image.height))
    return whole


def _stage(point, moments, omegas, times):
    figure = Figure(figsize=INCHES, dpi=DOTS, facecolor="white")
    FigureCanvasAgg(figure)
    axis = int(point["axis"])
    name = f"{point['body']}, " if "body" in point else ""
    figure.text(
        0.03, 0.965, f"{name}spin about axis {axis}", fontsize=11, fontweight="bold", va="top", parse_math=False
    )
    words = settings({n: point[n] for n in ("I1", "I2", "I3", "omega0", "epsilon")})
    figure.text(0.03, 0.915, words, fontsize=7, color=colors.QUIET, va="top")
    solid = figure.add_axes((0.0, 0.33, 1.0, 0.56))
    solid.set(xlim=(-2.3, 2.3), ylim=(-1.25, 1.25), aspect="equal")
    solid.axis("off")
    (tip,) = solid.plot([], [], color=colors.INK, linewidth=1.6, zorder=0, animated=True)
    trace = figure.add_axes((0.13, 0.105, 0.84, 0.22))
    dots = []
    for k, color in enumerate(COMPONENTS):
        trace.plot(times, omegas[:, k], color=color, linewidth=1.6, label=f"$\\omega_{k + 1}$")
        dots += trace.plot([], [], "o", color=color, markersize=5, animated=True)
    trace.set(xlim=(times[0], times[-1]), xlabel="time (s)", ylabel=f"ω ({style.units('rad s-1')})")
    trace.legend(ncols=3, loc="lower right", bbox_to_anchor=(1.0, 0.98), borderaxespad=0.0, handlelength=1.2)
    for side in ("top", "right"):
        trace.spines[side].set_visible(False)
    return figure, solid, tip, dots


def _draw_solid(ax, half: np.ndarray, matrix: np.ndarray, tip, axis: int) -> PolyCollection:
    """The faces of the box that look at the viewer, shaded, and the spin axis sticking out of it."""
    towards = TOWARDS / np.linalg.norm(TOWARDS)
    right = np.cross([0.0, 0.0, 1.0], towards)
    right /= np.linalg.norm(right)
    screen = np.stack([right, np.cross(towards, right)])
    for old in list(ax.collections):
        old.remove()
    faces, shades = [], []
    for corners, normal, color in _faces(half):
        outward = matrix @ normal
        if outward @ towards > 0.0:
            faces.append(corners @ matrix.T @ screen.T)
            shades.append(np.array(color) * (0.55 + 0.45 * (0.5 + 0.5 * outward @ LIGHT)))
    drawn = PolyCollection(faces, facecolors=shades, edgecolors="white", linewidths=0.6, zorder=1, animated=True)
    ax.add_collection(drawn)
    end = 1.15 * matrix[:, axis - 1]
    line = np.stack([np.zeros(3), end]) @ screen.T
    tip.set_data(*line.T)
    tip.set_zorder(2 if end @ towards > 0.0 else 0)
    return drawn


def _faces(half: np.ndarray):
    """Corners, normal and colour of a box's six faces; the two broad ones differ, so that a flip is seen."""
    thin = int(np.argmin(half))
    for k in range(3):
        u, v = (k + 1) % 3, (k + 2) % 3
        for sign in (1.0, -1.0):
            corners = np.zeros((4, 3))
            corners[:, k] = sign
            corners[:, u] = [-1.0, 1.0, 1.0, -1.0]
            corners[:, v] = [-1.0, -1.0, 1.0, 1.0]
            yield corners * half, sign * np.eye(3)[k], ((FRONT if sign > 0 else BACK) if k == thin else EDGE)
