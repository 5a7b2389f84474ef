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

MAX_FLIP_DRAWS = 2**15  # largest number of draws of a body that are integrated to their flips
MAX_HALF_DRAWS = 2**13  # largest number of draws in each half of the design for sensitivities
DRAWS_PER_HALF = 4  # number of draws of a body for each draw in a half of that design
TILE_DRAWS = 2**14  # number of draws that one thread measures at once
DRAW_BYTES = 450  # memory of a draw while its body is measured, bytes
MAX_RATE_EPSILON = 1e-6  # rates are for small perturbations: a larger one by tilted axes is reduced to this size
STABLE, UNSTABLE = (0, 1), 2  # regimes of the kernels
# columns of a draw that the kernels return
DRAW_COLUMNS = {"omega_squared_reduced", "growth_rate_reduced", "frequency_reduced", "regime", "status"}

Columns = dict[str, np.ndarray]  # name → values


@dataclass(frozen=True)
class BodySampling:
    """Number and method of the draws, and quantities that are measured of them."""

    draws: int = 10_000  #: number of draws, at least
    seed: int = 1  #: seed of the random numbers, an integer ≥ 0
    method: str = "sobol"  #: a name in `designs.METHODS`
    turns: float = 100.0  #: number of turns of the spin within which `probability_flip` counts flips
    twist: bool = False  #: whether the twist of the draws that are integrated to their flips is measured


@dataclass(frozen=True)
class SpinSettings:
    """Axis, spin rate (rad/s) and perturbation (relative size, direction in rad) of a spin."""

    axis: int
    omega0: float
    epsilon: float
    phase: float


def measure_spins(
    distribution: Distribution,
    spins: Iterable[SpinSettings],
    sampling: BodySampling,
    integration: Integration,
    threads: int = 1,
) -> Iterator[tuple[Columns, Columns]]:
    """Yield (variables, draws) of each spin of a body.

    Variables are floats, or arrays over `quantile` (of `designs.QUANTILES`) or over the body's own inputs; draws are
    columns of shape (n,): I1, I2, I3, growth_rate, frequency, regime, flip_period, max_tilt; the last two NaN if a draw
    was not integrated to its flips.

    Args:
        distribution: the body's moments, as a distribution.
        spins: spins of the body.
        sampling: number and method of the draws.
        integration: length, sampling and accuracy of each run.
        threads: number of threads.
    """
    normals = designs.normals(sampling.method, distribution.dimension, sampling.draws, sampling.seed)
    with ThreadPoolExecutor(threads) as pool:
        body = _Body(distribution, normals, sampling, integration, pool.map if threads > 1 else map)
        for spin in spins:
            yield body.measure_spin(spin)


class _Body:
    """Draws of one body, made of `normals`, shape (replicates, size, dimension), each measured.

    `run` is `map`, or the `map` of a thread pool; the tiles of draws do not depend on the number of threads.
    """

    def __init__(self, distribution: Distribution, normals, sampling: BodySampling, integration: Integration, run):
        self.distribution, self.sampling, self.integration, self.run = distribution, sampling, integration, run
        self.shape = normals.shape[:2]
        self.normals = normals.reshape(-1, normals.shape[2])
        inertia = self._run_tiles(lambda draws: distribution.inertia(self.normals[draws]), len(self.normals))
        self.moments, self.impossible, self.rotations = inertia if distribution.has_uncertain_axes else (*inertia, None)

    def measure_spin(self, spin: SpinSettings) -> tuple[Columns, Columns]:
        """Measure one spin; see `measured`."""
        rates = self._run_tiles(lambda draws: self._measure_rates(self._points(draws, spin)), len(self.normals))
        count, size = self.shape
        # the first draws of each replicate
        first_draws = np.arange(min(size, 2 ** int(math.log2(max(MAX_FLIP_DRAWS / count, 1)))))
        flip_draws = (np.arange(count)[:, None] * size + first_draws).reshape(-1)
        flip_points = self._points(flip_draws, spin)
        nonlinear = self._flips(flip_points, rates["omega_squared_reduced"][flip_draws])
        if self.sampling.twist:
            nonlinear["twist"] = self._twists(flip_points, spin.axis)
        summary = self._linear_summary(rates, spin) | self._flip_summary(nonlinear, flip_points["omega0"])
        summary |= self._moment_summary(spin.axis) | self._sensitivities(spin)
        summary["probability_middle_theory"] = self.distribution.middle_theory(spin.axis)
        return summary, self._draw_columns(rates, nonlinear, flip_draws)

    # -- calls of the kernels, tile by tile

    def _run_tiles(self, work: Callable, size: int, tile: int = TILE_DRAWS):
        """Return the columns, by name or in a list, that a function returns of each tile, joined."""
        results = list(self.run(work, [slice(low, low + tile) for low in range(0, size, tile)]))
        if isinstance(results[0], dict):
            return {name: np.concatenate([result[name] for result in results]) for name in results[0]}
        return [np.concatenate(columns) for columns in zip(*results, strict=True) if columns[0] is not None]

    def _points(self, draws, spin: SpinSettings) -> dict[str, np.ndarray]:
        """Return points of the kernels for some draws."""
        rotations = None if self.rotations is None else self.rotations[draws]
        return _kernel_points(self.distribution, self.moments[draws], rotations, self.normals[draws], spin)

    def _measure_rates(self, points: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
        """Return measured regimes and rates of points, with epsilon at most `MAX_RATE_EPSILON`."""
        from kernels.near_axis import survey

        integration = self.integration
        settings = (integration.rotations, integration.samples_per_rotation, integration.tolerance)
        points = dict(points, epsilon=np.minimum(points["epsilon"], MAX_RATE_EPSILON))
        return survey.measure_points(points, *settings, wanted=DRAW_COLUMNS)

    def _flips(self, points, squares: np.ndarray) -> dict[str, np.ndarray]:
        """Return flip period (infinite if the spin keeps its sign) and largest tilt of points, measured."""
        from kernels.near_axis import survey

        spin = points["omega0"]
        order = np.argsort(np.abs(squares / spin / spin))  # motions of similar duration together
        sorted_points, tolerance = {name: values[order] for name, values in points.items()}, self.integration.tolerance

        def measure_tile(draws):
            return survey.measure_flips({name: values[draws] for name, values in sorted_points.items()}, tolerance)

        back = np.argsort(order)
        columns = {name: values[back] for name, values in self._run_tiles(measure_tile, order.size, 1024).items()}
        period, tilt_exact, tilt = columns["flip_period"], columns["max_tilt_exact"], columns["max_tilt"]
        is_missing = np.isnan(tilt)  # too near the separatrix to be integrated: the closed form replaces it
        keeps_sign = np.where(is_missing, tilt_exact <= math.pi / 2, np.isnan(period))
        period = np.where(keeps_sign, np.inf, np.where(np.isnan(period), columns["flip_period_exact"], period))
        return {"flip_period": period, "max_tilt": np.where(is_missing, tilt_exact, tilt)}

    def _twists(self, points, axis: int) -> np.ndarray:
        """Return the size of the twist of points, rad, measured, each about its own axis of least moment."""
        from kernels.events import twist

        moments = np.stack([points[name] for name in MOMENTS], axis=-1)
        across = [points["epsilon"] * f(points["phase"]) for f in (np.cos, np.sin)]
        momentum = moments * np.roll(np.stack([np.ones(len(moments)), *across], axis=-1), axis - 1, axis=1)
        order = np.argsort(moments, axis=1, kind="stable")
        along, second, third = np.take_along_axis(momentum, order, axis=1).T
        angles = {"chi": np.arctan2(third, second), "theta": np.arctan2(np.hypot(second, third), along)}
        columns = dict(zip(MOMENTS, moments.T, strict=True)) | angles | {"omega0": np.ones(len(moments))}

        def measure_tile(draws):
            return twist.survey({name: values[draws] for name, values in columns.items()}, self.integration.tolerance)

        twists = self._run_tiles(measure_tile, len(moments))
        sizes = np.abs(np.where(np.isnan(twists["twist"]), twists["twist_exact"], twists["twist"]))
        return np.where(np.isnan(sizes), np.inf, sizes)  # the spin is along the handle, which then has no azimuth

    # -- statistics

    def _linear_summary(self, rates: Mapping[str, np.ndarray], spin: SpinSettings) -> dict:
        """Return the summary of all draws: probabilities, quantiles of growth rate and frequency, stability and status.

        `stability` is 0 if almost no draw is unstable, 2 if almost all are, and 1 otherwise (see `designs.MAX_DOUBT`).
        """
        a = spin.axis - 1
        other_moments = [self.moments[:, axis] for axis in range(3) if axis != a]
        middle = (self.moments[:, a] > other_moments[0]) != (self.moments[:, a] > other_moments[1])
        unstable = rates["regime"] == UNSTABLE
        is_decided = (unstable | np.isin(rates["regime"], STABLE)) & (rates["status"] == 0)
        summary = _summarize_share("probability_middle", middle.reshape(self.shape))
        summary |= _summarize_share("probability_unstable", unstable.reshape(self.shape))

        def spread(name):
            return _summarize_quantiles(
                f"{name}_quantile", np.nan_to_num(rates[f"{name}_reduced"], nan=0.0).reshape(self.shape)
            )

        for quantiles in self.run(spread, ("growth_rate", "frequency")):
            summary |= quantiles
        likely, undecided = summary["probability_unstable"], 1.0 - float(np.mean(is_decided))
        return summary | {
            "impossible_naive": float(np.mean(self.impossible)),
            "undecided": undecided,
            "draws": math.prod(self.shape),
            "stability": 0 if likely < designs.MAX_DOUBT else 2 if likely > 1 - designs.MAX_DOUBT else 1,
            "status": 0 if undecided < designs.MAX_DOUBT else 1,
        }

    def _flip_summary(self, nonlinear: Mapping[str, np.ndarray], rate: np.ndarray) -> dict:
        """Return the probability of a flip within the requested turns, and quantiles of flip period, tilt and twist."""
        shape = self.shape[0], rate.size // self.shape[0]
        turns = nonlinear["flip_period"] * np.abs(rate) / (2 * math.pi)
        summary = _summarize_share("probability_flip", (turns <= self.sampling.turns).reshape(shape))
        for name, values in nonlinear.items():
            summary |= _summarize_quantiles(f"{name}_quantile", values.reshape(shape))
        return summary | {"draws_followed": rate.size}

    def _moment_summary(self, axis: int) -> dict:
        """Return mean and spread of the moment about an axis, as requested and as drawn."""
        distribution = self.distribution
        moments = self.moments[:, axis - 1].reshape(self.shape)
        middle, error = designs.mean(moments.mean(axis=1))
        variance = distribution.covariance[axis - 1, axis - 1]
        if distribution.has_uncertain_axes:  # variance of an entry along the axis, exact if the axes do not tilt
            direction = distribution.axes[axis - 1]
            weights = np.array([(1 + (i != j)) * direction[i] * direction[j] for i, j in possible.ENTRIES.values()])
            variance = max(weights @ distribution.covariance @ weights, 0.0)
        return {
            "moment_mean_requested": float(distribution.moments[axis - 1]),
            "moment_mean": float(middle),
            "moment_mean_error": float(error),
            "moment_spread_requested": math.sqrt(float(variance)),
            "moment_spread": float(moments.std()),
        }

    def _sensitivities(self, spin: SpinSettings) -> dict:
        """Return Sobol indices of the signed rate² over the body's inputs."""
        distribution, sampling = self.distribution, self.sampling
        if not distribution.groups:
            return {f"sensitivity_{kind}": np.empty(0) for kind in ("first", "first_error", "total", "total_error")}

        def rate2(normals):
            moments, _, rotations = distribution.inertia(normals)
            rates = self._measure_rates(_kernel_points(distribution, moments, rotations, normals, spin))
            return np.nan_to_num(rates["omega_squared_reduced"] / spin.omega0**2)

        half = max(designs.MIN_DRAWS, min(sampling.draws // DRAWS_PER_HALF, MAX_HALF_DRAWS))
        indices = designs.sobol_indices(rate2, distribution.groups, half, sampling.seed, sampling.method, self.run)
        return {f"sensitivity_{kind}": values for kind, values in indices.items()}

    def _draw_columns(self, rates, nonlinear, flip_draws) -> dict[str, np.ndarray]:
        """Return the columns of all draws; quantities of flips are NaN for draws that were not integrated to flips."""
        columns = dict(zip(MOMENTS, self.moments.T, strict=True)) | {"regime": rates["regime"]}
        columns |= {name: rates[f"{name}_reduced"] for name in ("growth_rate", "frequency")}
        for name, values in nonlinear.items():
            columns[name] = np.full(len(self.moments), np.nan)
            columns[name][flip_draws] = np.where(np.isfinite(values), values, np.nan)
        return columns


def _kernel_points(
    distribution: Distribution, moments, rotations, normals, spin: SpinSettings
) -> dict[str, np.ndarray]:
    """Return the kernels' points for drawn `moments`: spins drawn from `normals`, along the nominal body's axis.

    `rotations`, (draws, 3, 3), turn nominal axes into each draw's own; None if axes are certain.
    """
    rate, size, phase = distribution.draw_spins(normals, spin.omega0, spin.epsilon, spin.phase)
    if rotations is not None:
        a, b, c = spin.axis - 1, spin.axis % 3, (spin.axis + 1) % 3
        along, across = size * np.cos(phase), size * np.sin(phase)
        components = [rotations[:, k, a] + along * rotations[:, k, b] + across * rotations[:, k, c] for k in (a, b, c)]
        rate = rate * components[0]
        size = np.maximum(np.hypot(components[1], components[2]) / np.abs(components[0]), 1e-30)
        phase = np.arctan2(components[2] / components[0], components[1] / components[0])
    columns = dict(zip(MOMENTS, moments.T, strict=True))
    return columns | {"axis": np.full(len(rate), spin.axis), "omega0": rate, "epsilon": size, "phase": phase}


def _summarize_share(name: str, holds: np.ndarray) -> dict:
    value, error = designs.probability(holds.mean(axis=1), holds.size)
    return {name: float(value), f"{name}_error": float(error)}


def _summarize_quantiles(name: str, values: np.ndarray) -> dict:
    quantiles, error = designs.quantiles(values, designs.QUANTILES)
    finite = np.isfinite(quantiles)  # an infinite time, "never", is missing
    return {name: np.where(finite, quantiles, np.nan), f"{name}_error": np.where(finite, error, np.nan)}
