r"""Motions of first-order systems near an equilibrium, many in parallel, and their spectra.

Each point has several runs, from perturbations in different directions; see :mod:`kernels.flow.runs`. The n samples of
a run are :math:`y = P x`, with P an orthonormal basis, in units of the states' sizes, of the directions in which
conserved quantities are constant. They count until y has grown tenfold, or the remainder of the extrapolation to zero
amplitude exceeds MAX_REMAINDER of it after the first MIN_SAMPLES samples. :mod:`kernels.flow.spectrum` measures them,
or if they are many, means of two neighbours: half the work, for the model is the same with M², and a bound on every
sample's error bounds a mean's. Errors by white noise grow by (rate x spacing)²/12, some per cent at most.

*Error.* A sample's error is bounded by SCATTER_FACTOR times the scatter, the change by halving the step, and the
remainder of the extrapolation to zero amplitude: with b the distance from the samples extrapolated once, and d that
from those of the whole perturbation, both in the root mean square, :math:`b\,[2 + 3\min(15b/d, 10)]`, as in
:func:`kernels.flow.oscillations.find_errors`. An error of that size in every sample, of any shape, moves a measured
value by at most :math:`\sqrt{N}\,\sigma_1` times it, :math:`\sigma_1` the standard deviation for unit noise. So the
errors are bounds, not standard errors.

*Rounding.* Every step adds its own rounding, of standard deviation :math:`2^{-52}/\sqrt{12}` of the largest sample or
less, and the motion carries it on. The matrix that sums over the m samples of a run has a norm of :math:`2m/\pi`, so
that the value moves by :math:`\sigma_1 m\sqrt{k}\,2^{-52}` at five standard deviations, k the steps of a sample
(WALK_FACTOR). The coefficients of the equations are rounded too, which all motions share, so that no sample shows it:
the error of the matrix is COEFFICIENT_ERROR roundings of the scale in Frobenius' norm; for its effect see
:mod:`kernels.flow.invariants`.

Lanes are as in :mod:`kernels.compile.blocks`, and a point's bits depend on the point alone.
"""

import math

import numpy as np

from kernels.compile.blocks import LANES, ROWS, W, scratch
from kernels.compile.jit import OPTIONS, PASSED, float64, int64, njit, void
from kernels.estimator import measure
from kernels.estimator.statuses import NON_FINITE, NOT_CONVERGED, NOT_EXCITED, OK, SHORT_WINDOW
from kernels.flow import codes
from kernels.flow.runs import (
    BOTH_SIDES,
    CHANGE,
    INPUTS,
    LARGER,
    MIN_SPAN,
    SPACING,
    TAKE_TYPE,
    Measurement,
    has_converged,
    refine_steps,
    zero_limit,
)
from kernels.flow.spectrum import fit_block

SCATTER_FACTOR = 3.0  # multiple of the scatter in the error bound: three standard deviations
WALK_FACTOR = 1.0  # roundings of the largest sample, per sample and per square root of a step: five standard deviations
COEFFICIENT_ERROR = 4.0  # error of the coefficients of the equations, in roundings of the scale
MIN_SURPLUS = 4  # a run with more than this multiple of its minimum number of samples is measured by means of two
MAX_NONLINEARITY = 0.25  # largest error of the samples by the amplitude, over their least singular value
MAX_REMAINDER, MIN_SAMPLES = 1e-5, 16  # the window ends if b exceeds this fraction of a sample after so many samples
BASE_FACTOR, DECAY_FACTOR, MAX_DECAY = 2.0, 3.0, 10.0  # the factors 2, 3 and 10 of b [2 + 3 min(15b/d, 10)]

# Columns of a raw result before those of `spectrum`, the first two as of `runs`: REMAINDER is that of the extrapolation
# for all samples together, over the largest. After these follow the drifts of the conserved quantities.
HALVING, STEPS, SAMPLES, AMPLITUDE, REMAINDER = range(5)
FIRST = 5

# Rows of a block, W lanes each, after the first of `runs`: the scale; largest sample at the start, until now and of the
# current sample, square of its b, whether the window is open; sums of squares of b and d. Then each quantity's value at
# the start and its largest change, the samples' weights, and the samples.
SCALE, START, LARGEST, SIZE, DISTANCE, OPEN, ONCE_SQUARES, WHOLE_SQUARES, QUANTITY = range(INPUTS, INPUTS + 9)


@njit(TAKE_TYPE, **PASSED)
def take_sample(D, P, Q, numbers, direction, k):
    """Store one sample of every lane, extrapolated to zero amplitude; return whether any lane's window is open.

    `D`, `P`, `Q`, numbers, direction, `k`: samples, rows of the first motion, block, numbers, run and sample, as in
    :data:`kernels.flow.runs.TAKE_TYPE`.
    """
    count, states, n, quantities, runs, lanes = numbers[0], numbers[1], numbers[2], numbers[4], numbers[5], Q.shape[1]
    weight = np.uint64(QUANTITY + 2 * quantities + direction * count + k)
    first, has_both = QUANTITY + 2 * quantities + runs * count + (direction * count + k) * n, Q[BOTH_SIDES, 0] > 0.0
    for lane in range(lanes):
        Q[SIZE, lane], Q[DISTANCE, lane] = 0.0, 0.0
    for i in range(n):
        for lane in range(lanes):
            x = D[i, lane]
            Q[first + i, lane] = x
            Q[SIZE, lane] = max(Q[SIZE, lane], abs(x))
    for i in range(n if has_both else 0):
        for lane in range(lanes):
            half, quarter = D[n + i, lane], D[2 * n + i, lane]
            y = zero_limit(D[i, lane], half, quarter)
            remainder = y - (quarter + (quarter - half) / 3.0)
            Q[first + i, lane] = y
            Q[SIZE, lane] = max(Q[SIZE, lane], abs(y))
            Q[DISTANCE, lane] += remainder * remainder
    num_open = 0
    for lane in range(lanes):
        size, distance, start, largest = Q[SIZE, lane], Q[DISTANCE, lane], Q[START, lane], Q[LARGEST, lane]
        start = size if k == 0 else start
        is_near = (k < MIN_SAMPLES) | (distance <= (MAX_REMAINDER * size) * (MAX_REMAINDER * size))
        is_inside = ((k == 0) | (Q[OPEN, lane] > 0.0)) & (size <= measure.MAX_GROWTH * start) & is_near
        is_larger = is_inside & (size > largest)
        Q[START, lane], Q[OPEN, lane] = start, 1.0 if is_inside else 0.0
        Q[LARGER, lane], Q[LARGEST, lane] = 1.0 if is_larger else 0.0, size if is_larger else largest
        Q[ONCE_SQUARES, lane] += distance if is_inside else 0.0
        num_open += 1 if is_inside else 0
    for lane in range(lanes):
        Q[weight, lane] = Q[OPEN, lane]
    for i in range(n if has_both else 0):
        for lane in range(lanes):
            change = Q[first + i, lane] - D[i, lane]
            Q[WHOLE_SQUARES, lane] += change * change if Q[OPEN, lane] > 0.0 else 0.0
    for i in range(n if num_open < lanes else 0):
        for lane in range(lanes):
            Q[first + i, lane] = Q[first + i, lane] if Q[OPEN, lane] > 0.0 else 0.0
    for q in range(quantities):
        value, drift = QUANTITY + 2 * q, QUANTITY + 2 * q + 1
        for lane in range(lanes):
            x = P[(states + 2 + q) * W + lane]
            Q[value, lane] = x if k == 0 else Q[value, lane]
            distance = max(Q[drift, lane], abs(x - Q[value, lane]))
            Q[drift, lane] = distance if Q[OPEN, lane] > 0.0 else Q[drift, lane]
    return num_open > 0


@njit(void(LANES, LANES, *3 * (int64,), ROWS, ROWS, int64), **OPTIONS)
def _average_neighbours(Y, weight, runs, count, n, window, spacing, max_samples):
    """Replace samples by means of two neighbours, in lanes with more than ``max_samples`` of every run; in place.

    A mean's model is that of the samples with M², with the same error bound. Lanes with fewer samples are unchanged.
    """
    lanes = window.size
    for r in range(runs):
        for k in range(max_samples):
            new, old, pair = r * max_samples + k, r * count + k, r * count + 2 * k
            for lane in range(lanes):
                sample, pair_weight = weight[old, lane], weight[pair + 1, lane]
                weight[new, lane] = pair_weight if window[lane] > max_samples else sample
            for i in range(n):
                for lane in range(lanes):
                    sample, mean = Y[old * n + i, lane], 0.5 * (Y[pair * n + i, lane] + Y[(pair + 1) * n + i, lane])
                    Y[new * n + i, lane] = weight[new, lane] * (mean if window[lane] > max_samples else sample)
    for lane in range(lanes):
        spacing[lane] *= 2.0 if window[lane] > max_samples else 1.0


@njit(void(*4 * (int64[::1],), float64[:, :, ::1], LANES), nogil=True, **OPTIONS)
def _fit_blocks(steps, order, bounds, numbers, blocks, raw):
    """Measure the samples of block after block into the points' raw results; numbers as in `take_sample`."""
    count, n, quantities, runs = numbers[0], numbers[2], numbers[4], numbers[5]
    floor, matrix_error, shortest, total = scratch(1), scratch(1), scratch(1), scratch(1)
    fit = np.empty((W, codes.HEAD + 4 * n))
    max_samples = count // 2 if count >= MIN_SURPLUS * (n // runs + 2) else count
    for b in range(bounds.size - 1):
        Q, first, lanes = blocks[b], bounds[b], bounds[b + 1] - bounds[b]
        weight = Q[QUANTITY + 2 * quantities : QUANTITY + 2 * quantities + runs * count]
        Y = Q[QUANTITY + 2 * quantities + runs * count :]
        shortest[:], total[:] = math.inf, 0.0
        for lane in range(W):
            for r in range(runs):
                window = 0.0
                for k in range(count):
                    window += weight[r * count + k, lane]
                shortest[lane], total[lane] = min(shortest[lane], window), total[lane] + window
            num_steps, largest = steps[order[first + min(lane, lanes - 1)]], Q[LARGEST, lane]
            remainder, change = math.sqrt(Q[ONCE_SQUARES, lane]), math.sqrt(Q[WHOLE_SQUARES, lane])
            remainder *= BASE_FACTOR + DECAY_FACTOR * (
                min(15.0 * remainder / change, MAX_DECAY) if change > 0.0 else 0.0
            )
            Q[ONCE_SQUARES, lane] = remainder / largest
            rounding = 4.0 * codes.UNIT * math.sqrt(num_steps) * largest
            walk = WALK_FACTOR * codes.UNIT * math.sqrt(num_steps) * (total[lane] / runs) * largest
            floor[lane] = (remainder + walk) / math.sqrt(n * total[lane]) + max(Q[CHANGE, lane] - rounding, 0.0) * count
        if max_samples < count:
            _average_neighbours(Y, weight, runs, count, n, shortest, Q[SPACING], max_samples)
        for lane in range(W):
            matrix_error[lane] = COEFFICIENT_ERROR * codes.UNIT * Q[SCALE, lane] * Q[SPACING, lane]
        fit_block(Y, weight, runs, max_samples, n, Q[SPACING], floor, matrix_error, SCATTER_FACTOR, lanes, fit)
        for lane in range(lanes):
            i = order[first + lane]
            raw[i, SAMPLES], raw[i, STEPS], raw[i, AMPLITUDE] = shortest[lane], steps[i], Q[LARGEST, lane]
            raw[i, HALVING], raw[i, REMAINDER] = Q[CHANGE, lane] / Q[LARGEST, lane], Q[ONCE_SQUARES, lane]
            for q in range(quantities):
                raw[i, FIRST + q] = Q[QUANTITY + 2 * q + 1, lane]
            for j in range(fit.shape[1]):
                raw[i, FIRST + quantities + j] = fit[lane, j]


def count_rows(runs, quantities, n, intervals):
    """Return the number of rows of a block, from the numbers of runs, quantities, states `n` and sample intervals."""
    return QUANTITY + 2 * quantities + runs * (intervals + 1) * (1 + n)


def measure_points(integrator, points, quantities, sampling):
    """Integrate and measure points; return the raw results.

    Args:
        integrator (runs.Integrator): Its check writes the conserved quantities' deviations.
        points (runs.Runs): project: P, from the N states' deviations to the n measured channels.
        quantities (int): Number of conserved quantities.
        sampling (runs.Sampling): How the runs are sampled.

    Returns:
        numpy.ndarray, shape (points, FIRST + quantities + codes.HEAD + 4 n): Columns HALVING, STEPS, SAMPLES,
        AMPLITUDE, REMAINDER, the largest change of each conserved quantity's deviation, and those of
        :mod:`kernels.flow.spectrum`, in units of s; its errors are bounds.
    """
    runs, n = points.starts.shape[1], points.project.shape[1]

    def fit_samples(*block):
        raw = np.full((block[0].size, FIRST + quantities + codes.HEAD + 4 * n), np.nan)
        _fit_blocks(*block, raw)
        return raw

    size = count_rows(runs, quantities, n, sampling.intervals)
    return refine_steps(
        integrator, Measurement(take_sample, fit_samples, (n, 1, quantities, runs), size), points, sampling
    )


def row_status(raw, quantities, n, sampling, runs):
    """Return the status of each row: OK, SHORT_WINDOW, NOT_CONVERGED, NON_FINITE or NOT_EXCITED.

    A window is short if all runs together have too few samples for n modes and their scatter, or if it is shorter than
    MIN_SPAN: then the normal equations lose all digits.

    Args:
        raw (numpy.ndarray): As returned by :func:`measure_points`.
        quantities, n, runs (int): Numbers of conserved quantities, of channels, and of runs.
        sampling (runs.Sampling): How the runs were sampled.
    """
    fit = raw[:, FIRST + quantities :]
    excitation = fit[:, codes.EXCITATION]
    min_samples = n / runs + 2.0
    cases = [
        ~np.isfinite(raw[:, HALVING]) | ~np.isfinite(excitation),
        (raw[:, SAMPLES] < min_samples) | ((raw[:, SAMPLES] - 1.0) * sampling.spacing < MIN_SPAN),
        excitation < codes.MIN_EXCITATION,
        ~np.isfinite(fit[:, codes.HEAD]),
        ~has_converged(raw, sampling.intervals, sampling.tolerance),
    ]
    return np.select(cases, [NON_FINITE, SHORT_WINDOW, NOT_EXCITED, NON_FINITE, NOT_CONVERGED], OK).astype(np.int8)


def is_too_wide(raw, quantities, n, scale, has_pairs):
    """Return whether the amplitude is too large for reliable errors of the eigenvalues.

    Errors are propagated from the samples to the eigenvalues in first order. That is valid while the amplitude's effect
    on all samples together is small compared with their least singular value. If it is not, or if the fit contradicts
    the equations (no rate exceeds the scale; odd coefficients of the characteristic polynomial vanish if eigenvalues
    come in pairs ±μ), errors are unknown.

    Args:
        raw (numpy.ndarray): As returned by :func:`measure_points`.
        `quantities`, `n` (int): Numbers of conserved quantities and of channels.
        scale (numpy.ndarray, shape (points,)): Bound on every rate, s-1.
        has_pairs (numpy.ndarray of bool, shape (points,)): Whether eigenvalues come in pairs ±μ.
    """
    fit = raw[:, FIRST + quantities :]
    re, im, re_error, im_error = (fit[:, codes.HEAD + i * n : codes.HEAD + (i + 1) * n] for i in range(4))
    with np.errstate(invalid="ignore", over="ignore"):
        is_impossible = (np.hypot(re, im) > scale[:, None] + np.hypot(re_error, im_error)).any(axis=1)
        is_nonlinear = raw[:, REMAINDER] > MAX_NONLINEARITY * fit[:, codes.EXCITATION]
        return is_nonlinear | is_impossible | (has_pairs & (fit[:, codes.ODD] > 1.0))
