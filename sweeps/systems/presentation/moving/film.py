"""The motion of a described system as an animation: its picture, beside its coordinates over time."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
import sympy as sp

from sweeps.figure import colors, style
from sweeps.systems.presentation import animation
from sweeps.systems.presentation.moving.equations import picture

if TYPE_CHECKING:
    import xarray as xr

    from sweeps.mechanics.model import Model

INCHES, DOTS = (6.4, 3.6), 96
SCREEN = animation.screen(np.array([0.75, -0.5, 0.45]))  # of a viewer in that direction
TRAIL = 2.0  # s of a mass's trail
MOST_CURVES = 6
LOOKS = {"mass": {"marker": "o", "ms": 9}, "body": {"marker": "o", "ms": 4, "color": colors.QUIET}}


def frames(moved: "xr.Dataset", model: "Model") -> Iterator[np.ndarray]:
    """Yield one frame for each time of a motion of `sweeps.motion`, shape (height, width, 4)."""
    times = moved["time"].values
    words = [*animation.settings(model.system, moved), animation.timing(times[-1])[1]]
    figure = animation.stage(INCHES, DOTS, model.system.title, ",  ".join(words), (11.0, 7.5))
    drawn = [] if model.system.turning else list(places(moved, model))
    parts = [_scene(figure.add_axes((0.0, 0.02, 0.45, 0.8)), drawn)] if drawn else []
    names = [one.name for one in model.equations.places][:MOST_CURVES]
    for k, (name, ax) in enumerate(zip(names, _panels(figure, len(names), 0.56 if drawn else 0.13), strict=True)):
        ax.plot(times, moved[name], color=colors.SERIES_COLORS[k], lw=1.2)
        ax.set_ylabel(style.with_unit(name.replace("_", " "), moved[name].units, " ({})"))
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


def places(moved: "xr.Dataset", model: "Model") -> Iterator[tuple[str, np.ndarray]]:
    """Yield kind and places on the screen, shape (times, points, 2), of each part of a system's picture."""
    parameters = model.system.parameters.values()
    symbols = [*model.equations.states, *(p.symbol for p in parameters), model.system.time]
    names = [*(x.name for x in model.equations.states), *(p.name for p in parameters), "time"]
    values = np.broadcast_arrays(*(moved[name].values for name in names))
    for kind, points, _ in picture(model.system, model.equations):
        at = sp.lambdify(symbols, [x for point in points for x in point], "numpy")
        numbers = np.stack(np.broadcast_arrays(values[-1], *at(*values))[1:], axis=-1)
        seen = numbers.reshape(values[-1].size, len(points), -1)
        yield kind, seen if seen.shape[-1] == 2 else seen @ SCREEN


def _scene(ax, drawn: list[tuple[str, np.ndarray]]):
    """Draw the parts of a picture; return a function that moves them to a frame."""
    everywhere = np.concatenate([seen.reshape(-1, 2) for _, seen in drawn])
    middle, reach = 0.5 * (everywhere.max(0) + everywhere.min(0)), 0.58 * np.ptp(everywhere, axis=0).max() or 1.0
    ax.set(xlim=middle[0] + [-reach, reach], ylim=middle[1] + [-reach, reach], aspect="equal")
    ax.axis("off")
    parts, trail = [], int(TRAIL * style.film.get().rate)
    for kind, seen in drawn:
        color = colors.UNSTABLE if kind == "mass" else colors.INK
        if kind == "mass":
            parts.append((ax.plot([], [], color=color, alpha=0.4, lw=2.0, animated=True)[0], seen[:, 0], trail))
        closed = seen[:, [*range(seen.shape[1]), 0]] if kind == "face" else seen
        parts.append(
            (ax.plot([], [], animated=True, **{"color": color, "lw": 1.5} | LOOKS.get(kind, {}))[0], closed, 0)
        )

    def move(k: int):
        for line, seen, past in parts:
            line.set_data(*(seen[max(0, k - past) : k + 1] if past else seen[k]).T)
        return [line for line, *_ in parts]

    return move
