"""One uncertain body: tensor and spin, their covariances, and the uncertain inputs that follow."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import accumulate

import numpy as np

from sweeps.systems.bodies.inertia import InertiaError
from sweeps.systems.bodies.variables import MOMENTS
from sweeps.systems.uncertain_bodies import possible

ANY = "any"  # a phase of which nothing is known
MOST_EPSILON = 0.999  # a drawn nudge beyond that counts as that
SPIN = ("omega0", "epsilon", "phase")
LARGEST = 1e140  # kg m2, a standard deviation, whose square, and sums of it, are doubles
RANGE = "standard deviations from 1e-140 to 1e140 kg m2 (as ratios of the moments every body is in range)"


@dataclass(frozen=True, eq=False)
class Distribution:
    """One uncertain body."""

    moments: np.ndarray  #: principal moments, in the order of the axes 1, 2, 3
    axes: np.ndarray  #: principal axes as rows, in the coordinates of the tensor
    entries: np.ndarray  #: the three moments, or the six entries of the tensor (`possible.ENTRIES`), that are drawn
    covariance: np.ndarray  #: theirs
    #: of omega0 and epsilon the relative standard deviation, of phase that in rad or `ANY`; what is left out is known
    #: exactly.
    spin: Mapping[str, float | str]

    @property
    def is_tilted(self) -> bool:
        """Whether draws have principal axes of their own."""
        return len(self.entries) == 6

    @cached_property
    def _blocks(self) -> list[tuple[str, np.ndarray, np.ndarray]]:
        """Of each set of entries that depend on each other: name, their numbers, a factor F of F Fᵀ = covariance."""
        from scipy.sparse.csgraph import connected_components

        names, blocks = tuple(possible.ENTRIES) if self.is_tilted else MOMENTS, []
        uncertain = np.flatnonzero(np.diag(self.covariance) > 0)
        _, label = connected_components(self.covariance[np.ix_(uncertain, uncertain)] != 0.0, directed=False)
        for block in (uncertain[label == k] for k in dict.fromkeys(label)):
            values, vectors = np.linalg.eigh(self.covariance[np.ix_(block, block)])
            factor = vectors * np.sqrt(np.clip(values, 0.0, None))
            blocks.append(("+".join(names[k] for k in block), block, factor))
        return blocks

    @property
    def inputs(self) -> tuple[str, ...]:
        """Names of the inputs that are uncertain, each independent of the others; "I1+I2" for what depends."""
        return (*(name for name, _, _ in self._blocks), *(name for name in SPIN if name in self.spin))

    @cached_property
    def groups(self) -> tuple[tuple[int, ...], ...]:
        """Columns of standard normals that each input takes."""
        widths = [len(block) for _, block, _ in self._blocks] + [1] * sum(name in self.spin for name in SPIN)
        return tuple(tuple(range(end - width, end)) for width, end in zip(widths, accumulate(widths), strict=True))

    @property
    def dimension(self) -> int:
        """How many standard normals a draw takes, 1 at least."""
        return max(1, sum(map(len, self.groups)))

    @cached_property
    def delta(self) -> float:
        """δ of `sweeps.systems.uncertain_bodies.possible`; 0 where the tensor is known exactly."""
        return possible.softness(self.covariance, self.moments) if self._blocks else 0.0

    def inertia(self, normals: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray | None]:
        """Return possible bodies from standard normals, shape (n, dimension).

        Returns:
            Moments, shape (n, 3); which Gaussian draws were no body; and rotations from the body's axes to the draws',
            shape (n, 3, 3), or None where axes are fixed.
        """
        entries = np.repeat(self.entries[None, :], len(normals), axis=0)
        if not self._blocks:
            moments = np.repeat(self.moments[None, :], len(normals), axis=0)
            return moments, np.zeros(len(normals), dtype=bool), None
        for (_, block, factor), columns in zip(self._blocks, self.groups, strict=False):
            # one product at a time: a matrix product's last bits depend on how many rows it has
            for k, column in enumerate(columns):
                entries[:, block] += normals[:, column, None] * factor[:, k]
        if self.is_tilted:
            return possible.from_entries(entries, self.delta, self.axes)
        return *possible.from_moments(entries, self.delta), None

    def draw_spins(self, normals: np.ndarray, omega0: float, epsilon: float, phase: float) -> tuple[np.ndarray, ...]:
        """Return spin rate, size and direction of the perturbation of each draw; rates and sizes are log-normal."""
        columns = dict(zip(self.inputs, self.groups, strict=True))
        z = {name: normals[:, columns[name][0]] for name in SPIN if name in self.spin}
        rate = np.full(len(normals), omega0) * self._scattered("omega0", z)
        size = np.minimum(np.full(len(normals), epsilon) * self._scattered("epsilon", z), MOST_EPSILON)
        if self.spin.get("phase") == ANY:
            from scipy.special import ndtr

            return rate, size, phase + 2 * math.pi * ndtr(z["phase"])
        return rate, size, phase + self.spin.get("phase", 0.0) * z.get("phase", np.zeros(len(normals)))

    def _scattered(self, name: str, z: Mapping[str, np.ndarray]) -> np.ndarray | float:
        """Return factors of mean 1 and the requested relative standard deviation, log-normal: they keep their sign."""
        if name not in z:
            return 1.0
        variance = math.log1p(self.spin[name] ** 2)
        return np.exp(math.sqrt(variance) * z[name] - variance / 2)

    def middle_theory(self, axis: int) -> float:
        """Return the probability that an axis is intermediate for normal moments; NaN for a tensor whose axes tilt."""
        if self.is_tilted or not self._blocks:
            return math.nan
        return possible.middle_probability(self.moments, self.covariance, axis)


def relative(values: np.ndarray, shares: np.ndarray | float) -> np.ndarray:
    """Return the covariance of independent entries with relative standard deviations.

    Raises:
        InertiaError: where a variance would be no double: one of 0 would make what is uncertain exact.
    """
    deviations = np.abs(np.asarray(values, dtype=np.float64) * shares)
    if not (deviations <= LARGEST).all() or (deviations[deviations > 0] < 1 / LARGEST).any():
        raise InertiaError("(a variance)", "is too large or too small for a double", RANGE)
    return np.diag(deviations**2)


def checked_covariance(covariance: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return a valid covariance of entries with uncertainties below 100 %."""
    size = np.abs(covariance).max(initial=0.0)
    if size > LARGEST**2 or 0 < size < LARGEST**-2:
        raise InertiaError("(a matrix)", "is too large or too small for doubles", RANGE)
    if (np.abs(covariance - covariance.T) > 1e-9 * size).any():
        raise InertiaError("(a matrix)", "is not symmetric", "a symmetric matrix, kg2 m4")
    covariance = (covariance + covariance.T) / 2
    least = float(np.linalg.eigvalsh(covariance)[0])
    if least < -1e-9 * size or (np.diag(covariance) < 0).any():
        wrong = f"is not positive: it has the eigenvalue {least:.4g}"
        raise InertiaError("(a matrix)", wrong, "no variance below 0 in any direction")
    spread = np.sqrt(np.diag(covariance))
    for k, most in enumerate(np.abs(values[:3])):
        if spread[k] >= most:
            wrong = f"makes an uncertainty of {100 * spread[k] / most:.4g} %, entry {k + 1}"
            raise InertiaError("(a matrix)", wrong, "less than 100 % of each moment")
    return covariance
