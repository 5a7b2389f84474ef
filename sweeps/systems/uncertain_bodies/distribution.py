"""Distribution of an uncertain body: tensor and spin, their covariances, and the resulting uncertain inputs."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import accumulate

import numpy as np

from sweeps.systems.bodies.inertia import InertiaError
from sweeps.systems.bodies.variables import MOMENTS
from sweeps.systems.uncertain_bodies import designs, possible

ANY = "any"  # an unknown phase
MAX_EPSILON = 0.999  # larger sampled perturbations are reduced to this size
SPIN = ("omega0", "epsilon", "phase")
MAX_DEVIATION = 1e140  # kg m2, bound on standard deviations, so that sums of their squares do not overflow
RANGE = "standard deviations from 1e-140 to 1e140 kg m2 (as ratios of the moments every body is in range)"


@dataclass(frozen=True, eq=False)
class Distribution:
    """Distribution of the moments, or the tensor, and the spin of an uncertain body."""

    moments: np.ndarray  #: nominal principal moments, in the order of the axes 1, 2, 3
    axes: np.ndarray  #: principal axes as rows, in the coordinates of the tensor
    entries: np.ndarray  #: the three moments, or the six entries of the tensor (`possible.ENTRIES`), that are sampled
    covariance: np.ndarray  #: covariance of the entries
    #: relative standard deviations of omega0 and epsilon, and that of phase in rad or `ANY`; omitted values are exact.
    spin: Mapping[str, float | str]

    @property
    def has_uncertain_axes(self) -> bool:
        """True if the draws differ in their principal axes: the six entries of the tensor are sampled."""
        return len(self.entries) == 6

    @cached_property
    def _blocks(self) -> list[tuple[str, np.ndarray, np.ndarray]]:
        """(Name, numbers of the entries, factor F with F Fᵀ = covariance) of each set of correlated entries."""
        from scipy.sparse.csgraph import connected_components

        names, blocks = tuple(possible.ENTRIES) if self.has_uncertain_axes else MOMENTS, []
        uncertain = np.flatnonzero(np.diag(self.covariance) > 0)
        _, label = connected_components(self.covariance[np.ix_(uncertain, uncertain)] != 0.0, directed=False)
        for block in (uncertain[label == k] for k in dict.fromkeys(label)):
            values, vectors = np.linalg.eigh(self.covariance[np.ix_(block, block)])
            factor = vectors * np.sqrt(np.clip(values, 0.0, None))
            blocks.append(("+".join(names[k] for k in block), block, factor))
        return blocks

    @property
    def inputs(self) -> tuple[str, ...]:
        """Names of the independent uncertain inputs; "I1+I2" for correlated entries."""
        return (*(name for name, _, _ in self._blocks), *(name for name in SPIN if name in self.spin))

    @cached_property
    def groups(self) -> tuple[tuple[int, ...], ...]:
        """Columns of standard normals of each input."""
        widths = [len(block) for _, block, _ in self._blocks] + [1] * sum(name in self.spin for name in SPIN)
        return tuple(tuple(range(end - width, end)) for width, end in zip(widths, accumulate(widths), strict=True))

    @property
    def dimension(self) -> int:
        """Number of standard normals of a draw, at least 1."""
        return max(1, sum(map(len, self.groups)))

    @cached_property
    def delta(self) -> float:
        """δ of `sweeps.systems.uncertain_bodies.possible`; 0 if the tensor is known exactly."""
        return possible.softness(self.covariance, self.moments) if self._blocks else 0.0

    def inertia(self, normals: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray | None]:
        """Return possible bodies from standard normals, shape (n, dimension).

        Returns:
            Moments, shape (n, 3); True for impossible Gaussian draws; and rotations from the nominal axes to the
            draws', shape (n, 3, 3), or None for fixed axes.
        """
        entries = np.repeat(self.entries[None, :], len(normals), axis=0)
        if not self._blocks:
            moments = np.repeat(self.moments[None, :], len(normals), axis=0)
            return moments, np.zeros(len(normals), dtype=bool), None
        for (_, block, factor), columns in zip(self._blocks, self.groups, strict=False):
            # one product at a time, as the last bits of a matrix product depend on the number of rows
            for k, column in enumerate(columns):
                entries[:, block] += normals[:, column, None] * factor[:, k]
        if self.has_uncertain_axes:
            return possible.project_entries(entries, self.delta, self.axes)
        return *possible.project_moments(entries, self.delta), None

    def draw_spins(self, normals: np.ndarray, omega0: float, epsilon: float, phase: float) -> tuple[np.ndarray, ...]:
        """Return spin rate, size and direction of the perturbation of each draw, shape (n,) each.

        Rates and sizes are log-normal, with sizes reduced to `MAX_EPSILON` beyond it. The phase is normal, uniform over
        the circle if its uncertainty is `ANY`. Quantities without an uncertainty have their nominal value.

        Args:
            normals: standard normals, shape (n, dimension).
            omega0: nominal spin rate, rad s-1.
            epsilon: nominal size of the perturbation.
            phase: nominal direction of the perturbation, rad.
        """
        columns = dict(zip(self.inputs, self.groups, strict=True))
        zero = np.zeros(len(normals))
        spin_normals = {name: normals[:, columns[name][0]] if name in columns else zero for name in SPIN}
        factors = {
            name: designs.log_normal_factors(self.spin.get(name, 0.0), spin_normals[name])
            for name in ("omega0", "epsilon")
        }
        rate, size = omega0 * factors["omega0"], np.minimum(epsilon * factors["epsilon"], MAX_EPSILON)
        if self.spin.get("phase") == ANY:
            from scipy.special import ndtr

            return rate, size, phase + 2 * math.pi * ndtr(spin_normals["phase"])
        return rate, size, phase + self.spin.get("phase", 0.0) * spin_normals["phase"]

    def middle_theory(self, axis: int) -> float:
        """Return the probability that an axis is intermediate for normal moments; NaN if the axes vary."""
        if self.has_uncertain_axes or not self._blocks:
            return math.nan
        return possible.middle_probability(self.moments, self.covariance, axis)


def relative_covariance(values: np.ndarray, fractions: np.ndarray | float) -> np.ndarray:
    """Return the covariance of independent entries with relative standard deviations.

    Raises:
        InertiaError: if a variance over- or underflows; a variance of 0 would make an uncertain entry exact.
    """
    deviations = np.abs(np.asarray(values, dtype=np.float64) * fractions)
    if not (deviations <= MAX_DEVIATION).all() or (deviations[deviations > 0] < 1 / MAX_DEVIATION).any():
        raise InertiaError("(a variance)", "is too large or too small for a double", RANGE)
    return np.diag(deviations**2)


def check_covariance(covariance: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Check that a covariance of entries is valid, with uncertainties below 100 %. Return it symmetrised."""
    size = np.abs(covariance).max(initial=0.0)
    if size > MAX_DEVIATION**2 or 0 < size < MAX_DEVIATION**-2:
        raise InertiaError("(a matrix)", "is too large or too small for doubles", RANGE)
    if (np.abs(covariance - covariance.T) > 1e-9 * size).any():
        raise InertiaError("(a matrix)", "is not symmetric", "a symmetric matrix, kg2 m4")
    covariance = (covariance + covariance.T) / 2
    min_eigenvalue = float(np.linalg.eigvalsh(covariance)[0])
    if min_eigenvalue < -1e-9 * size or (np.diag(covariance) < 0).any():
        problem = f"is not positive: it has the eigenvalue {min_eigenvalue:.4g}"
        raise InertiaError("(a matrix)", problem, "no variance below 0 in any direction")
    deviations = np.sqrt(np.diag(covariance))
    for k, moment in enumerate(np.abs(values[:3])):
        if deviations[k] >= moment:
            problem = f"makes an uncertainty of {100 * deviations[k] / moment:.4g} %, entry {k + 1}"
            raise InertiaError("(a matrix)", problem, "less than 100 % of each moment")
    return covariance
