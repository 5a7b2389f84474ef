"""A map in a few numbers: counts by flag, how far from theory, the worst of its checks and where.

One rule says which points are compared with theory: those whose status is ok, whose measured flag is theory's, and
that are not marginal (their rate is nothing but rounding). How many that are is said beside what was found. A rate
whose 0 means that there is none is compared where it is not 0; an error is held against the variable that it names.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from sweeps.maps.description import MapDescription, describe_map
from sweeps.schema.iteration import blocks
from sweeps.schema.variables import Role, of_role

if TYPE_CHECKING:
    import xarray as xr

MARGINAL, OK = "marginal", "ok"
LEAST_DECADE, MOST_DECADE, PER_DECADE = -18, 4, 10  # bins of a relative deviation
BLOCK_POINTS = 2**20


@dataclass
class Worst:
    """The largest magnitude of something over a map, and where it stands."""

    value: float = 0.0  #: the largest magnitude; 0 where nothing was compared
    at: dict[str, int] = field(default_factory=dict)  #: dimension → number along it of that point
    points: int = 0  #: how many were compared

    def take(self, sizes: np.ndarray, box: Mapping[str, slice]) -> None:
        """Add magnitudes over a box; non-finite values are left out."""
        finite = np.isfinite(sizes)
        self.points += int(finite.sum())
        if not finite.any():
            return
        place = np.unravel_index(int(np.where(finite, sizes, -1.0).argmax()), sizes.shape)
        if sizes[place] > self.value or not self.at:
            self.value = float(sizes[place])
            self.at = {dim: s.start + int(i) for (dim, s), i in zip(box.items(), place, strict=True)}


@dataclass
class Deviation:
    """A variable against its theory: how far apart, as a histogram of the decades of the relative deviation."""

    name: str  #: the variable
    reference: str  #: what it is compared with
    scale: str = ""  #: the variable over which they are apart; "" for the reference itself, where that is not zero
    #: points by the decade of |value − reference|/|scale|, `PER_DECADE` bins a decade.
    counts: np.ndarray = field(default_factory=lambda: np.zeros((MOST_DECADE - LEAST_DECADE) * PER_DECADE, np.int64))
    equal: int = 0  #: points at which the two are the same to the last bit
    within: int = 0  #: points whose deviation is inside their own error, of `judged` that have one
    judged: int = 0
    worst: Worst = field(default_factory=Worst)  #: the largest deviation, and where
    worst_at_zero: Worst = field(default_factory=Worst)  #: the same over the error, where the reference is 0 within it

    @property
    def total(self) -> int:
        """Points compared: those of the summary's rule at which both are numbers and the scale is not zero.

        A reference within its error of 0 is no scale: rounding over rounding says nothing.
        """
        return self.equal + int(self.counts.sum())

    def quantile(self, share: float) -> float:
        """Return the relative deviation that `share` of the points do not exceed, to the upper end of its bin."""
        if self.total == 0:
            return math.nan
        reached = self.equal + np.cumsum(self.counts)
        if self.equal >= share * self.total:
            return 0.0
        at = int(np.searchsorted(reached, share * self.total))
        return min(self.worst.value, 10.0 ** (LEAST_DECADE + (at + 1) / PER_DECADE))

    def take(self, sound, values, reference, error, scale, box: Mapping[str, slice]) -> None:
        """Add a box: the points to compare, measured values, theory, errors or None, and the denominators."""
        numbers = sound & np.isfinite(values) & np.isfinite(reference)
        error = np.full(values.shape, np.nan) if error is None else error
        with np.errstate(all="ignore"):
            gap = np.abs(values - reference)
            zero = numbers & (np.abs(reference) <= error) & (self.scale == "")
            comparable = numbers & (scale != 0.0) & ~zero
            deviation = np.where(comparable, gap / np.abs(scale), np.nan)
            self.worst_at_zero.take(np.where(zero, gap / error, np.nan), box)
        self.worst.take(deviation, box)
        judged = (comparable | zero) & np.isfinite(error)
        self.judged += int(np.count_nonzero(judged))
        self.within += int(np.count_nonzero(gap[judged] <= error[judged]))
        self.equal += int(np.count_nonzero(deviation == 0.0))
        deviation = deviation[deviation > 0.0]
        bins = np.floor((np.log10(deviation) - LEAST_DECADE) * PER_DECADE)
        bins = np.clip(bins, 0, self.counts.size - 1).astype(int)
        self.counts += np.bincount(bins, minlength=self.counts.size)


class Summary:
    """Gathers a map's numbers while it is read box by box."""

    def __init__(self, description: MapDescription):
        self.description = description
        self._specs, variables = description.specs, description.variables
        self._all = tuple(variables)
        self._flags = {name: variable.flags for name, variable in variables.items() if variable.flags}
        self._lead, self._status = description.leading_flag, of_role(self._specs, Role.STATUS)
        #: points: how many it has; compared: how many of them the rule compares with theory; impossible: points that
        #: cannot exist
        self.points = self.compared = self.impossible = 0
        #: flag variable → meaning → number of points
        self.counts = {name: dict.fromkeys(meanings.values(), 0) for name, meanings in self._flags.items()}
        #: of the headline (see `MapDescription.leading_flag`) and the status: (meaning, status) → number of points
        self.table: dict[tuple[str, str], int] = {}
        pairs = [(r, n) for n, spec in self._specs.items() for r in spec.references if r in variables]
        #: pair (theory's flag variable, flag variable) → table [theory's meaning, meaning] of points
        lengths = {name: len(meanings) for name, meanings in self._flags.items()}
        shapes = {(r, n): (lengths[r], lengths[n]) for r, n in pairs if r in lengths and n in lengths}
        self.confusion = {pair: np.zeros(shape, np.int64) for pair, shape in shapes.items()}
        floats = {name for name, variable in variables.items() if variable.kind == "f"}
        #: variable that should be zero → its worst magnitude
        self.checks = {
            n: Worst() for n, spec in self._specs.items() if spec.role in (Role.CHECK, Role.CERTIFICATE) and n in floats
        }
        scales = {n: spec.scale if spec.scale in floats else "" for n, spec in self._specs.items()}
        #: pair (theory's variable, variable) → how far apart
        self.deviations = {(r, n): Deviation(n, r, scales[n]) for r, n in pairs if {r, n} <= floats}

    @property
    def unlike(self) -> dict[str, int]:
        """Flag variable that has a theory → number of points where the measured flag is another than theory's."""
        return {name: self.points - self.agreed(reference, name) for reference, name in self.confusion}

    @property
    def names(self) -> list[str]:
        """The variables whose values it takes in."""
        existing = (name for name, spec in self._specs.items() if spec.role == Role.EXISTENCE)
        compared = (each for (r, n), d in self.deviations.items() for each in (r, n, self._specs[n].error, d.scale))
        wanted = {*self._flags, *self.checks, *existing, *compared}
        return [name for name in self._all if name in wanted]

    def role(self, name: str) -> Role:
        """Return the role of a variable (see `sweeps.schema.variables`)."""
        return self._specs[name].role

    def agreed(self, reference: str, name: str) -> int:
        """Return the number of points at which two flag variables have equal meanings."""
        rows, columns = (list(self._flags[which].values()) for which in (reference, name))
        table = self.confusion[reference, name]
        return sum(int(table[i, columns.index(word)]) for i, word in enumerate(rows) if word in columns)

    def add(self, box: Mapping[str, slice], values: Mapping[str, np.ndarray]) -> None:
        """Add one box: name → values over all dimensions, of length one where a variable lacks one."""
        shape = [s.stop - s.start for s in box.values()]
        whole = {name: np.broadcast_to(array, shape) for name, array in values.items()}
        self.points += math.prod(shape)
        for name, meanings in self._flags.items():
            for value, meaning in meanings.items():
                self.counts[name][meaning] += int(np.count_nonzero(whole[name] == value))
        self._tabulate(whole)
        sound = self._sound(whole, shape)
        self.compared += int(np.count_nonzero(sound))
        for name, worst in self.checks.items():
            worst.take(np.abs(whole[name]), box)
        for (reference, name), deviation in self.deviations.items():
            spec = self._specs[name]
            error = whole.get(spec.error) if reference == spec.truth else None  # of another it says nothing
            scale = whole[deviation.scale or reference]
            comparable = sound & (whole[name] != 0.0) if spec.zero_is_none else sound
            deviation.take(comparable, whole[name], whole[reference], error, scale, box)
        for name in (name for name, spec in self._specs.items() if spec.role == Role.EXISTENCE):
            self.impossible += int(np.count_nonzero(whole[name] < 0))

    def _tabulate(self, whole: Mapping[str, np.ndarray]) -> None:
        for (reference, name), table in self.confusion.items():
            for i, r in enumerate(self._flags[reference]):
                for j, m in enumerate(self._flags[name]):
                    table[i, j] += np.count_nonzero((whole[reference] == r) & (whole[name] == m))
        if not (self._lead and self._status):
            return
        for value, meaning in self._flags[self._lead].items():
            for number, word in self._flags[self._status].items():
                count = np.count_nonzero((whole[self._lead] == value) & (whole[self._status] == number))
                self.table[meaning, word] = self.table.get((meaning, word), 0) + int(count)

    def _sound(self, whole: Mapping[str, np.ndarray], shape) -> np.ndarray:
        """Return which points are compared with theory: the rule of this module."""
        sound = np.ones(shape, dtype=bool)
        if self._status:
            sound &= np.isin(whole[self._status], _values(self._flags[self._status], OK))
        for reference, name in self.confusion:
            same = np.zeros(shape, dtype=bool)
            for value, word in self._flags[name].items():
                theirs = _values(self._flags[reference], word)
                same |= (whole[name] == value) & np.isin(whole[reference], theirs)
            sound &= same & ~np.isin(whole[name], _values(self._flags[name], MARGINAL))
        return sound


def _values(meanings: Mapping[int, str], word: str) -> list[int]:
    return [value for value, meaning in meanings.items() if meaning == word]


def summarise(ds: "xr.Dataset") -> Summary:
    """Summarise a map block by block, so that it may exceed the memory."""
    summary = Summary(describe_map(ds))
    for box in blocks(summary.description.sizes, BLOCK_POINTS):
        summary.add(box, {name: read(ds, name, box) for name in summary.names})
    return summary


def read(ds: "xr.Dataset", name: str, box: Mapping[str, slice]) -> np.ndarray:
    """Return the values of a variable in one box, over all dimensions of the map."""
    variable = ds[name]
    values = variable.isel({dim: part for dim, part in box.items() if dim in variable.dims}).transpose(
        *(dim for dim in box if dim in variable.dims)
    )
    lengths = iter(values.shape)
    return values.values.reshape([next(lengths) if dim in variable.dims else 1 for dim in box])


def rule(summary: Summary) -> str:
    """Return which points are compared, in words, with their number."""
    return f"{summary.compared:,} of {summary.points:,} points (status ok, regime as predicted, not marginal)"


def share(part: int, whole: int, decimals: int = 1) -> str:
    """Return a fraction in per cent that is 0 or 100 only where it is exactly that."""
    if part in (0, whole):
        return "0 %" if part == 0 else "100 %"
    least = 10.0**-decimals
    percent = min(max(100 * part / whole, least), 100 - least)
    return f"{percent:.{decimals}f} %" if math.isfinite(percent) else ""
