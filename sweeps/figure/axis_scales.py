"""Linear and logarithmic axes: their choice by the values, edges of cells, and ticks."""

import numpy as np
from matplotlib.ticker import LogLocator, MaxNLocator, NullFormatter

from sweeps.figure.wording import format_number, power_of_ten


def is_logarithmic(values) -> bool:
    """Return True if values are more evenly spaced by ratio than by difference, over a factor of ten or more."""
    values = np.sort(np.asarray(values, float))
    if values.size < 3 or values[0] <= 0 or values[-1] < 10 * values[0]:
        return False
    steps = np.diff(values) / np.ptp(values), np.diff(np.log(values)) / np.log(values[-1] / values[0])
    return bool(np.std(steps[1]) < np.std(steps[0]))


def set_scale(axis, values) -> None:
    """Set a logarithmic scale of an axis if its values are spaced by ratio."""
    if is_logarithmic(values):
        getattr(axis.axes, f"set_{axis.axis_name}scale")("log")
        set_plain_log_ticks(axis)


def cell_edges(values) -> np.ndarray:
    """Return cell edges halfway between ascending values (by ratio if these are logarithmic), shape (n + 1,)."""
    values = np.asarray(values, float)
    if values.size == 1:
        return values[0] * np.array([0.95, 1.05])
    by_ratio = is_logarithmic(values)
    values = np.log(values) if by_ratio else values
    inner = values[:-1] + 0.5 * np.diff(values)
    first, last = values[0] - 0.5 * (values[1] - values[0]), values[-1] + 0.5 * (values[-1] - values[-2])
    edges = np.concatenate([[first], inner, [last]])
    return np.exp(edges) if by_ratio else edges


def set_plain_log_ticks(axis) -> None:
    """Set ticks at 1, 2 and 5 in plain numbers on a logarithmic axis of under two decades, else at powers of ten."""
    low, high = axis.get_view_interval()
    if high < 100 * low:
        axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)) if high > 10 * low else MaxNLocator(5))
        axis.set_major_formatter(lambda value, _: format_number(value, 3))
    axis.set_minor_formatter(NullFormatter())


def set_log_ticks_above_zero(axis, zero: float, exponents) -> None:
    """Set ticks at powers of ten on a logarithmic axis, and a tick 0 at the place at which zeros are drawn.

    Args:
        axis: of Matplotlib.
        zero: the place of values of 0, a positive number below the powers.
        exponents: of the powers of ten.
    """
    axis.set_ticks([zero, *(10.0**n for n in exponents)], ["0", *map(power_of_ten, exponents)])
    axis.axes.minorticks_off()
