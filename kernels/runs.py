r"""Runs of described systems: perturbed motions near equilibria, many side by side, sampled for a measurement.

A point is a system with numbers in it and an equilibrium. Its motions are carried as the deviations
:math:`x = \text{state} - x_0` in the rows of a scratch array, W lanes each: states, 1/ε, the step in s, what is
watched, constants; samples are :math:`x/\varepsilon`. Functions that were written for the system advance them and
write what is watched, `advance(S, steps)` and `check(S)`; they come in as arguments, so that the kernels are compiled
once for all systems. So does `take`, which a measurement gives to be called with every sample.

*Amplitude.* Of a perturbation whose size counts, motions start from +ε and -ε, of which half the difference has no even
power of ε, and from a half and a quarter of it alike. What is left goes with even powers, so that of the samples
:math:`D` of the three sizes

.. math:: D_0 = \tfrac1{45}\left(64\,D_{1/4} - 20\,D_{1/2} + D_1\right)

has nothing of the second and fourth order: it is the sample of a perturbation that vanishes.

*Blind.* Spacing, length and number of steps come from the scale S of the system, a bound on every possible rate.
"""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from kernels import direct, measure
from kernels.blocks import LANES, ROWS, W, cut, rows_of, scratch
from kernels.codes import ORDER, UNIT
from kernels.jit import INLINE, INNER, OPTIONS, boolean, float64, int64, njit, types, void, whole_vectors

MOST_HALVINGS = 6
LONGEST = 0.4  # step, in 1/S: its first term left out is 0.4^13/13! = 1e-15
LEAST_SPAN = 1.0  # of 1/S: a shorter window shows too little of a motion, and of what its amplitude does

SIZES = (1.0, 0.5, 0.25)  # of the perturbation: a motion of each from either side, +, -

ADVANCE = types.FunctionType(void(float64[::1], int64))
CHECK = types.FunctionType(void(float64[::1]))
# Of samples, watched rows, the block's rows, numbers (see `run_blocks`), the run and the sample: whether to go on.
TAKEN = boolean(float64[:, ::1], float64[::1], float64[:, ::1], int64[::1], int64, int64)
TAKE = types.FunctionType(TAKEN)

# First rows of a block, of W lanes: 1 where a state is the largest so far; what halving the step changes; the time
# between samples, s; whether motions start from both sides; then what `Runs.given` holds.
LARGER, CHANGE, SPACING, PAIR, GIVEN = range(5)
HALVING, STEPS = range(2)  # first columns of a raw result: CHANGE over the largest sample, steps between samples


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

    @classmethod
    def of(cls, cycles, samples_per_cycle, tolerance):
        """Return the sampling of a run of so many cycles, 2π/S each."""
        return cls(round(cycles * samples_per_cycle), min(2.0 * np.pi / samples_per_cycle, 0.5), tolerance)


class Runs(NamedTuple):
    """Points and their runs."""

    #: rows at the start of each motion, shape (points, runs, motions, rows): of every direction, from +ε and -ε of each
    #: of SIZES; one motion alone where no size counts. The step is set by the kernel.
    starts: np.ndarray
    #: from the states' deviations over ε to what is measured, shape (points, measured, states that count).
    project: np.ndarray
    scale: np.ndarray  #: S, a bound on every possible rate, in s-1
    size: np.ndarray  #: relative size of the perturbation
    twice: np.ndarray  #: whether the motions from the other side are needed
    family: np.ndarray  #: which points are of one kind; changes no result, only the time
    given: np.ndarray  #: what the measurement knows of each point, shape (points, any)


RUNS = types.NamedTuple(
    [float64[:, :, :, ::1], float64[:, :, ::1], *(float64[::1],) * 2, *(int64[::1],) * 2, float64[:, ::1]], Runs
)


class Measurement(NamedTuple):
    """How the samples of a block are measured."""

    take: Callable  #: the compiled function that is called with every sample; see `run_blocks`
    #: ``raw(steps, order, bounds, numbers, blocks)`` returns the raw results: in their first columns the part that
    #: halving the step changes in an interval, and the steps.
    raw: Callable
    numbers: tuple[int, ...]  #: as of `run_blocks`, after the numbers of samples and of states
    rows: int  #: of a block


def planned(size, sampling):
    """Return the steps per sample of each point: from the scale's bound and the perturbation's size.

    A motion keeps the tolerance over the whole run. Whatever the tolerance, what a step leaves out of a small one is
    some roundings at most: fits average less than that.
    """
    sizes, number = np.unique(np.minimum(1.0, measure.WINDOW * size), return_inverse=True)
    left_out = np.array([direct.truncation(a, ORDER) for a in sizes.tolist()])[number]
    excess = sampling.intervals * sampling.spacing ** (ORDER + 1) * left_out / sampling.tolerance
    least = math.ceil(sampling.spacing / LONGEST)
    return np.clip(np.ceil(np.maximum(excess, 1e-300) ** (1.0 / ORDER)), least, direct.MOST_STEPS).astype(np.int64)


@njit(**INLINE)
def at_zero(whole, half, quarter):
    """Return what samples of SIZES of the perturbation tend to, without the square and the fourth power of its size."""
    return quarter + (19.0 * (quarter - half) + (whole - half)) / 45.0


@njit(void(LANES, LANES, int64, boolean, int64, LANES), **INNER)
def _project(project, R, states, pair, sizes, D):
    """Write what is measured of the motions of each size: half the difference of both sides, where there are two."""
    whole_vectors()
    channels, N, lanes = project.shape[0], project.shape[1] // W, D.shape[1]
    for size in range(sizes):
        P, M = R[2 * size], R[2 * size + 1]
        for c in range(channels):
            row = size * channels + c
            for lane in range(lanes):
                D[row, lane] = 0.0
            for j in range(N):
                for lane in range(lanes):
                    x = P[j * W + lane]
                    D[row, lane] += project[c, j * W + lane] * (0.5 * (x - M[j * W + lane]) if pair else x)
            for lane in range(lanes):
                D[row, lane] *= P[states * W + lane]


@njit(void(ADVANCE, LANES, ROWS, LANES, *3 * (int64,), LANES, ROWS), **INNER)
def _halve(advance, R, K, project, watched, states, steps, D, change):
    """Run the interval that begins at each lane's largest state with steps, and with twice as many: largest change."""
    whole_vectors()
    for turn in range(2):
        for i in range(states * W):
            R[0, i] = K[i]
        advance(R[0], steps * (turn + 1))
        _project(project, R, states, False, 1, D[turn * project.shape[0] :])
        for lane in range(W):
            R[0, (states + 1) * W + lane] *= 0.5
    for c in range(watched):
        for lane in range(W):
            change[lane] = max(change[lane], abs(D[c, lane] - D[project.shape[0] + c, lane]))


@njit(
    void(ADVANCE, CHECK, TAKE, RUNS, *(int64[::1],) * 4, float64, float64[:, :, ::1]),
    nogil=True,
    **OPTIONS,
)
def run_blocks(advance, check, take, runs, steps, order, bounds, numbers, spacing, blocks):
    """Integrate block after block, and give every sample to a measurement; order[bounds[j]:bounds[j + 1]] are block j.

    numbers: of samples, of states, of what is measured whose change counts when steps are halved, of sizes that a point
    of one side has; others are the measurement's. blocks (blocks, rows, W): zeros, what the measurement gathers.
    """
    whole_vectors()
    _, directions, motions, rows = runs.starts.shape
    _, channels, N = runs.project.shape
    count, states, watched, single = numbers[0], numbers[1], numbers[2], numbers[3]
    R, K, D = scratch(6 * rows).reshape(6, rows * W), scratch(states), rows_of(3 * channels)
    project = scratch(channels * N).reshape(channels, N * W)
    for b in range(bounds.size - 1):
        first, lanes, Q = bounds[b], bounds[b + 1] - bounds[b], blocks[b]
        number, pair = steps[order[first]], runs.twice[order[first]] > 0
        sizes = len(SIZES) if pair else single
        for lane in range(W):
            i = order[first + min(lane, lanes - 1)]
            Q[SPACING, lane], Q[PAIR, lane] = spacing / runs.scale[i], 1.0 if pair else 0.0
            for j in range(runs.given.shape[1]):
                Q[GIVEN + j, lane] = runs.given[i, j]
            for c in range(channels):
                for j in range(N):
                    project[c, j * W + lane] = runs.project[i, c, j]
        for direction in range(directions):
            for lane in range(W):
                i = order[first + min(lane, lanes - 1)]
                for motion in range(min(motions, 2 * sizes)):
                    for row in range(rows):
                        R[motion, row * W + lane] = runs.starts[i, direction, motion, row]
                    R[motion, (states + 1) * W + lane] = Q[SPACING, lane] / number
            for k in range(count):
                if k > 0:
                    for motion in range(0, 2 * sizes, 1 if pair else 2):
                        advance(R[motion], number)
                check(R[0])
                _project(project, R, states, pair, sizes, D)
                going = take(D, R[0], Q, numbers, direction, k)
                for row in range(0, states * W, W):
                    for lane in range(Q.shape[1]):
                        K[row + lane] = R[0, row + lane] if Q[LARGER, lane] > 0.0 else K[row + lane]
                if not going:
                    break
        _halve(advance, R, K, project, watched, states, number, D, Q[CHANGE])


def refined(integrator, measurement, runs, sampling):
    """Return the raw results of points, of which those that have not converged are run again with twice the steps."""
    steps = planned(runs.size, sampling)
    numbers = np.array([sampling.intervals + 1, integrator.states, *measurement.numbers])
    left, raw = np.arange(steps.size), None
    for _ in range(MOST_HALVINGS + 1):
        if left.size == 0 and raw is not None:
            break
        chosen = runs if left.size == steps.size else Runs(*(np.ascontiguousarray(x[left]) for x in runs))
        key = (2 * steps[left] + chosen.twice) * (chosen.family.max(initial=0) + 1) + chosen.family
        order, bounds = cut(np.unique(key, return_inverse=True)[1], 1)
        plan = (steps[left], order, bounds, numbers)
        blocks = scratch((bounds.size - 1) * measurement.rows).reshape(bounds.size - 1, measurement.rows, W)
        run_blocks(*integrator[:2], measurement.take, chosen, *plan, sampling.spacing, blocks)
        part = measurement.raw(*plan, blocks)
        raw = part if raw is None else raw
        raw[left] = part
        left = left[~(has_converged(part, sampling.intervals, sampling.tolerance) | ~np.isfinite(part[:, 0]))]
        steps[left] *= 2
    return raw


def has_converged(raw, intervals, tolerance):
    """Return True where halving the step changes less than the tolerance plus rounding."""
    rounding = 8.0 * UNIT * np.sqrt(raw[:, STEPS])
    return (raw[:, HALVING] - rounding) * intervals <= tolerance
