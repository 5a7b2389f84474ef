"""Motions of a described system, however far from an equilibrium, with errors.

The generated Taylor steps carry deviations from where the last few steps began, so that functions are worked out afresh
there and no rounding adds up in them. Each sample interval is cut into steps of equal length; they are halved until the
samples change by less than the tolerance, or by rounding alone, and what the last halving changed is the error. Where
the time stands in the equations it is known to a rounding; every other solution is later by that much.
"""

import numpy as np

from kernels.runs import advance_table
from sweeps.mechanics.taylor import Code

SEGMENT = 32  # steps from one place
LEAST, MOST = 2, 1 << 14  # steps in an interval
ROUNDING = 4.0 * float(np.finfo(np.float64).eps)  # of a state's largest size, whatever the halving shows
SOON = 64  # steps from which on a motion that is not finite has left all numbers
FALLING, ROUNDED = 0.25, 1e-7  # changes below ROUNDED that a halving does not make so much smaller are rounding


def follow(code: Code, parameters, start, times, steps: int) -> np.ndarray:
    """Return the states at times, shape (runs, times, states).

    Args:
        code: of motions, not near equilibria.
        parameters: a list of arrays (runs,).
        start: states at the first time, the time left out, shape (runs, states).
        times: shape (runs, times).
        steps: in each interval.
    """
    time = len(code.graph.equations.states)  # the place of the time among the states
    x = np.insert(start, time, times[:, 0], axis=1)
    found, module = np.empty((*times.shape, code.n)), code.module()
    found[:, 0] = x
    ones = np.ones(len(x))
    for k in range(1, times.shape[1]):
        for first in range(0, steps, SEGMENT):
            table = np.ascontiguousarray(code.starts(parameters, x, [(ones, np.zeros((code.n, len(x))))])[:, 0].T)
            table[code.step_row] = (times[:, k] - times[:, k - 1]) / steps
            advance_table(module.advance, table, min(SEGMENT, steps - first))
            x = x + table[: code.n].T
        x[:, time] = times[:, k]
        found[:, k] = x
    return np.delete(found, time, axis=2)


def solved(
    code: Code, parameters, start, times, tolerance: float, least=None
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return states at times and their errors, shape (runs, times, states), and whether each run meets the tolerance.

    Args:
        code: as of :func:`follow`.
        parameters: as of :func:`follow`.
        start: as of :func:`follow`.
        times: as of :func:`follow`.
        tolerance: largest change by halving the steps, relative to the largest size of each state in the run.
        least: what that size is at least, shape (runs, states); left out, 0.
    """
    states, error = (np.full((*times.shape, start.shape[1]), np.nan) for _ in range(2))
    converged = np.zeros(len(start), dtype=bool)
    left, steps, last = np.arange(len(start)), LEAST, np.full(len(start), np.inf)
    late = np.finfo(np.float64).eps * np.abs(times).max(axis=1, keepdims=True) * code.graph.equations.timed
    with np.errstate(all="ignore"):
        coarse = follow(code, parameters, start, times, steps)
    while left.size and steps < MOST:
        steps *= 2
        chosen = [p[left] for p in parameters]
        with np.errstate(all="ignore"):
            late = -late  # 0 and one rounding in turn
            fine = follow(code, chosen, start[left], times[left] + np.maximum(late[left], 0.0), steps)
            apart = np.maximum.accumulate(np.abs(fine - coarse), axis=1)
            size = np.abs(fine).max(axis=1)
            size = size if least is None else np.maximum(size, least[left])
            change = np.where(apart[:, -1] == 0.0, 0.0, apart[:, -1] / size).max(axis=1)
        states[left], error[left] = fine, apart
        converged[left] = change <= tolerance
        rounded = (change > FALLING * last[left]) & (change < ROUNDED)
        last[left] = change
        hopeless = ~np.isfinite(change) & (steps >= SOON)
        going = ~(converged[left] | rounded | hopeless)
        left, coarse = left[going], fine[going]
    return states, error + ROUNDING * np.maximum.accumulate(np.abs(states), axis=1), converged
