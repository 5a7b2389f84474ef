r"""Eigenvalues from samples of known states, with errors, blind to any theory.

*Model.* Runs r = 1 … R of one linear motion, all n states sampled every h: :math:`y^{(r)}_k = M^k x^{(r)}_0` and noise,
:math:`M = e^{Ah}`. Asked for are the eigenvalues of A, and what is smooth in A where two of them meet.

*Fit.* :mod:`kernels.projection` finds M by least squares, :mod:`kernels.invariants` what follows from it. Each is
compiled by itself and handed over as an argument: a function that calls another by its name compiles it once more.

Not validated: more than 12 states.
"""

import math
from typing import NamedTuple

import numpy as np

from kernels.blocks import W, rows_of, scratch
from kernels.invariants import (
    DISCRIMINANT,
    DISCRIMINANT_ERROR,
    EQUATIONS,
    HEAD,
    MOVED,
    PRODUCT,
    PRODUCT_ERROR,
    SCATTER,
    SUM,
    SUM_ERROR,
    TELL,
    tell,
)
from kernels.jit import OPTIONS, PASSED, float64, int64, njit, types, void, whole_vectors
from kernels.projection import LANES, LEAST_MOVED, ROWS, STEP, as_lanes, moments, start, step, sums

MOST_STATES = 12
STEPS = 4  # of Gauss-Newton, at most

FITTED = void(STEP, TELL, LANES, LANES, int64, int64, int64, ROWS, ROWS, float64, int64, LANES)
FIT = types.FunctionType(FITTED)


@njit(FITTED, **PASSED)
def fit_block(step, tell, Y, weight, runs, count, n, spacing, floor, trust, lanes, raw):
    """Measure the lanes of a block; step and tell are those of `PARTS`.

    Y, shape (runs*count*n, W): sample k of run r, state i in row (r*count + k)*n + i. weight, shape (runs*count, W):
    1 for a sample that counts, else 0, and Y too; a run's first ones. floor, shape (W,): error of a sample that its
    scatter does not show. trust: 0 for standard errors, else the multiple of the scatter in a bound (see `bound`).
    """
    whole_vectors()
    P = runs * n
    Y, counts = Y.reshape(Y.size), weight.reshape(weight.size)
    XX, XR, M, X0 = scratch(n * n), scratch(n * n), scratch(n * n), scratch(P)
    x, d, Z = scratch(2 * n), scratch(n), scratch(2 * P * n)
    XZ, HH, HR, RR = scratch(P * n * n), scratch(P * P), scratch(P), scratch(1)
    moved, rest, change, covariance, noise = scratch(1), scratch(1), scratch(1), rows_of(P * P + 1), scratch(1)
    change[:], noise[:] = math.inf, math.nan
    moments(Y, counts, runs, count, n, XX, XR, x, d)
    start(as_lanes(XX), as_lanes(XR), n, as_lanes(M), moved)
    for r in range(runs):
        for at in range(n * W):
            X0[r * n * W + at] = Y[r * count * n * W + at]
    for _ in range(STEPS):
        sums(Y, counts, M, X0, runs, count, n, x, d, Z, XX, XR, XZ, HH, HR, RR)
        given = (as_lanes(XX), as_lanes(XR), as_lanes(XZ), as_lanes(HH), as_lanes(HR), as_lanes(RR))
        if not step(as_lanes(M), as_lanes(X0), runs, n, *given, covariance, rest, moved, change):
            break
    for lane in range(lanes):
        row, used = raw[lane], 0.0
        for k in range(runs * count):
            used += weight[k, lane]
        equations = n * used
        free = equations - n * n - P
        for i in range(row.size):
            row[i] = math.nan
        row[EQUATIONS], row[MOVED] = equations, moved[lane]
        if moved[lane] < LEAST_MOVED or free < 1.0:
            continue
        scatter = math.sqrt(rest[lane] / free)
        row[SCATTER] = scatter
        noise[lane] = math.sqrt(equations) * (trust * scatter + floor[lane]) if trust > 0.0 else scatter
    tell(as_lanes(M), as_lanes(X0), runs, n, covariance, noise, spacing, lanes, raw)


PARTS = (fit_block, step, tell)


@njit(
    void(FIT, STEP, TELL, float64[:, :, :, ::1], float64[::1], int64[:, ::1], float64, float64[:, ::1]),
    nogil=True,
    **OPTIONS,
)
def _fit_points(fit, step, tell, samples, spacing, used, trust, raw):
    """Points W at a time, each with its runs' samples, shape (points, runs, count, n); the last block is padded."""
    whole_vectors()
    points, runs, count, n = samples.shape
    Y, weight = rows_of(runs * count * n), rows_of(runs * count)
    floor, h, part = np.zeros(W), np.empty(W), np.empty((W, raw.shape[1]))
    for first in range(0, points, W):
        lanes = min(W, points - first)
        for lane in range(W):
            i = first + min(lane, lanes - 1)
            h[lane] = spacing[i]
            for r in range(runs):
                for k in range(count):
                    inside = k < used[i, r]
                    weight[r * count + k, lane] = 1.0 if inside else 0.0
                    for j in range(n):
                        Y[(r * count + k) * n + j, lane] = samples[i, r, k, j] if inside else 0.0
        fit(step, tell, Y, weight, runs, count, n, h, floor, trust, lanes, part)
        for lane in range(lanes):
            for j in range(raw.shape[1]):
                raw[first + lane, j] = part[lane, j]


class Spectrum(NamedTuple):
    """Hold what samples say: arrays over the points, with the eigenvalues along the last axis.

    Attributes:
        eigenvalues: s-1, complex, ordered by imaginary, then real part; NaN where a mode was not moved.
        errors: standard error of the real part + i that of the imaginary part, s-1.
        invariants: S (s-2), D (s-4) and S² - 4D (s-4), last axis; NaN unless there are four eigenvalues.
        invariant_errors: their standard errors.
        scatter: root mean square of what the model leaves of the samples, in their unit.
        moved: smallest singular value of the samples over the largest.
    """

    eigenvalues: np.ndarray
    errors: np.ndarray
    invariants: np.ndarray
    invariant_errors: np.ndarray
    scatter: np.ndarray
    moved: np.ndarray


def measure(samples, spacing, used=None):
    """Measure the eigenvalues of sampled linear motions.

    Args:
        samples (array_like, shape (..., runs, count, n)): All n states at equally spaced times, in units in which their
            noise is alike.
        spacing (float or array_like, shape (...)): Time between samples, in s; no mode may turn by more than half a
            radian in it.
        used (array_like of int, shape (..., runs), optional): How many samples of each run count; left out, all.

    Returns:
        Spectrum.

    Raises:
        ValueError: For a wrong shape, more than MOST_STATES states, or too few samples for the n² + runs n parameters.
    """
    samples = np.asarray(samples, dtype=np.float64)
    if samples.ndim < 3 or not 1 <= samples.shape[-1] <= MOST_STATES:
        raise ValueError(f"samples must have the shape (..., runs, count, n ≤ {MOST_STATES}), not {samples.shape}")
    runs, count, n = samples.shape[-3:]
    shape = samples.shape[:-3]
    if runs * count <= n + runs:
        raise ValueError(f"{runs} runs of {count} samples are too few for {n} states; allowed: more than n + runs")
    flat = np.ascontiguousarray(samples.reshape(-1, runs, count, n))
    h = np.broadcast_to(np.asarray(spacing, dtype=np.float64), shape).reshape(-1).copy()
    most = np.full((*shape, runs), count) if used is None else np.broadcast_to(used, (*shape, runs))
    raw = np.empty((len(flat), HEAD + 4 * n))
    _fit_points(*PARTS, flat, h, np.array(most.reshape(-1, runs), dtype=np.int64), 0.0, raw)
    raw = raw.reshape(*shape, -1)
    re, im, e_re, e_im = (raw[..., HEAD + i * n : HEAD + (i + 1) * n] for i in range(4))
    values = raw[..., [SUM, PRODUCT, DISCRIMINANT]]
    errors = raw[..., [SUM_ERROR, PRODUCT_ERROR, DISCRIMINANT_ERROR]]
    return Spectrum(re + 1j * im, e_re + 1j * e_im, values, errors, raw[..., SCATTER], raw[..., MOVED])
