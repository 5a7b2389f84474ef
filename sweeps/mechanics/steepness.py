r"""How steep functions of the time are: steps meet no pulse that is narrower than they are, and know nothing of it.

So functions are enclosed in many intervals of the period, whatever their values at any phases. Products of waves are
written as sums of waves first: of cos² + sin² the enclosure is 1, however wide the interval. In the shortest intervals
the slope bounds a change as well, :math:`|f(t) - f(m)| \le |f'|\,|t - m|`, which falls with their square where terms
cancel.
"""

import numpy as np
import sympy as sp
from sympy.simplify.fu import TR8  # products of waves → sums of waves

from sweeps.mechanics.equations import SHORT, Equations
from sweeps.mechanics.tape import Tape

INTERVALS = 64, 4096  # of a period; the second where a function changes by more than a SHARE of its range in the first
SHARE, MOST = 0.3, 0.9  # of the range: by more than MOST in the shortest interval, and it may jump there
ROUNDING = 1e-12  # of the values: no change
HALF_WIDTH = 0.5 + 1e-9  # half width of an interval, with an allowance for rounding
TOGETHER = 1 << 17  # intervals


class Steepness:
    """The functions of the time in some equations, over a period: of parameters and states at one place."""

    def __init__(self, equations: Equations):
        phase = sp.Symbol("phase", real=True)
        timed = {equations.system.time: phase * equations.system.given_period}
        expressions = [e.subs(timed) for e in [*equations.forces, *(equations.a or ())]]
        parts = _parts_of(expressions, phase)
        self.parts = sorted(_parts_of((_as_sums(e) for e in parts), phase), key=str)
        self.tape = Tape(self.parts, [phase], (*equations.parameters, *equations.states))

    def __call__(self, arguments, level: int = 0) -> np.ndarray:
        """Return the largest slope by the phase over the range of a function, at points; infinite where one may jump.

        There is one array (points,) for each argument.
        """
        steepness, count = np.zeros(arguments[0].size), INTERVALS[level]
        size, begin = TOGETHER // count, np.arange(count)[:, None] / count
        for first in range(0, steepness.size if self.parts else 0, size):
            some = [x[first : first + size] for x in arguments]
            owner = np.repeat(np.arange(some[0].size), count)
            low = np.tile(begin, (some[0].size, 1))
            values = self._enclosed(self.tape.constants(some), owner, low, 1.0 / count, is_centred=level > 0)
            low, high = np.moveaxis(values.reshape(some[0].size, count, -1, 2), 3, 0)
            whole = high.max(axis=1) - low.min(axis=1)
            share = (high - low).max(axis=1) / whole
            share[whole <= ROUNDING * np.maximum(np.abs(low), np.abs(high)).max(axis=1)] = 0.0
            steepness[first : first + size] = count * share.max(axis=1)
        steep = np.flatnonzero(~(steepness <= count * (SHARE, MOST)[level]))
        steepness[steep] = self([x[steep] for x in arguments], 1) if steep.size and level == 0 else np.inf
        return steepness

    def _enclosed(self, constants, owner, low, width, is_centred):
        """Enclose all functions in intervals of the phase, shape (intervals, functions, 2)."""
        values = self.tape.slopes(constants, owner, low, low + width, int(is_centred))[0]
        if is_centred:
            middle = self.tape.slopes(constants, owner, low + width / 2, low + width / 2, 0)[0][:, :, 0]
            change = np.abs(values[:, :, 1]).max(axis=-1) * width * HALF_WIDTH
            values[:, :, 0, 0] = np.fmax(values[:, :, 0, 0], middle[..., 0] - change)
            values[:, :, 0, 1] = np.fmin(values[:, :, 0, 1], middle[..., 1] + change)
        return values[:, :, 0]


def _parts_of(expressions, phase):
    """Return the functions and powers in expressions that depend on the phase and are no plain waves."""
    parts = set().union(*(e.atoms(sp.Function, sp.Pow) for e in expressions))
    return {e for e in parts if e.has(phase) and not _is_plain(e, phase)}


def _as_sums(e):
    """Return an expression with products of waves as sums of waves, each wave once, if it is short."""
    last, e = None, e.rewrite([sp.sinh, sp.cosh], sp.exp)
    while e != last and e.count_ops() <= SHORT:
        last, e = e, sp.expand(TR8(sp.expand(e, power_exp=False)), power_exp=False)
    return e.replace(lambda part: part.is_Add, lambda part: sp.collect(part, [*part.atoms(sp.sin, sp.cos)]))


def _is_plain(e, phase):
    """Return True for a wave of one frequency, and for a whole power of what is looked at by itself."""
    if e.is_Pow and e.base != sp.E:
        return bool(e.exp.is_Integer and e.exp > 0)
    return e.func in (sp.sin, sp.cos) and not e.args[0].diff(phase).has(phase)
