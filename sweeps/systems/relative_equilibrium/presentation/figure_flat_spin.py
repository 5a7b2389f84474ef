"""Animation of the flat spin: the end of a slender body's growing nutation, by the full equations.

Left, the direction of the angular momentum L in the body: a spiral from the spin axis to the equator. Right, its angle
from that axis, and the unbounded growth by linear theory. Explorer 1 took this path in 1958.
"""

import math
from collections.abc import Iterator

import numpy as np
import sympy as sp
import xarray as xr

from sweeps.figure import colors, sheets, wording
from sweeps.systems.presentation import animation

FRAMES = 60
INCHES = (6.4, 3.4)
DOTS = 90  # pixels per inch
TILT = 0.01  # rad, initial tilt of L from the spin axis
FLAT = math.radians(88.0)  # tilt at which the motion ends, as the flat spin is reached slowly
MAX_E_FOLDS = 60.0  # bound on the integrated time, in e-folds of the nutation
FINER = 60  # points of the path per frame
TRAIL = 6  # length of the dark end of the path, frames
NAMES = ("transverse_moment", "axial_moment", "slug_moment", "drag", "rotor_momentum", "spin_rate")
SCREEN = animation.screen_axes(np.array([0.75, -0.5, 0.45]))  # unit vectors of a viewer in this direction


def frames(ds: xr.Dataset) -> Iterator[np.ndarray]:
    """Yield the frames of the animation, shape (height, width, 4); none if no slender body without a rotor grows."""
    point = fastest_growth(ds)
    if point is None:
        return
    times, momenta = integrate(point)
    yield from _draw_frames(point, times, momenta)


def fastest_growth(ds: xr.Dataset) -> dict[str, float] | None:
    """Return the slender body without a rotor with the largest growth rate over its spin rate; None if none grows."""
    rates = ds["growth_rate"].isel(eigenvalue=0, equilibrium=0, epsilon=0)
    rates = rates.where((rates["axial_moment"] < rates["transverse_moment"]) & (rates["rotor_momentum"] == 0.0))
    rate = (rates / np.abs(rates["spin_rate"])).transpose(*NAMES)
    if not np.nanmax(rate.values, initial=0.0) > 0.0:
        return None
    place = np.unravel_index(int(np.nanargmax(rate.values)), rate.shape)
    best = rates.transpose(*NAMES)[place]
    return {name: float(best[name]) for name in NAMES} | {"growth_rate": float(best)}


def integrate(point: dict[str, float]) -> tuple[np.ndarray, np.ndarray]:
    """Integrate the full motion from a tilt of L by TILT until the spin is flat.

    `point` has the parameters and `growth_rate`. Return times, s, shape (n,), and L in the body's axes, kg m2 s-1,
    shape (n, 3).
    """
    from scipy.integrate import solve_ivp

    from sweeps.mechanics.library.relative.viscous_slug import system

    values = {p.symbol: point[p.name] for p in system.parameters.values()}
    states = [state.symbol for state in system.states.values()]
    rates = sp.lambdify([states], [system.rates[x].subs(values) for x in states], "math", cse=True)
    moments = np.array([point["transverse_moment"]] * 2 + [point["axial_moment"]])
    spin, slug = point["spin_rate"], point["slug_moment"]

    def flat(t, x):
        L = moments * x[:3] + slug * x[3:]
        return L[2] * np.sign(spin) - math.cos(FLAT) * np.linalg.norm(L)

    flat.terminal = True
    across = math.tan(TILT) * point["axial_moment"] / point["transverse_moment"] * spin
    start, end = np.array([across, 0.0, spin, across, 0.0, spin]), MAX_E_FOLDS / point["growth_rate"]
    options = {"rtol": 1e-9, "atol": 1e-12, "events": flat, "dense_output": True}
    run = solve_ivp(lambda t, x: rates(x), (0.0, end), start, "DOP853", **options)
    times = np.linspace(0.0, run.t[-1], FRAMES * sheets.current_film.get().frame_factor * FINER + 1)
    x = run.sol(times)
    return times, (moments[:, None] * x[:3] + slug * x[3:]).T


def tilt_angle(momenta: np.ndarray) -> np.ndarray:
    """Return the angle of L from the spin axis, rad."""
    return np.arctan2(np.hypot(momenta[:, 0], momenta[:, 1]), np.abs(momenta[:, 2]))


def _draw_frames(point, times, momenta):
    """Yield the frames of the film: the path of L on the body's sphere, and its tilt over time with linear theory."""
    moments = ("axial_moment", "transverse_moment", "slug_moment")
    axial, transverse, slug = (wording.format_number(point[name], 3) for name in moments)
    words = f"moment about its axis {axial} of {transverse} kg m², slug {slug} kg m²"
    figure = animation.empty_stage(INCHES, DOTS, "A slender body ends in a flat spin", words)
    sphere_ax, tilt_ax = figure.add_axes((0.01, 0.04, 0.42, 0.78)), figure.add_axes((0.53, 0.16, 0.44, 0.62))
    directions = momenta / np.linalg.norm(momenta, axis=1, keepdims=True) @ SCREEN
    path = _draw_sphere(sphere_ax, directions)
    degrees = np.degrees(tilt_angle(momenta))
    linear = np.minimum(degrees[0] * np.exp(point["growth_rate"] * times), 95.0)
    tilt_ax.plot(times, linear, color=colors.QUIET, lw=1.0, ls=(0, (4, 2)), label="linear theory")
    tilt_ax.plot(times, degrees, color=colors.SERIES_COLORS[0], lw=1.4, label="full equations")
    tilt_ax.axhline(90.0, color=colors.FAINT, lw=0.8)
    tilt_ax.set(xlim=(0.0, times[-1]), ylim=(0.0, 94.0), xlabel="time (s)", ylabel="L from the spin axis (°)")
    tilt_ax.legend(fontsize=7, loc="upper left", frameon=False)
    props = {"color": colors.INK, "ms": 5, "animated": True}
    (dot,), (tip,) = tilt_ax.plot([], [], "o", **props), sphere_ax.plot([], [], "o", **props)
    finer = sheets.current_film.get().frame_factor

    def frames():
        """Yield the artists of each frame, set to its instant."""
        for index in range(0, FINER * (FRAMES * finer + 1), FINER):
            path.set_data(*directions[max(0, index - TRAIL * finer * FINER) : index + 1].T)
            dot.set_data([times[index]], [degrees[index]])
            tip.set_data(*directions[index : index + 1].T)
            yield path, dot, tip

    yield from animation.draw_frames(figure, frames())


def _draw_sphere(ax, directions):
    """Draw the sphere of directions with outline, equator, spin axis and the faint path; return the trail's line."""
    angle = np.linspace(0.0, 2.0 * math.pi, 121)
    ax.plot(np.cos(angle), np.sin(angle), color=colors.QUIET, lw=0.8)
    equator = np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=1)
    ax.plot(*(equator @ SCREEN).T, color=colors.QUIET, lw=0.8)
    ax.plot(*np.outer(SCREEN[2], [-1.25, 1.25]), color=colors.QUIET, lw=2.0)
    ax.plot(*directions.T, color=colors.FAINT, lw=0.4)
    ax.set(xlim=(-1.3, 1.3), ylim=(-1.3, 1.3), aspect="equal")
    ax.axis("off")
    return ax.plot([], [], color=colors.SERIES_COLORS[0], lw=0.9, animated=True)[0]
