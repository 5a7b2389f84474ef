"""Checked values: numbers and text that refuse in words what they may not hold."""

import math
import sys
from collections.abc import Callable
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BeforeValidator

from sweeps.schema import units
from sweeps.schema.refusals import display, hint, refusal

MAX_SPIN_RATE, MIN_SPIN_RATE = 1e150, 1e-150
MAX_AMOUNT = 1e30  # bound on lengths and masses in SI units, so that products of five do not overflow


def finite(value: Any, allowed: str, unit: str = "") -> float:
    """Return `value` as a finite double, text in `unit` (UDUNITS; "" for none) too; a refusal quotes `allowed`."""
    value = convert_unit(value, unit) if unit else value
    if isinstance(value, str):
        raise refusal("is text, not a number", allowed)
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise refusal("is not a number", allowed)
    try:
        number = float(value)
    except OverflowError:
        number = math.inf
    if not math.isfinite(number):
        raise refusal("is not finite as a double", allowed)
    return number


def number(is_allowed: Callable[[float], bool], allowed: str) -> BeforeValidator:
    """Return a validator of finite numbers for which `is_allowed` is true."""

    def check(value: Any) -> float:
        """Return a finite number that is allowed; refuse every other value."""
        number = finite(value, allowed)
        if not is_allowed(number):
            raise refusal("is out of range", allowed)
        return number

    return BeforeValidator(check)


def convert_unit(value: Any, unit: str) -> Any:
    """Return text with a unit, "30 rpm", as a number in `unit` (UDUNITS text); everything else as it is."""
    try:
        return units.number(value, unit)
    except ValueError as unknown:
        raise refusal(f"has the unit {str(unknown)!r}", units.unit_list(unit)) from None


def in_unit(unit: str, item: Any) -> Any:
    """Return the type of numbers in a unit, which may also be given as text with another unit."""
    return Annotated[item, BeforeValidator(lambda value: convert_unit(value, unit), json_schema_input_type=float | str)]


def integer(minimum: int, maximum: int, allowed: str) -> BeforeValidator:
    """Return a validator of whole numbers from `minimum` to `maximum`, refusing all further numbers with `allowed`."""

    def check(value: Any) -> int:
        """Return a whole number in the range; refuse every other value."""
        if isinstance(value, bool) or not isinstance(value, int):
            raise refusal("is not a whole number", allowed)
        if not minimum <= value <= maximum:
            raise refusal("is out of range", allowed)
        return value

    return BeforeValidator(check)


def choice(options: tuple[str, ...]) -> BeforeValidator:
    """Return a validator of a word among some options."""

    def check(value: Any) -> str:
        """Return a word among the options; refuse every other value."""
        if value in options:
            return value
        raise refusal("is not available" + hint(value, options), ", ".join(options))

    return BeforeValidator(check, json_schema_input_type=Literal[options])


def printable(max_length: int, allowed: str, also: str = "") -> AfterValidator:
    """Return a validator of text of 1 to `max_length` printable characters or those of `also`; it quotes `allowed`."""

    def check(text: str) -> str:
        if not text.strip() or len(text) > max_length or not all(c.isprintable() or c in also for c in text):
            raise refusal("is empty, too long or not printable", allowed)
        return text

    return AfterValidator(check)


def line_of_text(max_length: int) -> AfterValidator:
    """Return a validator of one line of printable text."""
    return printable(max_length, f"one line of printable text, 1 to {max_length} characters")


def not_empty(values: tuple) -> tuple:
    """Return a list, refused if empty."""
    if not values:
        raise refusal("is empty", "a list of at least one value")
    return values


def all_different(values: tuple) -> tuple:
    """Return a list, refused if a value occurs twice."""
    earlier_values = set()
    for value in values:
        if value in earlier_values:
            raise refusal(f"holds {display(value)} twice", "values that all differ")
        earlier_values.add(value)
    return values


def list_of_different(item: Any, *checks: Callable) -> Any:
    """Return the type of a list of values of a type, at least one, which all differ."""
    return Annotated[(tuple[item, ...], *map(AfterValidator, (not_empty, all_different, *checks)))]


def spin_rate(name: str) -> Any:
    """Return the type of spin rates in rad s-1, of either sign and not 0; `name` is the key."""
    allowed = f"a number with 1e-150 ≤ |{name}| ≤ 1e150 in rad s-1; negative spins the other way"
    return Annotated[float, number(lambda x: MIN_SPIN_RATE <= abs(x) <= MAX_SPIN_RATE, allowed)]


def numbers(words: tuple[str, ...], unit: str, is_size: bool = False) -> BeforeValidator:
    """Return a validator of a number for each of the words, in a unit, > 0 if it is a size; one may be no list."""
    allowed = f"{len(words)} numbers{' > 0' if is_size else ''} in {unit}, up to {MAX_AMOUNT:g} ({', '.join(words)})"

    def check(value: Any) -> tuple[float, ...]:
        """Return as many amounts as there are words; refuse amounts out of range."""
        amounts = tuple(
            finite(each, allowed, unit) for each in (value if isinstance(value, tuple | list) else (value,))
        )
        is_small = all(abs(amount) <= MAX_AMOUNT for amount in amounts)
        if len(amounts) != len(words) or not is_small or (is_size and not min(amounts) > 0):
            raise refusal("is out of range", allowed)
        return amounts

    return BeforeValidator(check)


Moment = Annotated[float, number(lambda x: x >= sys.float_info.min, "a positive number, a moment in kg m2 or a ratio")]
Epsilon = Annotated[float, number(lambda x: 0 < x < 1, "a number with 0 < epsilon < 1")]
Phase = Annotated[float, number(lambda x: True, "any finite number, in rad")]
Positive = Annotated[float, number(lambda x: x > 0, "a finite number > 0")]
Amount = Annotated[float, number(lambda x: 0 < x <= MAX_AMOUNT, f"a finite number > 0, up to {MAX_AMOUNT:g}")]
Tolerance = Annotated[float, number(lambda x: 1e-13 <= x <= 1e-3, "a number from 1e-13 to 1e-3")]
TOLERANCE = "1e-13 to 1e-3: below 1e-13 rounding dominates, above 1e-3 the error hides the measured effect"
Prose = Annotated[str, AfterValidator(str.strip), printable(4000, "printable text, 1 to 4000 characters", also="\n\t")]
Axis = Annotated[int, integer(1, 3, "1, 2 or 3")]
Count = Annotated[int, integer(1, 2**53, "a whole number ≥ 1 (and ≤ 2^53)")]
