"""Linear systems from matrices: eigenvalues against SciPy's, and each way to give a matrix."""

import numpy as np
import pytest
import sympy as sp
from scipy.linalg import eigvals

import sweeps
from sweeps.mechanics import DescriptionError, System

RNG = np.random.default_rng(5)
M, C, G, K, N = (RNG.uniform(-1.0, 1.0, (3, 3)) for _ in "MCGKN")
M, G = M @ M.T + np.eye(3), G - G.T


def eigenvalues(speed):
    """Return the eigenvalues of M q″ + (C + speed G) q′ + (K + speed² N) q = 0 by SciPy, ordered as a map's."""
    zero, one = np.zeros((3, 3)), np.eye(3)
    forces = -np.hstack([K + speed**2 * N, C + speed * G])
    values = eigvals(np.vstack([np.hstack([zero, one]), forces]), np.block([[one, zero], [zero, M]]))
    return values[np.lexsort((values.real, np.round(values.imag, 9)))]


def test_eigenvalues_of_general_matrices_are_those_of_scipy():
    system = System("Three coordinates")
    speed = system.parameter("speed", default=1.0)
    coordinates = system.matrices(M, K, C=C, G=speed * sp.Matrix(G), N=speed**2 * sp.Matrix(N), names=["x", "y", "z"])
    assert [str(x) for x in coordinates] == ["x", "y", "z"]
    ds = sweeps.survey(system=system, speed=[0.0, 0.7, 2.0]).squeeze()
    for value in ds.speed.values:
        at, right = ds.sel(speed=value), eigenvalues(value)
        for part in ("real", "imag"):
            error = at[f"eigenvalue_{part}_error"].values + 1e-13  # SciPy's own error
            assert (np.abs(at[f"eigenvalue_{part}"].values - getattr(right, part)) <= error).all()
            np.testing.assert_allclose(at[f"eigenvalue_{part}_theory"], getattr(right, part), atol=1e-12)


@pytest.mark.parametrize("way", ["lists", "csv", "npz"])
def test_symmetric_matrices_of_files_make_a_natural_system(way, tmp_path):
    masses, stiffness = np.diag([1.0, 2.0]), np.array([[3.0, -1.0], [-1.0, 1.5]])
    np.savez(tmp_path / "chain.npz", M=masses, K=stiffness)
    np.savetxt(tmp_path / "K.csv", stiffness, delimiter=",")
    matrices = {
        "lists": {"M": masses.tolist(), "K": stiffness.tolist()},
        "csv": {"M": masses, "K": tmp_path / "K.csv"},
        "npz": dict(np.load(tmp_path / "chain.npz")),
    }
    system = System("Chain")
    system.matrices(**matrices[way])
    squares = sweeps.survey(system=system).omega_squared_theory.squeeze()
    np.testing.assert_allclose(squares, np.sort(eigvals(stiffness, masses).real), rtol=1e-14)


@pytest.mark.parametrize(
    ("matrices", "message"),
    [
        ({"M": [[1, 2], [3, 4]], "K": K}, "M: is no symmetric matrix"),
        ({"M": M, "K": [[1.0]]}, "K: is 1 × 1; allowed: 3 × 3, as M"),
        ({"M": M, "K": K, "C": "missing.csv"}, "C: missing.csv not found"),
        ({"M": M, "K": K, "names": ["x"]}, "names: there are 1; allowed: 3"),
        ({"M": M, "K": "text"}, "K: text not found"),
        ({"M": [[1.0], [1.0, 2.0]], "K": K}, "M: .*allowed: a square list of lists"),
        ({"M": sp.Matrix([[sp.Symbol("u")]]), "K": [[1]]}, "unbound symbol u"),
        ({"M": np.eye(11), "K": np.eye(11)}, "there are 10 already"),
    ],
)
def test_matrices_that_make_no_system_are_refused(matrices, message):
    with pytest.raises(DescriptionError, match=message):
        System("Refused").matrices(**matrices)
