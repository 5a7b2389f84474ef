"""Scales of Jacobians and condition numbers against LAPACK's spectra and vectors."""

import numpy as np
import pytest

from kernels.flow import jacobians


def _matrices(n, count=70):
    return np.random.default_rng(n).normal(size=(count, n, n))


@pytest.mark.parametrize("n", [1, 3, 4, 7])
def test_roots_are_the_spectral_radius_to_some_per_cent(n):
    G = np.abs(_matrices(n))
    ratio = jacobians.perron_roots(G) / np.abs(np.linalg.eigvals(G)).max(1)
    assert (
        np.abs(ratio - 1.0) < 0.05
    ).all()  # the 64th root of the ratio of the power's largest element to the root's power


def test_roots_of_what_has_none_are_not_a_number():
    G = np.array([np.zeros((2, 2)), np.full((2, 2), np.nan), [[1.0, np.nan], [2.0, 3.0]], np.eye(2), np.ones((2, 2))])
    roots = jacobians.perron_roots(G)
    np.testing.assert_array_equal(np.isnan(roots), [True, True, True, False, False])
    assert roots[3] == 1.0


@pytest.mark.parametrize("n", [2, 4, 5])
def test_scales_bound_every_rate_whatever_the_units(n):
    terms, sizes = np.abs(_matrices(n)), np.exp(0.3 * _matrices(n)[:, 0])
    S, scaled = jacobians.rate_bounds(terms, sizes)
    greatest = np.abs(np.linalg.eigvals(terms)).max(1)
    assert (greatest <= S).all()  # so of any matrix with terms of these sizes
    each = (terms * scaled[:, None, :] / scaled[:, :, None]).sum(2)
    assert (each < S[:, None]).all()  # each state's rate, in its own size
    assert (1.1 * greatest > S).all()  # a hundredth, coupled to every state in sizes that hardly differ
    units = 2.0 ** np.arange(n)  # powers of two: every bit stays
    rates, scales = jacobians.rate_bounds(terms * units[:, None] / units, sizes * units)
    np.testing.assert_array_equal(rates, S)
    np.testing.assert_array_equal(scales, scaled * units)


@pytest.mark.parametrize("n", [1, 2, 4, 8])
def test_condition_numbers_are_those_of_lapacks_vectors(n):
    A = _matrices(n)
    values, right = np.linalg.eig(A)
    left_vectors = np.conj(np.swapaxes(np.linalg.inv(right), 1, 2))
    expected = np.linalg.norm(left_vectors, axis=1) * np.linalg.norm(right, axis=1)
    scale = np.abs(values).max(1)
    condition = jacobians.condition_numbers(A, values, scale)
    np.testing.assert_allclose(condition, expected, rtol=1e-8)  # differences of eigenvalues, some of them small
    np.testing.assert_array_equal(
        jacobians.condition_numbers(A * 2.0**300, values * 2.0**300, scale * 2.0**300), condition
    )


def test_where_two_eigenvalues_are_one_the_condition_is_infinite():
    A, values = np.array([[[1.0, 1.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 2.0]]]), np.array([[1.0, 1.0, 2.0]]) + 0j
    np.testing.assert_allclose(jacobians.condition_numbers(A, values, np.array([2.0])), [[np.inf, np.inf, 1.0]])
