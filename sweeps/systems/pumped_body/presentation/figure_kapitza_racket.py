"""Animation of Kapitza's racket: two equal bodies spun about their intermediate axis, with and without shaking.

Left the moments change as in the map, and the shape with them; right they are constant, and the body flips. Below,
the tilt of the angular momentum from the spin axis. Both motions solve the full equations from the same start.
"""

import math
from collections.abc import Iterator

import numpy as np
import xarray as xr
from scipy.integrate import solve_ivp

from kernels.flow.codes import REGIMES
from kernels.free import linear
from sweeps.figure import colors, sheets, wording
from sweeps.systems.bodies.solid import solid
from sweeps.systems.presentation import animation
from sweeps.systems.pumped_body.system import moments_at
from sweeps.systems.rigid_body.presentation.figure_flip import FINER, TRAIL, FilmStage

FRAMES = 150
INCHES = (7.2, 5.0)
DOTS = 90  # pixels per inch
TILT = 0.02  # rad, initial tilt of L from the spin axis
E_FOLDS = 9.0  # length in e-folds of the unshaken body, which flips and returns within it
MIN_GROWTH = 1e-3  # growth rate over the spin rate; slower bodies would flip after thousands of rotations
NAMES = ("axis", *(f"{name}{i}" for name in ("I", "depth", "lag") for i in (1, 2, 3)), "frequency", "omega0")


def frames(ds: xr.Dataset, inverse: bool) -> Iterator[np.ndarray]:
    """Yield the frames of the animation, shape (height, width, 4); none if no intermediate axis is stabilised.

    With `inverse`, 1/I_i is modulated instead of I_i.
    """
    point = stabilised_point(ds)
    if point is None:
        return
    end = E_FOLDS / growth(*(point[f"I{i}"] for i in (1, 2, 3)), int(point["axis"])) / abs(point["omega0"])
    times = np.linspace(0.0, end, FRAMES * sheets.current_film.get().frame_factor * FINER + 1)
    at_rest = {f"depth{i}": 0.0 for i in (1, 2, 3)}
    motions = [integrate(point | depths, inverse, times) for depths in ({}, at_rest)]
    if motions[0][1][:, int(point["axis"]) - 1].min() > 0.0:  # the shaken body does not flip from this start
        yield from _draw_frames(point, times, motions)


def growth(I1, I2, I3, axis):
    """Return the growth rate over the spin rate about `axis` for constant moments I1, I2, I3; 0 if stable."""
    return np.sqrt(np.maximum(-linear.omega_squared(I1, I2, I3, 1.0, axis), 0.0))


def stabilised_point(ds: xr.Dataset) -> dict[str, float] | None:
    """Return a point with a stabilised intermediate axis; None if there is none.

    It has a high frequency, for which averaging is valid, and a multiplier near exp(iπ/3), in a deep averaged well.
    """
    margin = ds["triangle_margin"]
    rate = xr.apply_ufunc(growth, ds["I1"], ds["I2"], ds["I3"], ds["axis"])
    is_stabilised = (rate > MIN_GROWTH) & (ds["regime"] == REGIMES.index("stable") - 1) & (margin >= 0.0)
    merit = (rate * ds["frequency"] * ds["trace"] * (2.0 - ds["trace"])).where(is_stabilised)
    if not merit.max() > 0.0:
        return None
    best = merit[merit.argmax(...)]
    return {name: float(best[name]) for name in NAMES}


def integrate(point: dict[str, float], inverse: bool, times: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Integrate the full motion of a body, shaken by the depths of its point.

    Args:
        point: parameters by `NAMES`.
        inverse: True if 1/I_i is modulated instead of I_i.
        times: s, shape (n,).

    Returns:
        Moments, kg m2, shape (n, 3); direction of L in the body, shape (n, 3); attitude, L along z, shape (n, 3, 3).
    """
    k = int(point["axis"]) - 1
    size = point["omega0"] * point[f"I{k + 1}"]

    def moments(t):
        return np.stack(moments_at(point, point["frequency"] * t, inverse), axis=-1)

    def rates(t, y):
        attitude = y.reshape(3, 3)  # rows: axes of space, the last along L, in the body
        return np.cross(attitude, size * attitude[2] / moments(t)).ravel()

    momentum = np.zeros(3)
    momentum[[k, (k + 1) % 3]] = math.cos(TILT), math.sin(TILT)
    first = np.eye(3)[(k + 2) % 3]
    start = np.array([first, np.cross(momentum, first), momentum])
    y = solve_ivp(rates, (0.0, times[-1]), start.ravel(), "DOP853", times, rtol=1e-9, atol=1e-12).y
    attitude = y.T.reshape(-1, 3, 3)
    return moments(times), attitude[:, 2], attitude


def _draw_frames(point, times, motions):
    """Yield the frames of the film: the modulated and the unmodulated body, and the tilt of L over time for both."""
    axis, trail_length = int(point["axis"]), FINER * TRAIL * sheets.current_film.get().frame_factor
    depths = ", ".join(f"I{i} by {100 * abs(point[f'depth{i}']):.3g} %" for i in (1, 2, 3) if point[f"depth{i}"])
    moments = ", ".join(wording.format_number(point[f"I{i}"], 4) for i in (1, 2, 3))
    words = f"I = ({moments}) kg m², spun about the intermediate axis {axis}"
    figure = animation.empty_stage(INCHES, DOTS, "Kapitza's racket", words, (12.0, 8.0))
    shaken = wording.with_unit(f"shaken: {depths}, at {wording.format_number(point['frequency'], 3)}", "rad s-1")
    trace, scenes, dots = figure.add_axes((0.1, 0.12, 0.87, 0.2)), [], []
    for k, (title, color) in enumerate(((shaken, colors.STABLE), ("at rest", colors.UNSTABLE))):
        place = figure.add_axes((0.5 * k, 0.36, 0.5, 0.45))
        place.set_title(title, fontsize=9, color=color, fontweight="bold")
        scenes.append(FilmStage(place, 1.6, solid(motions[k][0][0]), axis))
        tilt = np.degrees(np.arccos(np.clip(motions[k][1][:, axis - 1], -1.0, 1.0)))
        trace.plot(times, tilt, color=color, linewidth=1.4)
        dots += [(trace.plot([], [], "o", color=color, markersize=5, animated=True)[0], tilt)]
    trace.set(xlim=(0.0, times[-1]), ylim=(0.0, 185.0), xlabel="time (s)", ylabel="tilt of L (°)", yticks=[0, 90, 180])
    trace.spines[["top", "right"]].set_visible(False)

    def steps():
        """Yield the artists of each frame, set to its instant."""
        for index in range(0, times.size, FINER):
            artists = []
            for scene, (moments, L, attitude), (dot, tilt) in zip(scenes, motions, dots, strict=True):
                scene.solid.set_faces(solid(moments[index]))
                dot.set_data([times[index]], [tilt[index]])
                trail = attitude[max(0, index - trail_length) : index + 1, :, int(np.argmin(moments[index]))]
                artists += [*scene.set_attitude(attitude[index], L[index] / moments[index], trail), dot]
            yield artists

    yield from animation.draw_frames(figure, steps())
