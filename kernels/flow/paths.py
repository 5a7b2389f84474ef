r"""Motions and their samples, many in parallel, by Taylor steps of variable length.

The terms are computed first, for a step of any length. The step's length then is such that its last term equals the
tolerance, relative to the largest size of each state so far, and the states at its end and at the samples within it are
sums of its terms. The rounding error of a state is carried to the next step. Lanes are as in
:mod:`kernels.compile.blocks`, and each loads the next run when its own is finished.

Source: Jorba and Zou, Experimental Mathematics 14 (2005) 99 (the choice of the step).
"""

import math
from typing import NamedTuple

import numpy as np

from kernels.compile.blocks import W, rows_of, scratch
from kernels.compile.jit import INNER, OPTIONS, float64, int64, njit, types, void
from kernels.compile.llvm_formulas import lines, parse_formula
from kernels.flow.codes import FAR_ORDER as ORDER
from kernels.flow.runs import CHECK as EXPAND

BLOCK = ORDER + 1  # rows of a series: its terms, then a fraction of the step, which its sum up to there replaces
NUM_TOGETHER = 16  # number of samples that are evaluated together: two vectors of eight
_sum_series = parse_formula(
    "sum_terms",
    ["s", "c"],
    f"q, x, y = s * s, c[{ORDER - 1}], c[{ORDER - 2}]\n"
    + "".join(f"x = x * q + c[{n + 1}]\ny = y * q + c[{n}]\n" for n in range(ORDER - 4, -1, -2))
    + "return (x * s + y) * s",
    {},
)
_SUM_LINES = lines(
    f"x, s = S[{(ORDER - 1) * W} + lane], S[{ORDER * W} + lane]\n"
    + "".join(f"x = x * s + S[{n * W} + lane]\n" for n in reversed(range(ORDER - 1)))
    + f"S[{ORDER * W} + lane] = x * s"
)


class Path(NamedTuple):
    """Unfinished runs; the series of a state or function is in the row with its number."""

    table: np.ndarray  #: shape (runs, rows): states, the time last; functions; a bound; the step; constants
    remainder: np.ndarray  #: rounding error of each series' value, to be added, shape (runs, series)
    size: np.ndarray  #: largest size of each state so far, shape (runs, states)
    next_sample: np.ndarray  #: number of each run, and of its next sample, shape (2, runs)


PATH = types.NamedTuple([*(float64[:, ::1],) * 3, int64[:, ::1]], Path)
MAX_GROWTH, MIN_STEP = 16.0, 1e-290  # largest ratio of successive steps; smallest step, and relative last term
FAILED_FACTOR = 0.05  # factor of the next step if terms are not finite
MAX_EXCESS = 20.0  # change of an argument over its bound from which on a step's terms are computed again
MIN_SHARE = 0.5  # if less than this fraction of a step is usable, its terms are computed again for a shorter one
PREVIOUS_WEIGHT = 1.0 / 16.0  # weight of the last term but one in the choice of the step, in case the last vanishes


@njit(**INNER)
def _choose_step(S, terms, step, size, share, next_step, tolerance):
    """Write the fraction of the step that each lane makes, and its next step; 0 if terms must be computed again.

    The row before that of the step is 0, or the change of an argument within it over its bound; negative if functions
    must be evaluated anew after it.

    The power is 3/64, a little less than 1/20: it needs no logarithm.
    """
    for lane in range(share.size):
        share[lane] = MIN_STEP
    for i in range(len(size)):
        first = terms + BLOCK * i
        last, previous = first + ORDER - 1, first + ORDER - 2
        for lane in range(share.size):
            size[i, lane] = max(size[i, lane], abs(S[i, lane]))
            term = abs(S[last, lane]) + PREVIOUS_WEIGHT * abs(S[previous, lane])
            excess = term / max(size[i, lane], abs(S[first, lane]))
            is_larger = ~(term == 0.0) & ~(excess <= share[lane]) & (share[lane] == share[lane])
            share[lane] = excess if is_larger else share[lane]
    for lane in range(share.size):
        root = math.sqrt(math.sqrt(math.sqrt(math.sqrt(tolerance / share[lane]))))
        growth = root / math.sqrt(math.sqrt(root))
        growth = MAX_GROWTH if growth > MAX_GROWTH else growth
        bound = abs(S[step - 1, lane])
        allowed = (
            MAX_GROWTH
            if not bound > 0.0
            else 1.0
            if bound < 1.0
            else 1.0 / bound
            if bound < MAX_EXCESS
            else FAILED_FACTOR
        )
        next_step[lane] = S[step, lane] * (min(growth, 2.0 * allowed) if growth > 0.0 else FAILED_FACTOR)
        share[lane] = min(growth, allowed) if (growth >= MIN_SHARE) & ~(bound >= MAX_EXCESS) else 0.0


@njit(**INNER)
def _sum_terms(rows, S, first, share):
    """Write a series' sum at a fraction of the step into its last row; first: the row of its first term."""
    for lane in range(share.size):
        S[first + ORDER, lane] = share[lane]
    _SUM_LINES(rows[first * W :])


@njit(**INNER)
def _advance_states(rows, S, terms, low, share):
    """Add the sums of the terms to all series, with compensation of the rounding."""
    for row in range(len(low)):
        _sum_terms(rows, S, terms + BLOCK * row, share)
        for lane in range(share.size):
            x, change = S[row, lane], S[terms + BLOCK * row + ORDER, lane] + low[row, lane]
            state = x + change
            actual = state - x
            remainder = (x - (state - actual)) + (change - actual)
            S[row, lane] = state if share[lane] > 0.0 else x
            low[row, lane] = remainder if share[lane] > 0.0 else low[row, lane]


@njit(**INNER)
def _lane_terms(S, first, lane):
    """Return the terms of a series in a lane."""
    at = max(first * W + lane, 0)  # tells the compiler that the index is not negative
    return (
        S[at], S[at + W], S[at + 2 * W], S[at + 3 * W], S[at + 4 * W], S[at + 5 * W], S[at + 6 * W], S[at + 7 * W],
        S[at + 8 * W], S[at + 9 * W], S[at + 10 * W], S[at + 11 * W], S[at + 12 * W], S[at + 13 * W], S[at + 14 * W],
        S[at + 15 * W], S[at + 16 * W], S[at + 17 * W], S[at + 18 * W], S[at + 19 * W],
    )  # fmt: skip


@njit(**INNER)
def _write_samples(rows, S, terms, step, low, share, times, number, next_sample, out):
    """Write the samples of each lane within its step, and the number of its next sample."""
    N = out.shape[1]
    for lane in range(W):
        run = number[lane]
        t = S[N, lane]
        remainder = low[N, lane]
        per_step = 1.0 / S[step, lane]
        num_inside = NUM_TOGETHER
        end = t + (share[lane] * S[step, lane] + remainder)
        while num_inside == NUM_TOGETHER:
            num_inside, first = 0, max(next_sample[lane], 0)
            for k in range(NUM_TOGETHER):
                num_inside += 1 if times[run, first + k] <= end else 0
            for i in range(N if num_inside > 0 else 0):
                x, remainder_of_state, c = S[i, lane], low[i, lane], _lane_terms(rows, terms + BLOCK * i, lane)
                for k in range((num_inside + 7) // 8 * 8):  # whole vectors
                    at = ((times[run, first + k] - t) - remainder) * per_step
                    out[run, i, first + k] = x + (_sum_series(at, c) + remainder_of_state)
            next_sample[lane] += num_inside


@njit(**INNER)
def _load_run(path, run, S, low, sizes, lane):
    """Copy a run's states and step, their low parts, and the sizes of the states from the path's tables to a lane."""
    for row in range(path.table.shape[1]):
        S[row, lane] = path.table[run, row]
    for row in range(path.remainder.shape[1]):
        low[row, lane] = path.remainder[run, row]
    for row in range(path.size.shape[1]):
        sizes[row, lane] = path.size[run, row]


@njit(**INNER)
def _store_run(path, run, S, low, sizes, lane):
    """Copy a lane's states and step, their low parts, and the sizes of the states to its run in the path's tables."""
    for row in range(path.table.shape[1]):
        path.table[run, row] = S[row, lane]
    for row in range(path.remainder.shape[1]):
        path.remainder[run, row] = low[row, lane]
    for row in range(path.size.shape[1]):
        path.size[run, row] = sizes[row, lane]


@njit(void(EXPAND, PATH, float64[:, ::1], float64, int64, float64[:, :, ::1]), nogil=True, **OPTIONS)
def follow_runs(expand, path, times, tolerance, steps, out):
    """Advance runs by a maximum number of steps, and write their samples.

    A run ends if its steps become too small, and its later samples are NaN.

    Args:
        expand (function): ``expand(S)`` writes the terms of all series.
        path (Path): The runs, overwritten.
        times (numpy.ndarray, shape (runs, samples + NUM_TOGETHER)): The last NUM_TOGETHER are infinite.
        tolerance (float): Last term of a step, relative to the largest size of a state.
        steps (int): Maximum number of steps.
        out (numpy.ndarray, shape (runs, states without the time, samples + NUM_TOGETHER)): Written.
    """
    (runs, terms), series, N = path.table.shape, path.remainder.shape[1], path.size.shape[1]
    rows, low, size = scratch(terms + BLOCK * series), rows_of(series), rows_of(N)
    share, next_step, step, S = scratch(1), scratch(1), series + 1, rows.reshape(-1, W)
    run, number, steps_left = np.full(W, -1), np.zeros(W, dtype=np.int64), np.zeros(W, dtype=np.int64)
    next_sample, next_run, count = np.full(W, times.shape[1] - NUM_TOGETHER), 0, times.shape[1] - NUM_TOGETHER
    while True:
        goes_on = False
        for lane in range(W):
            if run[lane] >= 0 and (steps_left[lane] == 0 or next_sample[lane] == count):
                path.next_sample[1, run[lane]] = next_sample[lane]
                _store_run(path, run[lane], S, low, size, lane)
                run[lane], next_sample[lane], S[step, lane] = -1, count, 0.0
            if run[lane] < 0 and next_run < runs:
                run[lane], steps_left[lane] = next_run, steps
                number[lane], next_sample[lane] = path.next_sample[0, next_run], path.next_sample[1, next_run]
                _load_run(path, next_run, S, low, size, lane)
                next_run += 1
            goes_on = goes_on or run[lane] >= 0
        if not goes_on:
            break
        expand(rows)
        _choose_step(S, terms, step, size, share, next_step, tolerance)
        _write_samples(rows, S, terms, step, low, share, times, number, next_sample, out)
        _advance_states(rows, S, terms, low, share)
        for lane in range(W):
            steps_left[lane] = 0 if S[step - 1, lane] < 0.0 else steps_left[lane] - 1
            S[step, lane] = next_step[lane]
            if next_sample[lane] < count and not next_step[lane] >= MIN_STEP:
                for k in range(next_sample[lane], count):
                    for i in range(N - 1):
                        out[number[lane], i, k] = math.nan
                next_sample[lane] = count
