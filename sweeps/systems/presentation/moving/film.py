"""Animation of a described system's motion: its picture next to its coordinates over time."""

from collections.abc import Callable, Iterable, Iterator
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes

from sweeps.figure import colors, sheets, wording
from sweeps.systems.presentation import animation
from sweeps.systems.presentation.moving.equations import picture, picture_points

if TYPE_CHECKING:
    import xarray as xr

    from sweeps.mechanics.model import Model

INCHES, DOTS = (6.4, 3.6), 96
SCREEN = animation.screen_axes(np.array([0.75, -0.5, 0.45]))  # unit vectors of a viewer in this direction
TRAIL_SECONDS = 2.0  # length of a mass's trail in the film
MAX_CURVES = 6  # panels of coordinates over time that fit next to the picture
COLORS = {"mass": colors.UNSTABLE, "body": colors.QUIET}
MARKS = {"mass": {"marker": "o", "ms": 9}, "body": {"marker": "o", "ms": 4}}


def frames(motion: "xr.Dataset", model: "Model") -> Iterator[np.ndarray]:
    """Yield a frame, shape (height, width, 4), for each time of a motion: the moving picture, and curves with a dot."""
    times = motion["time"].values
    words = [*animation.format_parameters(model.system, motion), animation.frame_times(times[-1])[1]]
    figure = animation.empty_stage(INCHES, DOTS, model.system.title, ",  ".join(words), (11.0, 7.5))
    has_picture = not model.system.attitude_equations and picture(model.system, model.equations)
    setters = [draw_scene(figure.add_axes((0.0, 0.02, 0.45, 0.8)), motion, model.equations)] if has_picture else []
    names = [place.name for place in model.equations.places][:MAX_CURVES]
    for k, (name, ax) in enumerate(zip(names, _panels(figure, len(names), 0.56 if has_picture else 0.13), strict=True)):
        ax.plot(times, motion[name], color=colors.SERIES_COLORS[k], lw=1.2)
        ax.set_ylabel(wording.with_unit(name.replace("_", " "), motion[name].units, " ({})"))
        ax.set(xlim=(times[0], times[-1]))
        (dot,) = ax.plot([], [], "o", color=colors.SERIES_COLORS[k], ms=5, animated=True)
        setters.append(lambda k, dot=dot, y=motion[name].values: dot.set_data([times[k]], [y[k]]) or [dot])
    ax.set_xlabel("time (s)")
    yield from animation.draw_frames(
        figure, ([artist for setter in setters for artist in setter(k)] for k in range(times.size))
    )


def _panels(figure, count: int, x: float):
    """Add `count` axes above one another, from `x` to the right edge of the figure, with times below the last only."""
    height = 0.68 / count
    panels = [figure.add_axes((x, 0.84 - (k + 1) * height, 0.97 - x, 0.86 * height)) for k in range(count)]
    for ax in panels:
        ax.spines[["top", "right"]].set_visible(False)
        ax.tick_params(labelbottom=ax is panels[-1])
    return panels


def draw_scene(ax, motion, equations):
    """Draw the picture of a motion; return the function that sets its artists to a frame."""
    elements = [
        (kind, points if points.shape[-1] == 2 else points @ SCREEN)
        for kind, points in picture_points(equations, motion)
    ]
    everywhere = np.concatenate([points.reshape(-1, 2) for _, points in elements])
    middle, reach = 0.5 * (everywhere.max(0) + everywhere.min(0)), 0.58 * np.ptp(everywhere, axis=0).max() or 1.0
    ax.set(xlim=middle[0] + [-reach, reach], ylim=middle[1] + [-reach, reach])
    lines = ((kind, points, {"color": COLORS.get(kind, colors.INK), "lw": 1.5}) for kind, points in elements)
    return frame_setter(ax, lines, int(TRAIL_SECONDS * sheets.current_film.get().rate))


def frame_setter(
    ax: Axes, elements: Iterable[tuple[str, np.ndarray, dict]], trail: int
) -> Callable[[int], list[Artist]]:
    """Return a function that sets the lines of a picture to the k-th time and returns them.

    Args:
        ax: panel of the picture.
        elements: kind as of `PicturePart`, points on the screen, shape (times, points, 2), properties of the line.
        trail: length of a mass's trail, frames.
    """
    ax.set_aspect("equal")
    ax.axis("off")
    lines = []
    for kind, points, props in elements:
        if kind == "mass":
            line = ax.plot([], [], color=props["color"], alpha=0.4, lw=2.0, animated=True)[0]
            lines.append((line, points[:, 0], trail))
        outline = points[:, [*range(points.shape[1]), 0]] if kind == "face" else points
        lines.append((ax.plot([], [], animated=True, **props | MARKS.get(kind, {}))[0], outline, 0))

    def move(k):
        for line, points, trail_length in lines:
            line.set_data(*(points[max(0, k - trail_length) : k + 1] if trail_length else points[k]).T)
        return [line for line, *_ in lines]

    return move
