"""Stacks of small matrices, shape (points, n, n): operations in addition to NumPy's LAPACK."""

import numpy as np


def apply_by_matrix(function, *stacks):
    """Return a LAPACK function of stacks of matrices; NaN for each matrix at which it fails."""
    try:
        return function(*stacks)
    except np.linalg.LinAlgError:
        half = len(stacks[0]) // 2
        if not half:
            return np.full(stacks[-1].shape, np.nan)
        halves = [[stack[half_slice] for stack in stacks] for half_slice in (slice(half), slice(half, None))]
        return np.concatenate([apply_by_matrix(function, *half_slice) for half_slice in halves])


def sum_entries(A):
    """Return the sum of each matrix's entries, in a fixed order: NumPy's depends on the number of points."""
    return sum(A[:, i, j] for i in range(A.shape[1]) for j in range(A.shape[2]))


def frobenius_norm(A):
    """Return the Frobenius norm of each real matrix."""
    return np.sqrt(sum_entries(A * A))


def find_coupled(n, groups):
    """Return whether pairs of states are coupled, shape (n, n), from groups of coupled states."""
    block = np.arange(n)
    for group in [*groups] * n:
        block[[*group]] = block[[*group]].min()
    return block[:, None] == block


def eigenvalues(A):
    """Return the eigenvalues, complex, shape (points, n); NaN if a matrix is not finite."""
    values, is_finite = np.full(A.shape[:2], np.nan, dtype=complex), np.isfinite(A).all(axis=(1, 2))
    values[is_finite] = np.linalg.eigvals(A[is_finite])
    return values


def eigenvector_conditions(A):
    """Return a bound on the condition number of each matrix's unit eigenvectors; infinite if it is not finite."""
    bound, is_finite = np.full(len(A), np.inf), np.isfinite(A).all(axis=(1, 2))
    if is_finite.any():
        vectors = np.linalg.eig(A[is_finite])[1].astype(complex)  # real arrays, with different bits, if all are real
        smallest = np.linalg.svd(vectors, compute_uv=False)[:, -1]
        with np.errstate(divide="ignore"):
            bound[is_finite] = np.sqrt(A.shape[1]) / smallest
    return bound


def sort_eigenvalues(values, min_gap):
    """Return eigenvalues, shape (points, n), sorted by imaginary, then real part, and their unsorted indices.

    Neighbouring imaginary parts that differ by at most ``min_gap``, shape (points,), count as equal.
    """
    order = np.argsort(values.imag, axis=1, kind="stable")
    by_imag = np.take_along_axis(values, order, axis=1)
    group = np.zeros(values.shape, dtype=np.int64)
    group[:, 1:] = np.cumsum(np.diff(by_imag.imag, axis=1) > min_gap[:, None], axis=1)
    order = np.take_along_axis(order, np.lexsort((by_imag.real, group)), axis=1)
    return np.take_along_axis(values, order, axis=1), order
