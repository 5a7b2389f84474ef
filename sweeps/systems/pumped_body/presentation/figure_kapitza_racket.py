"""Kapitza's racket as an animation: two equal bodies spun about their intermediate axis, and one of them is shaken.

Left its moments change as in the map, and its shape with them; right they stay, and it flips. Below, the tilt of the
angular momentum from the spin axis. Both motions are those of the full equations, from the same start.
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
DOTS = 90  # per inch
TILT = 0.02  # rad, of L at the start
E_FOLDS = 9.0  # of the body that stays: it flips within half of them, and back
SLOW = 1e-3  # of the spin: growth that is not waited for
NAMES = ("axis", *(f"{name}{i}" for name in ("I", "depth", "lag") for i in (1, 2, 3)), "frequency", "omega0")


def frames(ds: xr.Dataset, inverse: bool) -> Iterator[np.ndarray]:
    """Yield the frames of the animation, shape (height, width, 4); none where no intermediate axis is held.

    With `inverse`, 1/I_i is modulated, and not I_i.
    """
    point = held(ds)
    if point is None:
        return
    end = E_FOLDS / growth(*(point[f"I{i}"] for i in (1, 2, 3)), int(point["axis"])) / abs(point["omega0"])
    times = np.linspace(0.0, end, FRAMES * sheets.current_film.get().frame_factor * FINER + 1)
    still = {f"depth{i}": 0.0 for i in (1, 2, 3)}
    both = [followed(point | other, inverse, times) for other in ({}, still)]
    if both[0][1][:, int(point["axis"]) - 1].min() > 0.0:  # the well is deep enough for this start
        yield from _drawn(point, times, both)


def growth(I1, I2, I3, axis):
    """Return the growth rate over the spin rate with the moments at rest; 0 where the spin is stable."""
    return np.sqrt(np.maximum(-linear.omega_squared(I1, I2, I3, 1.0, axis), 0.0))


def held(ds: xr.Dataset) -> dict[str, float] | None:
    """Return a point whose intermediate axis is held, at a sixth of a turn a period and fast; None where there is none.

    There averaging holds, and what it adds is a well that a tilt of some degrees does not leave.
    """
    margin = ds["triangle_margin"]
    rate = xr.apply_ufunc(growth, ds["I1"], ds["I2"], ds["I3"], ds["axis"])
    there = (rate > SLOW) & (ds["regime"] == REGIMES.index("stable") - 1) & (margin >= 0.0)
    merit = (rate * ds["frequency"] * ds["trace"] * (2.0 - ds["trace"])).where(there)
    if not merit.max() > 0.0:
        return None
    best = merit[merit.argmax(...)]
    return {name: float(best[name]) for name in NAMES}


def followed(point: dict[str, float], inverse: bool, times: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return moments (times, 3), angular momentum over its size (times, 3) and attitude (times, 3, 3), L along z.

    The point has parameters of the body, by `NAMES`; times are in s. With `inverse`, 1/I_i is modulated, and not I_i.
    """
    k = int(point["axis"]) - 1
    size = point["omega0"] * point[f"I{k + 1}"]

    def moments(t):
        return np.stack(moments_at(point, point["frequency"] * t, inverse), axis=-1)

    def rates(t, y):
        turned = y.reshape(3, 3)  # rows: the axes of space, the last along L, in those of the body
        return np.cross(turned, size * turned[2] / moments(t)).ravel()

    upright = np.zeros(3)
    upright[[k, (k + 1) % 3]] = math.cos(TILT), math.sin(TILT)
    first = np.eye(3)[(k + 2) % 3]
    start = np.array([first, np.cross(upright, first), upright])
    y = solve_ivp(rates, (0.0, times[-1]), start.ravel(), "DOP853", times, rtol=1e-9, atol=1e-12).y
    turned = y.T.reshape(-1, 3, 3)
    return moments(times), turned[:, 2], turned


def _drawn(point, times, both):
    axis, lasting = int(point["axis"]), FINER * TRAIL * sheets.current_film.get().frame_factor
    depths = ", ".join(f"I{i} by {100 * abs(point[f'depth{i}']):.3g} %" for i in (1, 2, 3) if point[f"depth{i}"])
    moments = ", ".join(wording.format_number(point[f"I{i}"], 4) for i in (1, 2, 3))
    words = f"I = ({moments}) kg m², spun about the intermediate axis {axis}"
    figure = animation.empty_stage(INCHES, DOTS, "Kapitza's racket", words, (12.0, 8.0))
    shaken = wording.with_unit(f"shaken: {depths}, at {wording.format_number(point['frequency'], 3)}", "rad s-1")
    trace, scenes, dots = figure.add_axes((0.1, 0.12, 0.87, 0.2)), [], []
    for k, (title, color) in enumerate(((shaken, colors.STABLE), ("at rest", colors.UNSTABLE))):
        place = figure.add_axes((0.5 * k, 0.36, 0.5, 0.45))
        place.set_title(title, fontsize=9, color=color, fontweight="bold")
        scenes.append(FilmStage(place, 1.6, solid(both[k][0][0]), axis))
        tilt = np.degrees(np.arccos(np.clip(both[k][1][:, axis - 1], -1.0, 1.0)))
        trace.plot(times, tilt, color=color, linewidth=1.4)
        dots += [(trace.plot([], [], "o", color=color, markersize=5, animated=True)[0], tilt)]
    trace.set(xlim=(0.0, times[-1]), ylim=(0.0, 185.0), xlabel="time (s)", ylabel="tilt of L (°)", yticks=[0, 90, 180])
    trace.spines[["top", "right"]].set_visible(False)

    def steps():
        for at in range(0, times.size, FINER):
            artists = []
            for scene, (moments, L, turned), (dot, tilt) in zip(scenes, both, dots, strict=True):
                scene.solid.cover(solid(moments[at]))
                dot.set_data([times[at]], [tilt[at]])
                trail = turned[max(0, at - lasting) : at + 1, :, int(np.argmin(moments[at]))]
                artists += [*scene.turn(turned[at], L[at] / moments[at], trail), dot]
            yield artists

    yield from animation.draw_frames(figure, steps())
