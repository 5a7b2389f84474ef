"""What a map says in numbers: counts by flag, tables of theory against measured, the worst of each certificate."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
import xarray as xr

from sweeps.boxes import flags

CERTIFICATES = ("_error", "_drift")  # endings of the names of what should be zero
REFERENCES = ("_theory", "_exact")  # endings of the names of what a variable is compared with
MARGINAL = "marginal"  # a point whose rate is nothing but rounding, and has no relative deviation
LEAST_DECADE, MOST_DECADE, PER_DECADE = -18, 4, 10  # bins of a relative deviation


@dataclass
class Worst:
    """The largest magnitude of one certificate, and the point where it stands."""

    name: str
    value: float = 0.0
    at: dict[str, int] = field(default_factory=dict)


@dataclass
class Agreement:
    """A variable against its reference: how far apart, as a histogram of the decades of the relative deviation.

    Attributes:
        name: the variable.
        reference: what it is compared with.
        counts: points by the decade of |value/reference − 1|, `PER_DECADE` bins a decade.
        equal: points at which the two are the same to the last bit.
        within: points inside five standard errors, of `judged` that have one.
        worst: the largest deviation.
    """

    name: str
    reference: str
    counts: np.ndarray = field(default_factory=lambda: np.zeros((MOST_DECADE - LEAST_DECADE) * PER_DECADE, np.int64))
    equal: int = 0
    within: int = 0
    judged: int = 0
    worst: float = 0.0

    @property
    def total(self) -> int:
        """Points compared: both are numbers, the reference is not zero, and the point is not marginal."""
        return self.equal + int(self.counts.sum())

    def quantile(self, share: float) -> float:
        """Relative deviation that `share` of the points do not exceed, to the upper end of its bin."""
        if self.total == 0:
            return float("nan")
        reached = self.equal + np.cumsum(self.counts)
        if self.equal >= share * self.total:
            return 0.0
        at = int(np.searchsorted(reached, share * self.total))
        return min(self.worst, 10.0 ** (LEAST_DECADE + (at + 1) / PER_DECADE))


class Summary:
    """Gathers a map's numbers while it is read box by box.

    Attributes:
        points: how many there are.
        counts: flag variable → meaning → number of points.
        confusion: pair (reference, flag variable) → table [reference's meaning, meaning] of numbers of points.
        worst: certificates.
        agreements: floats against their references.
    """

    def __init__(self, ds: xr.Dataset):
        self.points = 0
        self._flags = {name: flags(variable) for name, variable in ds.data_vars.items() if flags(variable)}
        self.counts = {name: dict.fromkeys(meanings.values(), 0) for name, meanings in self._flags.items()}
        pairs = [(name + end, name) for name in ds.data_vars for end in REFERENCES if name + end in ds.data_vars]
        self.confusion = {
            (r, n): np.zeros((len(self._flags[r]), len(self._flags[n])), np.int64)
            for r, n in pairs
            if r in self._flags and n in self._flags
        }
        self._marginal = [(n, v) for _, n in self.confusion for v, word in self._flags[n].items() if word == MARGINAL]
        floats = {name for name, variable in ds.data_vars.items() if variable.dtype.kind == "f"}
        self.worst = {n: Worst(n) for n in ds.data_vars if n in floats and n.endswith(CERTIFICATES)}
        self.agreements = {(r, n): Agreement(n, r) for r, n in pairs if {r, n} <= floats}

    def add(self, box: Mapping[str, slice], values: Mapping[str, np.ndarray]) -> None:
        """Takes in one box: name → values over all dimensions, of length one where a variable has them not."""
        shape = [s.stop - s.start for s in box.values()]
        whole = {name: np.broadcast_to(array, shape) for name, array in values.items()}
        self.points += int(np.prod(shape))
        for name, meanings in self._flags.items():
            for value, meaning in meanings.items():
                self.counts[name][meaning] += int(np.count_nonzero(whole[name] == value))
        for (reference, name), table in self.confusion.items():
            table += _table(whole[reference], self._flags[reference], whole[name], self._flags[name])
        for name, worst in self.worst.items():
            _raise(worst, whole[name], box)
        clear = np.ones(shape, dtype=bool)
        for name, value in self._marginal:
            clear &= whole[name] != value
        for (reference, name), agreement in self.agreements.items():
            _compare(agreement, clear, whole[name], whole[reference], whole.get(f"{name}_stderr"))


def _table(reference, reference_flags, measured, measured_flags) -> np.ndarray:
    return np.array(
        [[np.count_nonzero((reference == r) & (measured == m)) for m in measured_flags] for r in reference_flags]
    )


def _raise(worst: Worst, values: np.ndarray, box: Mapping[str, slice]) -> None:
    size = np.abs(values)
    if not np.isfinite(size).any():
        return
    place = np.unravel_index(int(np.nanargmax(np.where(np.isinf(size), np.nan, size))), size.shape)
    if size[place] > worst.value or not worst.at:
        worst.value = float(size[place])
        worst.at = {dim: s.start + int(i) for (dim, s), i in zip(box.items(), place, strict=True)}


def _compare(agreement: Agreement, clear, values, reference, stderr) -> None:
    known = clear & np.isfinite(values) & np.isfinite(reference) & (reference != 0.0)
    values, reference = values[known], reference[known]
    gap = np.abs(values - reference)
    with np.errstate(over="ignore"):
        deviation = gap / np.abs(reference)
    if stderr is not None:
        stderr = stderr[known]
        judged = np.isfinite(stderr)
        agreement.judged += int(np.count_nonzero(judged))
        agreement.within += int(np.count_nonzero(gap[judged] <= 5.0 * stderr[judged]))
    agreement.equal += int(np.count_nonzero(deviation == 0.0))
    deviation = deviation[deviation > 0.0]
    bins = np.floor((np.log10(deviation) - LEAST_DECADE) * PER_DECADE).astype(int)
    agreement.counts += np.bincount(np.clip(bins, 0, agreement.counts.size - 1), minlength=agreement.counts.size)
    agreement.worst = max(agreement.worst, float(deviation.max(initial=0.0)))
