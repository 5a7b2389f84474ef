"""Tumbling bodies: the ratio of both periods over shapes or energies, and the herpolhode.

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

PANELS = 4
STEPS = 200  # of a curve, on each side of the separatrix
TITLE = r"Ratio of tumbling periods, $P_\psi/P_\phi$"
DOTTED = (0, (1, 2))
PERIODS, POINTS = 7, 8000  # of the herpolhode


def draw_periods(ds: xr.Dataset, ax: Axes | None = None) -> Figure | None:
    """Draw P_psi over P_phi (long-axis convention) as a plane over two ratios of moments, or as curves of bodies."""
    if "body" in ds.dims:
        return _curves(ds, ax)
    if min(ds.sizes.get(name, 1) for name in ("I1", "I2")) < 2 or ds.sizes["I3"] > 1:
        return None
    return _planes(ds, ax)


def _planes(ds: xr.Dataset, place: Axes | None) -> Figure:
    subtitle = f"{ds.attrs.get('title', '')}\nclosed form; at each energy $E = 2TI_3/L^2$"
    shared = {"sharex": True, "sharey": True}
    figure, axes = canvas.make_panels(PANELS, (4.0, 3.3), f"{TITLE} (long-axis convention)", subtitle, place, **shared)
    energies = np.linspace(0, 0.6 * (ds.sizes["energy"] - 1), PANELS + 1).round().astype(int)[1:]
    for ax, k in zip(axes, energies, strict=True):
        mesh = _plane(ax, ds.isel(I3=0, omega0=0, energy=int(k)).load())
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


def _plane(ax, part: xr.Dataset):
    I3 = float(part["I3"])
    x, y = part["I1"].values / I3, part["I2"].values / I3
    ratio = part["period_ratio"].transpose("I2", "I1").values
    margin = part["triangle_margin"].transpose("I2", "I1").values
    energy = float(part["energy"])
    ax.set_facecolor(colors.FAINT)
    with np.errstate(divide="ignore", invalid="ignore"):
        level = np.where(y[:, None] >= x[None, :], np.log10(ratio), np.nan)
    props = {"cmap": sheets.color_map("logarithm"), "vmin": -1.5, "vmax": 1.5, "rasterized": True}
    mesh = ax.pcolormesh(axis_scales.cell_edges(x), axis_scales.cell_edges(y), level, **props)
    margin = np.where(y[:, None] >= x[None, :], margin, 1.0)
    impossible = ax.contourf(x, y, margin, [-np.inf, 0.0], colors="none", hatches=["////"])
    impossible.set(edgecolor="black", lw=0.0)  # in every theme: cells are pale
    ax.axhline(1.0 / energy, color=colors.UNSTABLE, lw=1.4, gid="separatrix")
    ax.plot([0, 1], [0, 1], color=colors.INK, lw=0.8)
    ax.set(
        xlim=axis_scales.cell_edges(x)[[0, -1]], ylim=axis_scales.cell_edges(y)[[0, -1]], title=f"$E = {energy:.4g}$"
    )
    return mesh


def _closed_form(part, energies):
    """Return energies and period ratios of a body, dense on both sides of the separatrix, where the ratio diverges."""
    low, high, at = energies.min(), energies.max(), float(part["I3"] / part["I2"])
    away = np.geomspace(1e-6, 1.0, STEPS)
    some = np.concatenate([at - (at - low) * away[::-1], [at], at + (high - at) * away])
    points = {name: np.full(some.size, float(part[name])) for name in ("I1", "I2", "I3", "omega0")}
    columns = tumbling.survey(points | {"energy": some}, 1e-9, measured=False)
    return some, columns["period_psi_exact"] / columns["period_phi_long_axis_exact"]


def _curves(ds: xr.Dataset, place: Axes | None) -> Figure:
    figure = canvas.make_figure(8.0, 5.0, TITLE, f"{ds.attrs.get('title', '')}\nlong-axis convention", ax=place)
    ax, is_curve = figure.subplots(), "energy" in ds.dims
    for number, name in enumerate(ds["body"].values.tolist()):
        part = ds.isel(body=number).squeeze().load()
        color = colors.SERIES_COLORS[number % len(colors.SERIES_COLORS)]
        if is_curve:
            ax.plot(*_closed_form(part, part["energy"].values), color=color, label=name)
            ax.axvline(float(part["I3"] / part["I2"]), color=color, lw=0.9, ls=DOTTED, gid="separatrix")
        else:
            ax.plot(part["energy"].values, part["period_ratio"].values, color=color, marker="o", label=name)
    ax.set(yscale="log", xlabel="$E = 2TI_3/L^2$", ylabel=r"$P_\psi/P_\phi$")
    axis_scales.set_plain_log_ticks(ax.yaxis)
    marks.draw_grid(ax)
    separatrix = Line2D([], [], color=colors.QUIET, lw=0.9, ls=DOTTED, label="separatrix (ratio diverges)")
    canvas.draw_legend(figure, [separatrix] * is_curve)
    return figure


def herpolhode(moments, omega, times) -> np.ndarray:
    """Return the angular velocity in the inertial frame, in the plane normal to L, shape (n, 2), in the unit of omega.

    The component along L stays 2T/L; the first axis of the plane is that of the angular velocity at time 0.
    """
    space = rotate_vectors(exact.attitude(moments, omega, times), exact.rotation(moments, omega, times))
    up = np.asarray(moments) * omega
    up = up / np.linalg.norm(up)
    first = np.asarray(omega) - np.dot(omega, up) * up
    size = np.linalg.norm(first)
    first = first / size if size > 0.0 else np.cross(up, np.eye(3)[np.argmin(np.abs(up))])
    return np.stack([space @ first, space @ np.cross(up, first)], axis=1)


def draw_herpolhode(ds: xr.Dataset, ax: Axes | None = None) -> Figure | None:
    """Draw the herpolhodes of one body in both modes; None where the map has no such motion."""
    places = [place for place in (_place(ds, "sam"), _place(ds, "lam")) if place is not None]
    if not places:
        return None
    subtitle = f"{ds.attrs.get('title', '')}\nseen along L, closed form"
    figure, axes = canvas.make_panels(len(places), (4.4, 4.4), "Herpolhodes", subtitle, ax)
    for ax, (mode, point) in zip(axes, places, strict=True):
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


def _place(ds: xr.Dataset, mode: str):
    """Return a point of a mode, well away from its ends, of a physically possible body; None where there is none."""
    number = {"sam": 0, "lam": 1}[mode]
    sound = (ds["mode_exact"] == number) & (ds["triangle_margin"] > 0.02)
    places = np.argwhere(sound.values)
    if not len(places):
        return None
    least, most = (ds[f"tilt_{name}"].values[tuple(places.T)] for name in ("least", "greatest"))
    at = places[int(np.argmin(np.abs(most - least - 0.6 * (most - least).max())))]  # a broad ring
    row = ds.isel(dict(zip(sound.dims, at.tolist(), strict=True)))
    return mode, {name: row[name].item() for name in ("I1", "I2", "I3", "energy", "omega0")}
