r"""Points of the unit cube, drawn by their numbers: any part of any draw, without the points before it in memory.

Sobol points are SciPy's, random points those of NumPy's `default_rng(seed).random((num, d))`; generators are advanced.

A Latin hypercube puts one point into each of `num` slices along every dimension. The slice of a point is a permutation
of its number, made by a Feistel network over :math:`2^k \ge` num numbers, walked until it falls below num: so no list
of `num` numbers is ever made, as SciPy's own does.

Source: Black and Rogaway (2002), Ciphers with arbitrary finite domains; Steele, Lea and Flood (2014), Fast splittable
pseudorandom number generators.
"""

from functools import cached_property
from threading import Lock

import numpy as np

from sweeps.schema.sample import Sample

BITS = 30  # of SciPy's Sobol points
ROUNDS = 4  # of the Feistel network: as many as make it like any permutation (Luby and Rackoff, 1988)
GOLDEN = 0x9E3779B97F4A7C15


class Draw:
    """Points of the unit cube."""

    def __init__(self, sample: Sample, dimensions: int):
        self._sample, self._dimensions, self._lock = sample, dimensions, Lock()

    def shares(self, start: int, stop: int) -> np.ndarray:
        """Return the points start … stop − 1 (from 0), float64 of shape (stop − start, dimensions), each in [0, 1)."""
        ways = {"sobol": self._sobol, "latin": self._latin, "random": self._random}
        return ways[self._sample.method](start, stop)

    def _random(self, start: int, stop: int) -> np.ndarray:
        bits = np.random.PCG64(self._sample.seed)
        bits.advance(start * self._dimensions)
        return np.random.Generator(bits).random((stop - start, self._dimensions))

    @cached_property
    def _engine(self):
        from scipy.stats import qmc

        return qmc.Sobol(self._dimensions, scramble=True, bits=BITS, rng=self._sample.seed)

    def _sobol(self, start: int, stop: int) -> np.ndarray:
        with self._lock:  # the engine counts what it has drawn
            if self._engine.num_generated > start:
                self._engine.reset()
            if self._engine.num_generated < start:
                self._engine.fast_forward(start - self._engine.num_generated)
            first = self._engine.random(min(1, stop - start))  # alone: of others than 2^k at once SciPy warns
            return np.concatenate([first, self._engine.random(stop - start - len(first))])

    def _latin(self, start: int, stop: int) -> np.ndarray:
        num = self._sample.num
        numbers = np.arange(start, stop, dtype=np.uint64)
        fractions = np.empty((stop - start, self._dimensions))
        for d in range(self._dimensions):
            keys = np.random.SeedSequence([self._sample.seed, d]).generate_state(ROUNDS + 1, np.uint64)
            within = (_mixed(numbers ^ keys[ROUNDS]) >> np.uint64(11)) * 2.0**-53
            # the last slice's upper end must not round to 1
            fractions[:, d] = np.minimum((_permuted(numbers, num, keys) + within) / num, 1 - 2.0**-53)
        return fractions


def _mixed(values: np.ndarray) -> np.ndarray:
    """Apply the finishing function of SplitMix64 to uint64."""
    values = values + np.uint64(GOLDEN)
    values = (values ^ (values >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    values = (values ^ (values >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return values ^ (values >> np.uint64(31))


def _permuted(numbers: np.ndarray, num: int, keys: np.ndarray) -> np.ndarray:
    """Return a permutation of 0 … num − 1 at some numbers, uint64."""
    digits = max(2, (num - 1).bit_length())
    places = _network(numbers, digits, keys)
    while (walking := np.flatnonzero(places >= np.uint64(num))).size:
        places[walking] = _network(places[walking], digits, keys)
    return places


def _network(values: np.ndarray, digits: int, keys: np.ndarray) -> np.ndarray:
    """Return a permutation of all numbers of so many binary digits: each half is changed by the other, in turn."""
    upper, lower = digits // 2, digits - digits // 2
    masks = [np.uint64(2**width - 1) for width in (upper, lower)]
    halves = [values >> np.uint64(lower), values & masks[1]]
    for turn, key in enumerate(keys[:ROUNDS]):
        changed = turn % 2
        halves[changed] = halves[changed] ^ (_mixed(halves[1 - changed] ^ key) & masks[changed])
    return (halves[0] << np.uint64(lower)) | halves[1]
