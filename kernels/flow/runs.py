r"""Runs of described systems: perturbed motions near equilibria, many in parallel, sampled for a measurement.

A point is a system with values of its parameters, and an equilibrium. Its motions are stored as the deviations
:math:`x = \text{state} - x_0` in the rows of a scratch array, W lanes each: states, 1/ε, the step in s, conserved
quantities, constants; samples are :math:`x/\varepsilon`. Functions generated for the system advance them,
`advance(S, steps)`, and write the quantities, `check(S)`; they are arguments, so that the kernels are compiled once for
all systems. So is `take`, the function of a measurement that is called with every sample.

*Amplitude.* If the size of a perturbation matters, motions start from +ε and -ε, so that half their difference has no
even power of ε, and from a half and a quarter of ε likewise. Its relative error has even powers only, so that of the
samples :math:`D` of the three sizes

.. math:: D_0 = \tfrac1{45}\left(64\,D_{1/4} - 20\,D_{1/2} + D_1\right)

has no term of the second and fourth order: it is the sample of an infinitesimal perturbation.

*Blind.* Spacing, length and number of steps come from the scale S of the system, a bound on every possible rate.
"""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from kernels.compile.blocks import LANES, ROWS, W, cut, rows_of, scratch
from kernels.compile.jit import INLINE, INNER, OPTIONS, boolean, float64, int64, njit, types, void
from kernels.estimator import measure
from kernels.flow.codes import ORDER, UNIT
from kernels.free import direct

MAX_HALVINGS = 6  # halvings of the step, after which a point is reported as not converged
MAX_STEP = 0.4  # longest step, in 1/S: the first omitted term of its series is 0.4^13/13! = 1e-15
MIN_SPAN = 1.0  # shortest window, in 1/S: a shorter one shows too little of the motion and of its amplitude's effect

SIZES = (1.0, 0.5, 0.25)  # sizes of the perturbations in units of ε; there is a motion of each sign, +, -

ADVANCE = types.FunctionType(void(float64[::1], int64))
CHECK = types.FunctionType(void(float64[::1]))
# take(samples, rows of the first motion, the block's rows, numbers (see `run_blocks`), run, sample) → whether to go on.
TAKE_TYPE = boolean(float64[:, ::1], float64[::1], float64[:, ::1], int64[::1], int64, int64)
TAKE = types.FunctionType(TAKE_TYPE)

# First rows of a block, of W lanes: 1 if the state is the largest so far; change by halving the step; time between
# samples, s; whether motions start from both sides; then the rows of `Runs.point_data`.
LARGER, CHANGE, SPACING, BOTH_SIDES, INPUTS = range(5)
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
        """Return the sampling of a run of cycles of 2π/S, with samples_per_cycle and the tolerance over the run."""
        return cls(round(cycles * samples_per_cycle), min(2.0 * np.pi / samples_per_cycle, 0.5), tolerance)


class Runs(NamedTuple):
    """Points and their runs."""

    #: rows at the start of each motion, shape (points, runs, motions, rows): of every direction, from +ε and -ε of each
    #: of SIZES; one motion alone where no size counts. The step is set by the kernel.
    starts: np.ndarray
    #: from the states' deviations over ε to the measured channels, shape (points, channels, projected states).
    project: np.ndarray
    scale: np.ndarray  #: S, a bound on every possible rate, in s-1
    epsilon: np.ndarray  #: relative size of the perturbation
    has_both_sides: np.ndarray  #: whether the motions from -ε are needed
    family: np.ndarray  #: number of the point's kind; points of a kind share blocks: changes no result, only the time
    point_data: np.ndarray  #: inputs of the measurement for each point, shape (points, any)


RUNS = types.NamedTuple(
    [float64[:, :, :, ::1], float64[:, :, ::1], *(float64[::1],) * 2, *(int64[::1],) * 2, float64[:, ::1]], Runs
)


class Measurement(NamedTuple):
    """How the samples of a block are measured."""

    take: Callable  #: the compiled function that is called with every sample; see `run_blocks`
    #: ``raw_results(steps, order, bounds, numbers, blocks)`` returns the raw results: in their first columns the
    #: relative change of an interval by halving the step, and the steps.
    raw_results: Callable
    numbers: tuple[int, ...]  #: as of `run_blocks`, after the numbers of samples and of states
    num_rows: int  #: number of rows of a block


def steps_per_sample(epsilon, sampling):
    """Return the steps per sample of each point, from the bound on rates and the perturbation's size.

    Truncation stays within the tolerance over the whole run. For any tolerance, a step's truncation of a small motion
    is at most some roundings: fits average less than that.

    Args:
        epsilon (numpy.ndarray, shape (points,)): Relative size of the perturbation.
        sampling (Sampling): Its spacing, number of intervals and tolerance.
    """
    sizes, index = np.unique(np.minimum(1.0, measure.MAX_GROWTH * epsilon), return_inverse=True)
    truncation = np.array([direct.truncation(a, ORDER) for a in sizes.tolist()])[index]
    excess = sampling.intervals * sampling.spacing ** (ORDER + 1) * truncation / sampling.tolerance
    min_steps = math.ceil(sampling.spacing / MAX_STEP)
    return np.clip(np.ceil(np.maximum(excess, 1e-300) ** (1.0 / ORDER)), min_steps, direct.MAX_STEPS).astype(np.int64)


def plan_example() -> None:
    """Compute the plan of one run as an example, which compiles the kernels of the planning."""
    direct.truncation(1.0, ORDER)
    cut(np.zeros(1, np.int64), 1)


@njit(**INLINE)
def zero_limit(full, half, quarter):
    """Return the limit at zero size of samples of full, half and quarter size, without second and fourth order."""
    return quarter + (19.0 * (quarter - half) + (full - half)) / 45.0


@njit(void(LANES, LANES, int64, boolean, int64, LANES), **INNER)
def _project_motions(project, R, states, has_both, sizes, D):
    """Write the channels of the motions of each size: of half the difference of both sides, if there are two."""
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
                    D[row, lane] += project[c, j * W + lane] * (0.5 * (x - M[j * W + lane]) if has_both else x)
            for lane in range(lanes):
                D[row, lane] *= P[states * W + lane]


@njit(void(ADVANCE, LANES, ROWS, LANES, *3 * (int64,), LANES, ROWS), **INNER)
def _measure_halving(advance, R, K, project, num_compared, states, steps, D, change):
    """Integrate from each lane's largest state over an interval with steps and twice as many; write the change."""
    for repeat in range(2):
        for i in range(states * W):
            R[0, i] = K[i]
        advance(R[0], steps * (repeat + 1))
        _project_motions(project, R, states, False, 1, D[repeat * project.shape[0] :])
        for lane in range(W):
            R[0, (states + 1) * W + lane] *= 0.5
    for c in range(num_compared):
        for lane in range(W):
            change[lane] = max(change[lane], abs(D[c, lane] - D[project.shape[0] + c, lane]))


@njit(void(ADVANCE, CHECK, TAKE, RUNS, *(int64[::1],) * 4, float64, float64[:, :, ::1]), nogil=True, **OPTIONS)
def run_blocks(advance, check, take, runs, steps, order, bounds, numbers, spacing, blocks):
    """Integrate block after block, and call a measurement with every sample.

    Args:
        advance, check (functions): Of the system, see the module.
        take (function): Called with every sample, see TAKE_TYPE.
        runs (Runs): All points.
        steps (numpy.ndarray, shape (points,)): Steps between samples.
        order, bounds (numpy.ndarray): Points order[bounds[j]:bounds[j + 1]] are block j.
        numbers (numpy.ndarray): Numbers of samples, of states, of channels that are compared when steps are halved, of
            sizes of a point with one side; then those of the measurement.
        spacing (float): Spacing of the samples, in 1/S.
        blocks (numpy.ndarray, shape (blocks, rows, W)): Zeros; written: the sums of the measurement.
    """
    _, directions, motions, rows = runs.starts.shape
    _, channels, N = runs.project.shape
    count, states, num_compared, num_single = numbers[0], numbers[1], numbers[2], numbers[3]
    R, K, D = scratch(6 * rows).reshape(6, rows * W), scratch(states), rows_of(3 * channels)
    project = scratch(channels * N).reshape(channels, N * W)
    for b in range(bounds.size - 1):
        first, lanes, Q = bounds[b], bounds[b + 1] - bounds[b], blocks[b]
        number, has_both = steps[order[first]], runs.has_both_sides[order[first]] > 0
        sizes = len(SIZES) if has_both else num_single
        for lane in range(W):
            i = order[first + min(lane, lanes - 1)]
            Q[SPACING, lane], Q[BOTH_SIDES, lane] = spacing / runs.scale[i], 1.0 if has_both else 0.0
            for j in range(runs.point_data.shape[1]):
                Q[INPUTS + j, lane] = runs.point_data[i, j]
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
                    for motion in range(0, 2 * sizes, 1 if has_both else 2):
                        advance(R[motion], number)
                check(R[0])
                _project_motions(project, R, states, has_both, sizes, D)
                goes_on = take(D, R[0], Q, numbers, direction, k)
                for row in range(0, states * W, W):
                    for lane in range(Q.shape[1]):
                        K[row + lane] = R[0, row + lane] if Q[LARGER, lane] > 0.0 else K[row + lane]
                if not goes_on:
                    break
        _measure_halving(advance, R, K, project, num_compared, states, number, D, Q[CHANGE])


def refine_steps(integrator, measurement, runs, sampling):
    """Return the raw results of points; points that have not converged are run again with twice the steps.

    Args:
        integrator (Integrator): The system's functions.
        measurement (Measurement): How samples are measured.
        runs (Runs): Points and their runs.
        sampling (Sampling): How runs are sampled.
    """
    steps = steps_per_sample(runs.epsilon, sampling)
    numbers = np.array([sampling.intervals + 1, integrator.states, *measurement.numbers])
    open_points, raw = np.arange(steps.size), None
    for _ in range(MAX_HALVINGS + 1):
        if open_points.size == 0 and raw is not None:
            break
        batch = runs if open_points.size == steps.size else Runs(*(np.ascontiguousarray(x[open_points]) for x in runs))
        key = (2 * steps[open_points] + batch.has_both_sides) * (batch.family.max(initial=0) + 1) + batch.family
        order, bounds = cut(np.unique(key, return_inverse=True)[1], 1)
        plan = (steps[open_points], order, bounds, numbers)
        blocks = scratch((bounds.size - 1) * measurement.num_rows).reshape(bounds.size - 1, measurement.num_rows, W)
        run_blocks(*integrator[:2], measurement.take, batch, *plan, sampling.spacing, blocks)
        result = measurement.raw_results(*plan, blocks)
        raw = result if raw is None else raw
        raw[open_points] = result
        open_points = open_points[
            ~(has_converged(result, sampling.intervals, sampling.tolerance) | ~np.isfinite(result[:, 0]))
        ]
        steps[open_points] *= 2
    return raw


def has_converged(raw, intervals, tolerance):
    """Return True if halving the step changes less than the tolerance plus rounding.

    Args:
        raw (numpy.ndarray, shape (points, columns)): Raw results, with columns HALVING and STEPS.
        intervals (int): Number of sample intervals.
        tolerance (float): Relative error allowed over the run.
    """
    rounding = 8.0 * UNIT * np.sqrt(raw[:, STEPS])
    return (raw[:, HALVING] - rounding) * intervals <= tolerance
