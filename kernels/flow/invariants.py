r"""Eigenvalues, invariants and their errors from the matrix M of a linear motion and its covariance.

*Errors.* From the last step, :math:`\mathrm{Cov}\,\Theta = s^2\tilde H^{-1}`, :math:`\tilde H` the projected normal
matrix: the Cramér-Rao bound for white noise. The coefficients of
:math:`p(\lambda) = \det(\lambda - A)` follow by Faddeev and Le Verrier,
:math:`\mathrm dc_{n-1-k} = -\operatorname{tr}(N_k\,\mathrm dA)` with polynomials :math:`N_k` in A, so that
:math:`\mathrm dA` may be :math:`M^{-1}\mathrm dM/h`. An eigenvalue's error is :math:`|\delta p/p'|` while that is much
smaller than the distance to the next eigenvalue, else the radius within which the perturbed polynomial has a root,
:math:`\min_k \bigl(\tbinom nk\,|\delta p|\,/\,|p^{(k)}/k!|\bigr)^{1/k}`. An error of A in the motion itself, which no
sample shows, of Frobenius norm b at most, changes the coefficients by :math:`b\,\lVert N_k\rVert` at most. The products
of Faddeev and Le Verrier round, too: if that may exceed p', as for many slow rates and a fast one or for a defective
eigenvalue in several blocks, A is changed by CHANGE_FACTOR times its error, and an eigenvalue's error is MOVE_FACTOR
times its shift over CHANGE_FACTOR.

*Invariants.* For four eigenvalues :math:`S = \tfrac12\sum\lambda^2`, :math:`D = \prod\lambda` and S² - 4D with errors:
for two pairs ±μ1, ±μ2 they are μ1² + μ2², μ1² μ2² and (μ1² - μ2²)², and smooth through any collision.

Symbols: :mod:`kernels.flow.spectrum`.

Source: Marden, Geometry of Polynomials, section 33 (radii).
"""

import math
from typing import NamedTuple

import numpy as np

from kernels.compile.blocks import LANES, ROWS, rows_of, scratch
from kernels.compile.jit import INNER, OPTIONS, boolean, complex128, float64, int64, njit, types, void
from kernels.flow import codes
from kernels.flow.codes import HEAD, MIN_IMAG_GAP, UNIT
from kernels.flow.dense import add_inner, copy_rows, eigenvalues, product_in_lanes, solve_in_lanes, sort_eigenvalues

ROUNDINGS = 8.0  # roundings of the logarithm and of the results from it, relative to the largest eigenvalue
LOGARITHM_FACTOR = 3.0  # multiple of the motion's own error: its coefficients' error, and twice that by the logarithm
ARTANH_TERMS, MAX_TERMS = 20, 200  # terms of artanh's series: enough while |Z| ≤ tan π/8; maximum for larger Z
MAX_EIGHTH = 2e-6  # square of the size of Z to the eighth, up to which the remainder of ARTANH_TERMS is below rounding
MIN_SLOPE = 20.0  # slope of the characteristic polynomial over its rounding, above which an error is divided by it
CHANGE_FACTOR, MOVE_FACTOR = 100.0, 10.0  # change of A over its error for smaller slopes; safety factor of the shifts
# Roundings of a term of a covariance after cancellation in a sum of large terms: a minimum, and a multiple of the
# inverse of the least pivot, which bounds them (a thirtieth of that bound, in an error, covers those of the benchmark).
MIN_LOSS, PIVOT_LOSS = 1e4, 1e-3


class LinearMotions(NamedTuple):
    """Lanes of fitted linear motions."""

    M: np.ndarray  #: matrix of one sample interval, shape (n², lanes)
    X0: np.ndarray  #: starts of the runs, shape (runs n, lanes)
    runs: int
    n: int
    covariance: np.ndarray  #: covariance of M and the starts for unit noise; its last row is the least pivot's inverse


MOTIONS = types.NamedTuple((LANES, LANES, int64, int64, LANES), LinearMotions)


class Polynomial(NamedTuple):
    """The characteristic polynomial of one lane."""

    c: np.ndarray  #: coefficients, c[n] = 1
    change: np.ndarray  #: largest changes of these by errors that no sample shows; that of c[n] is 0
    rounding: np.ndarray  #: largest changes by the rounding of the products in Faddeev and Le Verrier
    K: np.ndarray  #: their covariance for unit noise, shape (n, n)
    noise: float  #: standard deviation of a sample, or a bound on its error
    loss: float  #: relative error of a term of a covariance


POLYNOMIAL = types.NamedTuple((*3 * (float64[::1],), float64[:, ::1], float64, float64), Polynomial)
SCRATCH = types.Tuple((float64[:, ::1], complex128[::1]))


@njit(void(LANES, int64, LANES, types.Tuple((LANES, LANES, LANES, ROWS))), **OPTIONS)
def _matrix_logarithms(M, n, Y, work):
    """Write the logarithm of M into Y, 2 artanh (M - 1)(M + 1)⁻¹ by its series, lane by lane; work is scratch.

    If ARTANH_TERMS do not suffice, as estimated from Z to the eighth, more are used.
    """
    T, U, Z, f = work
    lanes, num_terms = f.size, ARTANH_TERMS
    for i in range(n):
        for j in range(n):  # transposed, for the factors commute, and rows of a product are its transpose's columns
            diagonal = 1.0 if i == j else 0.0
            for lane in range(lanes):
                T[i * n + j, lane] = M[j * n + i, lane] + diagonal
                Z[i * n + j, lane] = M[i * n + j, lane] - diagonal
    solve_in_lanes(T, Z, n, n, True, -math.inf, f)
    product_in_lanes(Z, Z, U, n)
    product_in_lanes(U, U, T, n)
    product_in_lanes(T, T, Y, n)
    f[:] = 0.0
    for at in range(n * n):
        for lane in range(lanes):
            f[lane] += Y[at, lane] * Y[at, lane]
    for lane in range(lanes):
        terms = ARTANH_TERMS * math.log(MAX_EIGHTH) / math.log(f[lane]) if MAX_EIGHTH <= f[lane] < 1.0 else MAX_TERMS
        f[lane] = min(math.ceil(terms), MAX_TERMS) if f[lane] >= MAX_EIGHTH else ARTANH_TERMS
        num_terms = max(num_terms, int(f[lane]))
    Y[:] = 0.0
    for k in range(num_terms, -1, -1):  # Horner: Y = 1/(2k + 1) + Z² Y
        product_in_lanes(U, Y, T, n)
        copy_rows(Y, T)
        for i in range(n):
            for lane in range(lanes):
                Y[i * n + i, lane] += 1.0 / (2 * k + 1) if k <= f[lane] else 0.0
    product_in_lanes(Z, Y, T, n)
    for at in range(n * n):
        for lane in range(lanes):
            Y[at, lane] = 2.0 * T[at, lane]


@njit(void(LANES, int64, LANES, LANES, LANES), **INNER)
def _characteristic_polynomials(A, n, N, c, T):
    """Write the coefficients c of det(λ - A), c[n] = 1, and N_k of adj(λ - A) = Σ λ^(n-1-k) N_k; T is scratch."""
    lanes, nn = A.shape[1], n * n
    c[:], N[:], c[n] = 0.0, 0.0, 1.0
    for i in range(n):
        N[i * n + i] = 1.0
    for k in range(1, n + 1):
        product_in_lanes(A, N[(k - 1) * nn : k * nn], T, n)
        for i in range(n):
            for lane in range(lanes):
                c[n - k, lane] -= T[i * n + i, lane] / k
        if k < n:
            copy_rows(N[k * nn :], T)
            for i in range(n):
                for lane in range(lanes):
                    N[k * nn + i * n + i, lane] += c[n - k, lane]


@njit(void(MOTIONS, LANES, LANES, LANES, ROWS), **INNER)
def _coefficient_covariances(motions, N, K, A, f):
    """Write the coefficients' covariance of unit noise to K: dc_{n-1-k} = -N_k M⁻¹ x0_s, by Θ_s; A, f are scratch."""
    M, X0, runs, n, covariance = motions
    P, nn = runs * n, n * n
    V, G, T = rows_of(P), rows_of(n * P), rows_of(n * P)
    copy_rows(A, M)
    copy_rows(V, X0)
    K[:] = 0.0
    solve_in_lanes(A, V, n, runs, True, -math.inf, f)
    adjugates, starts, slopes, products = N.reshape(N.size), V.reshape(V.size), G.reshape(G.size), T.reshape(T.size)
    inverse, target = covariance.reshape(covariance.size), K.reshape(K.size)  # the last row is not read
    for k in range(n):  # the sign of G cancels
        for s in range(runs):
            add_inner(slopes, (n - 1 - k) * P + s * n, adjugates, k * nn, n, starts, s * n, 0, n, n)
    for k in range(n):
        add_inner(products, k * P, inverse, 0, P, slopes, k * P, 0, P, P)
    for k in range(n):
        add_inner(target, k * n, slopes, 0, P, products, k * P, 0, P, n)


@njit(float64(LANES, *3 * (int64,)), **INNER)
def _frobenius_norm(A, first, count, lane):
    """Return the Frobenius norm of a lane's matrix in rows first … first + count - 1."""
    square = 0.0
    for row in range(first, first + count):
        square += A[row, lane] * A[row, lane]
    return math.sqrt(square)


@njit(float64(POLYNOMIAL, float64[::1]), **INNER)
def _form_error(p, a):
    """Return the standard deviation of Σ a_k c_k for unit noise, with the loss by cancellation of its terms."""
    total, absolute = 0.0, 0.0
    for k in range(len(p.K)):
        square = a[k] * p.K[k, k] * a[k]
        total, absolute = total + square, absolute + abs(square)
        for m in range(k):
            term = 2.0 * a[k] * p.K[k, m] * a[m]
            total, absolute = total + term, absolute + abs(term)
    return math.sqrt(max(total, 0.0) + p.loss * absolute)


@njit(types.Tuple((complex128, float64))(POLYNOMIAL, complex128), **INNER)
def _polynomial_slope(p, point):
    """Return the slope of the monic polynomial with coefficients p.c at a point, and a bound on its rounding."""
    size, value, slope = math.hypot(point.real, point.imag), complex(1.0, 0.0), complex(1.0, 0.0)
    error, slope_error = 0.0, 0.0
    for k in range(len(p.K) - 1, 0, -1):
        value, error = p.c[k] + point * value, p.rounding[k] + size * error
        slope, slope_error = value + point * slope, error + size * slope_error
    return slope, slope_error


@njit(boolean(POLYNOMIAL, float64[::1], float64[::1]), **INNER)
def _has_firm_slopes(p, re, im):
    """Return whether the slope of the polynomial exceeds its rounding at each eigenvalue."""
    for i in range(re.size):
        slope, error = _polynomial_slope(p, complex(re[i], im[i]))
        if not abs(slope) > MIN_SLOPE * error:
            return False
    return True


@njit(void(float64[:, ::1], float64, *3 * (float64[::1],)), **INNER)
def _find_moves(y, size, re, im, moves):
    """Add a matrix of a given size to y; write the distance from each old eigenvalue to the nearest new one."""
    n = re.size
    new_re, new_im = np.empty(n), np.empty(n)
    for i in range(n):
        for j in range(n):  # directions without a pattern, as in the perturbations
            y[i, j] += size * math.sqrt(2.0) / n * math.cos(1.0 + 2.399963229728653 * (i * n + j))
    has_values = eigenvalues(y, n, new_re, new_im)
    for i in range(n):
        moves[i] = math.inf
        for j in range(n if has_values else 0):
            moves[i] = min(moves[i], math.hypot(re[i] - new_re[j], im[i] - new_im[j]))


@njit(types.UniTuple(float64, 2)(POLYNOMIAL, complex128, *3 * (float64,), SCRATCH), **INNER)
def _eigenvalue_error(p, point, gap, largest, move, work):
    """Return the errors of an eigenvalue's real and imaginary part; ``gap`` is the distance to the nearest eigenvalue.

    ``largest``: the largest eigenvalue, to which rounding is relative; ``move``: as of :func:`_find_moves`; work:
    coefficients (5, n + 1) and taylor (n + 1), scratch.
    """
    rows, taylor = work
    n, (a, b, u, v, roundings) = (len(p.K), (rows[0], rows[1], rows[2], rows[3], rows[4]))
    size, (slope, slope_error) = math.hypot(point.real, point.imag), _polynomial_slope(p, point)
    rounding, height = 0.0, 1.0
    for k in range(n + 1):
        rounding += (ROUNDINGS * UNIT * abs(p.c[k]) + p.change[k]) * height
        height *= size
    real = imaginary = MOVE_FACTOR * move / CHANGE_FACTOR + ROUNDINGS * UNIT * largest
    steep = abs(slope)
    if steep > MIN_SLOPE * slope_error:
        power, inverse = complex(1.0, 0.0), 1.0 / slope
        for k in range(n):
            term = power * inverse
            a[k], b[k] = term.real, term.imag
            power *= point
        floor = rounding / steep + ROUNDINGS * UNIT * largest
        real, imaginary = p.noise * _form_error(p, a) + floor, p.noise * _form_error(p, b) + floor
    if max(real, imaginary) < 0.05 * gap:
        return real, imaginary
    power = complex(1.0, 0.0)
    for k in range(n + 1):
        taylor[k], roundings[k] = p.c[k], p.rounding[k]
        u[k], v[k] = power.real, power.imag
        power *= point
    for i in range(n):  # coefficients of p about the eigenvalue, and bounds on their rounding
        for k in range(n - 1, i - 1, -1):
            taylor[k] += point * taylor[k + 1]
            roundings[k] += size * roundings[k + 1]
    error = p.noise * math.hypot(_form_error(p, u), _form_error(p, v)) + rounding + roundings[0]
    radius, binomial = math.inf, 1.0
    for k in range(1, n + 1):
        binomial *= (n - k + 1.0) / k
        size = abs(taylor[k]) - roundings[k]
        if size > 0.0:
            radius = min(radius, (binomial * error / size) ** (1.0 / k))
    return radius, radius


@njit(void(POLYNOMIAL, *3 * (float64[::1],), float64, float64[::1]), **INNER)
def _write_invariants(p, re, im, a, spacing, row):
    """Write S, D and S² - 4D of four eigenvalues and their errors into a raw row; a: zeros, scratch."""
    c, change, noise = p.c, p.change, p.noise
    S, D = 0.5 * c[3] * c[3] - c[2], c[0]
    a[3], a[2] = c[3], -1.0
    s = _form_error(p, a)
    a[3], a[2], a[0] = 2.0 * S * c[3], -2.0 * S, -4.0
    disc = _form_error(p, a)
    s, d = noise * s + abs(c[3]) * change[3] + change[2], noise * math.sqrt(max(p.K[0, 0], 0.0)) + change[0]
    disc = noise * disc + 2.0 * abs(S) * (abs(c[3]) * change[3] + change[2]) + 4.0 * change[0] + 4.0 * s**2
    two, four, size = spacing * spacing, spacing**4, 0.0  # (the slope of S² - 4D may vanish)
    for i in range(4):
        size += re[i] * re[i] + im[i] * im[i]
    rounding = ROUNDINGS * UNIT * size
    row[codes.SUM], row[codes.SUM_ERROR] = S / two, (s + rounding) / two
    row[codes.PRODUCT], row[codes.PRODUCT_ERROR] = D / four, (d + rounding * size) / four
    row[codes.DISCRIMINANT], row[codes.DISCRIMINANT_ERROR] = ((S * S - 4.0 * D) / four, (disc + rounding * size) / four)


@njit(void(POLYNOMIAL, *3 * (float64[::1],), float64, SCRATCH, float64[::1]), **INNER)
def _write_lane(p, re, im, moves, spacing, work, row):
    """Write eigenvalues, invariants and their errors of one lane into its raw row; work is scratch."""
    n, largest_odd, a = re.size, 0.0, work[0][0]
    a[:] = 0.0
    for k in range(n - 1, -1, -2):
        noise = p.noise * math.sqrt((1.0 + p.loss) * max(p.K[k, k], 0.0))
        error = noise + LOGARITHM_FACTOR * p.change[k] + p.rounding[k]
        largest_odd = max(largest_odd, abs(p.c[k]) / error) if error > 0.0 else math.inf
    row[codes.ODD] = largest_odd
    if n == 4:
        _write_invariants(p, re, im, a, spacing, row)
    largest = 0.0
    for i in range(n):
        largest = max(largest, math.hypot(re[i], im[i]))
    for i in range(n):
        gap, twin = math.inf, -1
        for j in range(n):
            if j != i:
                gap = min(gap, (re[i] - re[j]) ** 2 + (im[i] - im[j]) ** 2)
            if j < i and re[j] == re[i] and im[j] == -im[i]:
                twin = j
        if twin < 0:
            errors = _eigenvalue_error(p, complex(re[i], im[i]), math.sqrt(gap), largest, moves[i], work)
            row[HEAD + 2 * n + i], row[HEAD + 3 * n + i] = errors[0] / spacing, errors[1] / spacing
        else:
            row[HEAD + 2 * n + i], row[HEAD + 3 * n + i] = row[HEAD + 2 * n + twin], row[HEAD + 3 * n + twin]
        row[HEAD + i], row[HEAD + n + i] = re[i] / spacing, im[i] / spacing


@njit(void(LANES, LANES, int64, int64, LANES, ROWS, ROWS, ROWS, int64, LANES), **OPTIONS)
def write_results(M, X0, runs, n, covariance, noise, matrix_error, spacing, lanes, raw):
    """Write eigenvalues and invariants of lanes into their raw rows, if the noise is a number and the iteration ends.

    Args:
        M, X0, runs, n, covariance: See :class:`LinearMotions`.
        noise (numpy.ndarray, shape (W,)): Standard deviation of a sample, or a bound on its error.
        matrix_error (numpy.ndarray, shape (W,)): Bound on the error of A in the motion itself, times the spacing.
        spacing (numpy.ndarray, shape (W,)): Time between samples, s.
        lanes (int): Number of lanes with points.
        raw (numpy.ndarray, shape (W, HEAD + 4 n)): Written: columns as in :mod:`kernels.flow.codes`.
    """
    nn = n * n
    Y, T, U, Z, K = rows_of(nn), rows_of(nn), rows_of(nn), rows_of(nn), rows_of(nn)
    N, c, f = rows_of(n * nn), rows_of(n + 1), scratch(1)
    _matrix_logarithms(M, n, Y, (T, U, Z, f))
    _characteristic_polynomials(Y, n, N, c, T)
    _coefficient_covariances(LinearMotions(M, X0, runs, n, covariance), N, K, T, f)
    y, k, rows = np.empty((n, n)), np.empty((n, n)), np.empty((5, n + 1))
    re, im, polynomial, taylor = np.empty(n), np.empty(n), np.empty(n + 1), np.empty(n + 1, dtype=np.complex128)
    change, roundings, moves = np.zeros(n + 1), np.zeros(n + 1), np.empty(n)
    for lane in range(lanes):
        if math.isnan(noise[lane]):
            continue
        for i in range(n):
            polynomial[i] = c[i, lane]
            for j in range(n):
                y[i, j], k[i, j] = Y[i * n + j, lane], K[i * n + j, lane]
        polynomial[n] = 1.0
        size, loss = _frobenius_norm(Y, 0, nn, lane), 0.0
        for i in range(n - 1, -1, -1):  # c_i = -tr(A N)/(n - i), with the N of c_(i+1); loss: error of the next N
            norm = _frobenius_norm(N, (n - 1 - i) * nn, nn, lane)
            change[i], loss = matrix_error[lane] * norm, size * (loss + 0.5 * UNIT * norm)
            roundings[i] = loss / (n - i)
            loss += math.sqrt(n) * roundings[i]
        if eigenvalues(y, n, re, im):
            relative_loss = min(1.0, UNIT * max(MIN_LOSS, PIVOT_LOSS * covariance[runs * n * runs * n, lane]))
            p = Polynomial(polynomial, change, roundings, k, noise[lane], relative_loss)
            sort_eigenvalues(re, im, n, MIN_IMAG_GAP)
            moves[:] = math.inf
            if not _has_firm_slopes(p, re, im):
                _find_moves(
                    y,
                    CHANGE_FACTOR * (matrix_error[lane] + noise[lane] * math.sqrt(max(k[n - 1, n - 1], 0.0))),
                    re,
                    im,
                    moves,
                )
            _write_lane(p, re, im, moves, spacing[lane], (rows, taylor), raw[lane])
