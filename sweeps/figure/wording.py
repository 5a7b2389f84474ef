"""Names, numbers and units as text of figures."""

import re
from collections.abc import Mapping

_SUPERSCRIPTS = str.maketrans("-−0123456789", "⁻⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def format_units(text: str) -> str:
    """Return UDUNITS text with superscripts: "rad s-1" becomes "rad s⁻¹", and "1" nothing."""
    return "" if text == "1" else re.sub(r"(?<=[A-Za-z])-?\d+", lambda m: m[0].translate(_SUPERSCRIPTS), text)


def with_unit(text: str, unit: str, form: str = " {}") -> str:
    """Return text followed by its unit, for example "spin rate (rad s⁻¹)".

    Args:
        text: a number or a name.
        unit: UDUNITS text; nothing is added for "1".
        form: format string of the addition; the unit takes the place of {}.
    """
    unit = format_units(unit)
    return text + form.format(unit) if unit else text


def axis_label(ds, name: str, symbols: Mapping = {}) -> str:
    """Return the label of a plot's axis: the meaning of a coordinate, its symbol and its unit.

    Args:
        ds: the map.
        name: of the coordinate.
        symbols: name → symbol (with `tex`) of the system's coordinates.
    """
    text = _as_formulas(ds[name].attrs.get("long_name", name).partition(";")[0])
    symbol = symbols[name].tex if name in symbols else _as_formulas(f" {name}").strip()
    if len(name) == 1:
        text = re.sub(rf"\b{name}\b", symbol.replace("\\", r"\\"), text) if symbol not in text else text
    if "$" in symbol and symbol not in text:
        text = f"{symbol} = {text}" if "/" in text else f"{text}, {symbol}"
    return with_unit(text, ds[name].attrs.get("units", "1"), "  ({})")


def format_coordinate(ds, name: str, value: float, symbols: Mapping = {}) -> str:
    """Return a coordinate of a map with one of its values: "spin rate = 2 rad s⁻¹".

    Args:
        ds: the map.
        name: of the coordinate.
        value: in the unit of the map.
        symbols: name → symbol (with `tex`) of the system's coordinates.
    """
    text = _as_formulas(f" {name}").strip().replace("_", " " if "_" in name else "_")
    text = symbols[name].tex if name in symbols else text
    return with_unit(f"{text} = {format_number(float(value), 4)}", ds[name].attrs.get("units", "1"))


def _as_formulas(text: str) -> str:
    """Return text with symbols such as I2, and a letter at its end, as mathtext."""
    text = re.sub(r"\b([A-Za-z])_?(\d)\b", r"$\1_\2$", text).replace(" - ", " − ")
    return re.sub(r"(?<= )([A-Za-z])$", r"$\1$", text)


def format_number(value: float, digits: int = 6) -> str:
    """Return a number as text: 1e-06 becomes 10⁻⁶, 0.0174799999 becomes 0.01748."""
    text = f"{value:.{digits}g}".replace("-", "−", 1) if value < 0 else f"{value:.{digits}g}"
    if "e" not in text:
        return text
    mantissa, exponent = text.split("e")
    power = "10" + str(int(exponent)).translate(_SUPERSCRIPTS)
    return power if mantissa == "1" else f"{mantissa}×{power}"


def format_count(n: int, singular: str, plural: str) -> str:
    """Return a number `n` of things with its noun, `singular` or `plural`: "1 body", "1,200 bodies"."""
    return f"{n:,} {singular if n == 1 else plural}"


def power_of_ten(exponent: int) -> str:
    """Return a power of ten as mathtext."""
    return f"$10^{{{exponent}}}$"
