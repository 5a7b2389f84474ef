r"""Points of the unit cube, drawn by their numbers: any part of any draw costs no more than itself.

Sobol points are SciPy's, bit for bit. In Gray code point n is :math:`x_n = x_0 \oplus \bigoplus_b g_b\,v_b` over the
binary digits g of :math:`n \oplus \lfloor n/2 \rfloor`, linear in n under exclusive or; so a block of
:math:`2^k` points is the first one with one constant exclusive-ored in, and only the points numbered by powers of two
are asked of SciPy.

Random points are those of NumPy's `default_rng(seed).random((num, d))`, whose generator is advanced.

A Latin hypercube puts one point into each of `num` slices along every dimension. The slice of a point is a permutation
of its number, made by a Feistel network over :math:`2^k \ge` num numbers, walked until it falls below num: so no list
of `num` numbers is ever made, as SciPy's own does.

Source: Antonov and Saleev (1979), USSR Comput. Math. Math. Phys. 19, 252; Black and Rogaway (2002), Ciphers with
arbitrary finite domains; Steele, Lea and Flood (2014), Fast splittable pseudorandom number generators.
"""

from functools import cached_property

import numpy as np

from sweeps.schema.definition import Sample

BITS = 30  # of SciPy's Sobol points
LOW = 16  # binary digits of a number within a block
ROUNDS = 4  # of the Feistel network: as many as make it like any permutation (Luby and Rackoff, 1988)
GOLDEN = 0x9E3779B97F4A7C15


class Draw:
    """Points of the unit cube."""

    def __init__(self, sample: Sample, dimensions: int):
        self._sample, self._dimensions = sample, dimensions

    def shares(self, start: int, stop: int) -> np.ndarray:
        """Return the points start … stop − 1 (from 0), float64 of shape (stop − start, dimensions), each in [0, 1)."""
        ways = {"sobol": self._sobol, "latin": self._latin, "random": self._random}
        return ways[self._sample.method](start, stop)

    def _random(self, start: int, stop: int) -> np.ndarray:
        bits = np.random.PCG64(self._sample.seed)
        bits.advance(start * self._dimensions)
        return np.random.Generator(bits).random((stop - start, self._dimensions))

    @cached_property
    def _block(self) -> np.ndarray:
        """The first points, as whole numbers."""
        return self._whole(self._engine().random(min(2**LOW, 1 << (self._sample.num - 1).bit_length())))

    @cached_property
    def _turns(self) -> np.ndarray:
        """What is exclusive-ored in for each binary digit of a block's number, shape (digits, dimensions)."""
        engine, turns = self._engine(), []
        for digit in range(LOW, max(LOW, (self._sample.num - 1).bit_length())):
            engine.fast_forward(2**digit - engine.num_generated)
            turns.append(self._whole(engine.random(1))[0] ^ self._block[0])
        return np.array(turns, np.int64).reshape(-1, self._dimensions)

    def _engine(self):
        from scipy.stats import qmc

        return qmc.Sobol(self._dimensions, scramble=True, bits=BITS, rng=self._sample.seed)

    @staticmethod
    def _whole(points: np.ndarray) -> np.ndarray:
        return np.round(points * 2.0**BITS).astype(np.int64)

    def _sobol(self, start: int, stop: int) -> np.ndarray:
        fractions = np.empty((stop - start, self._dimensions), np.int64)
        for number in range(start >> LOW, -(-stop >> LOW) if stop > start else 0):
            first = number << LOW
            low, high = max(start, first), min(stop, first + 2**LOW)
            turn = np.zeros(self._dimensions, np.int64)
            for digit, digit_turn in enumerate(self._turns):
                if number >> digit & 1:
                    turn ^= digit_turn
            fractions[low - start : high - start] = self._block[low - first : high - first] ^ turn
        return fractions * 2.0**-BITS

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
