"""Figures of the twist of thrown bodies: over two ratios of moments, and over the angle of the throw."""

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from sweeps.figure import axis_scales, canvas, colors, marks, sheets, wording
from sweeps.schema.iteration import spaced_indices
from sweeps.systems.presentation.sentences import head_texts

REAL_BODIES = {  # (I1/I2, I3/I2): sources in the definition `rackets`
    "tennis racket": (0.00121 / 0.01638, 0.01748 / 0.01638),
    "telephone": (7.4181040233333e-5 / 3.0975441516667e-4, 3.8236311326667e-4 / 3.0975441516667e-4),
}
THROW_ANGLE = 0.13  # rad, χ near a racket's best throw; the nearest throw of the grid is drawn
MAX_DRAWN = 320  # ratios per side of the map
MAX_NAMED = 20  # bodies with curves that a reader can distinguish by their names


def draw_map(dataset: xr.Dataset, ax: Axes | None = None) -> Figure | None:
    """Draw |twist| over I1/I2 and I3/I2 at one chi, with contours of the growth rate; else return None."""
    if (
        "body" in dataset.dims
        or min(dataset.sizes.get(name, 1) for name in ("I1", "I3")) < 2
        or dataset.sizes["I2"] > 1
    ):
        return None
    indices: dict[str, Any] = {"chi": int(np.argmin(np.abs(np.abs(dataset["chi"].values) - THROW_ANGLE)))}
    indices |= {"I2": 0, "theta": 0, "omega0": 0}
    indices |= {name: spaced_indices(dataset.sizes[name], MAX_DRAWN) for name in ("I1", "I3")}
    plane = dataset[["twist_exact", "growth", "triangle_margin"]].isel(indices).load().sortby(["I1", "I3"])
    chi, theta = (wording.format_number(float(plane[name]), digits) for name, digits in (("chi", 3), ("theta", 4)))
    throw = f"thrown at χ = {chi} rad from the intermediate axis, θ = {theta} rad; closed form"
    figure = canvas.make_figure(7.6, 6.0, *head_texts(dataset, "Twist per revolution of the handle", throw), ax=ax)
    ax = figure.subplots()
    x, y = plane["I1"].values / float(plane["I2"]), plane["I3"].values / float(plane["I2"])
    margin = plane["triangle_margin"].transpose("I3", "I1").values
    twist = np.abs(plane["twist_exact"].transpose("I3", "I1").values) / np.pi
    props: dict[str, Any] = {"cmap": sheets.color_map("size"), "vmin": 0.0, "vmax": 1.0, "rasterized": True}
    mesh = ax.pcolormesh(axis_scales.cell_edges(x), axis_scales.cell_edges(y), twist, **props)
    figure.colorbar(mesh, ax=ax, label="|twist|  (half turns)", extend="max")
    growth = np.where(margin >= 0, plane["growth"].transpose("I3", "I1").values, np.nan)
    lines = ax.contour(x, y, growth, [0.2, 0.4, 0.6, 0.8, 1.0], colors="white", linewidths=0.9)
    ax.clabel(lines, list(lines.levels)[:2], fmt=lambda value: rf"$\sigma = {value:g}\,\omega_0$", fontsize=7.5)
    impossible = ax.contourf(x, y, margin, [-np.inf, 0.0], colors=colors.PAPER, hatches=["////"], zorder=2)
    impossible.set(edgecolor=colors.QUIET, lw=0.0)
    ax.contour(x, y, margin, [0.0], colors=colors.INK, linewidths=1.0)
    for name, (ratio1, ratio3) in REAL_BODIES.items():
        ax.plot(ratio1, ratio3, marker="*", color=colors.UNSTABLE, mec=colors.PAPER, ms=12, gid=name)
        marks.annotate(ax, name, (ratio1, ratio3), (7, 5), path_effects=marks.halo(), fontsize=8.5)
    ax.set(xlabel="$I_1/I_2$  (handle over intermediate axis)", ylabel="$I_3/I_2$")
    ax.set(xlim=(x[0], x[-1]), ylim=(y[0], y[-1]))
    growth_entry = Line2D(
        [], [], color=colors.QUIET, lw=0.9, label=r"white: growth rate $\sigma/\omega_0$ in steps of 0.2"
    )
    canvas.draw_legend(figure, [growth_entry, marks.hatched_patch()])
    return figure


def draw_defect(dataset: xr.Dataset, ax: Axes | None = None) -> Figure | None:
    """Draw the twist of named bodies over the angle of the throw, with each one's best throw; else return None."""
    if "body" not in dataset.dims or not 1 <= dataset.sizes["body"] <= MAX_NAMED or dataset.sizes["chi"] < 2:
        return None
    rows = dataset.isel({name: 0 for name in ("theta", "omega0") if name in dataset.dims}).sortby("chi").load()
    texts = head_texts(dataset, "Twist of the handle in a revolution", "dots: best throws")
    figure = canvas.make_figure(7.6, 5.2, *texts, ax=ax)
    panel = figure.subplots()
    angles = np.degrees(rows["chi"].values)
    for order, name in enumerate(rows["body"].values.tolist()):
        body, color = rows.isel(body=order), colors.SERIES_COLORS[order % len(colors.SERIES_COLORS)]
        twist = np.degrees(np.abs(body["twist" if "twist" in body else "twist_exact"].values))
        best = int(np.nanargmax(twist))
        panel.plot(angles, twist, color=color, lw=1.5, label=f"{name}: {twist[best]:.1f}°", gid="twist")
        panel.plot(angles[best], twist[best], "o", color=color, ms=6, gid="best")
    panel.axhline(180.0, color=colors.INK, lw=0.9, ls=":")
    marks.annotate(panel, "half twist", (angles[0], 180.0), (2, 3), fontsize=8.5)
    panel.set(xscale="log", ylim=(0.0, 198.0), yticks=range(0, 181, 30), ylabel="twist (degrees)")
    panel.set(xlabel="angle of the throw from the intermediate axis, χ (degrees)")
    axis_scales.set_plain_log_ticks(panel.xaxis)
    marks.draw_grid(panel)
    canvas.draw_legend(figure)
    return figure
