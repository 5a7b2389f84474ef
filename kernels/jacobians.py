r"""Scales of many Jacobians, and the condition numbers of their eigenvalues.

With G the absolute values of a Jacobian's terms, in the states' sizes, Perron's root bounds every possible rate. It is
the limit of :math:`\max(G^k)^{1/k}`, which is within some per cent at k = 2^HALVED; its vector is that of the sums of a
high power's rows, and with any positive one S is a bound.

A simple eigenvalue's condition number is that of its vectors, :math:`|y||x|/|y^*x|`, and
:math:`\operatorname{adj}(\lambda_i - A) = xy^*\,\prod_{j\ne i}(\lambda_i - \lambda_j)/(y^*x)`, so that neither is asked
for.

Source: Horn and Johnson, Matrix Analysis, sections 5.6 (Gelfand's formula), 8.1 (Collatz and Wielandt's bounds) and
0.8.2 (adjugates).
"""

import numpy as np

COUPLED = 0.01  # of S, that every state is taken to feel of every other
HALVED = 6  # times, the logarithm of a power's size, for the Perron root
SQUARINGS = 8  # towards the Perron vector


def _product(A, B):
    """Return the products of matrices, shape (n, n, points): points last, for NumPy is quick along long axes alone."""
    from kernels.dense import product_in_lanes  # compiled by its import

    C, n = np.empty_like(A), len(A)
    product_in_lanes(*(matrices.reshape(n * n, A.shape[2]) for matrices in (A, B, C)), n)
    return C


def _over_largest(power):
    """Return matrices over their largest elements, which are not negative, and these: NaN where an element is."""
    largest = power.max(axis=(0, 1))
    return power / largest, largest


def roots(matrices):
    """Return Perron's roots of matrices of absolute values, shape (points, n, n), to some per cent.

    NaN where one is not finite or vanishes.
    """
    return _roots(np.ascontiguousarray(np.moveaxis(matrices, 0, -1)))


@np.errstate(all="ignore")
def _roots(G):
    power, largest = _over_largest(G)
    total = np.log(largest)
    for _ in range(HALVED):
        power, largest = _over_largest(_product(power, power))
        total = 2.0 * total + np.log(largest)
    root = np.exp(total / 2**HALVED)
    return np.where((root > 0.0) & (root < np.inf), root, np.nan)


def with_velocities(terms, sizes):
    """Return the sizes of coordinates and, at a rate from the terms, of velocities, so that no unit of time counts.

    Terms are as of :func:`scales`, of coordinates and velocities; sizes have the shape (points, n/2).
    """
    m, ratio = sizes.shape[1], sizes[:, None, :] / sizes[:, :, None]
    pulled, dragged = terms[:, m:, :m] * ratio, terms[:, m:, m:] * ratio
    rate = np.maximum(np.sqrt(pulled.max((1, 2))), dragged.max((1, 2)))
    return np.concatenate([sizes, sizes * rate[:, None]], axis=1)


@np.errstate(all="ignore")
def scales(terms, sizes):
    """Return a bound S on every rate, and the states' sizes, from the Jacobians' terms and the stated sizes.

    Terms are absolute values, shape (points, n, n), in s-1 and units of the states, as the sizes are, shape (points,
    n). S, shape (points,), in s-1, is at least the root, by Collatz and Wielandt.
    """
    n = terms.shape[1]
    G = np.ascontiguousarray(np.moveaxis(terms * sizes[:, None, :] / sizes[:, :, None], 0, -1))
    root = _roots(G)
    G = G + COUPLED / n * root
    power = G / (2.0 * root) + 0.5 * np.eye(n)[:, :, None]
    for _ in range(SQUARINGS):
        power, _ = _over_largest(_product(power, power))
    u = sum(power[:, j] for j in range(n))
    u /= u.max(axis=0)
    return (sum(G[:, j] * u[j] for j in range(n)) / u).max(axis=0), sizes * u.T


@np.errstate(all="ignore")
def conditions(A, values, scale):
    """Return the condition numbers of eigenvalues, (points, n); infinite where two are one, NaN where one is NaN."""
    n = A.shape[1]
    A, values = np.ascontiguousarray(np.moveaxis(A, 0, -1)) / scale, np.ascontiguousarray(values.T) / scale
    one, N, size = np.eye(n)[:, :, None], [], np.empty(values.shape)  # adj(λ - A) = Σ λ^(n-1-k) N_k
    for k in range(n):
        T = _product(A, N[-1]) if k > 1 else A
        N.append(T - sum(T[i, i] for i in range(n)) / k * one if k else one)
    for e, (x, y) in enumerate(zip(values.real, values.imag, strict=True)):
        re, im = np.zeros(A.shape), np.zeros(A.shape)
        for term in N:
            turned = re * y
            re *= x
            re -= im * y
            re += term
            im *= x
            im += turned
        squares = (re * re + im * im).reshape(n * n, -1)
        size[e] = np.sqrt(sum(squares))  # one after the other: NumPy's own sums depend on the number of points
    apart = np.abs(values[:, None] - values) + one
    return np.maximum(1.0, size / apart.prod(axis=1)).T
