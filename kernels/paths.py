r"""Motions through their samples, many side by side, by Taylor steps as long as their own terms allow.

The terms are found first, for a step that may be of any length; then it is made so long that its last term is the
tolerance, relative to the largest size of each state so far, and the states at its end and at the samples that lie
within it are sums of its terms. What rounding leaves of a state is carried to the next step. Lanes are as in
:mod:`kernels.blocks`, and each takes the next run when its own is through.

Source: Jorba and Zou, Experimental Mathematics 14 (2005) 99 (the choice of the step).
"""

import math
from typing import NamedTuple

import numpy as np

from kernels.blocks import W, rows_of, scratch
from kernels.codes import FAR_ORDER as ORDER
from kernels.jit import INNER, OPTIONS, float64, int64, njit, types, void, whole_vectors
from kernels.runs import CHECK as EXPAND
from kernels.straight import lines, straight

BLOCK = ORDER + 1  # rows of a series: its terms, then a share of the step, in whose place its sum up to there comes
TOGETHER = 16  # samples
_sum = straight(
    "sum_terms",
    ["s", "c"],
    f"q, x, y = s * s, c[{ORDER - 1}], c[{ORDER - 2}]\n"
    + "".join(f"x = x * q + c[{n + 1}]\ny = y * q + c[{n}]\n" for n in range(ORDER - 4, -1, -2))
    + "return (x * s + y) * s",
    {},
)
_SUM = lines(
    f"x, s = S[{(ORDER - 1) * W} + lane], S[{ORDER * W} + lane]\n"
    + "".join(f"x = x * s + S[{n * W} + lane]\n" for n in reversed(range(ORDER - 1)))
    + f"S[{ORDER * W} + lane] = x * s"
)


class Path(NamedTuple):
    """Runs on their way through their samples; a state's and a function's series stand in rows of these numbers."""

    table: np.ndarray  #: shape (runs, rows): states, the time last; functions; a bound; the step; constants
    low: np.ndarray  #: what is left of each series below its rounding, shape (runs, series)
    size: np.ndarray  #: largest size of each state so far, shape (runs, states)
    due: np.ndarray  #: number of each run, and of its next sample, shape (2, runs)


PATH = types.NamedTuple([*(float64[:, ::1],) * 3, int64[:, ::1]], Path)
LONGER, LEAST = 16.0, 1e-290  # of a step; and of its last terms over their sizes
SHORTER = 0.05  # of a step whose terms are no numbers
MOST_BEYOND = 20.0  # times its bound that an argument may change by in a step that is then made shorter
GUESSED = 0.5  # terms of a step that is to be shorter than this share of theirs are found again
LAST_BUT_ONE = 1.0 / 16.0  # what the last term but one counts, should the last vanish


@njit(**INNER)
def _choose(S, terms, step, size, share, next_step, tolerance):
    """Write how much of the step each lane makes, and its next step; 0 where terms have to be found again.

    The row before that of the step is 0, or how far an argument changes in it, over what it may; negative where
    functions are to be worked out afresh after it.

    By the power 3/64, a little less than 1/20: it takes no logarithm, and steps follow one another.
    """
    whole_vectors()
    for lane in range(share.size):
        share[lane] = LEAST
    for i in range(len(size)):
        first = terms + BLOCK * i
        last, before = first + ORDER - 1, first + ORDER - 2
        for lane in range(share.size):
            size[i, lane] = max(size[i, lane], abs(S[i, lane]))
            term = abs(S[last, lane]) + LAST_BUT_ONE * abs(S[before, lane])
            excess = term / max(size[i, lane], abs(S[first, lane]))
            more = ~(term == 0.0) & ~(excess <= share[lane]) & (share[lane] == share[lane])
            share[lane] = excess if more else share[lane]
    for lane in range(share.size):
        root = math.sqrt(math.sqrt(math.sqrt(math.sqrt(tolerance / share[lane]))))
        longer = root / math.sqrt(math.sqrt(root))
        longer = LONGER if longer > LONGER else longer
        bound = abs(S[step - 1, lane])
        within = LONGER if not bound > 0.0 else 1.0 if bound < 1.0 else 1.0 / bound if bound < MOST_BEYOND else SHORTER
        next_step[lane] = S[step, lane] * (min(longer, 2.0 * within) if longer > 0.0 else SHORTER)
        share[lane] = min(longer, within) if (longer >= GUESSED) & ~(bound >= MOST_BEYOND) else 0.0


@njit(**INNER)
def _sum_terms(rows, S, first, share):
    """Write in a series' last row how far it comes in shares of the step; first: the row of its first term."""
    whole_vectors()
    for lane in range(share.size):
        S[first + ORDER, lane] = share[lane]
    _SUM(rows[first * W :])


@njit(**INNER)
def _move(rows, S, terms, low, share):
    """Add the sums of the terms to all series: with what rounding left before, and has left now."""
    whole_vectors()
    for row in range(len(low)):
        _sum_terms(rows, S, terms + BLOCK * row, share)
        for lane in range(share.size):
            x, change = S[row, lane], S[terms + BLOCK * row + ORDER, lane] + low[row, lane]
            moved = x + change
            back = moved - x
            left = (x - (moved - back)) + (change - back)
            S[row, lane] = moved if share[lane] > 0.0 else x
            low[row, lane] = left if share[lane] > 0.0 else low[row, lane]


@njit(**INNER)
def _terms(S, first, lane):
    """Return the terms of a series in a lane."""
    at = max(first * W + lane, 0)  # no compiler knows that it is no index from the end
    return (
        S[at], S[at + W], S[at + 2 * W], S[at + 3 * W], S[at + 4 * W], S[at + 5 * W], S[at + 6 * W], S[at + 7 * W],
        S[at + 8 * W], S[at + 9 * W], S[at + 10 * W], S[at + 11 * W], S[at + 12 * W], S[at + 13 * W], S[at + 14 * W],
        S[at + 15 * W], S[at + 16 * W], S[at + 17 * W], S[at + 18 * W], S[at + 19 * W],
    )  # fmt: skip


@njit(**INNER)
def _write_samples(rows, S, terms, step, low, share, times, number, due, out):
    """Write the samples of each lane that lie within its step, and what is its next; a later step writes the others."""
    whole_vectors()
    N = out.shape[1]
    for lane in range(W):
        run, t, rest, per_step, within = number[lane], S[N, lane], low[N, lane], 1.0 / S[step, lane], TOGETHER
        end = t + (share[lane] * S[step, lane] + rest)
        while within == TOGETHER:
            within, first = 0, max(due[lane], 0)
            for k in range(TOGETHER):
                within += 1 if times[run, first + k] <= end else 0
            for i in range(N if within > 0 else 0):
                x, left, c = S[i, lane], low[i, lane], _terms(rows, terms + BLOCK * i, lane)
                for k in range((within + 7) // 8 * 8):  # whole vectors
                    at = ((times[run, first + k] - t) - rest) * per_step
                    out[run, i, first + k] = x + (_sum(at, c) + left)
            due[lane] += within


@njit(**INNER)
def _take(path, run, S, low, size, lane):
    """Write a run into a lane."""
    for row in range(path.table.shape[1]):
        S[row, lane] = path.table[run, row]
    for row in range(path.low.shape[1]):
        low[row, lane] = path.low[run, row]
    for row in range(path.size.shape[1]):
        size[row, lane] = path.size[run, row]


@njit(**INNER)
def _give_back(path, run, S, low, size, lane):
    """Write a lane into its run."""
    for row in range(path.table.shape[1]):
        path.table[run, row] = S[row, lane]
    for row in range(path.low.shape[1]):
        path.low[run, row] = low[row, lane]
    for row in range(path.size.shape[1]):
        path.size[run, row] = size[row, lane]


@njit(void(EXPAND, PATH, float64[:, ::1], float64, int64, float64[:, :, ::1]), nogil=True, **OPTIONS)
def follow(expand, path, times, tolerance, steps, out):
    """Advance runs by so many steps at most, and write their samples.

    A run whose steps vanish is at an end, and its further samples are NaN.

    Args:
        times (runs, samples and TOGETHER times that never come).
        out (runs, states without the time, samples and TOGETHER places more).
    """
    whole_vectors()
    (runs, terms), series, N = path.table.shape, path.low.shape[1], path.size.shape[1]
    rows, low, size = scratch(terms + BLOCK * series), rows_of(series), rows_of(N)
    share, next_step, step, S = scratch(1), scratch(1), series + 1, rows.reshape(-1, W)
    run, number, left = np.full(W, -1), np.zeros(W, dtype=np.int64), np.zeros(W, dtype=np.int64)
    due, following, count = np.full(W, times.shape[1] - TOGETHER), 0, times.shape[1] - TOGETHER
    while True:
        going = False
        for lane in range(W):
            if run[lane] >= 0 and (left[lane] == 0 or due[lane] == count):
                path.due[1, run[lane]] = due[lane]
                _give_back(path, run[lane], S, low, size, lane)
                run[lane], due[lane], S[step, lane] = -1, count, 0.0
            if run[lane] < 0 and following < runs:
                run[lane], left[lane] = following, steps
                number[lane], due[lane] = path.due[0, following], path.due[1, following]
                _take(path, following, S, low, size, lane)
                following += 1
            going = going or run[lane] >= 0
        if not going:
            break
        expand(rows)
        _choose(S, terms, step, size, share, next_step, tolerance)
        _write_samples(rows, S, terms, step, low, share, times, number, due, out)
        _move(rows, S, terms, low, share)
        for lane in range(W):
            left[lane] = 0 if S[step - 1, lane] < 0.0 else left[lane] - 1
            S[step, lane] = next_step[lane]
            if due[lane] < count and not next_step[lane] >= LEAST:
                for k in range(due[lane], count):
                    for i in range(N - 1):
                        out[number[lane], i, k] = math.nan
                due[lane] = count
