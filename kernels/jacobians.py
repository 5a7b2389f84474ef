r"""Scales of many Jacobians, and the condition numbers of their eigenvalues.

With G the absolute values of a Jacobian's terms, in the states' sizes, Perron's root bounds every possible rate. It is
the limit of :math:`\max(G^k)^{1/k}`, which is within some per cent at k = 2^HALVED; its vector is that of the sums of a
high power's rows, and with any positive one S is a bound.

A simple eigenvalue's condition number is that of its vectors, :math:`|y||x|/|y^*x|`, and
:math:`\operatorname{adj}(\lambda_i - A) = xy^*\,\prod_{j\ne i}(\lambda_i - \lambda_j)/(y^*x)`, so that neither is asked
for. The adjugate's polynomial in λ is Faddeev's and Le Verrier's.

Source: Horn and Johnson, Matrix Analysis, sections 5.6 (Gelfand's formula), 8.1 (Collatz and Wielandt's bounds) and
0.8.2 (adjugates).
"""

import math

import numpy as np

from kernels.blocks import W, rows_of, scratch
from kernels.dense import product_in_lanes
from kernels.jit import OPTIONS, complex128, float64, njit, void, whole_vectors

COUPLED = 0.01  # of S, that every state is taken to feel of every other
HALVED = 6  # times, the logarithm of a power's size, for the Perron root
SQUARINGS = 8  # towards the Perron vector


@njit(**OPTIONS)
def _square(power, into, n, largest):
    """Write each matrix's square over its largest element into power, that into ``largest``; into: scratch."""
    product_in_lanes(power, power, into, n)
    _scale(into, power, n * n, largest)


@njit(**OPTIONS)
def _scale(rows, into, count, largest):
    """Write rows over their largest element, which is not negative, and NaN where one is, into ``into``."""
    whole_vectors()
    lanes = largest.size
    largest[:] = 0.0
    for at in range(count):
        for lane in range(lanes):
            x, most = rows[at, lane], largest[lane]
            largest[lane] = most if most > x or most != most else x
    for at in range(count):
        for lane in range(lanes):
            into[at, lane] = rows[at, lane] / largest[lane]


@njit(**OPTIONS)
def _roots(G, n, power, into, largest, out):
    """Write Perron's roots of G, rows i n + j, to some per cent; NaN where one is not finite or vanishes."""
    whole_vectors()
    lanes = out.size
    _scale(G, power, n * n, largest)
    for lane in range(lanes):
        out[lane] = np.log(largest[lane])
    for _ in range(HALVED):
        _square(power, into, n, largest)
        for lane in range(lanes):
            out[lane] = 2.0 * out[lane] + np.log(largest[lane])
    for lane in range(lanes):
        root = np.exp(out[lane] / 2**HALVED)
        out[lane] = root if 0.0 < root < math.inf else math.nan


@njit(void(float64[:, :, ::1], float64[::1]), nogil=True, **OPTIONS)
def roots(matrices, out):
    """Fill ``out`` with Perron's roots of matrices of absolute values, shape (points, n, n)."""
    whole_vectors()
    points, n, _ = matrices.shape
    G, power, into, largest, root = rows_of(n * n), rows_of(n * n), rows_of(n * n), scratch(1), scratch(1)
    for first in range(0, points, W):
        for lane in range(W):
            for i in range(n):
                for j in range(n):
                    G[i * n + j, lane] = matrices[min(first + lane, points - 1), i, j]
        _roots(G, n, power, into, largest, root)
        for lane in range(min(W, points - first)):
            out[first + lane] = root[lane]


@njit(**OPTIONS)
def _bound(G, power, n, u, total, most):
    """Write the sums u of the power's rows, 1 at most, and the largest (G u)/u into ``most``; total: scratch."""
    whole_vectors()
    lanes = most.size
    u[:] = 0.0
    for i in range(n):
        for j in range(n):
            for lane in range(lanes):
                u[i, lane] += power[i * n + j, lane]
    _scale(u, u, n, most)
    most[:] = 0.0
    for i in range(n):
        total[:] = 0.0
        for j in range(n):
            for lane in range(lanes):
                total[lane] += G[i * n + j, lane] * u[j, lane]
        for lane in range(lanes):
            x = total[lane] / u[i, lane]
            most[lane] = most[lane] if most[lane] > x or most[lane] != most[lane] else x


@njit(void(float64[:, :, ::1], float64[:, ::1], float64[::1], float64[:, ::1]), nogil=True, **OPTIONS)
def scales(terms, sizes, S, scaled):
    """Return a bound S on every rate, and the states' sizes, from the Jacobians' terms and the stated sizes.

    terms, shape (points, n, n): absolute values, s-1 in units of the states. S is at least the root, by Collatz and
    Wielandt.
    """
    whole_vectors()
    points, n, _ = terms.shape
    G, power, into, u = rows_of(n * n), rows_of(n * n), rows_of(n * n), rows_of(n)
    largest, root = scratch(1), scratch(1)
    for first in range(0, points, W):
        for lane in range(W):
            point = min(first + lane, points - 1)
            for i in range(n):
                for j in range(n):
                    G[i * n + j, lane] = terms[point, i, j] * sizes[point, j] / sizes[point, i]
        _roots(G, n, power, into, largest, root)
        for i in range(n):
            for j in range(n):
                for lane in range(W):
                    G[i * n + j, lane] += COUPLED / n * root[lane]
                    power[i * n + j, lane] = G[i * n + j, lane] / (2.0 * root[lane]) + (0.5 if i == j else 0.0)
        for _ in range(SQUARINGS):
            _square(power, into, n, largest)
        _bound(G, power, n, u, largest, root)
        for lane in range(min(W, points - first)):
            S[first + lane] = root[lane]
            for i in range(n):
                scaled[first + lane, i] = sizes[first + lane, i] * u[i, lane]


@njit(**OPTIONS)
def _adjugates(A, scale, n, N, T):
    """Write the matrices N_k of adj(λ - A) = Σ λ^(n-1-k) N_k, A over its scale; T is scratch."""
    for i in range(n):
        for j in range(n):
            N[0, i, j] = 1.0 if i == j else 0.0
    for k in range(1, n):
        trace = 0.0
        for i in range(n):
            for j in range(n):
                T[i, j] = 0.0
            for m in range(n):
                factor = A[i, m] / scale
                for j in range(n):
                    T[i, j] += factor * N[k - 1, m, j]
            trace += T[i, i]
        for i in range(n):
            for j in range(n):
                N[k, i, j] = T[i, j] - (trace / k if i == j else 0.0)


@njit(void(float64[:, :, ::1], complex128[:, ::1], float64[::1], float64[:, ::1]), nogil=True, **OPTIONS)
def conditions(A, values, scale, out):
    """Return the condition numbers of eigenvalues, (points, n); infinite where two are one, NaN where one is NaN."""
    n = A.shape[1]
    N, T = np.empty((n, n, n)), np.empty((n, n))
    for point in range(A.shape[0]):
        _adjugates(A[point], scale[point], n, N, T)
        for e in range(n):
            value = values[point, e] / scale[point]
            x, y, apart, size = value.real, value.imag, 1.0, 0.0
            for j in range(n):
                apart *= abs(value - values[point, j] / scale[point]) if j != e else 1.0
            for i in range(n):
                for j in range(n):
                    re, im = N[0, i, j], 0.0
                    for k in range(1, n):
                        re, im = re * x - im * y + N[k, i, j], re * y + im * x
                    size += re * re + im * im
            out[point, e] = max(1.0, math.sqrt(size) / apart) if apart != 0.0 else math.inf
