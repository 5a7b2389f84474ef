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
from sweeps.systems.uncertain_bodies.distribution import Distribution

QUANTILES = (0.01, 0.05, 0.5, 0.95, 0.99)
FOLLOWED = 2**15  # draws of a body that are followed on to their flips, at most
SENSITIVE = 2**13  # draws in each half of the design for sensitivities, at most
SHARE_SENSITIVE = 4  # else the draws over that
TILE = 2**14  # draws that one thread measures at once
DRAW_BYTES = 450  # of memory that a draw takes while its body is measured
RATE_NUDGE = 1e-6  # rates belong to small nudges: where a tilt makes a larger one, the rate is that of this
STABLE, UNSTABLE = (0, 1), 2  # regimes of the kernels
CLEAR = 0.01  # probability below which (or above its complement) the stability is certain
COLUMNS = {"omega_squared_reduced", "growth_rate_reduced", "frequency_reduced", "regime", "status"}  # of a draw

Columns = dict[str, np.ndarray]  # name → values


@dataclass(frozen=True)
class BodySampling:
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
    distribution: Distribution,
    spins: Iterable[Spun],
    sampling: BodySampling,
    integration: Integration,
    threads: int = 1,
) -> Iterator[tuple[Columns, Columns]]:
    """Yield (variables, draws) of each spin of a body.

    Variables are floats, or arrays over `quantile` (of `QUANTILES`) or over the body's own inputs; draws are columns of
    shape (n,): I1, I2, I3, growth_rate, frequency, regime, flip_period, max_tilt, the last two NaN where a draw was not
    followed.
    """
    given = sampling.method, distribution.dimension, sampling.draws, sampling.seed
    normals = designs.normals(*given, threads=threads)
    with ThreadPoolExecutor(threads) as pool:
        body = _Body(distribution, normals, sampling, integration, pool.map if threads > 1 else map)
        for spin in spins:
            yield body.spun(spin)


class _Body:
    """Draws of one body, made of `normals`, shape (replicates, size, dimension), each measured.

    `run` is `map`, or one that calls a function side by side; where tiles of draws end does not depend on threads.
    """

    def __init__(self, distribution: Distribution, normals, sampling: BodySampling, integration: Integration, run):
        self.distribution, self.sampling, self.integration, self.run = distribution, sampling, integration, run
        self.shape = normals.shape[:2]
        self.normals = normals.reshape(-1, normals.shape[2])
        drawn = self._tiled(lambda part: distribution.inertia(self.normals[part]), len(self.normals))
        self.moments, self.impossible, self.turned = drawn if distribution.is_tilted else (*drawn, None)

    def spun(self, spin: Spun) -> tuple[Columns, Columns]:
        """Measure one spin; see `measured`."""
        rates = self._tiled(lambda part: self._rates(self._points(part, spin)), len(self.normals))
        count, size = self.shape
        some = np.arange(min(size, 2 ** int(math.log2(max(FOLLOWED / count, 1)))))  # of each replicate the first
        followed = (np.arange(count)[:, None] * size + some).reshape(-1)
        thrown = self._points(followed, spin)
        nonlinear = self._flips(thrown, rates["omega_squared_reduced"][followed])
        if self.sampling.twist:
            nonlinear["twist"] = self._twists(thrown, spin.axis)
        summary = self._linear_summary(rates, spin) | self._flip_summary(nonlinear, thrown["omega0"])
        summary |= self._moment_summary(spin.axis) | self._sensitivities(spin)
        summary["probability_middle_theory"] = self.distribution.middle_theory(spin.axis)
        return summary, self._kept(rates, nonlinear, followed)

    # -- through the kernels, a tile after the other or side by side

    def _tiled(self, work: Callable, size: int, tile: int = TILE):
        """Join the columns, named or not, that a function returns of each tile."""
        parts = list(self.run(work, [slice(low, low + tile) for low in range(0, size, tile)]))
        if isinstance(parts[0], dict):
            return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
        return [np.concatenate(columns) for columns in zip(*parts, strict=True) if columns[0] is not None]

    def _points(self, part, spin: Spun) -> dict[str, np.ndarray]:
        """Return points of the kernels for some draws."""
        turned = None if self.turned is None else self.turned[part]
        return _points(self.distribution, self.moments[part], turned, self.normals[part], spin)

    def _rates(self, points: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
        from kernels import survey

        integration = self.integration
        settings = (integration.rotations, integration.samples_per_rotation, integration.tolerance)
        points = dict(points, epsilon=np.minimum(points["epsilon"], RATE_NUDGE))
        return survey.measured(points, *settings, wanted=COLUMNS)

    def _flips(self, points, squares: np.ndarray) -> dict[str, np.ndarray]:
        """Return flip period (infinite where the spin keeps its sign) and largest tilt of points, measured."""
        from kernels import survey

        spin = points["omega0"]
        order = np.argsort(np.abs(squares / spin / spin))  # of like duration together
        ordered, tolerance = {name: values[order] for name, values in points.items()}, self.integration.tolerance

        def follow(part):
            return survey.flipped({name: values[part] for name, values in ordered.items()}, tolerance)

        back = np.argsort(order)
        columns = {name: values[back] for name, values in self._tiled(follow, order.size, 1024).items()}
        period, tilt_exact, tilt = columns["flip_period"], columns["max_tilt_exact"], columns["max_tilt"]
        given_up = np.isnan(tilt)  # so near the separatrix that the closed form has to stand in
        keeps = np.where(given_up, tilt_exact <= math.pi / 2, np.isnan(period))
        period = np.where(keeps, np.inf, np.where(np.isnan(period), columns["flip_period_exact"], period))
        return {"flip_period": period, "max_tilt": np.where(given_up, tilt_exact, tilt)}

    def _twists(self, points, axis: int) -> np.ndarray:
        """Return the size of the twist of points, rad, measured, each about its own axis of least moment."""
        from kernels import twist

        moments = np.stack([points[name] for name in MOMENTS], axis=-1)
        across = [points["epsilon"] * f(points["phase"]) for f in (np.cos, np.sin)]
        momentum = moments * np.roll(np.stack([np.ones(len(moments)), *across], axis=-1), axis - 1, axis=1)
        order = np.argsort(moments, axis=1, kind="stable")
        along, second, third = np.take_along_axis(momentum, order, axis=1).T
        angles = {"chi": np.arctan2(third, second), "theta": np.arctan2(np.hypot(second, third), along)}
        columns = dict(zip(MOMENTS, moments.T, strict=True)) | angles | {"omega0": np.ones(len(moments))}

        def follow(part):
            return twist.survey({name: values[part] for name, values in columns.items()}, self.integration.tolerance)

        twists = self._tiled(follow, len(moments))
        sizes = np.abs(np.where(np.isnan(twists["twist"]), twists["twist_exact"], twists["twist"]))
        return np.where(np.isnan(sizes), np.inf, sizes)  # along the handle, which then has no azimuth

    # -- reduced

    def _linear_summary(self, rates: Mapping[str, np.ndarray], spin: Spun) -> dict:
        a = spin.axis - 1
        others = [self.moments[:, axis] for axis in range(3) if axis != a]
        middle = (self.moments[:, a] > others[0]) != (self.moments[:, a] > others[1])
        unstable = rates["regime"] == UNSTABLE
        decided = (unstable | np.isin(rates["regime"], STABLE)) & (rates["status"] == 0)
        summary = _share("probability_middle", middle.reshape(self.shape))
        summary |= _share("probability_unstable", unstable.reshape(self.shape))

        def spread(name):
            return _quantiles(f"{name}_quantile", np.nan_to_num(rates[f"{name}_reduced"], nan=0.0).reshape(self.shape))

        for quantiles in self.run(spread, ("growth_rate", "frequency")):
            summary |= quantiles
        likely, undecided = summary["probability_unstable"], 1.0 - float(np.mean(decided))
        return summary | {
            "impossible_naive": float(np.mean(self.impossible)),
            "undecided": undecided,
            "draws": math.prod(self.shape),
            "stability": 0 if likely < CLEAR else 2 if likely > 1 - CLEAR else 1,
            "status": 0 if undecided < CLEAR else 1,
        }

    def _flip_summary(self, nonlinear: Mapping[str, np.ndarray], rate: np.ndarray) -> dict:
        shape = self.shape[0], rate.size // self.shape[0]
        turns = nonlinear["flip_period"] * np.abs(rate) / (2 * math.pi)
        summary = _share("probability_flip", (turns <= self.sampling.turns).reshape(shape))
        for name, values in nonlinear.items():
            summary |= _quantiles(f"{name}_quantile", values.reshape(shape))
        return summary | {"draws_followed": rate.size}

    def _moment_summary(self, axis: int) -> dict:
        """Return mean and spread of the moment about an axis, as requested and as drawn."""
        distribution = self.distribution
        drawn = self.moments[:, axis - 1].reshape(self.shape)
        middle, error = designs.mean(drawn.mean(axis=1))
        variance = distribution.covariance[axis - 1, axis - 1]
        if distribution.is_tilted:  # of an entry along the axis: exact where the axes do not tilt
            direction = distribution.axes[axis - 1]
            weights = np.array([(1 + (i != j)) * direction[i] * direction[j] for i, j in possible.ENTRIES.values()])
            variance = max(weights @ distribution.covariance @ weights, 0.0)
        return {
            "moment_mean_requested": float(distribution.moments[axis - 1]),
            "moment_mean": float(middle),
            "moment_mean_error": float(error),
            "moment_spread_requested": math.sqrt(float(variance)),
            "moment_spread": float(drawn.std()),
        }

    def _sensitivities(self, spin: Spun) -> dict:
        """Return Sobol indices of the signed rate² over the body's inputs."""
        distribution, sampling = self.distribution, self.sampling
        if not distribution.groups:
            return {f"sensitivity_{kind}": np.empty(0) for kind in ("first", "first_error", "total", "total_error")}

        def rate2(normals):
            moments, _, turned = distribution.inertia(normals)
            rates = self._rates(_points(distribution, moments, turned, normals, spin))
            return np.nan_to_num(rates["omega_squared_reduced"] / spin.omega0**2)

        half = max(designs.LEAST, min(sampling.draws // SHARE_SENSITIVE, SENSITIVE))
        indices = designs.sobol_indices(rate2, distribution.groups, half, sampling.seed, sampling.method, self.run)
        return {f"sensitivity_{kind}": values for kind, values in indices.items()}

    def _kept(self, rates, nonlinear, followed) -> dict[str, np.ndarray]:
        kept = dict(zip(MOMENTS, self.moments.T, strict=True)) | {"regime": rates["regime"]}
        kept |= {name: rates[f"{name}_reduced"] for name in ("growth_rate", "frequency")}
        for name, values in nonlinear.items():
            kept[name] = np.full(len(self.moments), np.nan)
            kept[name][followed] = np.where(np.isfinite(values), values, np.nan)
        return kept


def _points(distribution: Distribution, moments, turned, normals, spin: Spun) -> dict[str, np.ndarray]:
    """Return points of the kernels: a perturbed spin along the body's own axis, in components along the draw's axes."""
    rate, size, phase = distribution.spun(normals, spin.omega0, spin.epsilon, spin.phase)
    if turned is not None:
        a, b, c = spin.axis - 1, spin.axis % 3, (spin.axis + 1) % 3
        along, across = size * np.cos(phase), size * np.sin(phase)
        seen = [turned[:, k, a] + along * turned[:, k, b] + across * turned[:, k, c] for k in (a, b, c)]
        rate = rate * seen[0]
        size = np.maximum(np.hypot(seen[1], seen[2]) / np.abs(seen[0]), 1e-30)
        phase = np.arctan2(seen[2] / seen[0], seen[1] / seen[0])
    columns = dict(zip(MOMENTS, moments.T, strict=True))
    return columns | {"axis": np.full(len(rate), spin.axis), "omega0": rate, "epsilon": size, "phase": phase}


def _share(name: str, holds: np.ndarray) -> dict:
    value, error = designs.share(holds.mean(axis=1), holds.size)
    return {name: float(value), f"{name}_error": float(error)}


def _quantiles(name: str, values: np.ndarray) -> dict:
    quantiles, error = designs.quantiles(values, QUANTILES)
    finite = np.isfinite(quantiles)  # "never" is missing
    return {name: np.where(finite, quantiles, np.nan), f"{name}_error": np.where(finite, error, np.nan)}
