"""Motions of a described system, however far from an equilibrium, with errors.

The generated Taylor series carry functions beside the states, and after some steps these are worked out afresh, so that
no rounding adds up in them; what rounding leaves of a state is carried on. Each step is as long as its own terms allow,
and samples within it are sums of its terms. Steps are halved until the samples change by less than the tolerance, or by
rounding alone. Starts are known to a rounding, and so is the time where it stands in the equations: one more solution
starts that much beside and later, for no halving shows what the motion makes of that. Four times what both change
together is the error.
"""

from itertools import pairwise

import numpy as np

from kernels import paths
from sweeps.mechanics.series import Moving

SEGMENT, MOST_SEGMENTS = 32, 1 << 14  # steps until functions are worked out afresh, and how often
SHARE = 1.0 / 16.0  # of the tolerance: the last term of the first steps
MOST_HALVINGS = 6
BETWEEN = 8  # more times at which solutions are compared
EPSILON = float(np.finfo(np.float64).eps)
SAFE = 4.0  # times what both changed is the error: roundings add up
ROUNDING = 4.0 * EPSILON  # of a state's largest size, whatever the halving shows, and of the time
STIFF_CHANGE = 0.01  # largest relative change of the states in a segment of a stiff motion; others change by about 1
STIFF_SEGMENTS = 1 << 12  # from here on, a stiff motion that cannot end within MOST_SEGMENTS at this pace is given up
MAX_ACCELERATION = 16.0  # any other motion is given up if it would have to become so many times as fast
STATUSES = ("ok", "not_converged", "non_finite", "too_many_steps", "stiff")
OK, NOT_CONVERGED, NON_FINITE, TOO_MANY_STEPS, STIFF = range(len(STATUSES))
FALLING, ROUNDED = 0.25, 1e-7  # changes below ROUNDED that a halving does not make so much smaller are rounding


def follow(code: Moving, parameters, start, times, tolerance: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the states at times, shape (runs, times, states), and the status of each run.

    States are NaN from where a motion ends. The status is TOO_MANY_STEPS, or STIFF if the steps are much shorter than
    the time in which the motion changes: the fastest rate of the equations bounds an explicit step, even if the motion
    does not contain it.

    Args:
        code: of motions, not near equilibria.
        parameters: a list of arrays (runs,).
        start: states at the first time, the time left out, shape (runs, states).
        times: shape (runs, times).
        tolerance: the last term of a step, relative to the largest size of each state so far.
    """
    x = np.column_stack([start, times[:, 0]])
    count, expand = times.shape[1], code.module().expand
    states = np.empty((*start.shape, count + paths.TOGETHER))
    states[:, :, 0] = start
    low, size, step = np.zeros((len(x), code.states)), np.zeros(x.shape), (times[:, -1] - times[:, 0]) / count
    step[step == 0.0] = 1.0
    due = np.stack([np.arange(len(x)), np.ones(len(x), dtype=np.int64)])
    status = np.full(len(x), TOO_MANY_STEPS, np.int8)
    begin, span = times[:, 0], np.ptp(times, axis=1)
    times = np.pad(times, ((0, 0), (0, paths.TOGETHER)), constant_values=np.inf)
    for segment in range(MOST_SEGMENTS):
        if not due.size:
            break
        table = code.table([p[due[0]] for p in parameters], x, low[:, : code.n], step)
        low[:, code.n :] = 0.0
        path = paths.Path(table, low, size, due)
        paths.follow(expand, path, times, tolerance, SEGMENT, states)
        is_over = due[1] == count
        status[due[0, is_over]] = OK
        if segment >= STIFF_SEGMENTS:
            change = np.abs(table[:, : code.n] - x)[:, :-1] / size[:, :-1]
            progress = (table[:, code.n - 1] - begin[due[0]]) / span[due[0]]
            is_stiff = ~is_over & (change.max(axis=1) < STIFF_CHANGE) & (progress < segment / MOST_SEGMENTS)
            status[due[0, is_stiff]] = STIFF
            is_over |= is_stiff | (progress < segment / (MAX_ACCELERATION * MOST_SEGMENTS))
        left = ~is_over
        x, low, size, step = table[left, : code.n], low[left], size[left], table[left, code.step_row]
        due = np.ascontiguousarray(due[:, left])
    states[status != OK] = np.nan
    return states[..., :count].swapaxes(1, 2), status


def solved(
    code: Moving, parameters, start, times, tolerance: float, least=None, uncertain=0.0
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return states at times and their errors, shape (runs, times, states), and the status of each run.

    Arguments are those of :func:`follow`; the tolerance is the largest change by halving the steps, relative to the
    largest size of each state in the run, which is at least `least`, shape (runs, states). Starts are uncertain by a
    quarter of an error.
    """
    times, place = _with_times_between(times)
    states, apart = (np.full((*times.shape, start.shape[1]), np.nan) for _ in range(2))
    change, last = np.full(len(start), np.inf), np.full(len(start), np.inf)
    status = np.full(len(start), OK, np.int8)
    signs = np.resize([1.0, -1.0], start.shape[1])
    beside = start * (1.0 + 2.0 * signs * EPSILON) + signs * uncertain
    late = times + ROUNDING * np.abs(times).max(axis=1, keepdims=True) * code.graph.equations.timed

    def followed(runs, begin, at, halving):
        finer = SHARE * tolerance / 2.0 ** (code.order * halving)
        found, outcome = follow(code, [p[runs] for p in parameters], begin[runs], at[runs], finer)
        status[runs] = np.maximum(status[runs], outcome)
        return found

    def largest(runs):
        size = np.abs(states[runs]).max(axis=1)
        size = size if least is None else np.maximum(size, least[runs])
        return np.where(apart[runs, -1] == 0.0, 0.0, apart[runs, -1] / size).max(axis=1)

    left = np.arange(len(start))
    with np.errstate(all="ignore"):
        coarse = followed(left, start, times, 0)
        coarse, left = coarse[status == OK], left[status == OK]
        for halving in range(1, MOST_HALVINGS + 1) if left.size else ():
            states[left] = followed(left, start, times, halving)
            apart[left] = np.maximum.accumulate(np.abs(states[left] - coarse), axis=1)
            change[left] = largest(left)
            going = (change > tolerance) & ~((change > FALLING * last) & (change < ROUNDED)) & np.isfinite(change)
            going = going[left] if halving < MOST_HALVINGS else np.zeros(left.size, bool)
            done, last = left[~going], change.copy()
            near = followed(done, beside, late, halving)
            apart[done] += np.maximum.accumulate(np.abs(near - states[done]), axis=1)
            change[done] = largest(done)
            left, coarse = left[going], states[left[going]]
            if not left.size:
                break
    states[:, 0] = start
    error = SAFE * apart + ROUNDING * np.maximum.accumulate(np.abs(states), axis=1)
    states, error = (np.take_along_axis(array, place[..., None], axis=1) for array in (states, error))
    is_finite = np.isfinite(states + error).all(axis=(1, 2))
    status = np.select([status != OK, ~is_finite, change > tolerance], [status, NON_FINITE, NOT_CONVERGED], OK)
    return states, error, status.astype(np.int8)


def solved_between_jumps(model, parameters, start, times, tolerance: float, least=None) -> tuple | None:
    """Return the same of equations that may jump in time, run by run from jump to jump; None if these are not known."""
    outcomes, smallest = [], np.abs(start) if least is None else least
    for run in range(len(start) if model.equations.switches else 0):
        given, wanted = [p[run : run + 1] for p in parameters], times[run]
        pieces = model.jumps.of_point([p[run] for p in model.with_switches(parameters)], wanted[0], wanted[-1])
        if pieces is None:
            return None
        x, error, size, status, parts = start[run], np.zeros(start.shape[1]), smallest[run], OK, []
        for (begin, end), switches in zip(pairwise(pieces[0]), pieces[1], strict=True):
            within = np.r_[begin, wanted[(wanted > begin) & (wanted <= end)], end]
            at = [*given, *switches[:, None]]
            piece = solved(model.moving, at, x[None], within[None], tolerance, size[None], error / SAFE)
            states, errors, status = piece[0][0], piece[1][0], max(status, int(piece[2][0]))
            x, error, size = states[-1], errors[-1], np.maximum(size, np.abs(states).max(axis=0))
            parts.append(np.stack([states[1:-1], errors[1:-1]]))
        begun = np.stack([start[run], np.zeros(start.shape[1])])[:, None]
        states, errors = np.concatenate([begun, *parts], axis=1)
        outcomes.append((states, errors, status))
    if not outcomes:
        return solved(model.moving, parameters, start, times, tolerance, least)
    return tuple(np.array(column) for column in zip(*outcomes, strict=True))


def _with_times_between(times):
    """Return times with BETWEEN more, evenly over each run, where solutions are compared, and the places of the given.

    At a single time two solutions that differ may agree by chance.
    """
    span = np.linspace(0.0, 1.0, BETWEEN + 2)[1:-1]
    more = np.concatenate([times, times[:, :1] + np.ptp(times, axis=1)[:, None] * span], axis=1)
    order = np.argsort(more, axis=1, kind="stable")
    return np.take_along_axis(more, order, axis=1), np.argsort(order, axis=1)[:, : times.shape[1]]
