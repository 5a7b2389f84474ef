"""Figure of normal modes: the system's picture, displaced along each mode of its stable equilibrium."""

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sweeps.figure import canvas, colors, wording
from sweeps.systems.oscillator.system import REGIMES
from sweeps.systems.presentation.moving.equations import picture_points
from sweeps.systems.presentation.sentences import head_texts

MAX_ANGLE = 0.4  # rad, largest angle of a drawn mode
STYLES: dict[str, dict[str, Any]] = {
    "line": {"lw": 2.0},
    "mass": {"marker": "o", "ms": 11, "ls": "none"},
    "body": {"marker": "o", "ms": 4},
}


def draw(dataset: xr.Dataset, system, target: Axes | None = None) -> Figure | None:
    """Draw both extreme positions of each mode, at the grid's point nearest to the system's defaults.

    Args:
        dataset: the map.
        system: its system, of angles alone.
        target: Axes to draw in; None for a new figure.

    Returns:
        The figure; None without an equilibrium that is stable in all modes.
    """
    defaults = {entry.name: entry.default for entry in system.mechanism.system.parameters.values()}
    point = dataset.sel(defaults, method="nearest").isel(epsilon=0, phase=0).load()
    is_stable = (point["regime"] == REGIMES.index("stable") - 1).all("mode")
    if not is_stable.any():
        return None
    point = point.isel(equilibrium=int(np.argmax(is_stable.values)))
    arguments = {str(name): value.values[None] for name, value in point.coords.items() if not value.ndim}
    shapes = system.mode_shapes(arguments)[0].vectors[0].real
    places = [place.name for place in system.mechanism.equations.places]
    rest = np.array([point[f"{name}_equilibrium"].values[0] for name in places])
    fixed = {name: float(point[name]) for name in defaults} | {"time": 0.0}
    fixed |= {str(speed): 0.0 for speed in system.mechanism.equations.v}
    words = ", ".join(wording.format_coordinate(dataset, name, float(point[name])) for name in defaults)
    texts = head_texts(dataset, words=f"{words}\nshapes by linear theory at {MAX_ANGLE:g} rad, measured frequencies")
    figure, panels = canvas.make_panels(len(shapes), (3.4, 3.6), *texts, target, sharex=True, sharey=True)
    for panel, shape, rate in zip(panels, shapes, point["frequency"].values, strict=True):
        swing = MAX_ANGLE * shape / np.abs(shape).max()
        for sign, color in ((0.0, colors.FAINT), (-1.0, colors.LIGHT_BLUE), (1.0, colors.STABLE)):
            states = fixed | dict(zip(places, rest + sign * swing, strict=True))
            for kind, points in picture_points(system.mechanism.equations, states):
                panel.plot(*points.T, color=color, gid=f"mode {sign:g}", **STYLES.get(kind, {}))
        panel.set_title(wording.with_unit(f"{wording.format_number(rate, 4)}", "rad s-1"), fontsize=11)
        panel.set(aspect="equal")
        panel.margins(0.12)
        panel.axis("off")
    return figure
