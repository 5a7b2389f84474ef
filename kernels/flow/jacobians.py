r"""Scales of many Jacobians, and the condition numbers of their eigenvalues.

With G the absolute values of a Jacobian's terms, in the states' sizes, Perron's root bounds every possible rate. It is
the limit of :math:`\max(G^k)^{1/k}`, which is within some per cent at k = 2^ROOT_SQUARINGS; its vector is approximated
by the row sums of a high power, and any positive vector gives a bound S.

A simple eigenvalue's condition number is that of its vectors, :math:`|y||x|/|y^*x|`, and
:math:`\operatorname{adj}(\lambda_i - A) = xy^*\,\prod_{j\ne i}(\lambda_i - \lambda_j)/(y^*x)`, so that neither vector
is needed.

Source: Horn and Johnson, Matrix Analysis, sections 5.6 (Gelfand's formula), 8.1 (Collatz and Wielandt's bounds) and
0.8.2 (adjugates).
"""

import numpy as np

MIN_COUPLING = 0.01  # coupling of every pair of states that is added to G, over S, so that G is irreducible
ROOT_SQUARINGS = 6  # squarings of G for the Perron root, to some per cent
VECTOR_SQUARINGS = 8  # squarings of G for the Perron vector


def _matrix_products(A, B):
    """Return the products of matrices, shape (n, n, points): points last, for NumPy is fast along long axes only."""
    from kernels.flow.dense import product_in_lanes  # compiled by its import

    C, n = np.empty_like(A), len(A)
    product_in_lanes(*(matrices.reshape(n * n, A.shape[2]) for matrices in (A, B, C)), n)
    return C


def _over_largest(power):
    """Return nonnegative matrices over their largest elements, and these; NaN if an element is NaN."""
    largest = power.max(axis=(0, 1))
    return power / largest, largest


def perron_roots(matrices):
    """Return Perron's roots of matrices of absolute values, shape (points, n, n), to some per cent.

    NaN if a matrix is not finite or vanishes.
    """
    return _perron_roots(np.ascontiguousarray(np.moveaxis(matrices, 0, -1)))


@np.errstate(all="ignore")
def _perron_roots(G):
    """Return the roots of matrices of shape (n, n, points), by repeated squaring."""
    power, largest = _over_largest(G)
    logarithm = np.log(largest)
    for _ in range(ROOT_SQUARINGS):
        power, largest = _over_largest(_matrix_products(power, power))
        logarithm = 2.0 * logarithm + np.log(largest)
    root = np.exp(logarithm / 2**ROOT_SQUARINGS)
    return np.where((root > 0.0) & (root < np.inf), root, np.nan)


def add_velocity_sizes(terms, sizes):
    """Return the sizes of coordinates and of velocities, at a rate from the terms: independent of the unit of time.

    Terms are as in :func:`rate_bounds`, of coordinates and velocities; sizes have the shape (points, n/2).
    """
    m, ratio = sizes.shape[1], sizes[:, None, :] / sizes[:, :, None]
    stiffness, damping = terms[:, m:, :m] * ratio, terms[:, m:, m:] * ratio
    rate = np.maximum(np.sqrt(stiffness.max((1, 2))), damping.max((1, 2)))
    return np.concatenate([sizes, sizes * rate[:, None]], axis=1)


@np.errstate(all="ignore")
def rate_bounds(terms, sizes):
    """Return a bound S on every rate, and the states' sizes, from the Jacobians' terms and the stated sizes.

    Terms are absolute values, shape (points, n, n), in s-1 and units of the states, as the sizes are, shape (points,
    n). S, shape (points,), in s-1, is at least the root, by Collatz and Wielandt.
    """
    n = terms.shape[1]
    G = np.ascontiguousarray(np.moveaxis(terms * sizes[:, None, :] / sizes[:, :, None], 0, -1))
    root = _perron_roots(G)
    G = G + MIN_COUPLING / n * root
    power = G / (2.0 * root) + 0.5 * np.eye(n)[:, :, None]
    for _ in range(VECTOR_SQUARINGS):
        power, _ = _over_largest(_matrix_products(power, power))
    u = sum(power[:, j] for j in range(n))
    u /= u.max(axis=0)
    return (sum(G[:, j] * u[j] for j in range(n)) / u).max(axis=0), sizes * u.T


@np.errstate(all="ignore")
def condition_numbers(A, values, scale):
    """Return the condition numbers of eigenvalues, (points, n); infinite if two are equal, NaN if one is NaN.

    Args:
        `A` (numpy.ndarray, shape (points, n, n)): Matrices.
        values (numpy.ndarray, shape (points, n)): Their eigenvalues.
        scale (numpy.ndarray, shape (points,)): Bound on the eigenvalues, by which both are divided.
    """
    n = A.shape[1]
    A, values = np.ascontiguousarray(np.moveaxis(A, 0, -1)) / scale, np.ascontiguousarray(values.T) / scale
    identity, N, size = np.eye(n)[:, :, None], [], np.empty(values.shape)  # adj(λ - A) = Σ λ^(n-1-k) N_k
    for k in range(n):
        T = _matrix_products(A, N[-1]) if k > 1 else A
        N.append(T - sum(T[i, i] for i in range(n)) / k * identity if k else identity)
    for e, (x, y) in enumerate(zip(values.real, values.imag, strict=True)):
        re, im = np.zeros(A.shape), np.zeros(A.shape)
        for term in N:
            cross = re * y
            re *= x
            re -= im * y
            re += term
            im *= x
            im += cross
        squares = (re * re + im * im).reshape(n * n, -1)
        size[e] = np.sqrt(sum(squares))  # in a fixed order: that of NumPy's sums depends on the number of points
    distance = np.abs(values[:, None] - values) + identity
    return np.maximum(1.0, size / distance.prod(axis=1)).T
