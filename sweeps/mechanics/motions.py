"""Motions of a described system, however far from an equilibrium, with errors.

The generated Taylor series integrate functions together with the states; after some steps the functions are evaluated
again, so that no rounding adds up in them, and the rounding of a state is carried to the next step. Each step is as
long as its terms allow, and samples within it are sums of its terms. Steps are halved until the samples change by
less than the tolerance, or by rounding alone. The start is uncertain by a rounding, and so is the time if the
equations depend on it: one more solution starts that much off and later. The error is four times both changes.
"""

from itertools import pairwise

import numpy as np

from kernels.flow import paths
from sweeps.mechanics.series import Moving

SEGMENT_STEPS, MAX_SEGMENTS = 32, 1 << 14  # steps between evaluations of the functions, and how many segments of these
FIRST_TERM_SHARE = 1.0 / 16.0  # last term of the first steps, relative to the tolerance
MAX_HALVINGS = 6  # halvings of the steps
COMPARISON_TIMES = 8  # additional times at which two solutions are compared
EPSILON = float(np.finfo(np.float64).eps)
ERROR_FACTOR = 4.0  # the error, relative to the sum of both changes: roundings add up
STATE_ROUNDING = 4.0 * EPSILON  # smallest error of a state, relative to its largest size, and of the time
STIFF_CHANGE = 0.01  # relative change of the states in a segment of a stiff motion; of any other motion it is about 1
STIFF_SEGMENTS = 1 << 12  # segments after which a stiff motion is given up if it will not end within MAX_SEGMENTS
MAX_ACCELERATION = 16.0  # after these, any motion is given up that would have to become this many times as fast
STATUSES = ("ok", "not_converged", "non_finite", "too_many_steps", "stiff")
OK, NOT_CONVERGED, NON_FINITE, TOO_MANY_STEPS, STIFF = range(len(STATUSES))
MIN_REDUCTION, MAX_ROUNDING = 0.25, 1e-7  # changes below the latter that a halving reduces less than this are rounding


def integrate_in_steps(code: Moving, parameters, start, times, tolerance: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the states at times, shape (runs, times, states), and the status of each run.

    States are NaN after the end of a motion. The status is TOO_MANY_STEPS, or STIFF if the steps are much shorter than
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
    states = np.empty((*start.shape, count + paths.NUM_TOGETHER))
    states[:, :, 0] = start
    low, size, step = np.zeros((len(x), code.states)), np.zeros(x.shape), (times[:, -1] - times[:, 0]) / count
    step[step == 0.0] = 1.0
    due = np.stack([np.arange(len(x)), np.ones(len(x), dtype=np.int64)])
    status = np.full(len(x), TOO_MANY_STEPS, np.int8)
    begin, span = times[:, 0], np.ptp(times, axis=1)
    times = np.pad(times, ((0, 0), (0, paths.NUM_TOGETHER)), constant_values=np.inf)
    for segment in range(MAX_SEGMENTS):
        if not due.size:
            break
        table = code.table([p[due[0]] for p in parameters], x, low[:, : code.n], step)
        low[:, code.n :] = 0.0
        path = paths.Path(table, low, size, due)
        paths.follow_runs(expand, path, times, tolerance, SEGMENT_STEPS, states)
        is_over = due[1] == count
        status[due[0, is_over]] = OK
        if segment >= STIFF_SEGMENTS:
            change = np.abs(table[:, : code.n] - x)[:, :-1] / size[:, :-1]
            progress = (table[:, code.n - 1] - begin[due[0]]) / span[due[0]]
            is_stiff = ~is_over & (change.max(axis=1) < STIFF_CHANGE) & (progress < segment / MAX_SEGMENTS)
            status[due[0, is_stiff]] = STIFF
            is_over |= is_stiff | (progress < segment / (MAX_ACCELERATION * MAX_SEGMENTS))
        running = ~is_over
        x, low, size, step = (table[running, : code.n], low[running], size[running], table[running, code.step_row])
        due = np.ascontiguousarray(due[:, running])
    states[status != OK] = np.nan
    return states[..., :count].swapaxes(1, 2), status


def solve(
    code: Moving, parameters, start, times, tolerance: float, min_size=None, uncertainty=0.0
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return states at times and their errors, shape (runs, times, states), and the status of each run.

    Steps are halved until the states agree; a last run from a start shifted by a rounding and `uncertainty` measures
    how errors of the start grow. The error is four times both changes.

    Args:
        code: as of :func:`integrate_in_steps`, as are `parameters`, `start` and `times`.
        parameters: as there.
        start: as there.
        times: as there.
        tolerance: largest change by halving the steps, relative to each state's largest size in the run.
        min_size: lower bound of these sizes, shape (runs, states).
        uncertainty: a quarter of the start's error, shape (runs, states).
    """
    times, place = _add_comparison_times(times)
    states, difference = (np.full((*times.shape, start.shape[1]), np.nan) for _ in range(2))
    change, last = np.full(len(start), np.inf), np.full(len(start), np.inf)
    status = np.full(len(start), OK, np.int8)
    signs = np.resize([1.0, -1.0], start.shape[1])
    shifted_start = start * (1.0 + 2.0 * signs * EPSILON) + signs * uncertainty
    end_times = times + STATE_ROUNDING * np.abs(times).max(axis=1, keepdims=True) * code.graph.equations.depends_on_time

    def integrate_runs(runs, begin, at, halvings):
        """Return states of `runs` at times `at` with steps halved so many times; add to the runs' `status`."""
        finer = FIRST_TERM_SHARE * tolerance / 2.0 ** (code.order * halvings)
        states_at, outcome = integrate_in_steps(code, [p[runs] for p in parameters], begin[runs], at[runs], finer)
        status[runs] = np.maximum(status[runs], outcome)
        return states_at

    def largest_relative_change(runs):
        """Return the largest `difference` of any state at the end of `runs`, relative to its largest size."""
        size = np.abs(states[runs]).max(axis=1)
        size = size if min_size is None else np.maximum(size, min_size[runs])
        return np.where(difference[runs, -1] == 0.0, 0.0, difference[runs, -1] / size).max(axis=1)

    open_runs = np.arange(len(start))
    with np.errstate(all="ignore"):
        coarse = integrate_runs(open_runs, start, times, 0)
        coarse, open_runs = coarse[status == OK], open_runs[status == OK]
        for halvings in range(1, MAX_HALVINGS + 1) if open_runs.size else ():
            states[open_runs] = integrate_runs(open_runs, start, times, halvings)
            difference[open_runs] = np.maximum.accumulate(np.abs(states[open_runs] - coarse), axis=1)
            change[open_runs] = largest_relative_change(open_runs)
            is_open = (
                (change > tolerance)
                & ~((change > MIN_REDUCTION * last) & (change < MAX_ROUNDING))
                & np.isfinite(change)
            )
            is_open = is_open[open_runs] if halvings < MAX_HALVINGS else np.zeros(open_runs.size, bool)
            new_runs, last = open_runs[~is_open], change.copy()
            shifted_states = integrate_runs(new_runs, shifted_start, end_times, halvings)
            difference[new_runs] += np.maximum.accumulate(np.abs(shifted_states - states[new_runs]), axis=1)
            change[new_runs] = largest_relative_change(new_runs)
            open_runs, coarse = open_runs[is_open], states[open_runs[is_open]]
            if not open_runs.size:
                break
    states[:, 0] = start
    error = ERROR_FACTOR * difference + STATE_ROUNDING * np.maximum.accumulate(np.abs(states), axis=1)
    states, error = (np.take_along_axis(array, place[..., None], axis=1) for array in (states, error))
    is_finite = np.isfinite(states + error).all(axis=(1, 2))
    status = np.select([status != OK, ~is_finite, change > tolerance], [status, NON_FINITE, NOT_CONVERGED], OK)
    return states, error, status.astype(np.int8)


def solve_between_jumps(model, parameters, start, times, tolerance: float, min_size=None) -> tuple | None:
    """Return the same as :func:`solve` for equations that may jump in time; None if the jumps are not known.

    Args:
        model: of the motions.
        parameters: without switches; these and the other arguments are those of :func:`solve`.
        start: as there.
        times: as there.
        tolerance: as there.
        min_size: as there.
    """
    outcomes, smallest = [], np.abs(start) if min_size is None else min_size
    for run in range(len(start) if model.equations.switches else 0):
        values, times_of_run = [p[run : run + 1] for p in parameters], times[run]
        pieces = model.jumps.of_point(
            [p[run] for p in model.with_switches(parameters)], times_of_run[0], times_of_run[-1]
        )
        if pieces is None:
            return None
        x, error, size, status, segments = start[run], np.zeros(start.shape[1]), smallest[run], OK, []
        for (begin, end), switches in zip(pairwise(pieces[0]), pieces[1], strict=True):
            inside = np.r_[begin, times_of_run[(times_of_run > begin) & (times_of_run <= end)], end]
            at = [*values, *switches[:, None]]
            solution = solve(model.moving, at, x[None], inside[None], tolerance, size[None], error / ERROR_FACTOR)
            states, errors, status = solution[0][0], solution[1][0], max(status, int(solution[2][0]))
            x, error, size = states[-1], errors[-1], np.maximum(size, np.abs(states).max(axis=0))
            segments.append(np.stack([states[1:-1], errors[1:-1]]))
        first = np.stack([start[run], np.zeros(start.shape[1])])[:, None]
        states, errors = np.concatenate([first, *segments], axis=1)
        outcomes.append((states, errors, status))
    if not outcomes:
        return solve(model.moving, parameters, start, times, tolerance, min_size)
    return tuple(np.array(column) for column in zip(*outcomes, strict=True))


def _add_comparison_times(times):
    """Return times with COMPARISON_TIMES more, evenly over each run, and the indices of the original times.

    At a single time two different solutions may agree by chance.
    """
    span = np.linspace(0.0, 1.0, COMPARISON_TIMES + 2)[1:-1]
    all_times = np.concatenate([times, times[:, :1] + np.ptp(times, axis=1)[:, None] * span], axis=1)
    order = np.argsort(all_times, axis=1, kind="stable")
    return np.take_along_axis(all_times, order, axis=1), np.argsort(order, axis=1)[:, : times.shape[1]]
