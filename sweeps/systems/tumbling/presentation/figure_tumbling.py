"""Figures of tumbling bodies: the ratio of both periods over shapes or energies, and the herpolhode.

The herpolhode is the curve that the angular velocity draws on the invariable plane, seen along L.
"""

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Patch

from kernels.events import tumbling
from kernels.free import exact
from sweeps.figure import axis_scales, canvas, colors, marks, sheets, wording
from sweeps.systems.motion import rotate_vectors
from sweeps.systems.tumbling.system import SYSTEM

PANELS = 4  # energies that are drawn
STEPS = 200  # points of a curve on each side of the separatrix
TITLE = r"Ratio of tumbling periods, $P_\psi/P_\phi$"
DOTTED = (0, (1, 2))
PERIODS, POINTS = 7, 8000  # periods and points of the herpolhode


def draw_periods(ds: xr.Dataset, ax: Axes | None = None) -> Figure | None:
    """Draw P_psi over P_phi (long-axis convention) over two ratios of moments, or as curves of bodies; else None."""
    if "body" in ds.dims:
        return _draw_curves(ds, ax)
    if min(ds.sizes.get(name, 1) for name in ("I1", "I2")) < 2 or ds.sizes["I3"] > 1:
        return None
    return _draw_planes(ds, ax)


def _draw_planes(ds: xr.Dataset, target_ax: Axes | None) -> Figure:
    """Draw the ratio of periods over I1/I3 and I2/I3, in a panel for each of several energies."""
    subtitle = f"{ds.attrs.get('title', '')}\nclosed form; at each energy $E = 2TI_3/L^2$"
    shared_axes = {"sharex": True, "sharey": True}
    figure, axes = canvas.make_panels(
        PANELS, (4.0, 3.3), f"{TITLE} (long-axis convention)", subtitle, target_ax, **shared_axes
    )
    energies = np.linspace(0, 0.6 * (ds.sizes["energy"] - 1), PANELS + 1).round().astype(int)[1:]
    for ax, k in zip(axes, energies, strict=True):
        mesh = _draw_plane(ax, ds.isel(I3=0, omega0=0, energy=int(k)).load())
        ax.set(xlabel="$I_1/I_3$", ylabel="$I_2/I_3$")
        ax.label_outer()
    figure.colorbar(mesh, ax=axes, label=r"$\log_{10}\,P_\psi/P_\phi$", extend="both", shrink=0.8)
    handles = [
        marks.hatched_patch(),
        Patch(facecolor=colors.FAINT, label="energy outside the range of the body"),
        Patch(facecolor="none", edgecolor=colors.UNSTABLE, label=r"separatrix: short-axis mode below, long-axis above"),
    ]
    canvas.draw_legend(figure, handles)
    return figure


def _draw_plane(ax, plane: xr.Dataset):
    """Draw log10 P_psi/P_phi over I1/I3 and I2/I3 at one energy, and return the coloured cells.

    Cells with I2 < I1 or without a motion of this energy have the colour of the background. Impossible bodies are
    hatched; a line marks the separatrix, I2/I3 = 1/E.
    """
    I3 = float(plane["I3"])
    x, y = plane["I1"].values / I3, plane["I2"].values / I3
    ratio = plane["period_ratio"].transpose("I2", "I1").values
    margin = plane["triangle_margin"].transpose("I2", "I1").values
    energy = float(plane["energy"])
    ax.set_facecolor(colors.FAINT)
    with np.errstate(divide="ignore", invalid="ignore"):
        log_ratio = np.where(y[:, None] >= x[None, :], np.log10(ratio), np.nan)
    props = {"cmap": sheets.color_map("logarithm"), "vmin": -1.5, "vmax": 1.5, "rasterized": True}
    mesh = ax.pcolormesh(axis_scales.cell_edges(x), axis_scales.cell_edges(y), log_ratio, **props)
    margin = np.where(y[:, None] >= x[None, :], margin, 1.0)
    impossible = ax.contourf(x, y, margin, [-np.inf, 0.0], colors="none", hatches=["////"])
    impossible.set(edgecolor="black", lw=0.0)  # in every theme, as the cells are pale
    ax.axhline(1.0 / energy, color=colors.UNSTABLE, lw=1.4, gid="separatrix")
    ax.plot([0, 1], [0, 1], color=colors.INK, lw=0.8)
    ax.set(
        xlim=axis_scales.cell_edges(x)[[0, -1]], ylim=axis_scales.cell_edges(y)[[0, -1]], title=f"$E = {energy:.4g}$"
    )
    return mesh


def _period_ratio_curve(body, energies):
    """Return energies, and the closed-form ratio P_psi/P_phi (long-axis convention) of a body at each of them.

    The energies span the given ones and are dense near the separatrix, E = I3/I2, at which the ratio diverges.
    """
    low, high, separatrix = energies.min(), energies.max(), float(body["I3"] / body["I2"])
    distance = np.geomspace(1e-6, 1.0, STEPS)
    dense_energies = np.concatenate(
        [separatrix - (separatrix - low) * distance[::-1], [separatrix], separatrix + (high - separatrix) * distance]
    )
    points = {name: np.full(dense_energies.size, float(body[name])) for name in ("I1", "I2", "I3", "omega0")}
    columns = tumbling.survey(points | {"energy": dense_energies}, 1e-9, measured=False)
    return dense_energies, columns["period_psi_exact"] / columns["period_phi_long_axis_exact"]


def _draw_curves(ds: xr.Dataset, target_ax: Axes | None) -> Figure:
    """Draw the ratio of periods of each body over energy, or as a dot for a single energy."""
    figure = canvas.make_figure(8.0, 5.0, TITLE, f"{ds.attrs.get('title', '')}\nlong-axis convention", ax=target_ax)
    ax, is_curve = figure.subplots(), "energy" in ds.dims
    for order, name in enumerate(ds["body"].values.tolist()):
        body = ds.isel(body=order).squeeze().load()
        color = colors.SERIES_COLORS[order % len(colors.SERIES_COLORS)]
        if is_curve:
            ax.plot(*_period_ratio_curve(body, body["energy"].values), color=color, label=name)
            ax.axvline(float(body["I3"] / body["I2"]), color=color, lw=0.9, ls=DOTTED, gid="separatrix")
        else:
            ax.plot(body["energy"].values, body["period_ratio"].values, color=color, marker="o", label=name)
    ax.set(yscale="log", xlabel="$E = 2TI_3/L^2$", ylabel=r"$P_\psi/P_\phi$")
    axis_scales.set_plain_log_ticks(ax.yaxis)
    marks.draw_grid(ax)
    separatrix = Line2D([], [], color=colors.QUIET, lw=0.9, ls=DOTTED, label="separatrix (ratio diverges)")
    canvas.draw_legend(figure, [separatrix] * is_curve)
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


def draw_herpolhode(ds: xr.Dataset, ax: Axes | None = None) -> Figure | None:
    """Draw the herpolhodes of one body in both modes; return None if the map has no such motion."""
    points = [point for point in (_point_of_mode(ds, "sam"), _point_of_mode(ds, "lam")) if point is not None]
    if not points:
        return None
    subtitle = f"{ds.attrs.get('title', '')}\nseen along L, closed form"
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


def _point_of_mode(ds: xr.Dataset, mode: str):
    """Return (mode, a point of a possible body well within the mode's range of energy); None without such a point."""
    code = {"sam": 0, "lam": 1}[mode]
    is_possible = (ds["mode_exact"] == code) & (ds["triangle_margin"] > 0.02)
    places = np.argwhere(is_possible.values)
    if not len(places):
        return None
    min_tilt, max_tilt = (ds[f"tilt_{name}"].values[tuple(places.T)] for name in ("least", "greatest"))
    best = places[int(np.argmin(np.abs(max_tilt - min_tilt - 0.6 * (max_tilt - min_tilt).max())))]  # a wide ring
    row = ds.isel(dict(zip(is_possible.dims, best.tolist(), strict=True)))
    return mode, {name: row[name].item() for name in ("I1", "I2", "I3", "energy", "omega0")}
