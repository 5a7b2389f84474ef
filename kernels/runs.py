r"""Runs of described systems: what the kernels of small oscillations and of first-order systems share.

A point is a system with numbers in it and an equilibrium. Its motions are carried as the deviations
:math:`x = (\text{state} - x_0)/\varepsilon` in the rows of a scratch array, W lanes each: states, epsilon, the
step in s, what is watched, constants. Functions that were written for the system advance them and write what is
watched, `advance(S, steps)` and `check(S)`; they come in as arguments, so that the kernels are compiled once for all
systems.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from kernels import direct, measure
from kernels.blocks import W, cut, scratch
from kernels.jit import OPTIONS, float64, int64, njit, types, void

ORDER = 12  # of the generated Taylor steps
EPSILON = float(np.finfo(np.float64).eps)
MOST_HALVINGS = 6
LEAST_SPAN = 1.0  # of 1/S: a shorter window shows too little of a motion, and of what its amplitude does

ADVANCE = types.FunctionType(void(float64[::1], int64))
CHECK = types.FunctionType(void(float64[::1]))


class Integrator(NamedTuple):
    """The compiled functions of a system, and the number of rows that are its states."""

    advance: Callable
    check: Callable
    states: int


class Sampling(NamedTuple):
    """How runs are sampled."""

    intervals: int  #: number of sample intervals
    spacing: float  #: spacing of the samples, in 1/S; at most 1/2
    tolerance: float  #: relative error allowed over the run


class Runs(NamedTuple):
    """Points and their runs."""

    starts: np.ndarray  #: rows at the start of each run, shape (points, runs, rows); the step is set by the kernel
    #: from the states' deviations to what is measured, shape (points, measured, states that count).
    project: np.ndarray
    scale: np.ndarray  #: S, a bound on every possible rate, in s-1
    size: np.ndarray  #: relative size of the perturbation
    twice: np.ndarray  #: whether the runs from the other side are needed
    family: np.ndarray  #: which points are of one kind; changes no result, only the time


RUNS = types.NamedTuple(
    [float64[:, :, ::1], float64[:, :, ::1], float64[::1], float64[::1], int64[::1], int64[::1]], Runs
)


def planned(size, sampling, share=1.0):
    """Return the steps per sample of each point: from the scale's bound and the perturbation's size.

    A motion whose frequencies are ``share`` times the scale at most keeps the tolerance over the whole run.
    """
    sizes, number = np.unique(np.minimum(1.0, measure.WINDOW * size), return_inverse=True)
    left_out = np.array([direct.truncation(a, ORDER) for a in sizes.tolist()])[number]
    excess = sampling.intervals * (share * sampling.spacing) ** (ORDER + 1) * left_out / sampling.tolerance
    return np.clip(np.ceil(np.maximum(excess, 1e-300) ** (1.0 / ORDER)), 1, direct.MOST_STEPS).astype(np.int64)


def refined(runs, steps, kernel, is_done):
    """Return the raw results of points, of which those that are not done are run again with twice the steps.

    Args:
        runs (Runs): All points.
        steps (numpy.ndarray of int64, shape (points,)): Steps per sample of the first try; there are MOST_HALVINGS more
            at most.
        kernel (callable): ``kernel(runs, which, steps, order, bounds)`` returns the raw results of runs, the points
            ``which`` of all; the points order[bounds[j]:bounds[j + 1]] share block j: points of equal work together.
        is_done (callable): Of raw results, which are.
    """
    left = np.arange(steps.size)
    raw = None
    for _ in range(MOST_HALVINGS + 1):
        if left.size == 0 and raw is not None:
            break
        chosen = runs if left.size == steps.size else Runs(*(np.ascontiguousarray(x[left]) for x in runs))
        key = (2 * steps[left] + chosen.twice) * (chosen.family.max(initial=0) + 1) + chosen.family
        order, bounds = cut(np.unique(key, return_inverse=True)[1], 1)
        part = kernel(chosen, left, steps[left], order, bounds)
        raw = part if raw is None else raw
        raw[left] = part
        left = left[~is_done(part)]
        steps[left] *= 2
    return raw


@njit(void(ADVANCE, float64[:, ::1], int64), nogil=True, **OPTIONS)
def advance_rows(advance, rows, steps):
    """Advance runs, shape (runs, rows), by so many steps, in place."""
    runs, count = rows.shape
    S = scratch(count)
    for first in range(0, runs, W):
        for lane in range(W):
            for row in range(count):
                S[row * W + lane] = rows[min(first + lane, runs - 1), row]
        advance(S, steps)
        for lane in range(min(W, runs - first)):
            for row in range(count):
                rows[first + lane, row] = S[row * W + lane]
