r"""Motions through their samples, many side by side, by Taylor steps as long as their own terms allow.

A step of order N is so long that its last term is the tolerance, relative to the largest size of each state so far;
the samples that lie within it are sums of its terms. Lanes are as in :mod:`kernels.blocks`: each has its own step.

Source: Jorba and Zou, Experimental Mathematics 14 (2005) 99 (the choice of the step).
"""

import math
from typing import NamedTuple

import numpy as np

from kernels.blocks import W, rows_of, scratch
from kernels.jit import OPTIONS, float64, int64, njit, types, void, whole_vectors
from kernels.runs import ADVANCE, load, store


class Path(NamedTuple):
    """Runs on their way through their samples, by steps of any length."""

    table: np.ndarray  #: rows of each run, shape (rows, runs), its states as deviations from `place`
    place: np.ndarray  #: shape (states, runs)
    size: np.ndarray  #: largest size of each state so far, shape (states, runs)
    clock: np.ndarray  #: time at `place`, time since then, length of the next step, shape (3, runs)
    due: np.ndarray  #: number of each run, and of its next sample, shape (2, runs)
    step: int  #: row of the step
    order: int  #: of the steps, from 3


PATH = types.NamedTuple([*(float64[:, ::1],) * 4, int64[:, ::1], int64, int64], Path)
LONGER, SHORTER, LEAST_STEP = 4.0, 0.05, 1e-290
ACCEPTED = 1.3  # a step that is longer by more than this than its terms allow is made again
LAST_BUT_ONE = 1.0 / 16.0  # what the last term but one counts, should the last vanish


@njit(**OPTIONS)
def _measure_step(S, B, place, order, size, excess):
    """Write the last terms over each state's size so far, and that size; NaN where a term is no number."""
    whole_vectors()
    rows = B.size // W
    for lane in range(excess.size):
        excess[lane] = 0.0
    for i in range(len(size)):
        here = (rows + order * i) * W
        last, before = here + (order - 1) * W, here + (order - 2) * W
        for lane in range(excess.size):
            size[i, lane] = max(size[i, lane], abs(place[i, lane] + B[i * W + lane]))
            term = abs(S[last + lane]) + LAST_BUT_ONE * abs(S[before + lane])
            share = term / max(size[i, lane], abs(S[here + lane]))
            more = ~(term == 0.0) & ~(share <= excess[lane]) & (excess[lane] == excess[lane])
            excess[lane] = share if more else excess[lane]


@njit(**OPTIONS)
def _choose(S, B, clock, excess, open_, tolerance):
    """Write when each lane stands after its step, and its next step; undo a step longer than its terms allow.

    By the sixteenth root, whatever the order: it takes no logarithm, and steps follow one another.
    """
    whole_vectors()
    begun, span, until, further = clock[1], clock[2], clock[3], clock[4]
    for lane in range(excess.size):
        longer = math.sqrt(math.sqrt(math.sqrt(math.sqrt(tolerance / excess[lane]))))
        excess[lane] = longer
        moved = (ACCEPTED * longer >= 1.0) & (open_[lane] > 0.0)
        until[lane] = begun[lane] + (span[lane] if moved else 0.0)
        further[lane] = span[lane] * (min(longer, LONGER) if longer >= SHORTER else SHORTER)
    for lane in range(excess.size):
        if not ACCEPTED * excess[lane] >= 1.0:
            for row in range(B.size // W):
                S[row * W + lane] = B[row * W + lane]


@njit(**OPTIONS)
def _sum_terms(S, row, order, B, i, share, X):
    """Write what a state is at shares of a step."""
    whole_vectors()
    for lane in range(X.size):
        X[lane] = S[(row + order - 1) * W + lane]
    for n in range(order - 2, -1, -1):
        for lane in range(X.size):
            X[lane] = X[lane] * share[lane] + S[(row + n) * W + lane]
    for lane in range(X.size):
        X[lane] = X[lane] * share[lane] + B[i * W + lane]


@njit(**OPTIONS)
def _write_samples(S, B, path, first, times, clock, place, due, share, X, out):
    """Write the samples of each lane that lie within its step; due: its next sample, and that after the step."""
    whole_vectors()
    rows, lanes, count = B.size // W, min(W, path.table.shape[1] - first), times.shape[1]
    base, begun, span, until = clock[0], clock[1], clock[2], clock[3]
    number, most = path.due[0, first : first + lanes], 0
    for lane in range(lanes):
        last = due[0, lane]
        while last < count and times[number[lane], last] - base[lane] <= until[lane]:
            last += 1
        due[1, lane] = last
        most = max(most, last - due[0, lane])
    for k in range(most):
        for lane in range(lanes):
            at = min(due[0, lane] + k, count - 1)
            share[lane] = (times[number[lane], at] - base[lane] - begun[lane]) / span[lane]
        for i in range(out.shape[2]):
            _sum_terms(S, rows + path.order * i, path.order, B, i, share, X)
            for lane in range(lanes):
                if due[0, lane] + k < due[1, lane]:
                    out[number[lane], due[0, lane] + k, i] = place[i, lane] + X[lane]


@njit(void(ADVANCE, PATH, float64[:, ::1], float64, int64, float64[:, :, ::1]), nogil=True, **OPTIONS)
def follow(advance, path, times, tolerance, steps, out):
    """Advance runs by so many steps at most, and write their samples, shape (runs, times, states or fewer).

    A step is so long that its last term is the tolerance, of the state's largest size so far; samples within it are
    sums of its terms. A run whose steps vanish is at an end, and its further samples are not written.
    """
    whole_vectors()
    rows, runs = path.table.shape
    N, count = path.place.shape[0], times.shape[1]
    S, B = scratch(rows + path.order * N), scratch(rows)
    size, place, clock = rows_of(N), rows_of(N), rows_of(5)
    X, share, excess, open_ = scratch(1), scratch(1), scratch(1), scratch(1)
    due = np.empty((2, W), dtype=np.int64)
    for first in range(0, runs, W):
        lanes = min(W, runs - first)
        load(path.table, first, S)
        load(path.size, first, size.reshape(N * W))
        load(path.place, first, place.reshape(N * W))
        load(path.clock, first, clock.reshape(5 * W))
        for lane in range(W):
            due[0, lane] = path.due[1, first + lane] if lane < lanes else count
        for _ in range(steps):
            going = False
            for lane in range(W):
                open_[lane] = 1.0 if due[0, lane] < count else 0.0
                going = going or due[0, lane] < count
                S[path.step * W + lane] = clock[2, lane] if open_[lane] > 0.0 else 0.0
            if not going:
                break
            for at in range(rows * W):
                B[at] = S[at]
            advance(S, 1)
            _measure_step(S, B, place, path.order, size, excess)
            _choose(S, B, clock, excess, open_, tolerance)
            _write_samples(S, B, path, first, times, clock, place, due, share, X, out)
            for lane in range(lanes):
                clock[1, lane], clock[2, lane] = clock[3, lane], clock[4, lane]
                due[0, lane] = due[1, lane] if clock[2, lane] >= LEAST_STEP else count
        store(S, first, path.table)
        store(size.reshape(N * W), first, path.size)
        store(clock.reshape(5 * W), first, path.clock)
        for lane in range(lanes):
            path.due[1, first + lane] = due[0, lane]
