"""Animation of stability: full motions that start near a stable and near an unstable equilibrium.

Left the system's picture; right its potential (of a rotating system the effective one) over one coordinate or two. Both
motions start at rest and solve the full equations, by the integrator that measures the map, at the grid's point that is
nearest to the system's defaults.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import sympy as sp
import xarray as xr

from sweeps.figure import colors, sheets, wording
from sweeps.mechanics import motions
from sweeps.schema.refusals import MapError
from sweeps.systems.oscillator.system import REGIMES
from sweeps.systems.presentation import animation
from sweeps.systems.presentation.moving import film
from sweeps.systems.presentation.moving.equations import picture_points

if TYPE_CHECKING:
    from sweeps.mechanics.model import Model

FRAMES = 84
INCHES = (6.4, 3.5)
DOTS = 96  # pixels per inch
FINER = 4  # points of a trail per frame
TRAIL = 10  # length of a trail, frames
TOLERANCE = 1e-9
STABLE_SHIFT, UNSTABLE_SHIFT = 0.25, 0.03  # rad, initial distance from the equilibrium
MIN_PERIODS = 2.0  # periods of the slowest oscillation about the stable equilibrium that are shown
ROUND_TRIP = 8.0  # rad; an unstable motion leaves and returns in about 2 ln(ROUND_TRIP/UNSTABLE_SHIFT) e-folds
WINDOW = (-0.5 * math.pi, 1.5 * math.pi)  # range of an angle that shows a valley and a hill of the potential
TICKS = ([0.0, math.pi], ["0", "π"])
COLORS = {"stable": colors.STABLE, "unstable": colors.UNSTABLE}


@dataclass(frozen=True)
class Run:
    """A motion that starts near an equilibrium."""

    name: str  #: name of the equilibrium
    regime: str  #: measured regime: "stable" or "unstable"
    place: np.ndarray  #: position of the equilibrium, rad, shape (n,)
    shift: np.ndarray  #: initial displacement from it, rad, shape (n,)
    duration: float  #: time that shows two oscillations, or departure and return, s


def frames(ds: xr.Dataset, model: "Model") -> Iterator[np.ndarray]:
    """Yield the frames of the animation; none without a stable and an unstable equilibrium."""
    defaults = {p.name: p.default for p in model.system.parameters.values()}
    if missing_names := defaults.keys() - ds.coords.keys():
        raise MapError(f"{min(missing_names)}: is missing; allowed: every parameter of the map's system")
    point = {n: float(ds[n].values[np.argmin(np.abs(ds[n].values - value))]) for n, value in defaults.items()}
    map_point = ds.sel(point).isel({d: 0 for d in ds["regime"].dims if d not in {*point, "equilibrium", "mode"}})
    runs = [run for regime in COLORS if (run := motion_near(map_point, regime, model)) is not None]
    if not runs:
        return
    duration = max(run.duration for run in runs)
    start = np.array([[*(run.place + run.shift), *np.zeros(run.place.size)] for run in runs])
    times = np.linspace(0.0, duration, FRAMES * sheets.current_film.get().frame_factor * FINER + 1)
    parameters = [np.full(len(runs), value) for value in point.values()]
    states, _, _ = motions.solve(model.moving, parameters, start, np.tile(times, (len(runs), 1)), TOLERANCE)
    if not np.isfinite(states).all():
        return
    yield from _draw_frames(model, point, runs, states[:, :, : model.equations.m], times)


def motion_near(point: xr.Dataset, regime: str, model: "Model") -> Run | None:
    """Return the motion near the first equilibrium of a regime.

    Args:
        point: the map at one point.
        regime: "stable" (in all modes) or "unstable" (in at least one mode).
        model: the system's model.

    Returns:
        The motion; None if no equilibrium has this regime, or its rate is not measured.
    """
    for name in point["equilibrium"].values.tolist():
        equilibrium = point.sel(equilibrium=name)
        regimes = {REGIMES[1 + int(code)] for code in equilibrium["regime"].values}
        if regime not in regimes or not regimes <= {"stable", "unstable"} or (regime == "stable" and len(regimes) > 1):
            continue
        place = np.array([float(equilibrium[f"{c.name}_equilibrium"].values[0]) for c in model.system.kept])
        rate = float(equilibrium["frequency"].min() if regime == "stable" else equilibrium["growth_rate"].max())
        if not (0.0 < rate < math.inf and np.isfinite(place).all()):
            continue
        signs = (-1.0) ** np.arange(place.size) if regime == "unstable" else 1.0 + 0.4 * np.arange(place.size)
        if regime == "stable":
            return Run(name, regime, place, STABLE_SHIFT * signs, MIN_PERIODS * 2.0 * math.pi / rate)
        duration = 2.0 * math.log(ROUND_TRIP / UNSTABLE_SHIFT) / rate
        return Run(name, regime, place, UNSTABLE_SHIFT * signs, duration)
    return None


# -- drawing


def _draw_frames(model, point, runs, q, times):
    """Yield the frames of the film: the picture, the potential with a moving dot for each run, and a clock.

    `q` has the coordinates of the runs, shape (runs, times, n), and `point` the value of each parameter by name.
    """
    words = ",  ".join(animation.format_parameters(model.system, point))
    figure = animation.empty_stage(INCHES, DOTS, model.system.title, words, (11.0, 7.5))
    for k, run in enumerate(runs):
        name, shift = run.name.replace("_", " "), wording.format_number(abs(run.shift[0]))
        text = f"● from rest {shift} rad beside “{name}”: {run.regime}"
        x, alignment = ((0.03, "left"), (0.98, "right"))[k]
        figure.text(x, 0.03, text, fontsize=8, color=COLORS[run.regime], va="bottom", ha=alignment)
    scene, curve = figure.add_axes((0.0, 0.09, 0.4, 0.76)), figure.add_axes((0.53, 0.22, 0.44, 0.58))
    curve.spines[["top", "right"]].set_visible(False)
    draw_potential = _draw_contours if q.shape[-1] == 2 else _draw_valley
    setters = [_draw_scene(scene, model, point, runs, q), draw_potential(curve, model, point, runs, q)]
    corner = {"transform": scene.transAxes, "ha": "right", "animated": True}
    clock = scene.text(0.98, 0.02, "", fontsize=8.5, color=colors.INK, **corner)
    digits = max(0, 2 - math.floor(math.log10(times[-1])))

    def frames():
        for k in range(0, FINER * FRAMES * sheets.current_film.get().frame_factor, FINER):
            clock.set_text(f"t = {times[k]:.{digits}f} s" if digits < 5 else f"t = {times[k]:.2e} s")
            yield *(artist for setter in setters for artist in setter(k)), clock

    yield from animation.draw_frames(figure, frames())


def _motion_lines(ax, runs, **props):
    """Draw an animated line for each motion, in its colour."""
    return [ax.plot([], [], color=COLORS[run.regime], animated=True, **props)[0] for run in runs]


def _draw_scene(ax, model, point, runs, q):
    """Draw the resting parts of the picture, and each run's equilibrium in its colour.

    Return a function of the instant k that sets the moving parts, masses with trails, and returns their artists.
    """
    elements, reach = [], 0.0
    equilibria = np.array([run.place for run in runs])
    states_and_rest = (
        dict(zip(map(str, model.equations.q), np.moveaxis(x, -1, 0), strict=True)) for x in (q, equilibria)
    )
    values = {**point, **{str(v): 0.0 for v in model.equations.v}, "time": 0.0}
    for (kind, points), (_, rest_points) in zip(
        *(picture_points(model.equations, values | x) for x in states_and_rest), strict=True
    ):
        reach = max(reach, float(np.abs(points).max()))
        props = {} if kind == "line" else {"ls": "none", "marker": "o", "mfc": "none", "ms": 9 if kind == "mass" else 4}
        if (points == points[0, 0]).all():  # it does not move
            ax.plot(*rest_points[0].T, color=colors.QUIET, **{"lw": 1.5} | props)
            continue
        for run, run_points, run_rest in zip(runs, points, rest_points, strict=True):
            ax.plot(*run_rest.T, color=COLORS[run.regime], **{"lw": 0.9, "ls": (0, (3, 3))} | props)
            elements.append((kind, run_points, {"color": COLORS[run.regime], "lw": 2.0}))
    ax.set(xlim=(-1.15 * reach, 1.15 * reach), ylim=(-1.15 * reach, 1.15 * reach))
    return film.frame_setter(ax, elements, TRAIL * FINER * sheets.current_film.get().frame_factor)


def _draw_valley(ax, model, point, runs, q):
    """Draw V over one turn of the angle, in units of half its height; return the setter of the moving dots."""
    height = _potential_function(model, point)
    theta = np.linspace(*WINDOW, 361)
    unit = 0.5 * np.ptp(height(theta[:, None])) or 1.0
    ax.plot(theta, height(theta[:, None]) / unit, color=colors.INK, lw=1.2)
    name = model.system.kept[0].name
    ax.set(xlabel=f"{name} (rad)", ylabel="V / half its height", xlim=WINDOW)
    ax.set_xticks(*TICKS)
    return _dot_setter(ax, runs, q, lambda states: (_reduce_angle(states[:, 0]), height(states) / unit))


def _draw_contours(ax, model, point, runs, q):
    """Draw contours of V over both angles and circles at the equilibria; return the setter of the moving dots."""
    height = _potential_function(model, point)
    angle = np.linspace(*WINDOW, 121)
    grid = np.stack(np.meshgrid(angle, angle), axis=-1)
    V = height(grid.reshape(-1, 2)).reshape(121, 121)
    ax.contour(angle, angle, V, 12, colors=colors.FAINT, linewidths=0.9, linestyles="-")
    for run in runs:
        x, y = _reduce_angle(run.place)
        ax.plot([x], [y], "o", color=COLORS[run.regime], mfc="none", ms=8, mew=0.9)
    names = [c.name for c in model.system.kept]
    ax.set(xlabel=f"{names[0]} (rad)", ylabel=f"{names[1]} (rad)", aspect="equal")
    ax.set(xlim=WINDOW, ylim=WINDOW)
    ax.set_title("lines of equal V", loc="right", fontsize=8.5)
    for axis in (ax.xaxis, ax.yaxis):
        axis.set_ticks(*TICKS)
    return _dot_setter(ax, runs, q, lambda states: (_reduce_angle(states[:, 0]), _reduce_angle(states[:, 1])))


def _dot_setter(ax, runs, q, project):
    """Return a function of the instant k that sets a dot and a trail of each run, and returns these artists.

    `project` maps states, shape (n, coordinates), to the (x, y) of the panel. Trails have gaps where an angle jumps by
    a turn.
    """
    trails, dots = _motion_lines(ax, runs, lw=3.0, alpha=0.35), _motion_lines(ax, runs, marker="o", ms=7)
    trail_length = TRAIL * FINER * sheets.current_film.get().frame_factor

    def move(k):
        """Set each dot to instant k, and its trail to the instants before; return these artists."""
        for trail, dot, states in zip(trails, dots, q[:, max(0, k - trail_length) : k + 1], strict=True):
            x, y = project(states)
            jumps = 1 + np.flatnonzero((np.abs(np.diff(x)) > math.pi) | (np.abs(np.diff(y)) > math.pi))
            trail.set_data(np.insert(x, jumps, np.nan), np.insert(y, jumps, np.nan))
            dot.set_data(x[-1:], y[-1:])
        return [*trails, *dots]

    return move


def _reduce_angle(angle):
    """Return an angle reduced to the window."""
    return WINDOW[0] + np.mod(angle - WINDOW[0], 2.0 * math.pi)


def _potential_function(model, point):
    """Return the function V of positions, shape (…, n), from the description."""
    values = {p.symbol: point[p.name] for p in model.system.parameters.values()}
    V = sp.lambdify(list(model.equations.q), model.equations.V.subs(values), "numpy")
    return lambda q: V(*np.moveaxis(q, -1, 0))
