"""Recognition of columns: time, attitude and angular velocity by their names, and the last digits of their texts."""

import re
from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from sweeps.schema import units
from sweeps.schema.refusals import DefinitionError, cut_text, display

ANY = "(?:.*_)?"  # pattern of a name's beginning, which groups its columns
QUATERNION = "q|quat|quaternion|orientation|rotation|attitude|e"
MATRIX = "r|m|c|a|dcm|rot|rotation|matrix"
RATES = r"w|omega|ω|gyro|ang(?:ular)?_?vel(?:ocity)?|(?:body_)?(?:angular_)?rates?(?:_wrt_[a-z]+)?|angular"
NAMES = (  # role, patterns of beginning and stem of its names, components in the order of the role; the first that fits
    *(("attitude", ANY, QUATERNION, tuple(parts)) for parts in ("0123", "wxyz", "sxyz", "c123", "1234")),
    *(("attitude", ANY, MATRIX, tuple(i + j for i in parts for j in parts)) for parts in ("123", "012")),
    *(("rates", ANY, RATES, tuple(parts)) for parts in ("123", "xyz", "012", ("roll", "pitch", "yaw"))),
    ("rates", ANY, "", ("p", "q", "r")),
    *(("attitude", ANY, "", (yaw, "pitch", "roll")) for yaw in ("yaw", "heading")),
    ("attitude", ANY, "", ("psi", "theta", "phi")),
    ("time", ANY, "", ("time",)), ("time", "", "", ("t",)),
    *(("time", ANY, "", (name,)) for name in ("timestamp", "times", "elapsed", "seconds")),
    *((role, ANY, "", (name,)) for role in ("longitude", "latitude") for name in (role, role[:3])),
)  # fmt: skip
SIZES = {"time": (1,), "attitude": (3, 4, 9), "rates": (3,), "longitude": (1,), "latitude": (1,)}
ROLES = "ROLE=NAME,…, with ROLE among " + ", ".join(SIZES)
UNITS = {"time": "s", "rates": "rad s-1", "angle": "rad"}
TIME_UNIT = "(?:_(ms|min|h|s|sec|seconds))?$"  # pattern of a unit of time at the end of a name, as in time_ms
ANGLE_UNIT = re.compile(r"_((?:deg|rad)(?:rees|ians)?(?:_?s(?:ec)?)?|rpm)(?=_|$)")  # pattern of a unit in a name
SPELLINGS = ((r"sec(onds?)?\b", "s"), (r"(rad|deg)(ians|rees)?[_/ ]*(per )?s\b(?![-^])", r"\1/s"), ("radians", "rad"))
SEQUENCE = re.compile("[XYZ]{3}|[xyz]{3}")
NUMBER = re.compile(r"\s*[-+]?(\d*)\.?(\d*)(?:[eEdD]([-+]?\d{1,3}))?\s*")


@dataclass(frozen=True)
class ColumnChoice:
    """Choices where the names of a file's columns say too little; empty otherwise."""

    columns: Mapping[str, Sequence[str]] = field(default_factory=dict)  #: role (see SIZES) → names of columns
    time_unit: str = ""
    angle_unit: str = ""  #: of Euler angles
    rate_unit: str = ""
    sequence: str = ""  #: of Euler angles: three of X, Y, Z about turned axes, or of x, y, z about fixed ones
    scalar: str = ""  #: "first" or "last" of the four columns of a quaternion
    direction: str = ""  #: "body-to-space" or "space-to-body"


def find(
    headings: Sequence[tuple[str, str]], choice: ColumnChoice, texts: Collection[int]
) -> tuple[dict[str, list[int]], list[float], str]:
    """Return the columns of each role, their factors to SI units in this order, and the sequence of Euler angles.

    Args:
        headings: name and unit of each column.
        choice: see `ColumnChoice`.
        texts: numbers of columns that are not numbers.

    Raises:
        DefinitionError: for a file without time, or with neither attitude nor angular velocity.
    """
    counts = Counter(name for name, _ in headings)
    is_indexed = [counts[name] > 1 and unit.isdigit() for name, unit in headings]  # q[0], q[1], …
    headings = [(n + unit, "") if index else (n, unit) for (n, unit), index in zip(headings, is_indexed, strict=True)]
    names = {k: name.lstrip("# ") for k, (name, _) in enumerate(headings) if k not in texts}
    found = {role: _columns_by_option(role, wanted, names) for role, wanted in choice.columns.items()}
    _columns_by_names(found, names)
    if "time" not in found:
        raise DefinitionError(f"columns: there is no time; allowed: a column `time`, or --columns {ROLES}")
    if not {"attitude", "rates"} & found.keys():
        allowed = f"columns q0 … q3, w1 … w3 and the like, or --columns {ROLES}"
        raise DefinitionError(f"columns: there is neither attitude nor angular velocity; allowed: {allowed}")
    if len({"longitude", "latitude"} & found.keys()) == 1:
        found = {role: places for role, places in found.items() if role in ("time", "attitude", "rates")}
    attitude, sequence = found.get("attitude", []), ""
    if len(attitude) == 4:
        found["attitude"] = _scalar_first(attitude, names, choice)
    elif len(attitude) == 3:
        found["attitude"], sequence = _angles(attitude, names, choice)
    is_plain = {"attitude": not sequence}  # quaternions and matrices have no unit
    return (
        found,
        [1.0 if is_plain.get(role) else _factor(role, *headings[k], choice) for role in found for k in found[role]],
        sequence,
    )


def _columns_by_option(role: str, option_names: Sequence[str], names: Mapping[int, str]) -> list[int]:
    """Return the columns that the user gives for a role."""
    if role not in SIZES or len(option_names) not in SIZES[role]:
        raise DefinitionError(f"columns: {display(f'{role}=' + ','.join(option_names))}; allowed: {ROLES}")
    numbers = {name: k for k, name in names.items()}
    for name in option_names:
        if (count := list(names.values()).count(name)) != 1:
            reason = "is the name of two columns" if count else "is no column of numbers"
            raise DefinitionError(f"columns: {display(name)} {reason}; allowed: {cut_text(', '.join(numbers), 200)}")
    return [numbers[name] for name in option_names]


def _plain(name: str) -> str:
    """Return a name in lower case, its words joined by _."""
    return re.sub(r"\W+", "_", re.sub(r"([a-z0-9])([A-Z])", r"\1_\2", name).lower()).strip("_")


def _columns_by_names(found: dict[str, list[int]], names: Mapping[int, str]) -> None:
    """Add to the columns of each role those with its names; refuse two such groups, or a part of one.

    Columns are of one group if their names differ only in the component; of several groups those with the shortest
    names are taken.
    """
    plain_names = {k: ANGLE_UNIT.sub("", _plain(name)) for k, name in names.items()}
    parts = []
    for role, beginning, stems, components in NAMES:
        if role in found:
            continue
        pattern = re.compile(f"({beginning})({stems})_?({'|'.join(components)}){TIME_UNIT}")
        unused = plain_names.keys() - {k for places in found.values() for k in places}
        groups: dict[tuple[str, str], list[tuple[int, int]]] = {}
        for k in sorted(unused):
            if match := pattern.fullmatch(plain_names[k]):
                groups.setdefault((match[1], match[2]), []).append((components.index(match[3]), k))
        whole = {key: group for key, group in groups.items() if len({i for i, _ in group}) == len(components)}
        shortest = min((len(begin) for begin, _ in whole), default=0)
        columns = [k for (begin, _), group in whole.items() if len(begin) == shortest for _, k in sorted(group)]
        if len(columns) > len(components):
            several = cut_text(", ".join(names[k] for k in columns))
            raise DefinitionError(f"columns: {several} may each be the {role}; allowed: --columns {ROLES}")
        if columns:
            found[role] = columns
        for (_, stem), group in groups.items():
            if 2 * len(group) >= len(components) or stem in ("q", "w", "omega"):
                parts.append((role, [k for _, k in group], len(components)))
    used = {k for places in found.values() for k in places}
    for role, columns, size in parts:
        if role not in found and not used.intersection(columns):
            reason = f"{cut_text(', '.join(names[k] for k in columns))}: {len(columns)} of {size} columns of the {role}"
            raise DefinitionError(f"columns: {reason}; allowed: all of them, or --columns {ROLES}")


def _scalar_first(places: list[int], names: Mapping[int, str], choice: ColumnChoice) -> list[int]:
    """Return the four columns of a quaternion, the scalar first."""
    if names[places[3]].endswith("4") and not choice.scalar and "attitude" not in choice.columns:
        problem = f"{', '.join(names[k] for k in places)} do not tell which is the scalar"
        raise DefinitionError(f"columns: {problem}; allowed: --scalar first, --scalar last")
    is_last = choice.scalar == "last" and ("attitude" in choice.columns or names[places[0]][-1].isdigit())
    return places[3:] + places[:3] if is_last else places


def _angles(places: list[int], names: Mapping[int, str], choice: ColumnChoice) -> tuple[list[int], str]:
    """Return the columns of Euler angles in the order of their sequence, and the sequence."""
    is_roll = ANGLE_UNIT.sub("", _plain(names[places[2]])).endswith("roll")
    sequence = choice.sequence or ("ZYX" if is_roll else "")
    if not SEQUENCE.fullmatch(sequence):
        problem = display(sequence) if sequence else "of the Euler angles is missing"
        allowed = "--sequence with three of X, Y, Z (about turned axes) or of x, y, z (about fixed axes), e.g. ZYX"
        raise DefinitionError(f"sequence: {problem}; allowed: {allowed}")
    if "attitude" in choice.columns:
        return places, sequence
    if len(set(sequence)) < 3:
        problem = f"{sequence} turns twice about one axis, and names do not tell the order"
        raise DefinitionError(f"sequence: {problem}; allowed: --columns attitude=FIRST,SECOND,THIRD")
    by_axis = dict(zip("ZYX", places, strict=True))  # yaw, pitch, roll
    return [by_axis[letter] for letter in sequence.upper()], sequence


def _factor(role: str, name: str, unit: str, choice: ColumnChoice) -> float:
    """Return the factor of a column to SI units, from an option, its heading or its name."""
    option = {"time": choice.time_unit, "rates": choice.rate_unit, "attitude": choice.angle_unit}.get(role, "")
    match = re.search(TIME_UNIT, _plain(name)) if role == "time" else ANGLE_UNIT.search(_plain(name))
    text = option or unit or (match[1] if match else "") or ""
    unit_text = text.partition(" since ")[0]
    for pattern, plain_unit in SPELLINGS:
        unit_text = re.sub(pattern, plain_unit, unit_text)
    target = UNITS.get(role, UNITS["angle"])
    factor = units.factor(unit_text, target)
    if factor is None:
        allowed = units.unit_list(target)
        raise DefinitionError(f"columns: {display(name)} has the unit {display(text)}; allowed: {allowed}")
    return factor


def units_of_last_digits(rows: Sequence[Sequence[str]], places: Sequence[int]) -> np.ndarray:
    """Return a unit of the last digit of the entry with the most digits in each column; NaN for binary files.

    Digits are counted from the first that is not 0; among entries with as many, the largest unit counts. A column whose
    entries are all equal (0.0) is printed like the remaining columns: it has the finest unit of all.
    """
    columns = [{row[place] for row in rows if place < len(row)} for place in places]
    is_constant = np.array([len(texts) == 1 for texts in columns])
    digit_units = np.full(len(places), np.nan)
    for i, texts in enumerate(columns):
        matches = [match for match in map(NUMBER.fullmatch, texts) if match]
        entries = [(len((m[1] + m[2]).lstrip("0")), 10.0 ** (int(m[3] or 0) - len(m[2]))) for m in matches]
        digit_units[i] = max(entries, default=(0, np.nan))[1]
    finest = np.fmin.reduce(digit_units[~is_constant], initial=np.nan)
    digit_units[is_constant] = np.fmin(digit_units[is_constant], finest)
    return digit_units
