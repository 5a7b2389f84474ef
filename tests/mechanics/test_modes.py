import numpy as np
import pytest
from scipy.linalg import eigvals

from sweeps.mechanics import modes


def matrices(n, count=50, seed=2):
    rng = np.random.default_rng(seed)
    half = rng.standard_normal((count, n, n))
    a = half @ half.transpose(0, 2, 1) + 0.1 * np.eye(n)
    hessian = rng.standard_normal((count, n, n))
    return hessian + hessian.transpose(0, 2, 1), a


@pytest.mark.parametrize("n", [1, 2, 3, 5])
def test_modes_solve_the_eigenproblem(n):
    hessian, a = matrices(n)
    squares, vectors = modes.normal_modes(hessian, a)
    force = hessian @ vectors
    assert force == pytest.approx(a @ vectors * squares[:, None, :], abs=1e-10)
    identity = np.broadcast_to(np.eye(n), a.shape)
    assert vectors.transpose(0, 2, 1) @ a @ vectors == pytest.approx(identity, abs=1e-10)
    assert (np.diff(squares, axis=1) >= 0).all()
    general = np.array([np.sort(eigvals(h, m).real) for h, m in zip(hessian, a, strict=True)])
    assert squares == pytest.approx(general, rel=1e-9, abs=1e-10)


def test_a_mode_has_its_largest_component_positive():
    _, vectors = modes.normal_modes(*matrices(3))
    largest = np.take_along_axis(vectors, np.abs(vectors).argmax(axis=1)[:, None], axis=1)
    assert (largest > 0).all()


def test_a_matrix_that_is_not_positive_has_no_modes():
    squares, _ = modes.normal_modes(np.eye(2)[None], np.diag([1.0, -1.0])[None])
    assert np.isnan(squares).all()
    assert np.isnan(modes.normal_modes(np.array([[[1.0]]]), np.array([[[-1.0]]]))[0]).all()


@pytest.mark.parametrize("n", [1, 2, 3, 5])
def test_scale_bounds_every_rate(n):
    hessian, a = matrices(n, 200)
    squares, _ = modes.normal_modes(hessian, a)
    S = modes.scale(np.abs(hessian), a)
    assert (np.abs(squares).max(axis=1) <= S**2 * (1 + 1e-12)).all()


def test_there_is_no_scale_where_nothing_pulls():
    assert np.isnan(modes.scale(np.zeros((1, 2, 2)), np.eye(2)[None])).all()


def test_a_matrix_is_positive_by_its_eigenvalues_whatever_the_units():
    matrices = np.array([np.diag([1e-40, 1e30]), [[1.0, 2.0], [2.0, 1.0]]])
    assert modes.is_positive_definite(matrices).tolist() == [True, False]
