"""How steep functions of the time are: steps meet no pulse that is narrower than they are, and know nothing of it.

So functions are enclosed in many intervals of the period, whatever their values at any phases.
"""

import numpy as np
import sympy as sp

from sweeps.mechanics.equations import Equations
from sweeps.mechanics.tape import Tape

INTERVALS = 64, 4096  # of a period; the second where a function changes by more than a SHARE of its range in the first
SHARE, MOST = 0.3, 0.9  # of the range: by more than MOST in the shortest interval, and it may jump there
ROUNDING = 1e-12  # of the values: no change
TOGETHER = 1 << 17  # intervals


class Steepness:
    """The functions of the time in some equations, over a period: of parameters and states at one place."""

    def __init__(self, equations: Equations):
        phase = sp.Symbol("phase", real=True)
        timed = {equations.system.time: phase * equations.system.given_period}
        expressions = [e.subs(timed) for e in [*equations.forces, *(equations.a or ())]]
        parts = set().union(*(e.atoms(sp.Function, sp.Pow) for e in expressions))
        self.parts = sorted((e for e in parts if e.has(phase) and not _is_plain(e, phase)), key=str)
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
            values = self.tape.slopes(self.tape.constants(some), owner, low, low + 1.0 / count, 0)[0]
            low, high = np.moveaxis(values.reshape(some[0].size, count, -1, 2), 3, 0)
            whole = high.max(axis=1) - low.min(axis=1)
            share = (high - low).max(axis=1) / whole
            share[whole <= ROUNDING * np.maximum(np.abs(low), np.abs(high)).max(axis=1)] = 0.0
            steepness[first : first + size] = count * share.max(axis=1)
        steep = np.flatnonzero(~(steepness <= count * (SHARE, MOST)[level]))
        steepness[steep] = self([x[steep] for x in arguments], 1) if steep.size and level == 0 else np.inf
        return steepness


def _is_plain(e, phase):
    """Return True for a wave of one frequency, and for a whole power of what is looked at by itself."""
    if e.is_Pow and e.base != sp.E:
        return bool(e.exp.is_Integer and e.exp > 0)
    return e.func in (sp.sin, sp.cos) and not e.args[0].diff(phase).has(phase)
