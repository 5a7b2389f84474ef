"""Numbers as people say them: durations, moments and axes."""

import math
from collections.abc import Iterator

from sweeps.systems.bodies.inertia import Principal

HOUR, DAY = 3600.0, 86_400.0
YEAR = 365.25 * DAY


def duration(seconds: float) -> str:
    """Return a time span in a suitable unit: "0.853 s", "7.29 hours", "303.7 days", "never"."""
    if math.isinf(seconds):
        return "never"
    if seconds < 2 * HOUR:
        return f"{seconds:.4g} s"
    if seconds < 2 * DAY:
        return f"{seconds / HOUR:.4g} hours"
    days = seconds / DAY
    text = f"{days:,.0f} days" if 1000 <= days < 1e7 else f"{days:.4g} days"
    return text if days < 1000 else f"{text} ({seconds / YEAR:.4g} years)"


def axis_in_words(row: tuple[float, float, float]) -> str:
    """Return a direction: "x", "−z" along a coordinate axis, else its three components."""
    for value, name in zip(row, "xyz", strict=True):
        if abs(value) > 1 - 1e-12:
            return name if value > 0 else f"−{name}"
    return "(" + ", ".join(f"{value:.6f}".replace("-", "−") for value in row) + ")"


def principal_axes(principal: Principal) -> Iterator[str]:
    """Yield a line for each principal moment and its axis, and for each note."""
    for number, (moment, row) in enumerate(zip(principal.moments, principal.axes, strict=True), 1):
        yield f"I{number} = {moment:.6g} kg m²  about {axis_in_words(row)}"
    for note in principal.notes:
        yield f"note: {note}"
