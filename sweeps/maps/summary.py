"""A map in a few numbers: counts by flag, how far from theory, the worst of its checks and where."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
import xarray as xr

from sweeps.boxes import blocks, dimensions, flags

CHECKS = ("_error", "_drift")  # endings of the names of what should be zero
REFERENCES = ("_theory", "_exact")  # endings of the names of what a variable is compared with
BLOCK_POINTS = 2**20


@dataclass
class Worst:
    """The largest of something over a map, and where it stands.

    Attributes:
        value: the largest magnitude; 0 where nothing was compared.
        at: dimension → coordinate of that point.
        points: how many were compared.
    """

    value: float = 0.0
    at: dict[str, float | int | str] = field(default_factory=dict)
    points: int = 0


@dataclass
class Summary:
    """A map in a few numbers.

    Attributes:
        points: how many it has.
        counts: flag variable → meaning → number of values.
        table: of the leading flag (see `leading_flag`) and the status: (meaning, status) → number of points.
        unlike: flag variable that has a theory → number of points where the measured flag differs from it.
        impossible: points of bodies that cannot exist.
        deviations: variable → worst |X/X_theory − 1| (or X_exact), of points that are ok, not marginal, and whose flags
            agree with theory's.
        checks: variable → worst magnitude of what should be zero.
    """

    points: int = 0
    counts: dict[str, dict[str, int]] = field(default_factory=dict)
    table: dict[tuple[str, str], int] = field(default_factory=dict)
    unlike: dict[str, int] = field(default_factory=dict)
    impossible: int = 0
    deviations: dict[str, Worst] = field(default_factory=dict)
    checks: dict[str, Worst] = field(default_factory=dict)


def leading_flag(ds: xr.Dataset) -> str:
    """The flag variable that says most: what was measured of the motion, else any other; "" where there is none."""
    told = [name for name in ds.data_vars if flags(ds[name]) and not name.endswith(REFERENCES)]
    return next((name for name in told if name not in ("shape", "status")), told[0] if told else "")


def summarise(ds: xr.Dataset) -> Summary:
    """Goes over a map once, a block at a time, so that a map larger than memory will do."""
    summary = Summary()
    for box in blocks(dimensions(ds), BLOCK_POINTS):
        block = ds.isel(box).load()
        summary.points += math.prod(dimensions(block).values())
        for name, variable in block.data_vars.items():
            if meanings := flags(variable):
                _count(summary.counts.setdefault(name, dict.fromkeys(meanings.values(), 0)), variable.values, meanings)
        _tabulate(summary, block)
        sound = _compare_flags(summary, block)
        _compare_numbers(summary, block, sound)
        for name in (name for name in block.data_vars if name.endswith(CHECKS)):
            _raise(summary.checks.setdefault(name, Worst()), abs(block[name]))
        if "triangle_margin" in block:
            summary.impossible += int((block["triangle_margin"] < 0).sum())
    return summary


def _count(counts: dict[str, int], values: np.ndarray, meanings: Mapping[int, str]) -> None:
    for value, meaning in meanings.items():
        counts[meaning] += int(np.count_nonzero(values == value))


def _tabulate(summary: Summary, block: xr.Dataset) -> None:
    lead = leading_flag(block)
    if not lead or "status" not in block:
        return
    for value, meaning in flags(block[lead]).items():
        chosen = block[lead] == value
        for status, word in flags(block["status"]).items():
            number = int((chosen & (block["status"] == status)).sum())
            summary.table[meaning, word] = summary.table.get((meaning, word), 0) + number


def _compare_flags(summary: Summary, block: xr.Dataset) -> xr.DataArray:
    """Points that are ok, whose flags agree with theory, and whose rate is not zero but for rounding (marginal)."""
    sound = block["status"] == 0 if "status" in block else xr.ones_like(next(iter(block.data_vars.values())), bool)
    for name in block.data_vars:
        if flags(block[name]) and f"{name}_theory" in block:
            same = _words(block[name]) == _words(block[f"{name}_theory"])
            summary.unlike[name] = summary.unlike.get(name, 0) + int((~same).sum())
            marginal = [value for value, word in flags(block[name]).items() if word == "marginal"]
            sound = sound & same & ~block[name].isin(marginal)
    return sound


def _words(variable: xr.DataArray) -> xr.DataArray:
    """Flags as numbers that mean the same in any flag variable."""
    meanings = flags(variable)
    found = np.select([variable.values == value for value in meanings], [hash(word) for word in meanings.values()])
    return variable.copy(data=found)


def _compare_numbers(summary: Summary, block: xr.Dataset, sound: xr.DataArray) -> None:
    for name in block.data_vars:
        reference = next((name + end for end in REFERENCES if name + end in block), None)
        if reference is None or block[name].dtype.kind != "f":
            continue
        true = block[reference]
        known = sound & np.isfinite(true) & np.isfinite(block[name]) & (true != 0)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            deviation = abs((block[name] - true) / true).where(known)
        _raise(summary.deviations.setdefault(name, Worst()), deviation)


def _raise(worst: Worst, sizes: xr.DataArray) -> None:
    known = np.isfinite(sizes.values)
    worst.points += int(known.sum())
    if not known.any():
        return
    place = np.unravel_index(np.where(known, sizes.values, -1.0).argmax(), sizes.shape)
    if sizes.values[place] > worst.value or not worst.at:
        worst.value = float(sizes.values[place])
        index = dict(zip(sizes.dims, place, strict=True))
        worst.at = {dim: _plain(sizes[dim].values[i]) for dim, i in index.items() if dim in sizes.coords}


def _plain(value) -> float | int | str:
    value = value.item() if hasattr(value, "item") else value
    return value if isinstance(value, int | float) else str(value)


def share(part: int, whole: int) -> str:
    """A share in per cent that is 0 or 100 only where it is exactly that."""
    if part in (0, whole):
        return "0 %" if part == 0 else "100 %"
    percent = min(max(100 * part / whole, 0.1), 99.9)
    return f"{percent:.1f} %" if math.isfinite(percent) else ""
