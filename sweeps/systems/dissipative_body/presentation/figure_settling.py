"""Figures of bodies that lose energy: final sense of spin over starts, and time to a flat spin over the loss."""

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from sweeps.figure import axis_scales, canvas, colors, marks
from sweeps.schema.iteration import spaced_indices

MAX_DRAWN = 512  # starts per side of the map of senses
SENSE_COLORS = [colors.GREY, colors.UNSTABLE, colors.STABLE]  # colours of the flags -1, 0 and 1 of `final_sense`


def draw_sense(dataset: xr.Dataset, place: Axes | None = None) -> Figure | None:
    """Draw the final sense over the hemisphere of starts about the axis of least inertia, equal-area; else None."""
    if min(dataset.sizes["from_angle"], dataset.sizes["phase"]) < 8:
        return None
    full = {name: spaced_indices(dataset.sizes[name], MAX_DRAWN) for name in ("from_angle", "phase")}
    sense = dataset["final_sense"].isel({name: full.get(str(name), 0) for name in dataset["final_sense"].dims}).load()
    subtitle = f"{dataset.attrs.get('title', '')}\nstarts seen along the axis of least inertia; equal areas"
    figure = canvas.make_figure(6.0, 6.0, "Final sense of spin", subtitle, ax=place)
    panel = figure.subplots()
    radius = 2.0 * np.sin(0.5 * np.clip(axis_scales.cell_edges(sense["from_angle"].values), 0.0, 0.5 * np.pi))
    angle = axis_scales.cell_edges(sense["phase"].values)[:, None]
    values = sense.transpose("phase", "from_angle").values
    props: dict[str, Any] = {"cmap": ListedColormap(SENSE_COLORS), "vmin": -1.5, "vmax": 1.5, "rasterized": True}
    panel.pcolormesh(radius * np.cos(angle), radius * np.sin(angle), values, **props)
    panel.set(aspect="equal", xlabel="towards the intermediate axis", ylabel="towards the axis of greatest inertia")
    words = ("undetermined", "negative", "positive")
    canvas.draw_legend(
        figure, [Patch(color=color, label=word) for color, word in zip(SENSE_COLORS, words, strict=True)]
    )
    return figure


def draw_times(dataset: xr.Dataset, place: Axes | None = None) -> Figure | None:
    """Draw crossing and settling times of each body over the loss, medians over the starts; else None."""
    if dataset.sizes["loss"] < 3 or "body" not in dataset.dims:
        return None
    subtitle = f"{dataset.attrs.get('title', '')}\nsolid: settled; dotted: at the energy of the intermediate axis"
    figure = canvas.make_figure(7.6, 5.2, "Time to a flat spin", subtitle, ax=place)
    panel = figure.subplots()
    for color, name in zip(colors.SERIES_COLORS, dataset["body"].values.tolist(), strict=False):
        body = dataset[["settling_time", "crossing_time", "omega0"]].sel(body=name).load()
        for variable, line in (("settling_time", "-"), ("crossing_time", ":")):
            turns = (body[variable] * body["omega0"] / (2.0 * np.pi)).transpose("loss", ...).values
            turns = np.median(turns.reshape(turns.shape[0], -1), axis=1)
            panel.plot(body["loss"], turns, line, color=color, marker="o", ms=3, label=name if line == "-" else None)
    panel.set(xscale="log", yscale="log", xlabel=r"loss $\alpha L$", ylabel="initial rotations")
    marks.draw_grid(panel)
    canvas.draw_legend(figure)
    return figure
