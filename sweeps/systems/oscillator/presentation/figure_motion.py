"""What stability means, as an animation: the full motion from beside a stable and from beside an unstable equilibrium.

Left the system as its description draws it; right its potential, over one coordinate or two, the effective one of what
turns. Both motions start at rest and are those of the full equations, by the integrator that measures the map, at the
grid's point nearest to the system's defaults.
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
from sweeps.systems.presentation.moving.equations import places

if TYPE_CHECKING:
    from sweeps.mechanics.model import Model

FRAMES = 84
INCHES = (6.4, 3.5)
DOTS = 96  # per inch
FINER = 4  # places of a trail a frame
TRAIL = 10  # frames
TOLERANCE = 1e-9
FAR, NEAR = 0.25, 0.03  # rad, from a stable place and from an unstable one
PERIODS = 2.0  # of the slowest oscillation about the stable place, at least
ROUND = 8.0  # rad: an unstable motion goes away and comes back in 2 ln(ROUND/NEAR) e-folds, about
WINDOW = (-0.5 * math.pi, 1.5 * math.pi)  # of an angle: the valley and the hill
TICKS = ([0.0, math.pi], ["0", "π"])
COLORS = {"stable": colors.STABLE, "unstable": colors.UNSTABLE}


@dataclass(frozen=True)
class Run:
    """One motion."""

    name: str  #: of the equilibrium that it starts beside
    regime: str  #: measured there: "stable" or "unstable"
    place: np.ndarray  #: of the equilibrium, rad, shape (n,)
    shift: np.ndarray  #: where it starts from there, rad, shape (n,)
    duration: float  #: how long it takes to show what it is, s


def frames(ds: xr.Dataset, model: "Model") -> Iterator[np.ndarray]:
    """Yield the frames of the animation; none without a stable and an unstable equilibrium."""
    defaults = {p.name: p.default for p in model.system.parameters.values()}
    if missing := defaults.keys() - ds.coords.keys():
        raise MapError(f"{min(missing)}: is missing; allowed: every parameter of the map's system")
    point = {n: float(ds[n].values[np.argmin(np.abs(ds[n].values - value))]) for n, value in defaults.items()}
    here = ds.sel(point).isel({d: 0 for d in ds["regime"].dims if d not in {*point, "equilibrium", "mode"}})
    runs = [run for regime in COLORS if (run := beside(here, regime, model)) is not None]
    if not runs:
        return
    duration = max(run.duration for run in runs)
    start = np.array([[*(run.place + run.shift), *np.zeros(run.place.size)] for run in runs])
    times = np.linspace(0.0, duration, FRAMES * sheets.current_film.get().frame_factor * FINER + 1)
    given = [np.full(len(runs), value) for value in point.values()]
    states, _, _ = motions.solve(model.moving, given, start, np.tile(times, (len(runs), 1)), TOLERANCE)
    if not np.isfinite(states).all():
        return
    yield from _drawn(model, point, runs, states[:, :, : model.equations.m], times)


def beside(here: xr.Dataset, regime: str, model: "Model") -> Run | None:
    """Return the motion beside the first equilibrium of this regime, stable in all modes; None without one."""
    for name in here["equilibrium"].values.tolist():
        one = here.sel(equilibrium=name)
        regimes = {REGIMES[1 + int(code)] for code in one["regime"].values}
        if regime not in regimes or not regimes <= {"stable", "unstable"} or (regime == "stable" and len(regimes) > 1):
            continue
        place = np.array([float(one[f"{c.name}_equilibrium"].values[0]) for c in model.system.kept])
        rate = float(one["frequency"].min() if regime == "stable" else one["growth_rate"].max())
        if not (0.0 < rate < math.inf and np.isfinite(place).all()):
            continue
        signs = (-1.0) ** np.arange(place.size) if regime == "unstable" else 1.0 + 0.4 * np.arange(place.size)
        if regime == "stable":
            return Run(name, regime, place, FAR * signs, PERIODS * 2.0 * math.pi / rate)
        duration = 2.0 * math.log(ROUND / NEAR) / rate
        return Run(name, regime, place, NEAR * signs, duration)
    return None


# -- drawing


def _drawn(model, point, runs, q, times):
    words = ",  ".join(animation.settings(model.system, point))
    figure = animation.stage(INCHES, DOTS, model.system.title, words, (11.0, 7.5))
    for k, run in enumerate(runs):
        name, shift = run.name.replace("_", " "), wording.format_number(abs(run.shift[0]))
        text = f"● from rest {shift} rad beside “{name}”: {run.regime}"
        x, side = ((0.03, "left"), (0.98, "right"))[k]
        figure.text(x, 0.03, text, fontsize=8, color=COLORS[run.regime], va="bottom", ha=side)
    scene, curve = figure.add_axes((0.0, 0.09, 0.4, 0.76)), figure.add_axes((0.53, 0.22, 0.44, 0.58))
    curve.spines[["top", "right"]].set_visible(False)
    landscape = _surface if q.shape[-1] == 2 else _valley
    parts = [_scene(scene, model, point, runs, q), landscape(curve, model, point, runs, q)]
    place = {"transform": scene.transAxes, "ha": "right", "animated": True}
    clock = scene.text(0.98, 0.02, "", fontsize=8.5, color=colors.INK, **place)
    digits = max(0, 2 - math.floor(math.log10(times[-1])))

    def frames():
        for k in range(0, FINER * FRAMES * sheets.current_film.get().frame_factor, FINER):
            clock.set_text(f"t = {times[k]:.{digits}f} s" if digits < 5 else f"t = {times[k]:.2e} s")
            yield *(artist for part in parts for artist in part(k)), clock

    yield from animation.played(figure, frames())


def _lines(ax, runs, **props):
    """Draw one animated line a motion, in its colour."""
    return [ax.plot([], [], color=COLORS[run.regime], animated=True, **props)[0] for run in runs]


def _scene(ax, model, point, runs, q):
    """Draw the picture, each run's moving part in its colour, and its equilibrium; masses have trails."""
    moving, reach = [], 0.0
    resting = np.array([run.place for run in runs])
    both = (dict(zip(map(str, model.equations.q), np.moveaxis(x, -1, 0), strict=True)) for x in (q, resting))
    values = {**point, **{str(v): 0.0 for v in model.equations.v}, "time": 0.0}
    for (kind, seen), (_, rest) in zip(*(places(model.equations, values | x) for x in both), strict=True):
        reach = max(reach, float(np.abs(seen).max()))
        mark = {} if kind == "line" else {"ls": "none", "marker": "o", "mfc": "none", "ms": 9 if kind == "mass" else 4}
        if (seen == seen[0, 0]).all():  # it stands still
            ax.plot(*rest[0].T, color=colors.QUIET, **{"lw": 1.5} | mark)
            continue
        for run, one, place in zip(runs, seen, rest, strict=True):
            ax.plot(*place.T, color=COLORS[run.regime], **{"lw": 0.9, "ls": (0, (3, 3))} | mark)
            moving.append((kind, one, {"color": COLORS[run.regime], "lw": 2.0}))
    ax.set(xlim=(-1.15 * reach, 1.15 * reach), ylim=(-1.15 * reach, 1.15 * reach))
    return film.mover(ax, moving, TRAIL * FINER * sheets.current_film.get().frame_factor)


def _valley(ax, model, point, runs, q):
    """Return V over one turn of the angle, in units of half its height."""
    height = _potential(model, point)
    theta = np.linspace(*WINDOW, 361)
    unit = 0.5 * np.ptp(height(theta[:, None])) or 1.0
    ax.plot(theta, height(theta[:, None]) / unit, color=colors.INK, lw=1.2)
    name = model.system.kept[0].name
    ax.set(xlabel=f"{name} (rad)", ylabel="V / half its height", xlim=WINDOW)
    ax.set_xticks(*TICKS)
    return _along(ax, runs, q, lambda one: (_shown(one[:, 0]), height(one) / unit))


def _surface(ax, model, point, runs, q):
    """Draw lines of equal V over both angles."""
    height = _potential(model, point)
    angle = np.linspace(*WINDOW, 121)
    grid = np.stack(np.meshgrid(angle, angle), axis=-1)
    V = height(grid.reshape(-1, 2)).reshape(121, 121)
    ax.contour(angle, angle, V, 12, colors=colors.FAINT, linewidths=0.9, linestyles="-")
    for run in runs:
        x, y = _shown(run.place)
        ax.plot([x], [y], "o", color=COLORS[run.regime], mfc="none", ms=8, mew=0.9)
    names = [c.name for c in model.system.kept]
    ax.set(xlabel=f"{names[0]} (rad)", ylabel=f"{names[1]} (rad)", aspect="equal")
    ax.set(xlim=WINDOW, ylim=WINDOW)
    ax.set_title("lines of equal V", loc="right", fontsize=8.5)
    for axis in (ax.xaxis, ax.yaxis):
        axis.set_ticks(*TICKS)
    return _along(ax, runs, q, lambda one: (_shown(one[:, 0]), _shown(one[:, 1])))


def _along(ax, runs, q, seen):
    """Return a function that moves dots with trails on a curve, broken where an angle is periodic."""
    trails, dots = _lines(ax, runs, lw=3.0, alpha=0.35), _lines(ax, runs, marker="o", ms=7)
    trail_length = TRAIL * FINER * sheets.current_film.get().frame_factor

    def move(k):
        for trail, dot, one in zip(trails, dots, q[:, max(0, k - trail_length) : k + 1], strict=True):
            x, y = seen(one)
            jumps = 1 + np.flatnonzero((np.abs(np.diff(x)) > math.pi) | (np.abs(np.diff(y)) > math.pi))
            trail.set_data(np.insert(x, jumps, np.nan), np.insert(y, jumps, np.nan))
            dot.set_data(x[-1:], y[-1:])
        return [*trails, *dots]

    return move


def _shown(angle):
    """Return an angle within the window."""
    return WINDOW[0] + np.mod(angle - WINDOW[0], 2.0 * math.pi)


def _potential(model, point):
    """Return V of places, shape (…, n), from the description."""
    values = {p.symbol: point[p.name] for p in model.system.parameters.values()}
    V = sp.lambdify(list(model.equations.q), model.equations.V.subs(values), "numpy")
    return lambda q: V(*np.moveaxis(q, -1, 0))
