r"""Eigenvalues from samples of known states, with errors, blind to any theory.

*Model.* Runs r = 1 … R of one linear motion, all n states sampled every h: :math:`y^{(r)}_k = M^k x^{(r)}_0` and noise,
:math:`M = e^{Ah}`. Asked for are the eigenvalues of A, and what is smooth in A where two of them meet.

*Fit.* :mod:`kernels.projection` finds M by least squares, :mod:`kernels.invariants` what follows from it. Each is
compiled by itself and handed over as an argument: a function that calls another by its name compiles it once more.

Not validated: more than 12 states.
"""

import math

from kernels.blocks import W, rows_of, scratch
from kernels.invariants import EQUATIONS, MOVED, SCATTER, TELL, tell
from kernels.jit import PASSED, float64, int64, njit, types, void, whole_vectors
from kernels.projection import EPSILON, LANES, LEAST_MOVED, ROWS, STEP, as_lanes, moments, start, step, sums

STEPS = 4  # of Gauss-Newton, at most
FEW, PIVOTED = 128.0, 16.0  # a bound is so many times as wide where the least pivot is of 16 roundings or less

FITTED = void(STEP, TELL, LANES, LANES, int64, int64, int64, ROWS, ROWS, ROWS, float64, int64, LANES)
FIT = types.FunctionType(FITTED)


@njit(FITTED, **PASSED)
def fit_block(step, tell, Y, weight, runs, count, n, spacing, floor, bend, trust, lanes, raw):
    """Measure the lanes of a block; step and tell are those of `PARTS`.

    Y, shape (runs*count*n, W): sample k of run r, state i in row (r*count + k)*n + i. weight, shape (runs*count, W):
    1 for a sample that counts, else 0, and Y too; a run's first ones. floor, shape (W,): error of a sample that its
    scatter does not show. bend, shape (W,): as of `tell`. trust: 0 for standard errors, else the multiple of the
    scatter in a bound, as of :mod:`kernels.flows`.
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
        weak = 1.0 + FEW * min(1.0, PIVOTED * EPSILON * covariance[P * P, lane])
        noise[lane] = weak * math.sqrt(equations) * (trust * scatter + floor[lane]) if trust > 0.0 else scatter
    tell(as_lanes(M), as_lanes(X0), runs, n, covariance, noise, bend, spacing, lanes, raw)


PARTS = (fit_block, step, tell)
