r"""Bounds on the slopes of functions of the time, so that steps are short enough for their pulses.

A step does not notice a pulse that is narrower than the step. So functions are enclosed in many intervals of the
period, whatever their values at the steps' phases. Products of waves are first written as sums of waves: the enclosure
of cos² + sin² is then 1, however wide the interval. In the shortest intervals the slope bounds a change as well,
:math:`|f(t) - f(m)| \le |f'|\,|t - m|`, which falls with their square if terms cancel.
"""

import numpy as np
import sympy as sp
from sympy.simplify.fu import TR8  # products of waves → sums of waves

from sweeps.mechanics.equations import MAX_EXPANDED_OPERATIONS, Equations
from sweeps.mechanics.tape import Tape

INTERVAL_NUMBERS = 64, 4096  # coarse and fine intervals of a period
MAX_COARSE_CHANGE = 0.3  # change in a coarse interval, relative to the range, beyond which fine intervals are used
MAX_FINE_CHANGE = 0.9  # change in a fine interval, relative to the range, beyond which the function may jump
CHANGE_ROUNDING = 1e-12  # changes below this, relative to the values, are rounding
HALF_WIDTH = 0.5 + 1e-9  # half width of an interval, with an allowance for rounding
MAX_TOTAL_INTERVALS = 1 << 17  # intervals of points that are enclosed together, which bounds the memory


class Steepness:
    """The functions of the time in a system's equations, over a period, at one place."""

    def __init__(self, equations: Equations):
        phase = sp.Symbol("phase", real=True)
        of_phase = {equations.system.time: phase * equations.system.given_period}
        expressions = [e.subs(of_phase) for e in [*equations.forces, *(equations.a or ())]]
        functions = _timed_functions(expressions, phase)
        self.functions = sorted(_timed_functions((_write_as_sums(e) for e in functions), phase), key=str)
        self.tape = Tape(self.functions, [phase], (*equations.parameters, *equations.states))

    def __call__(self, arguments, level: int = 0) -> np.ndarray:
        """Return the largest slope of a function by the phase, over its range, (points,); infinite if it may jump.

        `arguments` are parameters and states, one array (points,) each; `level` 0 begins with coarse intervals.
        """
        steepness, count = np.zeros(arguments[0].size), INTERVAL_NUMBERS[level]
        chunk, begin = MAX_TOTAL_INTERVALS // count, np.arange(count)[:, None] / count
        for first in range(0, steepness.size if self.functions else 0, chunk):
            values = [x[first : first + chunk] for x in arguments]
            points = values[0].size
            owner, low = np.repeat(np.arange(points), count), np.tile(begin, (points, 1))
            enclosures = self._enclose(self.tape.constants(values), owner, low, 1.0 / count, is_centred=level > 0)
            low, high = np.moveaxis(enclosures.reshape(points, count, -1, 2), 3, 0)
            full_range = high.max(axis=1) - low.min(axis=1)
            fraction = (high - low).max(axis=1) / full_range
            fraction[full_range <= CHANGE_ROUNDING * np.maximum(np.abs(low), np.abs(high)).max(axis=1)] = 0.0
            steepness[first : first + chunk] = count * fraction.max(axis=1)
        steep_points = np.flatnonzero(~(steepness <= count * (MAX_COARSE_CHANGE, MAX_FINE_CHANGE)[level]))
        steepness[steep_points] = (
            self([x[steep_points] for x in arguments], 1) if steep_points.size and level == 0 else np.inf
        )
        return steepness

    def _enclose(self, constants, owner, low, width, is_centred):
        """Enclose all functions in intervals of the phase, shape (intervals, functions, 2)."""
        values = self.tape.slopes(constants, owner, low, low + width, int(is_centred))[0]
        if is_centred:
            middle = self.tape.slopes(constants, owner, low + width / 2, low + width / 2, 0)[0][:, :, 0]
            change = np.abs(values[:, :, 1]).max(axis=-1) * width * HALF_WIDTH
            values[:, :, 0, 0] = np.fmax(values[:, :, 0, 0], middle[..., 0] - change)
            values[:, :, 0, 1] = np.fmin(values[:, :, 0, 1], middle[..., 1] + change)
        return values[:, :, 0]


def _timed_functions(expressions, phase):
    """Return the functions and powers in expressions that depend on the phase and are no plain waves."""
    candidates = set().union(*(e.atoms(sp.Function, sp.Pow) for e in expressions))
    return {e for e in candidates if e.has(phase) and not _is_plain(e, phase)}


def _write_as_sums(e):
    """Return an expression with products of waves as sums of waves, each wave once, if it is short."""
    last, e = None, e.rewrite([sp.sinh, sp.cosh], sp.exp)
    while e != last and e.count_ops() <= MAX_EXPANDED_OPERATIONS:
        last, e = e, sp.expand(TR8(sp.expand(e, power_exp=False)), power_exp=False)
    return e.replace(lambda part: part.is_Add, lambda part: sp.collect(part, [*part.atoms(sp.sin, sp.cos)]))


def _is_plain(e, phase):
    """Return True for a wave of one frequency, and for a whole power of a function that is considered itself."""
    if e.is_Pow and e.base != sp.E:
        return bool(e.exp.is_Integer and e.exp > 0)
    return e.func in (sp.sin, sp.cos) and not e.args[0].diff(phase).has(phase)
