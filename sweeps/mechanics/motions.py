"""Motions of a described system, however far from an equilibrium, with errors.

The generated Taylor series carry functions beside the states, and after some steps these are worked out afresh, so that
no rounding adds up in them; what rounding leaves of a state is carried on. Each step is as long as its own terms allow,
and samples within it are sums of its terms. Steps are halved until the samples change by less than the tolerance, or by
rounding alone, and four times what the last halving changed is the error. Starts are known to a rounding, and so is the
time where it stands in the equations; every other solution starts that much beside and later, for no halving shows what
the motion makes of that.
"""

import numpy as np

from kernels import paths
from sweeps.mechanics.taylor import Code

SEGMENT, MOST_SEGMENTS = 32, 1 << 14  # steps until functions are worked out afresh, and how often
SHARE = 1.0 / 16.0  # of the tolerance: the last term of the first steps
MOST_HALVINGS = 6
EPSILON = float(np.finfo(np.float64).eps)
SAFE = 4.0  # times what the last halving changed is the error: roundings add up
ROUNDING = 4.0 * EPSILON  # of a state's largest size, whatever the halving shows, and of the time
FALLING, ROUNDED = 0.25, 1e-7  # changes below ROUNDED that a halving does not make so much smaller are rounding


def follow(code: Code, parameters, start, times, tolerance: float) -> np.ndarray:
    """Return the states at times, shape (runs, times, states); NaN from where a motion ends.

    Args:
        code: of motions, not near equilibria.
        parameters: a list of arrays (runs,).
        start: states at the first time, the time left out, shape (runs, states).
        times: shape (runs, times).
        tolerance: the last term of a step, relative to the largest size of each state so far.
    """
    time = len(code.graph.equations.states)  # the place of the time among the states
    x = np.insert(start, time, times[:, 0], axis=1)
    count, expand = times.shape[1], code.module().expand
    states = np.empty((len(x), count, start.shape[1]))
    states[:, 0] = start
    low, size, step = np.zeros((len(x), code.states)), np.zeros(x.shape), np.ptp(times, axis=1) / count
    step[step == 0.0] = 1.0
    due = np.stack([np.arange(len(x)), np.ones(len(x), dtype=np.int64)])
    times = np.pad(times, ((0, 0), (0, paths.TOGETHER)), constant_values=np.inf)
    for _ in range(MOST_SEGMENTS):
        if not due.size:
            break
        table = code.table([p[due[0]] for p in parameters], x, low[:, : code.n], step)
        low[:, code.n :] = 0.0
        path = paths.Path(table, low, size, due)
        paths.follow(expand, path, times, tolerance, SEGMENT, states)
        left = due[1] < count
        x, low, size, step = table[left, : code.n], low[left], size[left], table[left, code.step_row]
        due = np.ascontiguousarray(due[:, left])
    for number, first in due.T:
        states[number, first:] = np.nan
    return states


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
    left, last = np.arange(len(start)), np.full(len(start), np.inf)
    late = ROUNDING * np.abs(times).max(axis=1, keepdims=True) * code.graph.equations.timed
    with np.errstate(all="ignore"):
        coarse = follow(code, parameters, start, times, SHARE * tolerance)
    for halving in range(1, MOST_HALVINGS + 1):
        if not left.size:
            break
        chosen = [p[left] for p in parameters]
        with np.errstate(all="ignore"):
            beside = halving % 2  # 0 and one rounding in turn
            begin, later = start[left] * (1.0 + beside * 2.0 * EPSILON), times[left] + beside * late[left]
            fine = follow(code, chosen, begin, later, SHARE * tolerance / 2.0 ** (code.order * halving))
            apart = np.maximum.accumulate(np.abs(fine - coarse), axis=1)
            size = np.abs(fine).max(axis=1)
            size = size if least is None else np.maximum(size, least[left])
            change = np.where(apart[:, -1] == 0.0, 0.0, apart[:, -1] / size).max(axis=1)
        states[left], error[left] = fine, SAFE * apart
        converged[left] = change <= tolerance
        rounded = (change > FALLING * last[left]) & (change < ROUNDED)
        last[left] = change
        hopeless = ~np.isfinite(change)
        going = ~(converged[left] | rounded | hopeless)
        left, coarse = left[going], fine[going]
    states[:, 0] = start
    return states, error + ROUNDING * np.maximum.accumulate(np.abs(states), axis=1), converged
