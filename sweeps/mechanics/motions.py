"""Motions of a described system, however far from an equilibrium, with errors.

The generated Taylor steps carry deviations from where the last few steps began, so that functions are worked out afresh
there and no rounding adds up in them. Each step is as long as its own terms allow, and samples within it are sums of
its terms. Steps are halved until the samples change by less than the tolerance, or by rounding alone, and four times
what the last halving changed is the error. Starts are known to a rounding, and so is the time where it stands in the
equations; every other solution starts that much beside and later, for no halving shows what the motion makes of that.
"""

import numpy as np

from kernels import paths
from sweeps.mechanics.taylor import Code

SEGMENT, MOST_SEGMENTS = 32, 1 << 14  # steps from one place, and how often
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
    found, module = np.full((*times.shape, start.shape[1]), np.nan), code.module()
    found[:, 0] = start
    size, span = np.zeros((code.n, len(x))), np.ptp(times, axis=1) / times.shape[1]  # the first step is a guess
    span[span == 0.0] = 1.0
    number, due, times = np.arange(len(x)), np.ones(len(x), dtype=np.int64), np.ascontiguousarray(times)
    rest = np.zeros(len(x))  # of the time, below its rounding
    for _ in range(MOST_SEGMENTS):
        if not number.size:
            break
        still = np.zeros((code.n, len(x)))
        still[time] = rest
        rows = code.starts([p[number] for p in parameters], x, [(np.ones(len(x)), still)])[:, 0]
        clock, place, table = np.stack([x[:, time], rest, span]), *map(np.ascontiguousarray, (x.T, rows.T))
        path = paths.Path(table, place, size, clock, np.stack([number, due]), code.step_row, code.order)
        paths.follow(module.advance, path, times, tolerance, SEGMENT, found)
        left = path.due[1] < times.shape[1]
        x, size, (since, gone, span) = (
            (x + table[: code.n].T)[left],
            np.ascontiguousarray(size[:, left]),
            clock[:, left],
        )
        x[:, time] = since + gone
        rest = gone - (x[:, time] - since)
        number, due = path.due[:, left]
    return found


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
