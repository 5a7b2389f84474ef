"""Units as people write them, "30 rpm", "2 deg/s", "12 kg cm²": numbers in the unit that a parameter is stored in."""

import math
import re
from collections import Counter
from fractions import Fraction
from typing import NamedTuple

NUMBER = re.compile(r"\s*([-+−]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d{1,3})?+)(?:\s*([^\d\s.].*?)|\s+(1\s*/.*?))\s*")
_TEXT = 80  # characters; longer text is no number
_SIGNS = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻−", "0123456789--")
_FACTOR = re.compile(r"(/?)\s*([^\W\d_]+|[°%]|1(?!\d))(-?\d)?[\s·*.]*")
_NAMED = {  # name: (factor, power of pi in it, base units)
    "kg": ("1", 0, "kg"), "g": ("1/1000", 0, "kg"), "mg": ("1/1000000", 0, "kg"), "t": ("1000", 0, "kg"),
    "lb": ("45359237/100000000", 0, "kg"), "amu": ("1.66053906892e-27", 0, "kg"),
    "m": ("1", 0, "m"), "km": ("1000", 0, "m"), "cm": ("1/100", 0, "m"), "mm": ("1/1000", 0, "m"),
    "in": ("254/10000", 0, "m"), "ft": ("3048/10000", 0, "m"),
    **dict.fromkeys(("angstrom", "Å", "\u212b"), ("1e-10", 0, "m")),  # the letter, and the sign of older keyboards
    "s": ("1", 0, "s"), "ms": ("1/1000", 0, "s"), "min": ("60", 0, "s"), "h": ("3600", 0, "s"), "d": ("86400", 0, "s"),
    "day": ("86400", 0, "s"), "days": ("86400", 0, "s"),
    "rad": ("1", 0, "rad"), "mrad": ("1/1000", 0, "rad"), "turn": ("2", 1, "rad"), "turns": ("2", 1, "rad"),
    "rev": ("2", 1, "rad"), "rpm": ("1/30", 1, "rad s-1"), "Hz": ("2", 1, "rad s-1"), "mHz": ("2/1000", 1, "rad s-1"),
    "MHz": ("2000000", 1, "rad s-1"), "GHz": ("2000000000", 1, "rad s-1"),
    **dict.fromkeys(("deg", "degree", "degrees", "°"), ("1/180", 1, "rad")),
    "N": ("1", 0, "kg m s-2"), "J": ("1", 0, "kg m2 s-2"), "W": ("1", 0, "kg m2 s-3"),
    "1": ("1", 0, ""), "%": ("1/100", 0, ""),
}  # fmt: skip
_COMMON = (
    "kg m2", "g m2", "kg cm2", "g cm2", "kg mm2", "g mm2", "t m2", "amu Å2", "rad s-1", "s-1", "deg s-1", "rpm",
    "turn s-1", "Hz", "deg h-1", "rad", "deg", "turn", "%", "kg", "g", "t", "lb", "m", "cm", "mm", "km", "in", "ft",
    "s", "min", "h", "d", "kg m-3", "g cm-3", "m s-1", "km h-1", "m s-2", "N", "N m",
)  # fmt: skip


class _Unit(NamedTuple):
    """A unit as factor · π^pi · product of base units to their powers."""

    factor: Fraction
    pi: int
    powers: dict[str, int]


def factor(unit: str, target: str) -> float | None:
    """Return the factor that converts a number from one unit to another; None for an unknown or another kind of unit.

    The unit is as written, "" for the target, which is UDUNITS text.
    """
    return _convert_amount(Fraction(1), unit, target)


def number(text: object, target: str) -> object:
    """Return a number from text with a unit, "30 rpm"; everything else as it is, numbers too.

    Raises:
        ValueError: for a number in an unknown or another kind of unit; the text is the unit.
    """
    match = NUMBER.fullmatch(text) if isinstance(text, str) and len(text) <= _TEXT else None
    if match is None:
        return text
    unit = match[2] or match[3]
    amount = _convert_amount(Fraction(match[1].replace("−", "-")), unit, target)
    if amount is None:
        raise ValueError(unit)
    return amount


def read_number(value: object, target: str) -> object:
    """Return `number`, and text in an unknown unit as it is: the check of the value refuses it."""
    try:
        return number(value, target)
    except ValueError:
        return value


def unit_list(target: str) -> str:
    """Return the common units that can replace a parameter's own, in words."""
    return ", ".join(dict.fromkeys([target, *(unit for unit in _COMMON if factor(unit, target) is not None)]))


def _convert_amount(amount: Fraction, unit: str, target: str) -> float | None:
    """Return an amount in another unit, None if the units do not fit; powers of π exactly."""
    is_target = not unit or unit.strip() == target  # an unknown unit may be its own target
    source, target_unit = (_parse_unit("1"),) * 2 if is_target else (_parse_unit(unit), _parse_unit(target))
    if source is None or target_unit is None:
        return None
    without = {k: n for k, n in target_unit.powers.items() if k != "rad"}
    if source.powers != target_unit.powers and (source.powers != without or source.factor != 1):
        return None  # of rad s-1, s-1 is another name; 1/min may mean radians or turns
    ratio, pi = source.factor / target_unit.factor, source.pi - target_unit.pi
    try:
        if pi == 0:
            return float(amount * ratio)
        return float(amount) * (ratio.numerator * math.pi / ratio.denominator if pi > 0 else float(ratio) / math.pi)
    except OverflowError:
        return math.inf if amount > 0 else -math.inf


def _parse_unit(text: str) -> _Unit | None:
    """Parse a unit, however it is written: "kg·m²", "kg*m^2" and "kg m2" are one, so are "rad/s" and "rad s-1"."""
    if text.strip() in ("-", ""):
        text = "1"
    text = text.strip().translate(_SIGNS).replace("**", "").replace("^", "")
    total, pi, at = Fraction(1), 0, 0
    powers: Counter[str] = Counter()
    while at < len(text):
        match = _FACTOR.match(text, at)
        if match is None or match[2] not in _NAMED:
            return None
        ratio, own_pi, base = _NAMED[match[2]]
        power = int(match[3] or 1) * (-1 if match[1] else 1)
        total, pi, at = total * Fraction(ratio) ** power, pi + own_pi * power, match.end()
        for each in base.split():
            name = each.rstrip("-0123456789")
            powers[name] += power * int(each.removeprefix(name) or 1)
    return _Unit(total, pi, {name: n for name, n in powers.items() if n})
