"""Stacks of small matrices against NumPy."""

import numpy as np

from kernels.flow import matrices


def test_a_matrix_for_which_lapack_fails_is_not_a_number_and_its_neighbours_are_as_alone():
    A = np.array([np.eye(2), np.zeros((2, 2)), 2.0 * np.eye(2)])
    inverses = matrices.apply_by_matrix(np.linalg.inv, A)
    np.testing.assert_array_equal(inverses, [np.eye(2), np.full((2, 2), np.nan), 0.5 * np.eye(2)])
    A[1] = np.nan
    np.testing.assert_array_equal(matrices.eigenvalues(A), [[1, 1], [np.nan + 0j, np.nan + 0j], [2, 2]])


def test_eigenvalues_are_in_the_order_of_imaginary_then_real_parts():
    values = np.array([[2.0 + 1e-9j, 1.0 + 2e-9j, 3.0 - 1.0j, -4.0 + 1.0j], [2.0 + 1e-9j, 1.0 + 2e-9j, 0.0, -1.0 + 0j]])
    eigenvalues, number = matrices.sort_eigenvalues(values, np.array([1e-8, 1e-10]))
    np.testing.assert_array_equal(number, [[2, 1, 0, 3], [3, 2, 0, 1]])
    np.testing.assert_array_equal(eigenvalues, np.take_along_axis(values, number, axis=1))
