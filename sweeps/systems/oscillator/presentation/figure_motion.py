"""What stability means, as an animation: the full motion from beside a stable and from beside an unstable equilibrium.

Left the bead on its hoop, the pendulum or the double pendulum; right the curve that tells of it: where the map's
equilibria are as the hoop turns faster, or the potential. Both motions start at rest and are those of the full
equations, by the integrator that measures the map, at the grid's point nearest to the system's defaults.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import sympy as sp
import xarray as xr

from sweeps.figure import colors, style
from sweeps.mechanics import motions
from sweeps.systems.oscillator.variables import REGIMES
from sweeps.systems.presentation import animation

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
SHOWN = {  # which of a regime is shown, the first that there is
    "bead_on_hoop": {"stable": ("right", "bottom"), "unstable": ("bottom", "top")},
    "pendulum": {"stable": ("hanging",), "unstable": ("upright",)},
    "double_pendulum": {"stable": ("hanging",), "unstable": ("upright", "lower_upright", "upper_upright")},
}


@dataclass(frozen=True)
class Run:
    """One motion."""

    name: str  #: of the equilibrium that it starts beside
    regime: str  #: measured there: "stable" or "unstable"
    place: np.ndarray  #: of the equilibrium, rad, shape (n,)
    shift: np.ndarray  #: where it starts from there, rad, shape (n,)
    duration: float  #: how long it takes to show what it is, s


def frames(ds: xr.Dataset, name: str, model: "Model") -> Iterator[np.ndarray]:
    """Yield the frames of the animation; none without a stable and an unstable equilibrium."""
    point = {p.name: _nearest(ds[p.name], p.default) for p in model.system.parameters.values()}
    here = ds.sel(point).isel({d: 0 for d in ds["regime"].dims if d not in {*point, "equilibrium", "mode"}})
    runs = [run for regime in COLORS if (run := _run(here, SHOWN[name][regime], regime, model)) is not None]
    if not runs:
        return
    duration = max(run.duration for run in runs)
    start = np.array([[*(run.place + run.shift), *np.zeros(run.place.size)] for run in runs])
    times = np.linspace(0.0, duration, FRAMES * style.film.get().finer * FINER + 1)
    given = [np.full(len(runs), value) for value in point.values()]
    states, _, _ = motions.solved(model.moving, given, start, np.tile(times, (len(runs), 1)), TOLERANCE)
    if not np.isfinite(states).all():
        return
    yield from _drawn(ds, name, model, point, runs, states[:, :, : model.equations.m], times)


def _nearest(values: xr.DataArray, wanted: float) -> float:
    return float(values.values[np.argmin(np.abs(values.values - wanted))])


def _run(here: xr.Dataset, names: tuple[str, ...], regime: str, model: "Model") -> Run | None:
    """The motion beside the first of these equilibria that has this regime."""
    for name in (name for name in names if name in here["equilibrium"].values):
        one = here.sel(equilibrium=name)
        told = {REGIMES[1 + int(code)] for code in one["regime"].values}
        if regime not in told or not told <= {"stable", "unstable"} or (regime == "stable" and len(told) > 1):
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


def _drawn(ds, name, model, point, runs, q, times):
    film = style.film.get()
    figure = animation.stage(INCHES, DOTS, model.system.title, _settings(model, point), (11.0, 7.5))
    for k, run in enumerate(runs):
        text = f"● from rest {style.number(abs(run.shift[0]))} rad beside “{run.name.replace('_', ' ')}”: {run.regime}"
        figure.text(0.03 + 0.48 * k, 0.03, text, fontsize=8, color=COLORS[run.regime], va="bottom")
    scene, curve = figure.add_axes((0.0, 0.09, 0.4, 0.76)), figure.add_axes((0.53, 0.24, 0.44, 0.58))
    scene.set(xlim=(-1.25, 1.25), ylim=(-1.25, 1.25), aspect="equal")
    scene.axis("off")
    parts = [_bodies(name, scene, model, point, runs), _curve(name, curve, ds, model, point, runs)]
    clock = scene.text(1.2, -1.2, "", fontsize=8.5, ha="right", color=colors.INK, animated=True)
    digits = max(0, 2 - math.floor(math.log10(times[-1])))

    def frames():
        for k in range(FRAMES * film.finer):
            clock.set_text(f"t = {times[k * FINER]:.{digits}f} s" if digits < 5 else f"t = {times[k * FINER]:.2e} s")
            lately = q[:, max(0, k - TRAIL * film.finer) * FINER : k * FINER + 1]
            yield *(artist for part in parts for artist in part(lately)), clock

    yield from animation.played(figure, frames())


def _settings(model, point):
    """The point in words: what is varied or matters, with units."""
    return ",  ".join(
        style.with_unit(f"{p.name.replace('_', ' ')} {style.number(point[p.name], 3)}", p.unit)
        for p in model.system.parameters.values()
    )


def _lines(ax, runs, **look):
    """One animated line a motion, in its colour."""
    return [ax.plot([], [], color=COLORS[run.regime], animated=True, **look)[0] for run in runs]


def _bodies(name, ax, model, point, runs):
    """What draws the moving thing: a function of the last places, shape (runs, times, n)."""
    return {"bead_on_hoop": _hoop, "pendulum": _rods, "double_pendulum": _rods}[name](ax, model, point, runs)


def _hoop(ax, model, point, runs):
    """The hoop in the plane that turns with it, its axis, and the beads with their trails."""
    turn = np.linspace(0.0, 2.0 * math.pi, 181)
    ax.plot(np.sin(turn), -np.cos(turn), color=colors.QUIET, lw=2.2)
    ax.plot((0.0, 0.0), (-1.2, 1.2), color=colors.FAINT, lw=1.0, ls=(0, (4, 3)))
    bow = np.linspace(-0.85 * math.pi, 0.45 * math.pi, 60)
    ax.plot(0.16 * np.cos(bow), 1.12 + 0.05 * np.sin(bow), color=colors.QUIET, lw=1.0)
    ax.plot([0.16 * math.cos(bow[-1])], [1.12 + 0.05 * math.sin(bow[-1])], "<", color=colors.QUIET, ms=4)
    for run in runs:
        x, y = math.sin(run.place[0]), -math.cos(run.place[0])
        ax.plot([x], [y], "o", ms=11, mfc="none", color=COLORS[run.regime], mew=0.9)
    trails, beads = _lines(ax, runs, lw=3.0, alpha=0.35), _lines(ax, runs, marker="o", ms=9)

    def move(q):
        for trail, bead, one in zip(trails, beads, q[..., 0], strict=True):
            trail.set_data(np.sin(one), -np.cos(one))
            bead.set_data([math.sin(one[-1])], [-math.cos(one[-1])])
        return [*trails, *beads]

    return move


def _rods(ax, model, point, runs):
    """Rods from one pivot, each with its mass at the end and the trail of the last one."""
    lengths = [point[name] for name in ("length", "length1", "length2") if name in point]
    masses = [point[name] for name in ("mass", "mass1", "mass2") if name in point]
    parts = np.array(lengths) / sum(lengths)
    sizes = 5.0 + 5.0 * np.sqrt(np.array(masses) / max(masses))
    ax.plot([0.0], [0.0], "o", color=colors.INK, ms=4)
    ax.plot((-0.16, 0.16), (0.0, 0.0), color=colors.QUIET, lw=2.0, zorder=0)
    for run in runs:
        ax.plot(*_ends(run.place[None], parts)[0], color=COLORS[run.regime], lw=0.9, ls=(0, (3, 3)))
    trails, rods = _lines(ax, runs, lw=1.4, alpha=0.45), _lines(ax, runs, lw=2.0)
    bobs = [_lines(ax, runs, marker="o", ms=size) for size in sizes]

    def move(q):
        for k, one in enumerate(q):
            ends = _ends(one, parts)
            trails[k].set_data(ends[:, 0, -1], ends[:, 1, -1])
            rods[k].set_data(*ends[-1])
            for j, bob in enumerate(bobs):
                bob[k].set_data([ends[-1, 0, j + 1]], [ends[-1, 1, j + 1]])
        return [*trails, *rods, *(one for bob in bobs for one in bob)]

    return move


def _ends(q, parts):
    """Pivot and ends of the rods in the plane, shape (times, 2, rods + 1)."""
    corners = np.stack([np.cumsum(parts * np.sin(q), axis=1), -np.cumsum(parts * np.cos(q), axis=1)], axis=1)
    return np.concatenate([np.zeros((*corners.shape[:2], 1)), corners], axis=2)


def _curve(name, ax, ds, model, point, runs):
    """What draws the motion on its curve: a function of the last places, shape (runs, times, n)."""
    ax.spines[["top", "right"]].set_visible(False)
    if len(model.system.kept) == 2:
        return _surface(ax, model, point, runs)
    if name == "bead_on_hoop" and ds.sizes["spin_rate"] > 2:
        return _branches(ax, ds, point, runs)
    return _valley(ax, model, point, runs)


def _branches(ax, ds, point, runs):
    """The equilibria over the spin rate, stable ones drawn through, and the beads at the hoop's own."""
    others = {name: value for name, value in point.items() if name != "spin_rate"}
    row = ds[["theta_equilibrium", "regime"]].sel(others).isel(mode=0)
    row = row.isel({d: 0 for d in row["regime"].dims if d not in ("spin_rate", "equilibrium")})
    x = row["spin_rate"].values
    for regime, dash in (("stable", "-"), ("unstable", (0, (4, 2)))):
        for equilibrium in row["equilibrium"].values:
            one = row.sel(equilibrium=equilibrium)
            there = one["regime"].values == REGIMES.index(regime) - 1
            edge = np.convolve(there, (1, 0, 1), "same") > 0
            there |= edge & (one["regime"].values == REGIMES.index("marginal") - 1)  # a line goes on to where it ends
            theta = np.where(there, one["theta_equilibrium"].values, np.nan)
            ax.plot(x, theta, color=COLORS[regime], ls=dash, lw=1.4)
            if equilibrium == "top":
                ax.plot(x, -theta, color=COLORS[regime], ls=dash, lw=1.4)
    ax.axvline(point["spin_rate"], color=colors.FAINT, lw=1.0, zorder=0)
    if style.is_logarithmic(x):
        ax.set_xscale("log")
    ax.set(xlabel=f"spin rate ({style.units('rad s-1')})", ylim=(-3.4, 3.4), xlim=(x[0], x[-1]))
    ax.set_ylabel("θ of equilibria (rad)")
    ax.set_yticks([-math.pi, 0.0, math.pi], ["−π", "0", "π"])
    return _along(ax, runs, lambda one: (np.full(one.shape[0], point["spin_rate"]), _wrapped(one[:, 0])))


def _valley(ax, model, point, runs):
    """V over one turn of the angle, in units of half its height."""
    height = _potential(model, point)
    theta = np.linspace(*WINDOW, 361)
    unit = 0.5 * np.ptp(height(theta[:, None])) or 1.0
    ax.plot(theta, height(theta[:, None]) / unit, color=colors.INK, lw=1.2)
    name = model.system.kept[0].name
    ax.set(xlabel=f"{name} (rad)", ylabel="V / half its height", xlim=WINDOW)
    ax.set_xticks(*TICKS)
    return _along(ax, runs, lambda one: (_shown(one[:, 0]), height(one) / unit))


def _surface(ax, model, point, runs):
    """Lines of equal V over both angles."""
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
    ax.set(xlim=WINDOW, ylim=WINDOW, title="lines of equal V")
    ax.title.set(fontsize=8.5)
    for axis in (ax.xaxis, ax.yaxis):
        axis.set_ticks(*TICKS)
    return _along(ax, runs, lambda one: (_shown(one[:, 0]), _shown(one[:, 1])))


def _along(ax, runs, seen):
    """What moves dots with trails on a curve, broken where an angle goes round."""
    trails, dots = _lines(ax, runs, lw=3.0, alpha=0.35), _lines(ax, runs, marker="o", ms=7)

    def move(q):
        for trail, dot, one in zip(trails, dots, q, strict=True):
            x, y = seen(one)
            jumps = 1 + np.flatnonzero((np.abs(np.diff(x)) > math.pi) | (np.abs(np.diff(y)) > math.pi))
            trail.set_data(np.insert(x, jumps, np.nan), np.insert(y, jumps, np.nan))
            dot.set_data(x[-1:], y[-1:])
        return [*trails, *dots]

    return move


def _wrapped(angle):
    """An angle within -π to π."""
    return angle - 2.0 * math.pi * np.round(angle / (2.0 * math.pi))


def _shown(angle):
    """An angle within the window."""
    return 0.5 * math.pi + _wrapped(angle - 0.5 * math.pi)


def _potential(model, point):
    """V of places, shape (…, n), from the description."""
    values = {p.symbol: point[p.name] for p in model.system.parameters.values()}
    V = sp.lambdify(list(model.equations.q), model.equations.V.subs(values), "numpy")
    return lambda q: V(*np.moveaxis(q, -1, 0))
