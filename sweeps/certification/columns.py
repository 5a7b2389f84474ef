"""Recognition of columns: time, attitude and angular velocity by their names, and the last digits of their texts."""

import re
from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from sweeps.schema import units
from sweeps.schema.refusals import DefinitionError, cut_text, display

ONE_TO_THREE, FROM_ZERO = tuple("123"), tuple("012")
FAMILIES = (  # role, pattern of the stem of its names, components in the order of the role
    ("quaternion", "q|quat|quaternion|orientation|rotation|attitude|e",
     tuple(map(tuple, ("0123", "wxyz", "sxyz", "c123", "1234")))),
    ("matrix", "r|m|c|a|dcm|rot|rotation|matrix",
     tuple(tuple(i + j for i in numbers for j in numbers) for numbers in (ONE_TO_THREE, FROM_ZERO))),
    ("rates", r"w|omega|ω|gyro|ang(?:ular)?_?vel(?:ocity)?|(?:body_)?(?:angular_)?rates?(?:_wrt_[a-z]+)?|angular",
     (ONE_TO_THREE, tuple("xyz"), FROM_ZERO, ("roll", "pitch", "yaw"))),
    ("rates", "", (tuple("pqr"),)),
    ("euler", "", (("yaw", "pitch", "roll"), ("heading", "pitch", "roll"), ("psi", "theta", "phi"))),
    ("time", "", (("time",), ("t",), ("timestamp",), ("times",), ("elapsed",), ("seconds",))),
    ("longitude", "", (("longitude",), ("lon",))),
    ("latitude", "", (("latitude",), ("lat",))),
)  # fmt: skip
SIZES = {"time": (1,), "attitude": (3, 4, 9), "rates": (3,), "longitude": (1,), "latitude": (1,)}
UNITS = {"time": "s", "rates": "rad s-1", "euler": "rad", "longitude": "rad", "latitude": "rad"}
IN_NAMES = {  # units within names: angle_deg_yaw, p_rad_sec, time_ms
    "time": re.compile(r"_(ms|min|h|s|sec|seconds)$"),
    "rates": re.compile(r"_((?:deg|rad)(?:rees|ians)?_?(?:s|sec)|rpm)(?=_|$)"),
    "angles": re.compile(r"_(deg|rad)(?:rees|ians)?(?=_|$)"),
}
SPELLINGS = ((r"sec(onds?)?\b", "s"), (r"(rad|deg)(ians|rees)?[_/ ]*(per )?s\b(?![-^])", r"\1/s"), ("radians", "rad"))
SEQUENCE = re.compile("[XYZ]{3}|[xyz]{3}")
NUMBER = re.compile(r"\s*[-+]?(\d*)\.?(\d*)(?:[eEdD]([-+]?\d{1,3}))?\s*")
ROLES = "ROLE=NAME,…, with ROLE among " + ", ".join(SIZES)


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


@dataclass
class FoundColumns:
    """Columns of a file by role."""

    places: dict[str, list[int]]  #: role → numbers of columns
    units: dict[int, float]  #: number of a column → factor to SI units
    sequence: str = ""  #: of Euler angles

    def factors(self, columns: Sequence[int]) -> np.ndarray:
        """Return the factors of some columns to SI units."""
        return np.array([self.units[k] for k in columns])


def find(headings: Sequence[tuple[str, str]], choice: ColumnChoice, texts: Collection[int]) -> FoundColumns:
    """Return the columns of each role; refuse a file without time, or with neither attitude nor angular velocity.

    Args:
        headings: name and unit of each column.
        choice: see `ColumnChoice`.
        texts: numbers of columns that are not numbers.
    """
    counts = Counter(name for name, _ in headings)
    is_indexed = [counts[name] > 1 and unit.isdigit() for name, unit in headings]  # q[0], q[1], …
    headings = [(n + unit, "") if index else (n, unit) for (n, unit), index in zip(headings, is_indexed, strict=True)]
    names = {k: name.lstrip("# ") for k, (name, _) in enumerate(headings) if k not in texts}
    role_columns: dict[str, list[int]] = {}
    for role, option_names in choice.columns.items():
        role_columns[role] = _columns_by_option(role, option_names, names)
    for role, stems, options in FAMILIES:
        is_attitude = role in ("quaternion", "matrix", "euler")
        goal = "attitude" if is_attitude else role
        if goal not in role_columns and (places := _match(role, stems, options, names, role_columns)):
            role_columns[goal] = places
    _check_roles(role_columns)
    attitude = role_columns.get("attitude", [])
    sequence = ""
    if len(attitude) == 4:
        role_columns["attitude"] = _scalar_first(attitude, names, choice)
    elif len(attitude) == 3:
        role_columns["attitude"], sequence = _angles(attitude, names, choice)
    factors = {}
    for role, places in role_columns.items():
        kind = role if role != "attitude" else ("euler" if sequence else "")
        factors |= {k: _factor(kind, *headings[k], choice) for k in places}
    return FoundColumns(role_columns, factors, sequence)


def _columns_by_option(role: str, option_names: Sequence[str], names: Mapping[int, str]) -> list[int]:
    """Return the columns that the user gives for a role."""
    if role not in SIZES or len(option_names) not in SIZES[role]:
        raise DefinitionError(f"columns: {display(f'{role}=' + ','.join(option_names))}; allowed: {ROLES}")
    places = [[k for k, name in names.items() if name == requested_name] for requested_name in option_names]
    for requested_name, numbers in zip(option_names, places, strict=True):
        if len(numbers) != 1:
            reason = "is the name of two columns" if numbers else "is no column of numbers"
            raise DefinitionError(f"columns: {display(requested_name)} {reason}; allowed: {_list(names)}")
    return [numbers[0] for numbers in places]


def _list(names: Mapping[int, str]) -> str:
    return cut_text(", ".join(dict.fromkeys(names.values())), 200)


def _snake_case(name: str) -> str:
    """Return a name in lower case, its words joined by _."""
    return re.sub(r"\W+", "_", re.sub(r"([a-z0-9])([A-Z])", r"\1_\2", name).lower()).strip("_")


def _plain(role: str, name: str) -> str:
    """Return a name in lower case, its words joined by _, without units."""
    name = _snake_case(name)
    unit = IN_NAMES.get(role, IN_NAMES["angles"])
    return unit.sub("", name) if role not in ("quaternion", "matrix") else name


def _match(role, stems, options, names, role_columns) -> list[int]:
    """Return the columns of a role by their names, [] if there are none; refuse two such groups, or a part of one."""
    used_columns = {k for places in role_columns.values() for k in places}
    partial = None
    for components in options:
        prefix = "" if components == ("t",) else "(?:.*_)?"
        pattern = re.compile(f"({prefix})({stems})_?({'|'.join(components)})")
        groups: dict[tuple[str, str], dict[str, list[int]]] = {}
        for k, name in names.items():
            if k not in used_columns and (match := pattern.fullmatch(_plain(role, name))):
                groups.setdefault((match[1], match[2]), {}).setdefault(match[3], []).append(k)
        complete_groups = {key: group for key, group in groups.items() if len(group) == len(components)}
        shortest = min((len(prefix) for prefix, _ in complete_groups), default=0)
        shortest_groups = [group for (prefix, _), group in complete_groups.items() if len(prefix) == shortest]
        if len(shortest_groups) > 1 or any(len(places) > 1 for group in shortest_groups for places in group.values()):
            several = ", ".join(names[k] for group in shortest_groups for places in group.values() for k in places)
            raise DefinitionError(f"columns: {cut_text(several)} may each be the {role}; allowed: --columns {ROLES}")
        if shortest_groups:
            return [shortest_groups[0][component][0] for component in components]
        for (_, stem), group in groups.items():
            if 2 * len(group) >= len(components) or stem in ("q", "w", "omega"):
                partial = partial or ([names[k] for places in group.values() for k in places], len(components))
    if partial and len(options[0]) > 1:
        reason = f"{cut_text(', '.join(partial[0]))}: {len(partial[0])} of {partial[1]} columns of the {role}"
        raise DefinitionError(f"columns: {reason}; allowed: all of them, or --columns {ROLES}")
    return []


def _check_roles(role_columns: Mapping[str, Sequence[int]]) -> None:
    """Refuse columns from which no rotation can be judged."""
    if "time" not in role_columns:
        raise DefinitionError(f"columns: there is no time; allowed: a column `time`, or --columns {ROLES}")
    if not {"attitude", "rates"} & role_columns.keys():
        allowed = f"columns q0 … q3, w1 … w3 and the like, or --columns {ROLES}"
        raise DefinitionError(f"columns: there is neither attitude nor angular velocity; allowed: {allowed}")
    if len({"longitude", "latitude"} & role_columns.keys()) == 1:
        role_columns.pop("longitude", None), role_columns.pop("latitude", None)


def _scalar_first(places: list[int], names: Mapping[int, str], choice: ColumnChoice) -> list[int]:
    """Return the four columns of a quaternion, the scalar first."""
    if names[places[3]].endswith("4") and not choice.scalar and "attitude" not in choice.columns:
        columns = ", ".join(names[k] for k in places)
        raise DefinitionError(
            f"columns: {columns} do not tell which is the scalar; allowed: --scalar first, --scalar last"
        )
    is_last = choice.scalar == "last" and ("attitude" in choice.columns or names[places[0]][-1].isdigit())
    return places[3:] + places[:3] if is_last else places


def _angles(places: list[int], names: Mapping[int, str], choice: ColumnChoice) -> tuple[list[int], str]:
    """Return the columns of Euler angles in the order of their sequence, and the sequence."""
    sequence = choice.sequence or ("ZYX" if _plain("euler", names[places[2]]).endswith("roll") else "")
    if not SEQUENCE.fullmatch(sequence):
        allowed = "--sequence with three of X, Y, Z (about turned axes) or of x, y, z (about fixed axes), e.g. ZYX"
        raise DefinitionError(
            f"sequence: {display(sequence) if sequence else 'of the Euler angles is missing'}; allowed: {allowed}"
        )
    if "attitude" in choice.columns:
        return places, sequence
    by_axis = dict(zip("ZYX", places, strict=True))  # yaw, pitch, roll
    if len(set(sequence)) < 3:
        allowed = "--columns attitude=FIRST,SECOND,THIRD"
        raise DefinitionError(
            f"sequence: {sequence} turns twice about one axis, and names do not tell the order; allowed: {allowed}"
        )
    return [by_axis[letter] for letter in sequence.upper()], sequence


def _factor(role: str, name: str, unit: str, choice: ColumnChoice) -> float:
    """Return the factor of a column to SI units, from an option, its heading or its name."""
    if role not in UNITS:
        return 1.0
    option = {"time": choice.time_unit, "rates": choice.rate_unit, "euler": choice.angle_unit}.get(role, "")
    unit_match = IN_NAMES.get(role, IN_NAMES["angles"]).search(_snake_case(name))
    text = option or unit or (unit_match[1] if unit_match else "")
    unit_text = text.partition(" since ")[0]
    for pattern, plain_unit in SPELLINGS:
        unit_text = re.sub(pattern, plain_unit, unit_text)
    factor = units.factor(unit_text, UNITS[role])
    if factor is None:
        raise DefinitionError(
            f"columns: {display(name)} has the unit {display(text)}; allowed: {units.unit_list(UNITS[role])}"
        )
    return factor


def units_of_last_digits(rows: Sequence[Sequence[str]], places: Sequence[int]) -> np.ndarray:
    """Return a unit of the last digit of the entry with the most digits in each column; NaN for binary files.

    Digits are counted from the first that is not 0; among entries with as many, the largest unit counts. A column whose
    entries are all equal (0.0) is printed like the remaining columns: it has the finest unit of all.
    """
    digit_units = np.full(len(places), np.nan)
    is_constant = np.zeros(len(places), dtype=bool)
    for i, place in enumerate(places):
        texts = {row[place] for row in rows if place < len(row)}
        is_constant[i] = len(texts) == 1
        matches = [match for match in map(NUMBER.fullmatch, texts) if match]
        entries = [(len((m[1] + m[2]).lstrip("0")), 10.0 ** (int(m[3] or 0) - len(m[2]))) for m in matches]
        digit_units[i] = max(entries, default=(0, np.nan))[1]
    if not is_constant.all() and len(rows):
        digit_units[is_constant] = np.fmin(
            digit_units[is_constant], np.nanmin(digit_units[~is_constant], initial=np.inf)
        )
    return digit_units
