import numpy as np
import pytest

from sweeps.mechanics import modes


@pytest.mark.parametrize("n", [1, 2, 3, 5])
def test_modes_solve_the_eigenproblem_and_the_scale_bounds_every_rate(n):
    rng = np.random.default_rng(2)
    half, hessian = rng.standard_normal((2, 50, n, n))
    a, hessian = half @ half.transpose(0, 2, 1) + 0.1 * np.eye(n), hessian + hessian.transpose(0, 2, 1)
    squares, vectors = modes.normal_modes(hessian, a)
    assert hessian @ vectors == pytest.approx(a @ vectors * squares[:, None, :], abs=1e-10)
    identity = np.broadcast_to(np.eye(n), a.shape)
    assert vectors.transpose(0, 2, 1) @ a @ vectors == pytest.approx(identity, abs=1e-10)
    assert (np.abs(squares).max(axis=1) <= modes.scale(np.abs(hessian), a) ** 2 * (1 + 1e-12)).all()  # rounding
