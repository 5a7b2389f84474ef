r"""Motions of first-order systems near an equilibrium, many side by side, and their spectra.

Of every point several runs are made, from perturbations in different directions; see :mod:`kernels.runs`. The n samples
of a run are :math:`y = P x`, P an orthonormal basis, in units of the states' sizes, of what the conserved quantities
leave free. They count until y has grown tenfold, or the extrapolation to zero amplitude leaves more than BENT of it
after the first ENOUGH samples; :mod:`kernels.spectrum` measures them, or where they are many, means
of two neighbours in their place: half the work, for the model is the same with M², and an error that bounds every
sample's bounds a mean's. Of what white noise leaves they lose (rate x spacing)²/12, some per cent at most.

*Error.* A sample's error is bounded by TRUST times the scatter, what halving the step changes, and what the
extrapolation to zero amplitude leaves: with b the distance from the samples extrapolated once, and d that from those of
the whole perturbation, both in the root mean square, :math:`b\,[2 + 3\min(15b/d, 10)]`, as of
:func:`kernels.oscillations.errors`. An error of that size in every sample, of whatever shape, moves a measured value by
:math:`\sqrt{N}\,\sigma_1` times it at most, :math:`\sigma_1` the standard deviation for noise of one. So the errors
are bounds, not standard errors.

*Rounding.* Every step adds its own rounding, of standard deviation :math:`2^{-52}/\sqrt{12}` of the largest sample or
less, and the motion carries it on. The matrix that sums over the m samples of a run has a norm of :math:`2m/\pi`, so
that the value moves by :math:`\sigma_1 m\sqrt{k}\,2^{-52}` at five standard deviations, k the steps of a sample
(WALK). The coefficients of the equations are rounded too, which all motions share and no sample shows: the matrix is
off by BENDING roundings of the scale in Frobenius' norm; :mod:`kernels.invariants` says what follows.

Lanes are as in :mod:`kernels.blocks`, and a point's bits depend on the point alone.
"""

import math

import numpy as np

from kernels import codes, measure
from kernels.blocks import LANES, ROWS, W, scratch
from kernels.jit import OPTIONS, PASSED, float64, int64, njit, void, whole_vectors
from kernels.runs import (
    CHANGE,
    GIVEN,
    LARGER,
    LEAST_SPAN,
    PAIR,
    SPACING,
    TAKEN,
    Measurement,
    at_zero,
    has_converged,
    refined,
)
from kernels.spectrum import fit_block
from kernels.statuses import NON_FINITE, NOT_CONVERGED, NOT_EXCITED, OK, SHORT_WINDOW

TRUST = 3.0  # multiples of the scatter in the bound
WALK = 1.0  # roundings of the largest sample, a sample and square root of a step
BENDING = 4.0  # roundings of the scale by which the coefficients of the equations may be off
MEANS_FROM = 4  # times the samples that a run needs: where it has more, means of two serve as well as both
LINEAR = 0.25  # largest error of the samples by the amplitude, over their least singular value
BENT, ENOUGH = 1e-5, 16  # the window ends where b exceeds this part of a sample, but not before so many samples
NEXT, GROWING, FALLING = 2.0, 3.0, 10.0  # in what the extrapolation leaves: of b, of it where orders do not fall

# Columns of a raw result before those of `spectrum`, the first two as of `runs`: LEFT is what the extrapolation leaves
# of all samples together, over the largest. After these follow the drifts of the conserved quantities.
HALVING, STEPS, SAMPLES, AMPLITUDE, LEFT = range(5)
FIRST = 5

# Rows of a block, W lanes each, after the first of `runs`: the scale; largest sample at the start, so far and of this
# one, square of its b, whether the window is open; sums of squares of b and d. Then each quantity's value at the start
# and its largest change, the samples' weights, and the samples.
SCALE, START, LARGEST, SIZE, FAR, OPEN, ONCE, WHOLE, QUANTITY = range(GIVEN, GIVEN + 9)


@njit(TAKEN, **PASSED)
def take(D, P, Q, numbers, direction, k):
    """Take one sample of every lane, extrapolated to zero amplitude; return whether any lane's window is open."""
    whole_vectors()
    count, states, n, quantities, runs, lanes = numbers[0], numbers[1], numbers[2], numbers[4], numbers[5], Q.shape[1]
    weight = np.uint64(QUANTITY + 2 * quantities + direction * count + k)
    first, pair = QUANTITY + 2 * quantities + runs * count + (direction * count + k) * n, Q[PAIR, 0] > 0.0
    for lane in range(lanes):
        Q[SIZE, lane], Q[FAR, lane] = 0.0, 0.0
    for i in range(n):
        for lane in range(lanes):
            x = D[i, lane]
            Q[first + i, lane] = x
            Q[SIZE, lane] = max(Q[SIZE, lane], abs(x))
    for i in range(n if pair else 0):
        for lane in range(lanes):
            half, quarter = D[n + i, lane], D[2 * n + i, lane]
            y = at_zero(D[i, lane], half, quarter)
            once = y - (quarter + (quarter - half) / 3.0)
            Q[first + i, lane] = y
            Q[SIZE, lane] = max(Q[SIZE, lane], abs(y))
            Q[FAR, lane] += once * once
    opened = 0
    for lane in range(lanes):
        size, far, start, largest = Q[SIZE, lane], Q[FAR, lane], Q[START, lane], Q[LARGEST, lane]
        start = size if k == 0 else start
        near = (k < ENOUGH) | (far <= (BENT * size) * (BENT * size))
        inside = ((k == 0) | (Q[OPEN, lane] > 0.0)) & (size <= measure.WINDOW * start) & near
        larger = inside & (size > largest)
        Q[START, lane], Q[OPEN, lane] = start, 1.0 if inside else 0.0
        Q[LARGER, lane], Q[LARGEST, lane] = 1.0 if larger else 0.0, size if larger else largest
        Q[ONCE, lane] += far if inside else 0.0
        opened += 1 if inside else 0
    for lane in range(lanes):
        Q[weight, lane] = Q[OPEN, lane]
    for i in range(n if pair else 0):
        for lane in range(lanes):
            whole = Q[first + i, lane] - D[i, lane]
            Q[WHOLE, lane] += whole * whole if Q[OPEN, lane] > 0.0 else 0.0
    for i in range(n if opened < lanes else 0):
        for lane in range(lanes):
            Q[first + i, lane] = Q[first + i, lane] if Q[OPEN, lane] > 0.0 else 0.0
    for q in range(quantities):
        value, drift = QUANTITY + 2 * q, QUANTITY + 2 * q + 1
        for lane in range(lanes):
            x = P[(states + 2 + q) * W + lane]
            Q[value, lane] = x if k == 0 else Q[value, lane]
            far = max(Q[drift, lane], abs(x - Q[value, lane]))
            Q[drift, lane] = far if Q[OPEN, lane] > 0.0 else Q[drift, lane]
    return opened > 0


@njit(void(LANES, LANES, *3 * (int64,), ROWS, ROWS, int64), **OPTIONS)
def _take_means(Y, weight, runs, count, n, used, h, most):
    """Take means of two neighbours for samples, in lanes with more than ``most`` of every run; in place.

    A mean's model is the samples' own with M², its error as their bound. Other lanes keep their first samples.
    """
    whole_vectors()
    lanes = used.size
    for r in range(runs):
        for k in range(most):
            to, here, there = r * most + k, r * count + k, r * count + 2 * k
            for lane in range(lanes):
                one, both = weight[here, lane], weight[there + 1, lane]
                weight[to, lane] = both if used[lane] > most else one
            for i in range(n):
                for lane in range(lanes):
                    one, mean = Y[here * n + i, lane], 0.5 * (Y[there * n + i, lane] + Y[(there + 1) * n + i, lane])
                    Y[to * n + i, lane] = weight[to, lane] * (mean if used[lane] > most else one)
    for lane in range(lanes):
        h[lane] *= 2.0 if used[lane] > most else 1.0


@njit(void(*4 * (int64[::1],), float64[:, :, ::1], LANES), nogil=True, **OPTIONS)
def _fit_blocks(steps, order, bounds, numbers, blocks, raw):
    """Measure the samples of block after block into the points' raw results; numbers as of `take`."""
    whole_vectors()
    count, n, quantities, runs = numbers[0], numbers[2], numbers[4], numbers[5]
    floor, bend, used, total = scratch(1), scratch(1), scratch(1), scratch(1)
    part = np.empty((W, codes.HEAD + 4 * n))
    most = count // 2 if count >= MEANS_FROM * (n // runs + 2) else count
    for b in range(bounds.size - 1):
        Q, first, lanes = blocks[b], bounds[b], bounds[b + 1] - bounds[b]
        weight = Q[QUANTITY + 2 * quantities : QUANTITY + 2 * quantities + runs * count]
        Y = Q[QUANTITY + 2 * quantities + runs * count :]
        used[:], total[:] = math.inf, 0.0
        for lane in range(W):
            for r in range(runs):
                window = 0.0
                for k in range(count):
                    window += weight[r * count + k, lane]
                used[lane], total[lane] = min(used[lane], window), total[lane] + window
            number, largest = steps[order[first + min(lane, lanes - 1)]], Q[LARGEST, lane]
            once, whole = math.sqrt(Q[ONCE, lane]), math.sqrt(Q[WHOLE, lane])
            once *= NEXT + GROWING * (min(15.0 * once / whole, FALLING) if whole > 0.0 else 0.0)
            Q[ONCE, lane] = once / largest
            rounding = 4.0 * codes.UNIT * math.sqrt(number) * largest
            walk = WALK * codes.UNIT * math.sqrt(number) * (total[lane] / runs) * largest
            floor[lane] = (once + walk) / math.sqrt(n * total[lane]) + max(Q[CHANGE, lane] - rounding, 0.0) * count
        if most < count:
            _take_means(Y, weight, runs, count, n, used, Q[SPACING], most)
        for lane in range(W):
            bend[lane] = BENDING * codes.UNIT * Q[SCALE, lane] * Q[SPACING, lane]
        fit_block(Y, weight, runs, most, n, Q[SPACING], floor, bend, TRUST, lanes, part)
        for lane in range(lanes):
            i = order[first + lane]
            raw[i, SAMPLES], raw[i, STEPS], raw[i, AMPLITUDE] = used[lane], steps[i], Q[LARGEST, lane]
            raw[i, HALVING], raw[i, LEFT] = Q[CHANGE, lane] / Q[LARGEST, lane], Q[ONCE, lane]
            for q in range(quantities):
                raw[i, FIRST + q] = Q[QUANTITY + 2 * q + 1, lane]
            for j in range(part.shape[1]):
                raw[i, FIRST + quantities + j] = part[lane, j]


def rows(runs, quantities, n, intervals):
    """Return the number of rows of a block."""
    return QUANTITY + 2 * quantities + runs * (intervals + 1) * (1 + n)


def run(integrator, points, quantities, sampling):
    """Integrate and measure points; the raw result before anything is named.

    Args:
        integrator (runs.Integrator): What is watched are the conserved quantities' deviations.
        points (runs.Runs): project: P, from the N states' deviations to the n that are measured.
        quantities (int): Number of conserved quantities.

    Returns:
        numpy.ndarray, shape (points, FIRST + quantities + codes.HEAD + 4 n): Columns HALVING, STEPS, SAMPLES,
        AMPLITUDE, LEFT, the largest change of each conserved quantity's deviation, and those of
        :mod:`kernels.spectrum`, in units of s; its errors are bounds.
    """
    runs, n = points.starts.shape[1], points.project.shape[1]

    def fitted(*block):
        raw = np.full((block[0].size, FIRST + quantities + codes.HEAD + 4 * n), np.nan)
        _fit_blocks(*block, raw)
        return raw

    size = rows(runs, quantities, n, sampling.intervals)
    return refined(integrator, Measurement(take, fitted, (n, 1, quantities, runs), size), points, sampling)


def status(raw, quantities, n, intervals, tolerance, runs, spacing):
    """Return the status of each row: OK, SHORT_WINDOW, NOT_CONVERGED, NON_FINITE or NOT_EXCITED.

    A window is short where all runs together hold too few samples to tell n modes and how they scatter, or where it is
    shorter than LEAST_SPAN, in 1/scale as ``spacing`` is: then the normal equations have no digits left.
    """
    fit = raw[:, FIRST + quantities :]
    moved = fit[:, codes.MOVED]
    least = n / runs + 2.0
    cases = [
        ~np.isfinite(raw[:, HALVING]) | ~np.isfinite(moved),
        (raw[:, SAMPLES] < least) | ((raw[:, SAMPLES] - 1.0) * spacing < LEAST_SPAN),
        moved < codes.LEAST_MOVED,
        ~np.isfinite(fit[:, codes.HEAD]),
        ~has_converged(raw, intervals, tolerance),
    ]
    return np.select(cases, [NON_FINITE, SHORT_WINDOW, NOT_EXCITED, NON_FINITE, NOT_CONVERGED], OK).astype(np.int8)


def is_too_wide(raw, quantities, n, scale, paired):
    """Return whether the amplitude leaves no error of the eigenvalues that can be relied on; ``raw`` as of :func:`run`.

    Errors are carried from the samples to the eigenvalues in first order. That holds while what the amplitude can do to
    all samples together is small beside their least singular value; where it is not, or the fit contradicts what holds
    for every motion of the equations (no rate above ``scale``; odd coefficients of the characteristic polynomial vanish
    where eigenvalues come in pairs ±μ, as ``paired`` says), nothing is known.
    """
    fit = raw[:, FIRST + quantities :]
    re, im, re_error, im_error = (fit[:, codes.HEAD + i * n : codes.HEAD + (i + 1) * n] for i in range(4))
    with np.errstate(invalid="ignore", over="ignore"):
        impossible = (np.hypot(re, im) > scale[:, None] + np.hypot(re_error, im_error)).any(axis=1)
        bent = raw[:, LEFT] > LINEAR * fit[:, codes.MOVED]
        return bent | impossible | (paired & (fit[:, codes.ODD] > 1.0))
