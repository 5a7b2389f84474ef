"""Summary of a map: counts by flag, deviations from theory, and the largest value of each check with its point.

Points are compared with theory if their status is ok, their measured flag is that of theory, and they are not marginal
(a rate that is rounding only). The number of compared points is reported. Rates that are 0 because none was measured
are excluded; an error is compared with the deviation from the variable that it names.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from sweeps.maps.description import MapDescription
from sweeps.schema.datasets import along, flags
from sweeps.schema.iteration import blocks
from sweeps.schema.variables import Role, of_role

if TYPE_CHECKING:
    import xarray as xr

MARGINAL, OK = "marginal", "ok"
MIN_DECADE, MAX_DECADE, BINS_PER_DECADE = -18, 4, 10  # range and resolution of histograms of relative deviations
BLOCK_POINTS = 2**20


@dataclass
class Worst:
    """The largest magnitude of a quantity over a map, and its point."""

    value: float = 0.0  #: the largest magnitude; 0 if nothing was compared
    at: dict[str, int] = field(default_factory=dict)  #: dimension → index of that point
    points: int = 0  #: number of compared points

    def add(self, magnitudes: np.ndarray, box: Mapping[str, slice]) -> None:
        """Add magnitudes over a box; non-finite values are ignored."""
        finite = np.isfinite(magnitudes)
        self.points += int(finite.sum())
        if not finite.any():
            return
        index = np.unravel_index(int(np.where(finite, magnitudes, -1.0).argmax()), magnitudes.shape)
        if magnitudes[index] > self.value or not self.at:
            self.value = float(magnitudes[index])
            self.at = {dim: extent.start + int(i) for (dim, extent), i in zip(box.items(), index, strict=True)}


@dataclass
class Deviation:
    """The deviation of a variable from its theory, as a histogram of the logarithm of the relative deviation."""

    name: str  #: the variable
    reference: str  #: theory's variable
    scale: str = ""  #: the variable by which the difference is divided; "" for the reference, if it is not zero
    #: points by the decade of |value − reference|/|scale|, `PER_DECADE` bins a decade.
    counts: np.ndarray = field(default_factory=lambda: np.zeros((MAX_DECADE - MIN_DECADE) * BINS_PER_DECADE, np.int64))
    equal: int = 0  #: number of points at which both have the same bits
    num_within: int = 0  #: number of points with a deviation within their own error, among `num_with_error`
    num_with_error: int = 0
    worst: Worst = field(default_factory=Worst)  #: the largest relative deviation
    worst_at_zero: Worst = field(
        default_factory=Worst
    )  #: the largest |difference|/error if the reference is 0 within it

    @property
    def total(self) -> int:
        """Return the number of compared points: those of the module's rule with two numbers and a scale that is not 0.

        A reference within its error of 0 is not used as a scale, since the ratio would be that of two roundings.
        """
        return self.equal + int(self.counts.sum())

    def quantile(self, fraction: float) -> float:
        """Return the upper end of the bin of the relative deviation that a fraction of the points do not exceed."""
        if self.total == 0:
            return math.nan
        cumulative = self.equal + np.cumsum(self.counts)
        if self.equal >= fraction * self.total:
            return 0.0
        bin_index = int(np.searchsorted(cumulative, fraction * self.total))
        return min(self.worst.value, 10.0 ** (MIN_DECADE + (bin_index + 1) / BINS_PER_DECADE))

    def add(self, comparable, values, reference, error, scale, box: Mapping[str, slice]) -> None:
        """Add the values of a box, arrays of one shape.

        Args:
            comparable: True for points to compare.
            values: measured.
            reference: theory.
            error: of the values; None if there is none.
            scale: denominators of the relative deviation.
            box: dimension → slice.
        """
        numbers = comparable & np.isfinite(values) & np.isfinite(reference)
        error = np.full(values.shape, np.nan) if error is None else error
        with np.errstate(all="ignore"):
            difference = np.abs(values - reference)
            is_zero = numbers & (np.abs(reference) <= error) & (self.scale == "")
            is_comparable = numbers & (scale != 0.0) & ~is_zero
            relative = np.where(is_comparable, difference / np.abs(scale), np.nan)
            self.worst_at_zero.add(np.where(is_zero, difference / error, np.nan), box)
        self.worst.add(relative, box)
        has_error = (is_comparable | is_zero) & np.isfinite(error)
        self.num_with_error += int(np.count_nonzero(has_error))
        self.num_within += int(np.count_nonzero(difference[has_error] <= error[has_error]))
        self.equal += int(np.count_nonzero(relative == 0.0))
        relative = relative[relative > 0.0]
        bins = np.floor((np.log10(relative) - MIN_DECADE) * BINS_PER_DECADE)
        bins = np.clip(bins, 0, self.counts.size - 1).astype(int)
        self.counts += np.bincount(bins, minlength=self.counts.size)


class Summary:
    """Counts, deviations and extreme values of a map, which is added box by box."""

    def __init__(self, description: MapDescription):
        self.description = description
        self._specs, variables = description.specs, description.variables
        self._flags = {name: meanings for name, variable in variables.items() if (meanings := flags(variable))}
        self._headline, self._status = description.leading_flag, of_role(self._specs, Role.STATUS)
        #: number of points; of points that are compared with theory; of points of bodies that
        #: are physically impossible
        self.points = self.compared = self.impossible = 0
        #: flag variable → meaning → number of points
        self.counts = {name: dict.fromkeys(meanings.values(), 0) for name, meanings in self._flags.items()}
        #: of the headline (see `MapDescription.leading_flag`) and the status: (meaning, status) → number of points
        self.table: dict[tuple[str, str], int] = {}
        pairs = [(i_value, n) for n, spec in self._specs.items() for i_value in spec.references if i_value in variables]
        #: pair (theory's flag variable, flag variable) → table [theory's meaning, meaning] of points
        lengths = {name: len(meanings) for name, meanings in self._flags.items()}
        shapes = {
            (i_value, n): (lengths[i_value], lengths[n]) for i_value, n in pairs if i_value in lengths and n in lengths
        }
        self.confusion = {pair: np.zeros(shape, np.int64) for pair, shape in shapes.items()}
        floats = {name for name, variable in variables.items() if variable.dtype.kind == "f"}
        #: variable that should be zero → its worst magnitude
        self.checks = {
            n: Worst() for n, spec in self._specs.items() if spec.role in (Role.CHECK, Role.CERTIFICATE) and n in floats
        }
        scales = {n: spec.scale if spec.scale in floats else "" for n, spec in self._specs.items()}
        #: pair (theory's variable, variable) → how far apart
        self.deviations = {
            (i_value, n): Deviation(n, i_value, scales[n]) for i_value, n in pairs if {i_value, n} <= floats
        }

    @property
    def disagreements(self) -> dict[str, int]:
        """Return flag variable that has a theory → number of points at which it differs from that of theory."""
        return {name: self.points - self.num_equal(reference, name) for reference, name in self.confusion}

    @property
    def names(self) -> list[str]:
        """Return the names of the variables that `add` needs, in the map's order."""
        existence = (name for name, spec in self._specs.items() if spec.role == Role.EXISTENCE)
        compared = (
            variable
            for (reference, name), d in self.deviations.items()
            for variable in (reference, name, self._specs[name].error, d.scale)
        )
        used = {*self._flags, *self.checks, *existence, *compared}
        return [name for name in self.description.variables if name in used]

    def num_equal(self, reference: str, name: str) -> int:
        """Return the number of points at which two flag variables have equal meanings."""
        rows, columns = (list(self._flags[which].values()) for which in (reference, name))
        table = self.confusion[reference, name]
        return sum(int(table[i, columns.index(word)]) for i, word in enumerate(rows) if word in columns)

    def add(self, box: Mapping[str, slice], values: Mapping[str, np.ndarray]) -> None:
        """Add one box (dimension → slice): name → values over all dimensions, of length one if a variable lacks it."""
        shape = [s.stop - s.start for s in box.values()]
        full = {name: np.broadcast_to(array, shape) for name, array in values.items()}
        self.points += math.prod(shape)
        for name, meanings in self._flags.items():
            for value, meaning in meanings.items():
                self.counts[name][meaning] += int(np.count_nonzero(full[name] == value))
        self._count_flags(full)
        comparable = self._comparable_points(full, shape)
        self.compared += int(np.count_nonzero(comparable))
        for name, worst in self.checks.items():
            worst.add(np.abs(full[name]), box)
        for (reference, name), deviation in self.deviations.items():
            spec = self._specs[name]
            error = full.get(spec.error) if reference == spec.truth else None  # it is no error of another one
            scale = full[deviation.scale or reference]
            pair_points = comparable & (full[name] != 0.0) if spec.zero_is_none else comparable
            deviation.add(pair_points, full[name], full[reference], error, scale, box)
        for name in (name for name, spec in self._specs.items() if spec.role == Role.EXISTENCE):
            self.impossible += int(np.count_nonzero(full[name] < 0))

    def _count_flags(self, full: Mapping[str, np.ndarray]) -> None:
        """Count points by pairs of flags that are compared, and by headline and status."""
        for (reference, name), table in self.confusion.items():
            for i, i_value in enumerate(self._flags[reference]):
                for j, j_value in enumerate(self._flags[name]):
                    table[i, j] += np.count_nonzero((full[reference] == i_value) & (full[name] == j_value))
        if not (self._headline and self._status):
            return
        for value, meaning in self._flags[self._headline].items():
            for number, word in self._flags[self._status].items():
                count = np.count_nonzero((full[self._headline] == value) & (full[self._status] == number))
                self.table[meaning, word] = self.table.get((meaning, word), 0) + int(count)

    def _comparable_points(self, full: Mapping[str, np.ndarray], shape) -> np.ndarray:
        """Return True for points that are compared with theory by the rule of this module, shape `shape`."""
        comparable = np.ones(shape, dtype=bool)
        if self._status:
            comparable &= np.isin(full[self._status], _flag_values(self._flags[self._status], OK))
        for reference, name in self.confusion:
            equal = np.zeros(shape, dtype=bool)
            for value, word in self._flags[name].items():
                expected = _flag_values(self._flags[reference], word)
                equal |= (full[name] == value) & np.isin(full[reference], expected)
            comparable &= equal & ~np.isin(full[name], _flag_values(self._flags[name], MARGINAL))
        return comparable


def _flag_values(meanings: Mapping[int, str], word: str) -> list[int]:
    return [value for value, meaning in meanings.items() if meaning == word]


def summarise(ds: "xr.Dataset") -> Summary:
    """Return the summary of a map, which is read block by block, so that it may exceed the memory."""
    summary = Summary(MapDescription(ds))
    for box in blocks(summary.description.sizes, BLOCK_POINTS):
        summary.add(box, {name: read_box(ds, name, box) for name in summary.names})
    return summary


def read_box(ds: "xr.Dataset", name: str, box: Mapping[str, slice]) -> np.ndarray:
    """Return the values of a variable in one box, over all dimensions of the map.

    Args:
        ds: the map.
        name: of the variable.
        box: dimension → slice; dimensions that the variable lacks have length one in the result.
    """
    variable = ds[name]
    return along(variable.isel({dim: extent for dim, extent in box.items() if dim in variable.dims}), tuple(box))


def comparison_rule(summary: Summary) -> str:
    """Return the number of compared points and the rule that selects them, as text."""
    return f"{summary.compared:,} of {summary.points:,} points (status ok, regime as predicted, not marginal)"


def format_share(count: int, total: int, decimals: int = 1) -> str:
    """Return a fraction in per cent, which is 0 or 100 only if it is exactly that.

    Args:
        count: numerator.
        total: denominator.
        decimals: number of decimals.
    """
    if count in (0, total):
        return "0 %" if count == 0 else "100 %"
    step = 10.0**-decimals
    percent = min(max(100 * count / total, step), 100 - step)
    return f"{percent:.{decimals}f} %" if math.isfinite(percent) else ""
