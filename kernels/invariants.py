r"""From the matrix M of a linear motion and its covariance to eigenvalues, invariants and their errors.

*Errors.* From the last step, :math:`\mathrm{Cov}\,\Theta = s^2\tilde H^{-1}`, :math:`\tilde H` the projected normal
matrix: the Cramér-Rao bound for white noise. The coefficients of
:math:`p(\lambda) = \det(\lambda - A)` follow by Faddeev and Le Verrier,
:math:`\mathrm dc_{n-1-k} = -\operatorname{tr}(N_k\,\mathrm dA)` with polynomials :math:`N_k` in A, so that
:math:`\mathrm dA` may be :math:`M^{-1}\mathrm dM/h`. An eigenvalue's error is :math:`|\delta p/p'|` while that is far
below the distance of the next one, else the radius within which a root of the disturbed polynomial must lie,
:math:`\min_k \bigl(\tbinom nk\,|\delta p|\,/\,|p^{(k)}/k!|\bigr)^{1/k}`. A change of A that no sample shows, for the
motion itself has it, of Frobenius norm b at most, changes the coefficients by :math:`b\,\lVert N_k\rVert` at most.
The products of Faddeev and Le Verrier round, too: where that may hide p', as of many slow rates beside a fast one or of
a defective eigenvalue in several blocks, A is changed by FARTHER times what it may be off, and the error is MOVED times
the share of what the eigenvalue moves.

*Invariants.* For four eigenvalues :math:`S = \tfrac12\sum\lambda^2`, :math:`D = \prod\lambda` and S² - 4D with errors:
of two pairs ±μ1, ±μ2 they are μ1² + μ2², μ1² μ2² and (μ1² - μ2²)², and smooth through any collision.

Symbols: :mod:`kernels.spectrum`.

Source: Marden, Geometry of Polynomials, section 33 (radii).
"""

import math
from typing import NamedTuple

import numpy as np

from kernels import codes
from kernels.blocks import LANES, ROWS, rows_of, scratch
from kernels.codes import HEAD, MIN_IMAG_GAP, UNIT
from kernels.dense import add_inner, eigenvalues, order, product_in_lanes, put, solve_in_lanes
from kernels.jit import INNER, OPTIONS, boolean, complex128, float64, int64, njit, types, void, whole_vectors

ROUNDINGS = 8.0  # of the logarithm and what follows it, beside the largest eigenvalue
LOGARITHM = 3.0  # times what the motion itself is bent by: with ROUNDINGS of the logarithm, twice as large as BENDING
ARTANH, MORE = 20, 200  # terms of artanh's series for a logarithm: where the rates bound |Z| by tan π/8, and at most
REACHED = 2e-6  # square of the size of Z to the eighth, below which what ARTANH terms leave is below rounding
FIRM = 20.0  # slope of the characteristic polynomial over its rounding, from which on an error is divided by it
FARTHER, MOVED = 100.0, 10.0  # else A is changed by so many times what it may be off, and moves count so many times
# Roundings that a term of a covariance may hold, which a large sum of terms cancels down to: at least, and over the
# least pivot, which bounds them (a thirtieth of that bound, in an error, holds those of the benchmark).
LOST, PIVOTED = 1e4, 1e-3


class Motions(NamedTuple):
    """Lanes of linear motions as they were fitted."""

    M: np.ndarray  #: of one sample, shape (n², lanes)
    X0: np.ndarray  #: starts of the runs, shape (runs n, lanes)
    runs: int
    n: int
    covariance: np.ndarray  #: of M and the starts for noise of one, of which the last row is the least pivot


MOTIONS = types.NamedTuple((LANES, LANES, int64, int64, LANES), Motions)


class Polynomial(NamedTuple):
    """The characteristic polynomial of one lane."""

    c: np.ndarray  #: coefficients, c[n] = 1
    bent: np.ndarray  #: largest changes of these, that of c[n] 0, by what no sample shows
    rounded: np.ndarray  #: likewise, by the rounding of the products that they are found from
    K: np.ndarray  #: their covariance for noise of one, shape (n, n)
    noise: float
    lost: float  #: relative error of a term of a covariance


POLYNOMIAL = types.NamedTuple((*3 * (float64[::1],), float64[:, ::1], float64, float64), Polynomial)
ROOM = types.Tuple((float64[:, ::1], complex128[::1]))


@njit(void(LANES, int64, LANES, types.Tuple((LANES, LANES, LANES, ROWS))), **OPTIONS)
def _logarithms(M, n, Y, room):
    """Write the logarithm of M into Y, 2 artanh (M - 1)(M + 1)⁻¹ by its series, lane by lane; room is scratch.

    Where ARTANH terms do not reach, as Z to the eighth tells, more do.
    """
    whole_vectors()
    T, U, Z, f = room
    lanes, most = f.size, ARTANH
    for i in range(n):
        for j in range(n):  # transposed, for the factors commute, and rows of a product are its transpose's columns
            one = 1.0 if i == j else 0.0
            for lane in range(lanes):
                T[i * n + j, lane] = M[j * n + i, lane] + one
                Z[i * n + j, lane] = M[i * n + j, lane] - one
    solve_in_lanes(T, Z, n, n, True, -math.inf, f)
    product_in_lanes(Z, Z, U, n)
    product_in_lanes(U, U, T, n)
    product_in_lanes(T, T, Y, n)
    f[:] = 0.0
    for at in range(n * n):
        for lane in range(lanes):
            f[lane] += Y[at, lane] * Y[at, lane]
    for lane in range(lanes):
        needed = ARTANH * math.log(REACHED) / math.log(f[lane]) if REACHED <= f[lane] < 1.0 else MORE
        f[lane] = min(math.ceil(needed), MORE) if f[lane] >= REACHED else ARTANH
        most = max(most, int(f[lane]))
    Y[:] = 0.0
    for k in range(most, -1, -1):  # Horner: Y = 1/(2k + 1) + Z² Y
        product_in_lanes(U, Y, T, n)
        put(Y, T)
        for i in range(n):
            for lane in range(lanes):
                Y[i * n + i, lane] += 1.0 / (2 * k + 1) if k <= f[lane] else 0.0
    product_in_lanes(Z, Y, T, n)
    for at in range(n * n):
        for lane in range(lanes):
            Y[at, lane] = 2.0 * T[at, lane]


@njit(void(LANES, int64, LANES, LANES, LANES), **INNER)
def _characteristics(A, n, N, c, T):
    """Write the coefficients c of det(λ - A), c[n] = 1, and N_k of adj(λ - A) = Σ λ^(n-1-k) N_k; T is scratch."""
    whole_vectors()
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
            put(N[k * nn :], T)
            for i in range(n):
                for lane in range(lanes):
                    N[k * nn + i * n + i, lane] += c[n - k, lane]


@njit(void(MOTIONS, LANES, LANES, LANES, ROWS), **INNER)
def _coefficient_covariances(motions, N, K, A, f):
    """Write the coefficients' covariance for noise of one: dc_{n-1-k} = -N_k M⁻¹ x0_s by Θ_s; A, f are scratch."""
    M, X0, runs, n, covariance = motions
    P, nn = runs * n, n * n
    V, G, T = rows_of(P), rows_of(n * P), rows_of(n * P)
    put(A, M)
    put(V, X0)
    K[:] = 0.0
    solve_in_lanes(A, V, n, runs, True, -math.inf, f)
    adjugates, starts, slopes, turned = N.reshape(N.size), V.reshape(V.size), G.reshape(G.size), T.reshape(T.size)
    inverse, into = covariance.reshape(covariance.size), K.reshape(K.size)  # of which the last row is not read
    for k in range(n):  # the sign of G cancels
        for s in range(runs):
            add_inner(slopes, (n - 1 - k) * P + s * n, adjugates, k * nn, n, starts, s * n, 0, n, n)
    for k in range(n):
        add_inner(turned, k * P, inverse, 0, P, slopes, k * P, 0, P, P)
    for k in range(n):
        add_inner(into, k * n, slopes, 0, P, turned, k * P, 0, P, n)


@njit(float64(LANES, *3 * (int64,)), **INNER)
def _norm(A, first, count, lane):
    """Return Frobenius norm of the matrix in some rows of a lane."""
    square = 0.0
    for row in range(first, first + count):
        square += A[row, lane] * A[row, lane]
    return math.sqrt(square)


@njit(float64(POLYNOMIAL, float64[::1]), **INNER)
def _form(p, a):
    """Return the standard deviation of Σ a_k c_k, and the loss by cancellation of its terms; both for noise of one."""
    total, absolute = 0.0, 0.0
    for k in range(len(p.K)):
        square = a[k] * p.K[k, k] * a[k]
        total, absolute = total + square, absolute + abs(square)
        for m in range(k):
            term = 2.0 * a[k] * p.K[k, m] * a[m]
            total, absolute = total + term, absolute + abs(term)
    return math.sqrt(max(total, 0.0) + p.lost * absolute)


@njit(types.Tuple((complex128, float64))(POLYNOMIAL, complex128), **INNER)
def _slope(p, point):
    """Return the slope of the polynomial at a point, and what rounding may leave of it."""
    size, value, slope = math.hypot(point.real, point.imag), complex(1.0, 0.0), complex(1.0, 0.0)
    rough, steep_rough = 0.0, 0.0
    for k in range(len(p.K) - 1, 0, -1):
        value, rough = p.c[k] + point * value, p.rounded[k] + size * rough
        slope, steep_rough = value + point * slope, rough + size * steep_rough
    return slope, steep_rough


@njit(boolean(POLYNOMIAL, float64[::1], float64[::1]), **INNER)
def _is_firm(p, re, im):
    """Return whether rounding leaves the slope of the polynomial at each eigenvalue."""
    for i in range(re.size):
        slope, rough = _slope(p, complex(re[i], im[i]))
        if not abs(slope) > FIRM * rough:
            return False
    return True


@njit(void(float64[:, ::1], float64, *3 * (float64[::1],)), **INNER)
def _move(y, size, re, im, moves):
    """Write how far each eigenvalue of y is from the next one of y changed by a matrix of a size; y is changed."""
    n = re.size
    re_there, im_there = np.empty(n), np.empty(n)
    for i in range(n):
        for j in range(n):  # directions without a pattern, as of the perturbations
            y[i, j] += size * math.sqrt(2.0) / n * math.cos(1.0 + 2.399963229728653 * (i * n + j))
    sound = eigenvalues(y, n, re_there, im_there)
    for i in range(n):
        moves[i] = math.inf
        for j in range(n if sound else 0):
            moves[i] = min(moves[i], math.hypot(re[i] - re_there[j], im[i] - im_there[j]))


@njit(types.UniTuple(float64, 2)(POLYNOMIAL, complex128, *3 * (float64,), ROOM), **INNER)
def _eigenvalue_error(p, point, gap, most, move, room):
    """Return the errors of an eigenvalue's real and imaginary part, the next one ``gap`` away.

    ``most``: the largest eigenvalue, for what rounding leaves; ``move``: as of :func:`_move`; room: parts (5, n + 1)
    and shifted (n + 1), scratch.
    """
    parts, shifted = room
    n, (a, b, u, v, rounded) = len(p.K), (parts[0], parts[1], parts[2], parts[3], parts[4])
    size, (slope, rough) = math.hypot(point.real, point.imag), _slope(p, point)
    rounding, height = 0.0, 1.0
    for k in range(n + 1):
        rounding += (ROUNDINGS * UNIT * abs(p.c[k]) + p.bent[k]) * height
        height *= size
    real = imaginary = MOVED * move / FARTHER + ROUNDINGS * UNIT * most
    steep = abs(slope)
    if steep > FIRM * rough:
        power, inverse = complex(1.0, 0.0), 1.0 / slope
        for k in range(n):
            turned = power * inverse
            a[k], b[k] = turned.real, turned.imag
            power *= point
        least = rounding / steep + ROUNDINGS * UNIT * most
        real, imaginary = p.noise * _form(p, a) + least, p.noise * _form(p, b) + least
    if max(real, imaginary) < 0.05 * gap:
        return real, imaginary
    power = complex(1.0, 0.0)
    for k in range(n + 1):
        shifted[k], rounded[k] = p.c[k], p.rounded[k]
        u[k], v[k] = power.real, power.imag
        power *= point
    for i in range(n):  # coefficients of p about the eigenvalue, and what rounding may leave of them
        for k in range(n - 1, i - 1, -1):
            shifted[k] += point * shifted[k + 1]
            rounded[k] += size * rounded[k + 1]
    off = p.noise * math.hypot(_form(p, u), _form(p, v)) + rounding + rounded[0]
    radius, binomial = math.inf, 1.0
    for k in range(1, n + 1):
        binomial *= (n - k + 1.0) / k
        size = abs(shifted[k]) - rounded[k]
        if size > 0.0:
            radius = min(radius, (binomial * off / size) ** (1.0 / k))
    return radius, radius


@njit(void(POLYNOMIAL, *3 * (float64[::1],), float64, float64[::1]), **INNER)
def _tell_invariants(p, re, im, a, spacing, row):
    """Write S, D and S² - 4D of four eigenvalues and their errors into a raw row; a: zeros, scratch."""
    c, bent, noise = p.c, p.bent, p.noise
    S, D = 0.5 * c[3] * c[3] - c[2], c[0]
    a[3], a[2] = c[3], -1.0
    s = _form(p, a)
    a[3], a[2], a[0] = 2.0 * S * c[3], -2.0 * S, -4.0
    both = _form(p, a)
    s, d = noise * s + abs(c[3]) * bent[3] + bent[2], noise * math.sqrt(max(p.K[0, 0], 0.0)) + bent[0]
    both = noise * both + 2.0 * abs(S) * (abs(c[3]) * bent[3] + bent[2]) + 4.0 * bent[0] + 4.0 * s**2
    two, four, size = spacing * spacing, spacing**4, 0.0  # (the slope of S² - 4D may vanish)
    for i in range(4):
        size += re[i] * re[i] + im[i] * im[i]
    rounding = ROUNDINGS * UNIT * size
    row[codes.SUM], row[codes.SUM_ERROR] = S / two, (s + rounding) / two
    row[codes.PRODUCT], row[codes.PRODUCT_ERROR] = D / four, (d + rounding * size) / four
    row[codes.DISCRIMINANT], row[codes.DISCRIMINANT_ERROR] = (S * S - 4.0 * D) / four, (both + rounding * size) / four


@njit(void(POLYNOMIAL, *3 * (float64[::1],), float64, ROOM, float64[::1]), **INNER)
def _tell_lane(p, re, im, moves, spacing, room, row):
    """Write eigenvalues, invariants and their errors of one lane into its raw row; room is scratch."""
    n, odd, a = re.size, 0.0, room[0][0]
    a[:] = 0.0
    for k in range(n - 1, -1, -2):
        error = p.noise * math.sqrt((1.0 + p.lost) * max(p.K[k, k], 0.0)) + LOGARITHM * p.bent[k] + p.rounded[k]
        odd = max(odd, abs(p.c[k]) / error) if error > 0.0 else math.inf
    row[codes.ODD] = odd
    if n == 4:
        _tell_invariants(p, re, im, a, spacing, row)
    most = 0.0
    for i in range(n):
        most = max(most, math.hypot(re[i], im[i]))
    for i in range(n):
        gap, twin = math.inf, -1
        for j in range(n):
            if j != i:
                gap = min(gap, (re[i] - re[j]) ** 2 + (im[i] - im[j]) ** 2)
            if j < i and re[j] == re[i] and im[j] == -im[i]:
                twin = j
        if twin < 0:
            errors = _eigenvalue_error(p, complex(re[i], im[i]), math.sqrt(gap), most, moves[i], room)
            row[HEAD + 2 * n + i], row[HEAD + 3 * n + i] = errors[0] / spacing, errors[1] / spacing
        else:
            row[HEAD + 2 * n + i], row[HEAD + 3 * n + i] = row[HEAD + 2 * n + twin], row[HEAD + 3 * n + twin]
        row[HEAD + i], row[HEAD + n + i] = re[i] / spacing, im[i] / spacing


@njit(void(LANES, LANES, int64, int64, LANES, ROWS, ROWS, ROWS, int64, LANES), **OPTIONS)
def tell(M, X0, runs, n, covariance, noise, bend, spacing, lanes, raw):
    """Write eigenvalues and invariants of lanes into their raw rows, where the noise is a number and algebra serves.

    bend: largest change, times the spacing, of A in the motion itself.
    """
    whole_vectors()
    nn = n * n
    Y, T, U, Z, K = rows_of(nn), rows_of(nn), rows_of(nn), rows_of(nn), rows_of(nn)
    N, c, f = rows_of(n * nn), rows_of(n + 1), scratch(1)
    _logarithms(M, n, Y, (T, U, Z, f))
    _characteristics(Y, n, N, c, T)
    _coefficient_covariances(Motions(M, X0, runs, n, covariance), N, K, T, f)
    y, k, parts = np.empty((n, n)), np.empty((n, n)), np.empty((5, n + 1))
    re, im, of_lane, shifted = np.empty(n), np.empty(n), np.empty(n + 1), np.empty(n + 1, dtype=np.complex128)
    bent, rounded, moves = np.zeros(n + 1), np.zeros(n + 1), np.empty(n)
    for lane in range(lanes):
        if math.isnan(noise[lane]):
            continue
        for i in range(n):
            of_lane[i] = c[i, lane]
            for j in range(n):
                y[i, j], k[i, j] = Y[i * n + j, lane], K[i * n + j, lane]
        of_lane[n] = 1.0
        size, loss = _norm(Y, 0, nn, lane), 0.0
        for i in range(n - 1, -1, -1):  # c_i = -tr(A N)/(n - i), N of which is c_(i+1)'s; loss: of the next N
            norm = _norm(N, (n - 1 - i) * nn, nn, lane)
            bent[i], loss = bend[lane] * norm, size * (loss + 0.5 * UNIT * norm)
            rounded[i] = loss / (n - i)
            loss += math.sqrt(n) * rounded[i]
        if eigenvalues(y, n, re, im):
            lost = min(1.0, UNIT * max(LOST, PIVOTED * covariance[runs * n * runs * n, lane]))
            p = Polynomial(of_lane, bent, rounded, k, noise[lane], lost)
            order(re, im, n, MIN_IMAG_GAP)
            moves[:] = math.inf
            if not _is_firm(p, re, im):
                _move(y, FARTHER * (bend[lane] + noise[lane] * math.sqrt(max(k[n - 1, n - 1], 0.0))), re, im, moves)
            _tell_lane(p, re, im, moves, spacing[lane], (parts, shifted), raw[lane])
