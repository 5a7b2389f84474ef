"""Draws of one body, measured by the kernels, and reduced to probabilities, quantiles and sensitivities.

The draws of all bodies come from the same standard normals: a body's numbers depend on itself and the seed alone.
"""

import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from sweeps.schema.definition import Integration
from sweeps.systems.bodies.variables import MOMENTS
from sweeps.systems.uncertain_bodies import designs, possible
from sweeps.systems.uncertain_bodies.known import Known

QUANTILES = (0.01, 0.05, 0.5, 0.95, 0.99)
FOLLOWED = 2**15  # draws of a body that are followed on to their flips, at most
SENSITIVE = 2**13  # draws in each half of the design for sensitivities, at most
SHARE_SENSITIVE = 4  # else the draws over that
TILE = 2**14  # draws that one thread measures at once
DRAW_BYTES = 450  # of memory that a draw takes while its body is measured
RATE_NUDGE = 1e-6  # rates belong to small nudges: where a tilt makes a larger one, the rate is that of this
STABLE, UNSTABLE = (0, 1), 2  # regimes of the kernels
CLEAR = 0.01  # probability below which (or above its complement) the stability is certain
RATES = ("omega_squared_reduced", "growth_rate_reduced", "frequency_reduced")
COLUMNS = dict.fromkeys(RATES, np.float64) | {"regime": np.int8, "status": np.int8}  # of a draw, with their types


@dataclass(frozen=True)
class Asked:
    """How draws are made."""

    draws: int = 10_000  #: how many, at least
    seed: int = 1  #: whole, ≥ 0
    method: str = "sobol"  #: one of `designs.METHODS`
    turns: float = 100.0  #: of the spin, within which a body flips or does not
    twist: bool = False  #: whether the twist of each draw that is followed is measured too


@dataclass(frozen=True)
class Spun:
    """What is spun: about which axis, how fast, perturbed how."""

    axis: int
    omega0: float
    epsilon: float
    phase: float


def measured(
    known: Known, spins: Iterable[Spun], asked: Asked, integration: Integration, threads: int = 1
) -> Iterator[tuple[dict[str, np.ndarray], dict[str, np.ndarray]]]:
    """Yield (variables, draws) of each spin of a body.

    Variables are floats, or arrays over `quantile` (of `QUANTILES`) or over the body's own inputs; draws are columns of
    shape (n,): I1, I2, I3, growth_rate, frequency, regime, flip_period, max_tilt, the last two NaN where a draw was not
    followed.
    """
    normals = designs.normals(asked.method, max(known.dimension, 1), asked.draws, asked.seed, threads=threads)
    count, size, _ = normals.shape
    flat = normals.reshape(count * size, -1)
    with ThreadPoolExecutor(threads) as pool:
        run = pool.map if threads > 1 else map
        bodies = _bodies(known, flat, run)
        for spin in spins:
            yield _one(known, bodies, flat, (count, size), spin, asked, integration, run)


def _one(known, bodies, normals, shape, spin: Spun, asked: Asked, integration, run):
    moments, impossible, turned = bodies
    draws = _all_rates(known, moments, turned, normals, spin, integration, run)
    followed = _followed(shape)
    thrown = _points(known, moments[followed], _part(turned, followed), normals[followed], spin)
    nonlinear = _flips(thrown, draws, followed, integration, run)
    if asked.twist:
        nonlinear["twist"] = _twists(thrown, integration, run)
    summary = _summary(shape, moments, impossible, draws, spin, run)
    summary |= _flip_summary((shape[0], followed.size // shape[0]), nonlinear, thrown["omega0"], asked)
    summary |= _moments(known, moments, shape, spin.axis)
    summary |= _sensitivities(known, spin, asked, integration, run)
    summary["probability_middle_theory"] = known.middle_theory(spin.axis)
    return summary, _kept(moments, draws, nonlinear, followed)


# -- through the kernels, a tile after the other or side by side; where tiles end does not depend on threads


def _tiles(size: int, tile: int = TILE) -> list[slice]:
    return [slice(low, low + tile) for low in range(0, size, tile)]


def _part(values: np.ndarray | None, part) -> np.ndarray | None:
    return None if values is None else values[part]


def _bodies(known: Known, normals: np.ndarray, run: Callable):
    """Return moments, which draws are impossible, and rotations or None (see `Known.inertia`), columns contiguous."""
    size = len(normals)
    moments, impossible = np.empty((3, size)).T, np.empty(size, bool)
    turned = np.empty((3, 3, size)).transpose(2, 0, 1) if known.is_tilted else None

    def fill(part):
        moments[part], impossible[part], rotations = known.inertia(normals[part])
        if rotations is not None:
            turned[part] = rotations

    list(run(fill, _tiles(size)))
    return moments, impossible, turned


def _points(known: Known, moments, turned, normals, spin: Spun) -> dict[str, np.ndarray]:
    """Return points of the kernels: a spin about the body's own axis, perturbed, in the draw's principal axes."""
    rate, size, phase = known.spun(normals, spin.omega0, spin.epsilon, spin.phase)
    if turned is not None:
        a, b, c = spin.axis - 1, spin.axis % 3, (spin.axis + 1) % 3
        along, across = size * np.cos(phase), size * np.sin(phase)
        seen = [turned[:, k, a] + along * turned[:, k, b] + across * turned[:, k, c] for k in (a, b, c)]
        rate = rate * seen[0]
        size = np.maximum(np.hypot(seen[1], seen[2]) / np.abs(seen[0]), 1e-30)
        phase = np.arctan2(seen[2] / seen[0], seen[1] / seen[0])
    columns = dict(zip(MOMENTS, moments.T, strict=True))
    return columns | {"axis": np.full(len(rate), spin.axis), "omega0": rate, "epsilon": size, "phase": phase}


def _all_rates(known: Known, moments, turned, normals, spin: Spun, integration: Integration, run: Callable):
    columns = {name: np.empty(len(moments), dtype) for name, dtype in COLUMNS.items()}

    def fill(part):
        points = _points(known, moments[part], _part(turned, part), normals[part], spin)
        for name, values in _rates(points, integration).items():
            columns[name][part] = values

    list(run(fill, _tiles(len(moments))))
    return columns


def _rates(points: Mapping[str, np.ndarray], integration: Integration) -> dict[str, np.ndarray]:
    from kernels import survey

    settings = (integration.rotations, integration.samples_per_rotation, integration.tolerance)
    points = dict(points, epsilon=np.minimum(points["epsilon"], RATE_NUDGE))
    return survey.measured(points, *settings, wanted=set(COLUMNS))


def _followed(shape: tuple[int, int]) -> np.ndarray:
    """Return numbers of the draws that are followed to their flips: the first of each replicate, a power of two."""
    count, size = shape
    size_followed = min(size, 2 ** int(math.log2(max(FOLLOWED / count, 1))))
    return (np.arange(count)[:, None] * size + np.arange(size_followed)).reshape(-1)


def _flips(points, draws, followed, integration: Integration, run: Callable) -> dict[str, np.ndarray]:
    """Return flip period (infinite where the spin keeps its sign) and largest tilt of points, measured."""
    from kernels import survey

    spin = points["omega0"]
    order = np.argsort(np.abs(draws["omega_squared_reduced"][followed] / spin / spin))  # of like duration together

    def follow(numbers):
        return survey.flipped({name: values[numbers] for name, values in points.items()}, integration.tolerance)

    parts = list(run(lambda part: follow(order[part]), _tiles(order.size, 1024)))
    back, names = np.argsort(order), ("flip_period", "flip_period_exact", "max_tilt", "max_tilt_exact")
    period, period_exact, tilt, tilt_exact = (np.concatenate([part[name] for part in parts])[back] for name in names)
    given_up = np.isnan(tilt)  # so near the separatrix that the closed form has to stand in
    keeps = np.where(given_up, tilt_exact <= math.pi / 2, np.isnan(period))
    period = np.where(keeps, np.inf, np.where(np.isnan(period), period_exact, period))
    return {"flip_period": period, "max_tilt": np.where(given_up, tilt_exact, tilt)}


def _twists(points, integration: Integration, run: Callable) -> np.ndarray:
    """Return the measured twist of points, rad: of each about its own axis of least moment, from its start."""
    from kernels import twist

    moments = np.stack([points[name] for name in MOMENTS], axis=-1)
    momentum = moments * _starts(points)
    order = np.argsort(moments, axis=1, kind="stable")
    along, second, third = np.take_along_axis(momentum, order, axis=1).T
    angles = {"chi": np.arctan2(third, second), "theta": np.arctan2(np.hypot(second, third), along)}
    columns = dict(zip(MOMENTS, moments.T, strict=True)) | angles | {"omega0": np.ones(len(moments))}

    def follow(*values):
        throws = twist.survey(dict(zip(columns, values, strict=True)), integration.tolerance)
        return np.where(np.isnan(throws["twist"]), throws["twist_exact"], throws["twist"])

    parts = run(lambda part: follow(*(values[part] for values in columns.values())), _tiles(len(moments)))
    sizes = np.abs(np.concatenate(list(parts)))
    return np.where(np.isnan(sizes), np.inf, sizes)  # along the handle, which then has no azimuth


def _starts(points) -> np.ndarray:
    """Return directions of the angular velocity that points start with, shape (n, 3)."""
    omega, rows = np.empty((len(points["axis"]), 3)), np.arange(len(points["axis"]))
    sizes = (1.0, points["epsilon"] * np.cos(points["phase"]), points["epsilon"] * np.sin(points["phase"]))
    for k, size in enumerate(sizes):
        omega[rows, (points["axis"] - 1 + k) % 3] = size
    return omega


# -- reduced


def _summary(shape, moments, impossible, draws, spin: Spun, run: Callable) -> dict:
    a = spin.axis - 1
    others = [moments[:, axis] for axis in range(3) if axis != a]
    middle = (moments[:, a] > others[0]) != (moments[:, a] > others[1])
    unstable = draws["regime"] == UNSTABLE
    decided = (unstable | np.isin(draws["regime"], STABLE)) & (draws["status"] == 0)
    summary = {}
    for name, holds in (("probability_middle", middle), ("probability_unstable", unstable)):
        summary |= _share(name, holds.reshape(shape))

    def spread(name):
        return _quantiles(f"{name}_quantile", np.nan_to_num(draws[f"{name}_reduced"], nan=0.0).reshape(shape))

    for quantiles in run(spread, ("growth_rate", "frequency")):
        summary |= quantiles
    likely = float(summary["probability_unstable"])
    undecided = 1.0 - float(np.mean(decided))
    return summary | {
        "impossible_naive": float(np.mean(impossible)),
        "undecided": undecided,
        "draws": math.prod(shape),
        "stability": 0 if likely < CLEAR else 2 if likely > 1 - CLEAR else 1,
        "status": 0 if undecided < CLEAR else 1,
    }


def _flip_summary(shape, nonlinear, rate, asked: Asked) -> dict:
    turns = nonlinear["flip_period"] * np.abs(rate) / (2 * math.pi)
    summary = _share("probability_flip", (turns <= asked.turns).reshape(shape))
    for name in nonlinear:
        summary |= _quantiles(f"{name}_quantile", nonlinear[name].reshape(shape))
    return summary | {"draws_followed": math.prod(shape)}


def _share(name: str, holds: np.ndarray) -> dict:
    value, error = designs.share(holds.mean(axis=1), holds.size)
    return {name: float(value), f"{name}_error": float(error)}


def _quantiles(name: str, values: np.ndarray) -> dict:
    quantiles, error = designs.quantiles(values, QUANTILES)
    finite = np.isfinite(quantiles)  # "never" is missing
    return {name: np.where(finite, quantiles, np.nan), f"{name}_error": np.where(finite, error, np.nan)}


def _moments(known: Known, moments, shape, axis: int) -> dict:
    """Return mean and spread of the moment about an axis, as requested and as drawn."""
    drawn = moments[:, axis - 1].reshape(shape)
    middle, error = designs.mean(drawn.mean(axis=1))
    if known.is_tilted:  # of an entry along the axis: exact where the axes do not tilt
        direction = known.axes[axis - 1]
        weights = np.array([(1 + (i != j)) * direction[i] * direction[j] for i, j in possible.ENTRIES])
        spread = math.sqrt(max(float(weights @ known.covariance @ weights), 0.0))
    else:
        spread = math.sqrt(float(known.covariance[axis - 1, axis - 1]))
    return {
        "moment_mean_requested": float(known.moments[axis - 1]),
        "moment_mean": float(middle),
        "moment_mean_error": float(error),
        "moment_spread_requested": spread,
        "moment_spread": float(drawn.std()),
    }


def _sensitivities(known: Known, spin: Spun, asked: Asked, integration: Integration, run: Callable) -> dict:
    """Return Sobol indices of the signed rate² over the body's inputs."""
    if not known.groups:
        return {f"sensitivity_{kind}": np.empty(0) for kind in ("first", "first_error", "total", "total_error")}

    def rate2(normals):
        moments, _, turned = known.inertia(normals)
        estimate = _rates(_points(known, moments, turned, normals, spin), integration)
        return np.nan_to_num(estimate["omega_squared_reduced"] / spin.omega0**2)

    half = max(designs.LEAST, min(asked.draws // SHARE_SENSITIVE, SENSITIVE))
    estimate = designs.sobol_indices(rate2, known.groups, half, asked.seed, asked.method, run)
    return {f"sensitivity_{kind}": values for kind, values in estimate.items()}


def _kept(moments, draws, nonlinear, followed) -> dict[str, np.ndarray]:
    columns = dict(zip(MOMENTS, moments.T, strict=True))
    columns |= {"growth_rate": draws["growth_rate_reduced"], "frequency": draws["frequency_reduced"]}
    columns["regime"] = draws["regime"]
    for name, values in nonlinear.items():
        columns[name] = np.full(len(moments), np.nan)
        columns[name][followed] = np.where(np.isfinite(values), values, np.nan)
    return columns
