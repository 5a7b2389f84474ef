"""Figure of Foucault's pendulum: its path on the turning ground, and the turn of its plane over the latitude."""

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sweeps.figure import canvas, colors, marks
from sweeps.systems.presentation.sentences import head_texts
from sweeps.systems.relative_equilibrium.presentation.sentences import PARIS, turn_ratio

PLACES = {"equator": 0.0, "Paris": PARIS, "pole": 90.0}  # degrees north
SWINGS_PER_TURN = 24.0  # swings in a turn of the ground, of the drawn path; the nearest rate of the grid is drawn
QUARTER_TURN = 0.5 * np.pi  # rad, that the ground turns while the path is drawn


def draw(dataset: xr.Dataset, target: Axes | None = None) -> Figure | None:
    """Draw both panels from the measured frequencies; return None for a map without slowly turning ground."""
    if (
        not {"length", "drag", "spin_rate"} <= {*dataset.dims}
        or 0.0 not in dataset["drag"]
        or dataset.sizes["spin_rate"] < 3
    ):
        return None
    ratio = turn_ratio(dataset)
    if not ratio.size:
        return None
    words = "by half the difference of both measured frequencies, of the shortest rod, without drag"
    figure, (path_ax, turn_ax) = canvas.make_panels(2, (4.0, 3.9), *head_texts(dataset, words=words), target)
    swing = np.sqrt(dataset["gravity"].item() / dataset["length"].values[0])
    index = int(np.argmin(np.abs(ratio["spin_rate"].values - swing / SWINGS_PER_TURN)))
    spin, turn = ratio["spin_rate"].values[index], ratio.values[index]
    angle = np.linspace(0.0, QUARTER_TURN, 2000)  # rotation of the ground, rad
    path = np.cos(swing / spin * angle) * np.exp(-1j * turn * angle)
    path_ax.plot(path.real, path.imag, color=colors.STABLE, lw=0.8, gid="path")
    for words, end in (("first swing", 1.0 + 0.0j), ("after a quarter turn", np.exp(-1j * turn * QUARTER_TURN))):
        path_ax.plot(*np.outer([end.real, end.imag], [-1.1, 1.1]), color=colors.UNSTABLE, lw=1.6)
        marks.annotate(path_ax, words, (end.real, end.imag), (4, -16), ha="right", path_effects=marks.halo())
    path_ax.set(aspect="equal", xticks=[], yticks=[], xlabel="east, seen on the ground", ylabel="north")
    latitude = np.linspace(0.0, 90.0, 181)
    turn_ax.plot(latitude, np.sin(np.radians(latitude)), color=colors.INK, lw=1.0, label="sin(latitude)", gid="law")
    top = ratio["spin_rate"].values.max()
    share = ratio["spin_rate"].values / top
    dots = {"color": colors.STABLE, "ms": 3.4, "mew": 0.0, "label": "measured", "gid": "measured"}
    turn_ax.plot(np.degrees(np.arcsin(share)), ratio.values * share, "o", **dots)
    for name, degrees in PLACES.items():
        place = degrees, np.sin(np.radians(degrees))
        turn_ax.plot(*place, "o", ms=6.0, color=colors.UNSTABLE, zorder=4)
        marks.annotate(
            turn_ax, name, place, (8, -10) if degrees < 90.0 else (-8, -14), ha="left" if degrees < 90.0 else "right"
        )
    turn_ax.set(xlabel="latitude (degrees)", ylabel="turns of the plane in a turn of the Earth", xlim=(-3, 93))
    marks.draw_grid(turn_ax)
    canvas.draw_legend(figure)
    return figure
