"""Units in the header of a table: how a column's numbers become those of its parameter."""

import math
import re

_ALIKE = {
    "kg m2": {"kg m2": 1.0, "g m2": 1e-3, "kg cm2": 1e-4, "g cm2": 1e-7, "kg mm2": 1e-6, "g mm2": 1e-9, "t m2": 1e3},
    "rad s-1": {
        "rad s-1": 1.0,
        "s-1": 1.0,
        "deg s-1": math.pi / 180,
        "rpm": math.pi / 30,
        "Hz": 2 * math.pi,
        "deg h-1": math.pi / 648_000,
        "rad h-1": 1 / 3600,
    },
    "rad": {"rad": 1.0, "deg": math.pi / 180, "°": math.pi / 180},
    "degree": {"degree": 1.0, "deg": 1.0, "°": 1.0, "rad": 180 / math.pi},
    "1": {"1": 1.0, "-": 1.0, "%": 0.01},
}


def factor(unit: str, wanted: str) -> float | None:
    """Return the factor of a number in a unit; None for an unknown unit.

    Args:
        unit: as written; "" for the wanted one.
        wanted: UDUNITS text of the parameter's own unit.
    """
    if not unit or _plain(unit) == _plain(wanted):
        return 1.0
    return next((f for name, f in _ALIKE.get(wanted, {}).items() if _plain(name) == _plain(unit)), None)


def allowed(wanted: str) -> str:
    """Return the units that stand for a parameter's own, in words."""
    return ", ".join(_ALIKE.get(wanted, {wanted: 1.0}))


def _plain(unit: str) -> str:
    """A unit without the ways of writing it: "kg·m²", "kg*m^2" and "kg m2" are one, so are "rad/s" and "rad s-1"."""
    text = unit.strip().replace("²", "2").replace("⁻¹", "-1").replace("^", "").replace("**", "")
    text = re.sub(r"[·*.\s]+", " ", text).replace("degrees", "deg").replace("degree", "deg")
    return re.sub(r"\s*/\s*([a-zA-Z]+)$", r" \1-1", text)
