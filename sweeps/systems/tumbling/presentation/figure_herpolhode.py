"""The herpolhode: the curve that the angular velocity draws on the invariable plane, seen along L."""

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from kernels import exact
from sweeps.figure import colors, style
from sweeps.systems.motion import rotated
from sweeps.systems.tumbling.system import SYSTEM

PERIODS, POINTS = 7, 8000


def herpolhode(moments, omega, times) -> np.ndarray:
    """Return the angular velocity in the inertial frame, in the plane normal to L, shape (n, 2), in the unit of omega.

    The component along L stays 2T/L; the first axis of the plane is that of the angular velocity at time 0.
    """
    space = rotated(exact.attitude(moments, omega, times), exact.rotation(moments, omega, times))
    up = np.asarray(moments) * omega
    up = up / np.linalg.norm(up)
    first = np.asarray(omega) - np.dot(omega, up) * up
    size = np.linalg.norm(first)
    first = first / size if size > 0.0 else np.cross(up, np.eye(3)[np.argmin(np.abs(up))])
    return np.stack([space @ first, space @ np.cross(up, first)], axis=1)


def draw(ds: xr.Dataset, ax: Axes | None = None) -> Figure | None:
    """Draw the herpolhodes of one body in both modes; None where the map has no such motion."""
    places = [place for place in (_place(ds, "sam"), _place(ds, "lam")) if place is not None]
    if not places:
        return None
    subtitle = f"{ds.attrs.get('title', '')}\nseen along L, closed form"
    figure, axes = style.panels(len(places), (4.4, 4.4), "Herpolhodes", subtitle, ax)
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
        ratios = " : ".join(style.number(value, 3) for value in moments / moments[2])
        ax.set_title(f"{words}, {ratios}, E = {style.number(float(point['energy']), 4)}")
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
