"""The trace of a described system's monodromy matrix, found again by SciPy's DOP853 on the variational equations.

The equations are the description's, as SymPy writes them for NumPy, and a complex step differentiates them: nothing is
shared with the generated integrators or with theory's Jacobian. Only the base motion's states are taken from these, at
the starts of segments that are so short that no large multiplier ruins the motion.
"""

from collections.abc import Callable, Mapping
from functools import cache
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from sweeps.systems.reintegration import rates_of
from sweeps.systems.system import Reference

if TYPE_CHECKING:
    from sweeps.systems.periodic.system import Periodic

STEP = 1e-30  # of a complex step: its square is nothing beside a double
MOST_TURNS = 1000.0  # of the fastest rate in a period, rad


def reference(system: "Periodic") -> Reference:
    """Return what `verify` measures again."""
    from sweeps.mechanics.periodic import Base

    model = system.mechanism
    rates = rates_of(model.equations)

    @cache
    def trace(given, slot):
        from scipy.integrate import solve_ivp

        base, n = Base(model, [np.array([value]) for value in given], np.array([slot])), model.equations.n
        T, K, steps, M = float(base.period[0]), int(max(base.count, base.pieces)[0]), 1j * STEP * np.eye(n), np.eye(n)
        if not T * base.scale[0] < MOST_TURNS:
            return np.nan

        def both(t, y, at):
            J = np.array([rates(at, y[:n] + step, t).imag / STEP for step in steps]).T
            return np.concatenate([rates(at, y[:n], t), (J @ y[n:].reshape(n, n)).ravel()])

        begin, _, parameters = base.between_jumps(np.arange(K) / K)  # segments that end at the jumps
        parameters = np.array([np.broadcast_to(p, (K, 1))[:, 0] for p in parameters])
        for k, times in enumerate(pairwise(T * np.append(begin, 1.0))):
            y, at = [*base.nodes[0, min(k, int(base.count[0]) - 1)], *M.ravel()], (tuple(parameters[:, k]),)
            M = solve_ivp(both, times, y, "DOP853", rtol=1e-12, atol=1e-15, args=at).y[n:, -1].reshape(n, n)
        return float(np.trace(M))

    def of_point(point):
        given = tuple(float(point[name]) for name in model.names) or (0.0,)
        return trace(given, model.system.names.index(str(point["equilibrium"])))

    return compared(of_point)


def compared(trace: Callable[[Mapping], float]) -> Reference:
    """Return a reference to traces of points that SciPy finds."""

    def allowed(point, _):
        return 1e-9 * max(1.0, abs(trace(point)))

    return Reference("trace", {"SciPy DOP853": lambda point, _: trace(point)}, allowed, within_error=True)
