"""The motion of a described system as an animation: its picture, beside its coordinates over time."""

from collections.abc import Callable, Iterable, Iterator
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes

from sweeps.figure import colors, sheets, wording
from sweeps.systems.presentation import animation
from sweeps.systems.presentation.moving.equations import picture, places

if TYPE_CHECKING:
    import xarray as xr

    from sweeps.mechanics.model import Model

INCHES, DOTS = (6.4, 3.6), 96
SCREEN = animation.screen(np.array([0.75, -0.5, 0.45]))  # of a viewer in that direction
TRAIL = 2.0  # s of a mass's trail
MOST_CURVES = 6
COLORS = {"mass": colors.UNSTABLE, "body": colors.QUIET}
MARKS = {"mass": {"marker": "o", "ms": 9}, "body": {"marker": "o", "ms": 4}}


def frames(moved: "xr.Dataset", model: "Model") -> Iterator[np.ndarray]:
    """Yield one frame for each time of a motion of `sweeps.motion`, shape (height, width, 4)."""
    times = moved["time"].values
    words = [*animation.settings(model.system, moved), animation.timing(times[-1])[1]]
    figure = animation.stage(INCHES, DOTS, model.system.title, ",  ".join(words), (11.0, 7.5))
    drawn = not model.system.attitude_equations and picture(model.system, model.equations)
    parts = [_scene(figure.add_axes((0.0, 0.02, 0.45, 0.8)), moved, model.equations)] if drawn else []
    names = [one.name for one in model.equations.places][:MOST_CURVES]
    for k, (name, ax) in enumerate(zip(names, _panels(figure, len(names), 0.56 if drawn else 0.13), strict=True)):
        ax.plot(times, moved[name], color=colors.SERIES_COLORS[k], lw=1.2)
        ax.set_ylabel(wording.with_unit(name.replace("_", " "), moved[name].units, " ({})"))
        ax.set(xlim=(times[0], times[-1]))
        (dot,) = ax.plot([], [], "o", color=colors.SERIES_COLORS[k], ms=5, animated=True)
        parts.append(lambda k, dot=dot, y=moved[name].values: dot.set_data([times[k]], [y[k]]) or [dot])
    ax.set_xlabel("time (s)")
    yield from animation.played(figure, ([artist for part in parts for artist in part(k)] for k in range(times.size)))


def _panels(figure, count: int, left: float):
    height = 0.68 / count
    panels = [figure.add_axes((left, 0.84 - (k + 1) * height, 0.97 - left, 0.86 * height)) for k in range(count)]
    for ax in panels:
        ax.spines[["top", "right"]].set_visible(False)
        ax.tick_params(labelbottom=ax is panels[-1])
    return panels


def _scene(ax, moved, equations):
    """Draw the picture of a motion; return a function that moves it to a frame."""
    parts = [(kind, seen if seen.shape[-1] == 2 else seen @ SCREEN) for kind, seen in places(equations, moved)]
    everywhere = np.concatenate([seen.reshape(-1, 2) for _, seen in parts])
    middle, reach = 0.5 * (everywhere.max(0) + everywhere.min(0)), 0.58 * np.ptp(everywhere, axis=0).max() or 1.0
    ax.set(xlim=middle[0] + [-reach, reach], ylim=middle[1] + [-reach, reach])
    drawn = ((kind, seen, {"color": COLORS.get(kind, colors.INK), "lw": 1.5}) for kind, seen in parts)
    return mover(ax, drawn, int(TRAIL * sheets.current_film.get().rate))


def mover(ax: Axes, parts: Iterable[tuple[str, np.ndarray, dict]], trail: int) -> Callable[[int], list[Artist]]:
    """Return a function that moves the parts of a picture to the k-th time, and returns what is drawn.

    Args:
        ax: where.
        parts: kind as of `PicturePart`, places on the screen, shape (times, points, 2), and look of the line.
        trail: number of times that the trail of a mass goes back.
    """
    ax.set_aspect("equal")
    ax.axis("off")
    lines = []
    for kind, seen, props in parts:
        if kind == "mass":
            line = ax.plot([], [], color=props["color"], alpha=0.4, lw=2.0, animated=True)[0]
            lines.append((line, seen[:, 0], trail))
        closed = seen[:, [*range(seen.shape[1]), 0]] if kind == "face" else seen
        lines.append((ax.plot([], [], animated=True, **props | MARKS.get(kind, {}))[0], closed, 0))

    def move(k):
        for line, seen, past in lines:
            line.set_data(*(seen[max(0, k - past) : k + 1] if past else seen[k]).T)
        return [line for line, *_ in lines]

    return move
