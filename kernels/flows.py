r"""Motions of first-order systems near an equilibrium, many side by side, and their spectra.

A point is a system with numbers in it and an equilibrium x0, f(x0) = 0. Its motion is carried as the deviation
:math:`x = (\text{state} - x_0)/\varepsilon` in the rows of a scratch array, and advanced by functions that were written
for the system (`advance`, `check`): they come in as arguments. Of every point several runs are made, from nudges in
different directions, and where the nudge is large each from +ε and -ε, of which half the difference counts.

The n samples of a run are :math:`y = P x`, P an orthonormal basis, in units of the states' sizes, of what the conserved
quantities leave free. They count until y has grown tenfold; :mod:`kernels.spectrum` measures them, or where they are
many, means of two neighbours in their place: half the work, for the model is the same with M², and an error that bounds
every sample's bounds a mean's. Of what white noise leaves they lose (rate x spacing)²/12, some per cent at most.

*Error.* A sample's error is bounded by TRUST times the scatter, rounding, what halving the step changes, and what the
size of the nudge can do; an error of that size in every sample, of whatever shape, moves a measured value by
:math:`\sqrt{N}\,\sigma_1` times it at most, :math:`\sigma_1` the standard deviation for noise of one. So the errors
are bounds, not standard errors.

*Blind.* Spacing, length and number of steps come from a bound on every possible rate; nothing here knows an eigenvalue
of theory.

Lanes are as in :mod:`kernels.blocks`, and a point's bits depend on the point alone.
"""

import math

import numpy as np

from kernels import invariants, measure, projection, spectrum
from kernels.blocks import W, rows_of, scratch
from kernels.jit import OPTIONS, float64, int64, njit, void, whole_vectors
from kernels.runs import ADVANCE, CHECK, EPSILON, LEAST_SPAN, RUNS, planned, refined
from kernels.statuses import NON_FINITE, NOT_CONVERGED, NOT_EXCITED, OK, SHORT_WINDOW

ASYMPTOTICALLY_STABLE, STABLE, UNSTABLE, FLUTTER, MARGINAL = range(5)

TRUST = 3.0  # multiples of the scatter in the bound
ROUNDINGS = 16.0  # of the largest sample, a square root of a step
MEANS_FROM = 4  # times the samples that a run needs: where it has more, means of two serve as well as both
LINEAR = 0.25  # largest error of the samples by the amplitude, over their least singular value
CURVED = 4.0  # relative size of quadratic (or, of pairs, cubic) terms per relative size of the motion

# Columns of a raw result before those of `spectrum`; after these follow the drifts of the conserved quantities.
SAMPLES, HALVING, STEPS, AMPLITUDE = range(4)
FIRST = 4


@njit(**OPTIONS)
def _follow(advance, check, P, M, K, Y, weight, project, first, n, N, quantities, states, steps, pair, count, told):
    """Follow one run of every lane through its samples; told gets the used samples, largest size and drifts."""
    whole_vectors()
    lanes = weight.shape[1]
    for k in range(count):
        if k > 0:
            advance(P, steps)
            if pair:
                advance(M, steps)
        check(P)
        for i in range(n):
            row = (first + k) * n + i
            for lane in range(lanes):
                Y[row, lane] = 0.0
            for j in range(N):
                for lane in range(lanes):
                    x = P[j * W + lane]
                    Y[row, lane] += project[i * N + j, lane] * (0.5 * (x - M[j * W + lane]) if pair else x)
        opened = _window(P, K, Y, weight, first, k, n, quantities, states, told)
        if not opened:
            for later in range(first + k + 1, first + count):
                for lane in range(lanes):
                    weight[later, lane] = 0.0
                    for i in range(n):
                        Y[later * n + i, lane] = 0.0
            break


# Rows of `told`: what a run shows; then the quantities' values at the start and their largest changes.
START, LARGEST, USED, SIZE, OPEN, QUANTITY = range(6)


@njit(**OPTIONS)
def _window(P, K, Y, weight, first, k, n, quantities, states, told):
    """Close the windows of lanes that have grown tenfold; keep the largest state in K; whether any window is open."""
    whole_vectors()
    lanes = weight.shape[1]
    for lane in range(lanes):
        told[SIZE, lane] = 0.0
    for i in range((first + k) * n, (first + k + 1) * n):
        for lane in range(lanes):
            told[SIZE, lane] = max(told[SIZE, lane], abs(Y[i, lane]))
    if k == 0:
        for lane in range(lanes):
            told[START, lane], told[OPEN, lane], told[USED, lane] = told[SIZE, lane], 1.0, 0.0
    for lane in range(lanes):
        inside = told[OPEN, lane] if told[SIZE, lane] <= measure.WINDOW * told[START, lane] else 0.0
        told[OPEN, lane] = inside
        weight[first + k, lane] = inside
        told[USED, lane] += inside
        told[SIZE, lane] = told[SIZE, lane] if inside > 0.0 else 0.0
    opened, larger = False, False
    for lane in range(lanes):
        opened = opened or told[OPEN, lane] > 0.0
        larger = larger or told[SIZE, lane] > told[LARGEST, lane]
    for i in range((first + k) * n, (first + k + 1) * n):
        for lane in range(lanes):
            Y[i, lane] = Y[i, lane] if told[OPEN, lane] > 0.0 else 0.0
    if larger:
        for row in range(states):
            for lane in range(lanes):
                at = row * W + lane
                K[at] = P[at] if told[SIZE, lane] > told[LARGEST, lane] else K[at]
        for lane in range(lanes):
            told[LARGEST, lane] = max(told[LARGEST, lane], told[SIZE, lane])
    for q in range(quantities):
        value, drift = QUANTITY + 2 * q, QUANTITY + 2 * q + 1
        for lane in range(lanes):
            x = P[(states + 2 + q) * W + lane]
            start = x if k == 0 else told[value, lane]
            told[value, lane] = start
            far = max(told[drift, lane], abs(x - start))
            told[drift, lane] = far if told[OPEN, lane] > 0.0 else told[drift, lane]
    return opened


@njit(**OPTIONS)
def _halve(advance, P, M, K, project, n, N, states, steps, change):
    """The interval that begins at each lane's largest state, with steps and with twice as many: the largest change."""
    whole_vectors()
    lanes = change.size
    coarse = rows_of(n)
    for turn in range(2):
        for i in range(states * W):
            P[i] = K[i]
        advance(P, steps * (turn + 1))
        for lane in range(lanes):
            for i in range(n):
                total = 0.0
                for j in range(N):
                    total += project[i * N + j, lane] * P[j * W + lane]
                if turn == 0:
                    coarse[i, lane] = total
                else:
                    change[lane] = max(change[lane], abs(total - coarse[i, lane]))
            if turn == 0:
                change[lane] = 0.0
                P[(states + 1) * W + lane] *= 0.5


@njit(**OPTIONS)
def _take_means(Y, weight, runs, count, n, used, h, kept):
    """Means of two neighbours in place of samples, in lanes with more than ``kept`` of every run; in place.

    A mean's model is the samples' own with M², its error as their bound. Other lanes keep their first samples.
    """
    whole_vectors()
    lanes = used.size
    for r in range(runs):
        for k in range(kept):
            to, here, there = r * kept + k, r * count + k, r * count + 2 * k
            for i in range(n):
                for lane in range(lanes):
                    mean = 0.5 * (Y[there * n + i, lane] + Y[(there + 1) * n + i, lane])
                    Y[to * n + i, lane] = mean if used[lane] > kept else Y[here * n + i, lane]
            for lane in range(lanes):
                both = weight[there + 1, lane]
                weight[to, lane] = both if used[lane] > kept else weight[here, lane]
            for i in range(n):
                for lane in range(lanes):
                    Y[to * n + i, lane] *= weight[to, lane]
    for lane in range(lanes):
        h[lane] *= 2.0 if used[lane] > kept else 1.0


@njit(
    void(
        *(ADVANCE, CHECK, spectrum.FIT, projection.STEP, invariants.TELL),
        *(RUNS, int64[::1], int64[::1], int64[::1], int64, int64, float64, int64, float64[:, ::1]),
    ),
    nogil=True,
    **OPTIONS,
)
def _run_blocks(advance, check, fit, step, tell, points, steps, order, bounds, states, runs, spacing, count, raw):
    """Integrate and measure block after block: order[bounds[j]:bounds[j + 1]] are the points of block j.

    points.starts: each run from +ε, then, where a point needs them, from -ε.
    """
    whole_vectors()
    _, n, N = points.project.shape
    rows, other = points.starts.shape[2], points.starts.shape[1] - runs  # other: 0 where no point has runs from -ε
    quantities = raw.shape[1] - FIRST - invariants.HEAD - 4 * n
    P, M, K = scratch(rows), scratch(rows), scratch(states)
    Y, weight = rows_of(runs * count * n), rows_of(runs * count)
    basis, told = rows_of(n * N), rows_of(QUANTITY + 2 * quantities)
    floor, h, change, used = scratch(1), scratch(1), scratch(1), scratch(1)
    part = np.empty((W, invariants.HEAD + 4 * n))
    kept = count // 2 if count >= MEANS_FROM * (n // runs + 2) else count
    for b in range(bounds.size - 1):
        first, lanes = bounds[b], bounds[b + 1] - bounds[b]
        number, pair = steps[order[first]], points.twice[order[first]] > 0
        told[:] = 0.0
        used[:] = math.inf
        for lane in range(W):
            i = order[first + min(lane, lanes - 1)]
            h[lane] = spacing / points.scale[i]
            for r in range(n):
                for c in range(N):
                    basis[r * N + c, lane] = points.project[i, r, c]
        for run in range(runs):
            for lane in range(W):
                i = order[first + min(lane, lanes - 1)]
                for r in range(rows):
                    P[r * W + lane], M[r * W + lane] = points.starts[i, run, r], points.starts[i, other + run, r]
                P[(states + 1) * W + lane] = h[lane] / number
                M[(states + 1) * W + lane] = h[lane] / number
            args = (basis, run * count, n, N, quantities, states, number, pair, count, told)
            _follow(advance, check, P, M, K, Y, weight, *args)
            for lane in range(W):
                used[lane] = min(used[lane], told[USED, lane])
        _halve(advance, P, M, K, basis, n, N, states, number, change)
        if kept < count:
            _take_means(Y, weight, runs, count, n, used, h, kept)
        for lane in range(W):
            i = order[first + min(lane, lanes - 1)]
            largest = told[LARGEST, lane]
            reach = points.size[i] * largest
            floor[lane] = ROUNDINGS * EPSILON * math.sqrt(number * count) * largest
            floor[lane] += CURVED * (reach * reach if pair else reach) * largest
            rounding = 4.0 * EPSILON * math.sqrt(number) * largest
            floor[lane] += max(change[lane] - rounding, 0.0) * count
        fit(step, tell, Y, weight, runs, kept, n, h, floor, TRUST, lanes, part)
        for lane in range(lanes):
            row = raw[order[first + lane]]
            row[SAMPLES], row[STEPS], row[AMPLITUDE] = used[lane], number, told[LARGEST, lane]
            row[HALVING] = change[lane] / told[LARGEST, lane]
            for q in range(quantities):
                row[FIRST + q] = told[QUANTITY + 2 * q + 1, lane]
            for j in range(part.shape[1]):
                row[FIRST + quantities + j] = part[lane, j]


def run(integrator, points, runs, quantities, sampling):
    """Integrate and measure points; the raw result before anything is named.

    Parameters
    ----------
    integrator : runs.Integrator
        What is watched are the conserved quantities' deviations.
    points : runs.Runs
        starts: the runs from +epsilon, then, if ``twice`` is 1 anywhere, those from -epsilon. project: P, from the N
        states' deviations to the n that are measured.
    runs, quantities : int
        Numbers of runs from one side and of conserved quantities.
    sampling : runs.Sampling
        How the runs are sampled.

    Returns
    -------
    numpy.ndarray, shape (points, FIRST + quantities + invariants.HEAD + 4 n)
        Columns SAMPLES, HALVING, STEPS, AMPLITUDE, the largest change of each conserved quantity's deviation, and
        those of :mod:`kernels.spectrum`, in units of s; its errors are bounds.
    """
    intervals, spacing, tolerance = sampling
    columns = FIRST + quantities + invariants.HEAD + 4 * points.project.shape[1]

    def kernel(chosen, _, *plan):
        raw = np.full((len(chosen.scale), columns), np.nan)
        numbers = (integrator.states, runs, spacing, intervals + 1)
        _run_blocks(*integrator[:2], *spectrum.PARTS, chosen, *plan, *numbers, raw)
        return raw

    def is_done(raw):
        return converged(raw, intervals, tolerance) | ~np.isfinite(raw[:, HALVING])

    return refined(points, planned(points.size, sampling), kernel, is_done)


def converged(raw, intervals, tolerance):
    """Return True where halving the step changes less than the tolerance plus rounding."""
    rounding = 8.0 * EPSILON * np.sqrt(raw[:, STEPS])
    return (raw[:, HALVING] - rounding) * intervals <= tolerance


def status(raw, quantities, n, intervals, tolerance, runs, spacing):
    """Return the status of each row: OK, SHORT_WINDOW, NOT_CONVERGED, NON_FINITE or NOT_EXCITED.

    A window is short where all runs together hold too few samples to tell n modes and how they scatter, or where it is
    shorter than LEAST_SPAN, in 1/scale as ``spacing`` is: then the normal equations have no digits left.
    """
    told = raw[:, FIRST + quantities :]
    moved = told[:, invariants.MOVED]
    least = n / runs + 2.0
    cases = [
        ~np.isfinite(raw[:, HALVING]) | ~np.isfinite(moved),
        (raw[:, SAMPLES] < least) | ((raw[:, SAMPLES] - 1.0) * spacing < LEAST_SPAN),
        moved < projection.LEAST_MOVED,
        ~np.isfinite(told[:, invariants.HEAD]),
        ~converged(raw, intervals, tolerance),
    ]
    return np.select(cases, [NON_FINITE, SHORT_WINDOW, NOT_EXCITED, NON_FINITE, NOT_CONVERGED], OK).astype(np.int8)


def is_too_wide(raw, quantities, n, size, scale, twice, paired):
    """Return whether the amplitude leaves no error of the eigenvalues that can be relied on.

    Errors are carried from the samples to the eigenvalues in first order. That holds while what the amplitude can do to
    all samples together is small beside their least singular value; where it is not, or the fit contradicts what holds
    for every motion of the equations (no rate above ``scale``; odd coefficients of the characteristic polynomial vanish
    where eigenvalues come in pairs ±μ), nothing is known.

    Parameters
    ----------
    raw : numpy.ndarray
        As of :func:`run`.
    quantities, n : int
        Numbers of conserved quantities and of eigenvalues.
    size, scale : numpy.ndarray
        As of :func:`run`.
    twice, paired : numpy.ndarray of bool
        Whether runs from both sides are made; where the equations make eigenvalues come in pairs ±μ.

    Returns
    -------
    numpy.ndarray of bool
    """
    told = raw[:, FIRST + quantities :]
    re, im, re_error, im_error = (told[:, invariants.HEAD + i * n : invariants.HEAD + (i + 1) * n] for i in range(4))
    with np.errstate(invalid="ignore", over="ignore"):
        reach = size * raw[:, AMPLITUDE]
        bent = CURVED * np.where(twice, reach * reach, reach) * np.sqrt(told[:, invariants.EQUATIONS])
        impossible = (np.hypot(re, im) > scale[:, None] + np.hypot(re_error, im_error)).any(axis=1)
        return (bent > LINEAR * told[:, invariants.MOVED]) | impossible | (paired & (told[:, invariants.ODD] > 1.0))
