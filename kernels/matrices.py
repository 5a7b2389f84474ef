"""Stacks of small matrices, shape (points, n, n): what NumPy's LAPACK leaves to be done."""

import numpy as np


def by_matrix(function, *stacks):
    """Return a function of LAPACK's of stacks of matrices; NaN for a matrix for which it fails."""
    try:
        return function(*stacks)
    except np.linalg.LinAlgError:
        half = len(stacks[0]) // 2
        if not half:
            return np.full(stacks[-1].shape, np.nan)
        parts = [[stack[part] for stack in stacks] for part in (slice(half), slice(half, None))]
        return np.concatenate([by_matrix(function, *part) for part in parts])


def total(A):
    """Return the sum of each matrix's entries, one after the other: NumPy's own sums depend on the number of points."""
    return sum(A[:, i, j] for i in range(A.shape[1]) for j in range(A.shape[2]))


def length(A):
    """Return the Frobenius norm of each real matrix."""
    return np.sqrt(total(A * A))


def joined(n, groups):
    """Return whether states act on each other, shape (n, n), from groups of those that do."""
    block = np.arange(n)
    for group in [*groups] * n:
        block[[*group]] = block[[*group]].min()
    return block[:, None] == block


def eigenvalues(A):
    """Return the eigenvalues, complex, shape (points, n); NaN where a matrix is not finite."""
    values, sound = np.full(A.shape[:2], np.nan, dtype=complex), np.isfinite(A).all(axis=(1, 2))
    values[sound] = np.linalg.eigvals(A[sound])
    return values


def eigenvector_conditions(A):
    """Return a bound on each matrix's condition number of all eigenvectors, at length one; infinite where none is."""
    bound, sound = np.full(len(A), np.inf), np.isfinite(A).all(axis=(1, 2))
    if sound.any():
        vectors = np.linalg.eig(A[sound])[1].astype(complex)  # real where all points' are, with other bits
        least = np.linalg.svd(vectors, compute_uv=False)[:, -1]
        with np.errstate(divide="ignore"):
            bound[sound] = np.sqrt(A.shape[1]) / least
    return bound


def ordered(values, same):
    """Return eigenvalues, shape (points, n), sorted by imaginary, then real part, and which of the unsorted each is.

    Imaginary parts nearer than ``same``, shape (points,), to a neighbour count as one.
    """
    number = np.argsort(values.imag, axis=1, kind="stable")
    by_imag = np.take_along_axis(values, number, axis=1)
    group = np.zeros(values.shape, dtype=np.int64)
    group[:, 1:] = np.cumsum(np.diff(by_imag.imag, axis=1) > same[:, None], axis=1)
    number = np.take_along_axis(number, np.lexsort((by_imag.real, group)), axis=1)
    return np.take_along_axis(values, number, axis=1), number
