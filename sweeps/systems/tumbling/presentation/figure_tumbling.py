"""Figures of tumbling bodies: the ratio of both periods over shapes or energies, and the herpolhode.

The herpolhode is the curve that the angular velocity draws on the invariable plane, seen along L.
"""

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Patch

from kernels.free import exact
from sweeps.figure import axis_scales, canvas, colors, marks, sheets, wording
from sweeps.systems.motion import rotate_vectors
from sweeps.systems.presentation.sentences import head_texts
from sweeps.systems.tumbling.presentation.sentences import OBSERVED, energies_of_ratio, period_ratio_curve
from sweeps.systems.tumbling.system import SYSTEM

PANELS = 2  # energies that are drawn
SHARES_OF_ENERGIES = (0.15, 0.45)  # places of these energies in the range of the map
MIN_LABEL_HEIGHT = 0.08  # range of I2/I3 that has room for the name of a mode
TITLE = r"Ratio of tumbling periods, $P_\psi/P_\phi$"
DOTTED = (0, (1, 2))
PERIODS, POINTS = 7, 8000  # periods and points of the herpolhode


def draw_periods(dataset: xr.Dataset, ax: Axes | None = None) -> Figure | None:
    """Draw P_psi over P_phi (long-axis convention) over two ratios of moments, or as curves of bodies; else None."""
    if "body" in dataset.dims:
        return _draw_curves(dataset, ax)
    if min(dataset.sizes.get(name, 1) for name in ("I1", "I2")) < 2 or dataset.sizes["I3"] > 1:
        return None
    return _draw_planes(dataset, ax)


def _draw_planes(dataset: xr.Dataset, target_ax: Axes | None) -> Figure:
    """Draw the ratio of periods over I1/I3 and I2/I3, in a panel for each of several energies."""
    texts = head_texts(dataset, f"{TITLE} (long-axis convention)", "closed form; at each energy $E = 2TI_3/L^2$")
    figure, axes = canvas.make_panels(PANELS, (5.0, 4.3), *texts, target_ax)
    for ax, share in zip(axes, SHARES_OF_ENERGIES, strict=True):
        mesh = _draw_plane(ax, dataset.isel(I3=0, omega0=0, energy=round(share * (dataset.sizes["energy"] - 1))).load())
        ax.set(xlabel="$I_1/I_3$", ylabel="$I_2/I_3$")
    ticks = (0.03, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0)
    bar = figure.colorbar(mesh, ax=axes, label=r"$P_\psi/P_\phi$", extend="both", shrink=0.8)
    bar.set_ticks(ticks, labels=[f"{tick:g}" for tick in ticks])
    bar.minorticks_off()
    handles = [marks.hatched_patch(), Patch(facecolor=colors.FAINT, label="no motion has this energy")]
    canvas.draw_legend(figure, handles)
    return figure


def _draw_plane(ax, plane: xr.Dataset):
    """Draw P_psi/P_phi over I1/I3 and I2/I3 at one energy, and return the coloured cells.

    Cells with I2 < I1 or without a motion of this energy have the colour of the background. Impossible bodies are
    hatched; a line marks the separatrix, I2/I3 = 1/E, between the modes.
    """
    I3, energy = float(plane["I3"]), float(plane["energy"])
    x, y = plane["I1"].values / I3, plane["I2"].values / I3
    is_half = y[:, None] >= x[None, :]
    ratio, margin = (plane[name].transpose("I2", "I1").values for name in ("period_ratio", "triangle_margin"))
    ax.set_facecolor(colors.FAINT)
    props = {"cmap": sheets.color_map("logarithm"), "norm": LogNorm(0.03, 30.0), "rasterized": True}
    mesh = ax.pcolormesh(*map(axis_scales.cell_edges, (x, y)), np.where(is_half, ratio, np.nan), **props)
    impossible = ax.contourf(x, y, np.where(is_half, margin, 1.0), [-np.inf, 0.0], colors="none", hatches=["////"])
    impossible.set(edgecolor="black", lw=0.0)  # in every theme, as the cells are pale
    ax.axhline(1.0 / energy, color=colors.UNSTABLE, lw=1.4, gid="separatrix")
    ax.plot([0, 1], [0, 1], color=colors.INK, lw=0.8)
    limits = [axis_scales.cell_edges(side)[[0, -1]] for side in (x, y)]
    ax.set(xlim=limits[0], ylim=limits[1], title=f"$E = {energy:.4g}$")
    text = {"path_effects": marks.halo(2.4), "ha": "center", "va": "center", "fontweight": "bold"}
    for words, end in (("short-axis mode", limits[1][0]), ("long-axis mode", limits[1][1])):
        if abs(end - 1.0 / energy) > MIN_LABEL_HEIGHT:
            ax.text(0.5, 1.0 / energy + np.sign(end * energy - 1.0) * 0.05, words, **text)
    return mesh


def _draw_curves(dataset: xr.Dataset, target_ax: Axes | None) -> Figure:
    """Draw the ratio of periods of each body over energy, with observed ratios, or as a dot for a single energy."""
    figure = canvas.make_figure(8.0, 5.0, *head_texts(dataset, TITLE, "long-axis convention"), ax=target_ax)
    ax, is_curve = figure.subplots(), "energy" in dataset.dims
    for order, name in enumerate(dataset["body"].values.tolist()):
        body = dataset.isel(body=order).squeeze().load()
        color = colors.SERIES_COLORS[order % len(colors.SERIES_COLORS)]
        if not is_curve:
            ax.plot(body["energy"].values, body["period_ratio"].values, color=color, marker="o", label=name)
            continue
        ax.plot(*period_ratio_curve(body)[:2], color=color, label=name)
        ax.axvline(float(body["I3"] / body["I2"]), color=color, lw=0.9, ls=DOTTED, gid="separatrix")
        dot: dict[str, Any] = {"fmt": "o", "color": color, "mec": colors.INK, "gid": "observed"}
        for ratio, error in OBSERVED.get(name, ()):
            energies = energies_of_ratio(body, ratio)
            ax.errorbar(energies, [ratio, ratio], yerr=error or None, ms=6, capsize=3, zorder=4, **dot)
    ax.set(yscale="log", xlabel="$E = 2TI_3/L^2$", ylabel=r"$P_\psi/P_\phi$")
    axis_scales.set_plain_log_ticks(ax.yaxis)
    marks.draw_grid(ax)
    handles = [Line2D([], [], color=colors.QUIET, lw=0.9, ls=DOTTED, label="separatrix (ratio diverges)")]
    if {*OBSERVED} & {*dataset["body"].values.tolist()}:
        handles.append(
            Line2D([], [], color=colors.QUIET, marker="o", ls="none", label="observed ratio, in either mode")
        )
    canvas.draw_legend(figure, handles * is_curve)
    return figure


def herpolhode(moments, omega, times) -> np.ndarray:
    """Return the angular velocity in the inertial frame, projected on the plane normal to L, shape (n, 2).

    The component along L is 2T/L at all times; the first axis of the plane is along the initial angular velocity.

    Args:
        moments: principal moments, shape (3,).
        omega: initial angular velocity in the body, shape (3,), in the unit of the result.
        times: shape (n,), in the inverse unit of omega.
    """
    space = rotate_vectors(exact.attitude(moments, omega, times), exact.rotation(moments, omega, times))
    up = np.asarray(moments) * omega
    up = up / np.linalg.norm(up)
    first = np.asarray(omega) - np.dot(omega, up) * up
    size = np.linalg.norm(first)
    first = first / size if size > 0.0 else np.cross(up, np.eye(3)[np.argmin(np.abs(up))])
    return np.stack([space @ first, space @ np.cross(up, first)], axis=1)


def draw_herpolhode(dataset: xr.Dataset, ax: Axes | None = None) -> Figure | None:
    """Draw the herpolhodes of one body in both modes; return None if the map has no such motion."""
    points = [point for point in (_point_of_mode(dataset, "sam"), _point_of_mode(dataset, "lam")) if point is not None]
    if not points:
        return None
    subtitle = f"{dataset.attrs.get('title', '')}\nseen along L, closed form"
    figure, axes = canvas.make_panels(len(points), (4.4, 4.4), "Herpolhodes", subtitle, ax)
    for ax, (mode, point) in zip(axes, points, strict=True):
        moments, omega = SYSTEM.start(point)
        times = np.linspace(0.0, PERIODS * exact.period(exact.set_up(*moments, *omega)), POINTS)
        curve = herpolhode(moments, omega, times) / float(point["omega0"])
        radius = np.hypot(*curve.T)
        ax.plot(*curve.T, color=colors.STABLE, lw=0.9, gid="herpolhode")
        for edge in (radius.min(), radius.max()):
            ax.add_patch(Circle((0, 0), edge, fill=False, color=colors.FAINT, lw=0.8))
        ax.plot(0, 0, marker="+", color=colors.INK)
        ax.locator_params(nbins=4)
        ax.set(aspect="equal", xlabel=r"$\omega_x/\omega_0$", ylabel=r"$\omega_y/\omega_0$")
        words = {"sam": "short-axis mode", "lam": "long-axis mode"}[mode]
        ratios = " : ".join(wording.format_number(value, 3) for value in moments / moments[2])
        ax.set_title(f"{words}, {ratios}, E = {wording.format_number(float(point['energy']), 4)}")
    return figure


def _point_of_mode(dataset: xr.Dataset, mode: str):
    """Return (mode, a point of a possible body well within the mode's range of energy); None without such a point."""
    code = {"sam": 0, "lam": 1}[mode]
    is_possible = (dataset["mode_exact"] == code) & (dataset["triangle_margin"] > 0.02)
    places = np.argwhere(is_possible.values)
    if not len(places):
        return None
    min_tilt, max_tilt = (dataset[f"tilt_{name}"].values[tuple(places.T)] for name in ("least", "greatest"))
    best = places[int(np.argmin(np.abs(max_tilt - min_tilt - 0.6 * (max_tilt - min_tilt).max())))]  # a wide ring
    row = dataset.isel(dict(zip(is_possible.dims, best.tolist(), strict=True)))
    return mode, {name: row[name].item() for name in ("I1", "I2", "I3", "energy", "omega0")}
