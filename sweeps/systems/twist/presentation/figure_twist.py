"""Figures of the twist of thrown bodies: over two ratios of moments, and its shortfall from a half turn."""

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from sweeps.figure import axis_scales, canvas, colors, marks, sheets, wording
from sweeps.schema.iteration import spaced_indices

REAL_BODIES = {  # (I1/I2, I3/I2): sources in the definition `rackets`
    "tennis racket": (0.00121 / 0.01638, 0.01748 / 0.01638),
    "telephone": (7.4181040233333e-5 / 3.0975441516667e-4, 3.8236311326667e-4 / 3.0975441516667e-4),
}
THROW_ANGLE = 0.13  # rad, χ near a racket's best throw; the nearest throw of the grid is drawn
MAX_DRAWN = 320  # ratios per side of the map
NAME_SPACING = 0.12  # distance of the names of bodies, relative to the panel's height
MAX_NAMED = 20  # bodies up to which they are named, and drawn large


def draw_map(ds: xr.Dataset, ax: Axes | None = None) -> Figure | None:
    """Draw |twist| over I1/I2 and I3/I2 at one chi, with contours of the growth rate; else return None."""
    if "body" in ds.dims or min(ds.sizes.get(name, 1) for name in ("I1", "I3")) < 2 or ds.sizes["I2"] > 1:
        return None
    indices: dict[str, Any] = {"chi": int(np.argmin(np.abs(np.abs(ds["chi"].values) - THROW_ANGLE)))}
    indices |= {"I2": 0, "theta": 0, "omega0": 0}
    indices |= {name: spaced_indices(ds.sizes[name], MAX_DRAWN) for name in ("I1", "I3")}
    plane = ds[["twist_exact", "growth", "triangle_margin"]].isel(indices).load().sortby(["I1", "I3"])
    chi, theta = (wording.format_number(float(plane[name]), digits) for name, digits in (("chi", 3), ("theta", 4)))
    throw = f"thrown at χ = {chi} rad from the intermediate axis, θ = {theta} rad; closed form"
    subtitle = f"{ds.attrs.get('title', '')}\n{throw}"
    figure = canvas.make_figure(7.6, 6.0, "Twist per revolution of the handle", subtitle, ax=ax)
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


def draw_defect(ds: xr.Dataset, ax: Axes | None = None) -> Figure | None:
    """Draw the least defect of each body's throws, and that of the separatrix, against exp(-pi sigma/omega0)."""
    bodies = _select_bodies(ds)
    if bodies["growth"].size == 0:
        return None
    subtitle = f"{ds.attrs.get('title', '')}\neach point a body"
    figure = canvas.make_figure(7.2, 5.2, "Shortfall of the twist from a half turn", subtitle, ax=ax)
    ax = figure.subplots()
    x = np.exp(-np.pi * bodies["growth"].values)
    defect: xr.DataArray = np.pi - abs(bodies["twist" if "twist" in bodies else "twist_exact"])
    has_names = x.size <= MAX_NAMED
    dot: dict[str, Any] = {"ms": 6.0 if has_names else 2.4, "mew": 0.0, "alpha": 1.0 if has_names else 0.5}
    ring = {"ms": 9.0, "mfc": "none", "mew": 1.6} if has_names else dot
    least_defect = defect.min("chi").values if "chi" in defect.dims else defect.values
    label = rf"twist, {'measured' if 'twist' in bodies else 'closed form'}, minimum over $\chi$"
    ax.plot(x, least_defect, "o", color=colors.STABLE, gid="best", label=label, **dot)
    separatrix_defect = bodies["twist_defect_theory"].values
    ax.plot(x, separatrix_defect, "o", color=colors.UNSTABLE, gid="law", label="on the separatrix, exact", **ring)
    text = r"law: $4\sqrt{a/(a+b)}\,e^{-(\pi+\arctan\sqrt{b/a})\,\sigma/\omega_0}$"
    ax.plot(
        x, asymptotic_defect(bodies), "o", color=colors.INK, ms=3.5 if has_names else 1.0, gid="asymptotic", label=text
    )
    ends = (x.min() / ((20.0 if sheets.is_narrow() else 6.0) if has_names else 1.2), min(1.0, 2.5 * x.max()))
    exponential = np.geomspace(*ends, 50)
    bound_label = r"its bound: $4\,e^{-\pi\sigma/\omega_0}$"
    ax.plot(exponential, 4.0 * exponential, color=colors.INK, lw=1.0, gid="slope", label=bound_label)
    ax.set(xscale="log", yscale="log", xlim=ends)
    ax.set(xlabel=r"$e^{-\pi\sigma/\omega_0}$", ylabel=r"$\pi - |\mathrm{twist}|$  (rad)")
    if has_names and "body" in bodies.coords:
        heights, order = (
            np.sort(marks.spread_heights(ax, x[0], least_defect, NAME_SPACING)),
            np.argsort(x),
        )  # no leader crosses a name
        props = {"path_effects": marks.halo(), "ha": "right", "va": "center", "fontsize": 8.0}
        arrow = {"arrowstyle": "-", "color": colors.QUIET, "lw": 0.7}
        leader: dict[str, Any] = {"textcoords": ("data", "axes fraction"), "arrowprops": arrow}
        for *place, defect_of_body, name in zip(
            x[order], heights, least_defect[order], bodies["body"].values[order], strict=True
        ):
            marks.annotate(ax, str(name), place, (-7, 0), xycoords=("data", "axes fraction"), **props)
            ax.annotate("", (place[0], defect_of_body), tuple(place), **leader)
    for axis in (ax.xaxis, ax.yaxis):
        axis_scales.set_plain_log_ticks(axis)
    marks.draw_grid(ax)
    canvas.draw_legend(figure)
    return figure


def asymptotic_defect(bodies: xr.Dataset) -> np.ndarray:
    """Return the small-defect law, rad: ``4 sqrt(a/(a+b)) exp(-(pi + arctan sqrt(b/a)) growth)``."""
    low, middle, high = np.sort(np.broadcast_arrays(*(bodies[name].values for name in ("I1", "I2", "I3"))), axis=0)
    a, b = middle / low - 1.0, 1.0 - middle / high
    return 4.0 * np.sqrt(a / (a + b)) * np.exp(-(np.pi + np.arctan(np.sqrt(b / a))) * bodies["growth"].values)


def _select_bodies(ds: xr.Dataset) -> xr.Dataset:
    """Return possible bodies with three different moments, over chi and (along one dimension) the bodies."""
    names = ["twist" if "twist" in ds else "twist_exact", "growth", "twist_defect_theory", "triangle_margin"]
    subset = ds[names].isel({name: 0 for name in ("theta", "omega0") if name in ds.dims})
    body_dims = list(dict.fromkeys(dim for name in ("I1", "I2", "I3") for dim in subset[name].dims))
    subset = subset.isel({dim: spaced_indices(ds.sizes[dim], 40) for dim in body_dims if dim != "body"}).load()
    points = subset.stack(point=body_dims, create_index=False)
    first_chi = points.isel(chi=0)
    is_asymmetric = (first_chi["triangle_margin"] >= 0) & (first_chi["growth"] > 0.05)
    bodies = points.isel(point=np.flatnonzero(is_asymmetric.values))
    return bodies.assign(
        {name: bodies[name].isel(chi=0) for name in ("growth", "twist_defect_theory", "triangle_margin")}
    )
