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
        ({"M": np.eye(31), "K": np.eye(31)}, "there are 30 already"),
    ],
)
def test_matrices_that_make_no_system_are_refused(matrices, message):
    with pytest.raises(DescriptionError, match=message):
        System("Refused").matrices(**matrices)


@pytest.mark.slow
def test_many_coordinates_are_measured_as_a_matrix():
    """Gyroscopic forces and damping that turns with the shaft: at rest all modes are double."""
    count, system = 30, System("Shaft of thirty coordinates")
    speed = system.parameter("speed", "rad s-1", default=1.0)
    rng = np.random.default_rng(3)
    turn = np.kron(np.eye(count // 2), [[0.0, 1.0], [-1.0, 0.0]])
    stiffness = np.kron(np.diag(np.linspace(1.0, 4.0, count // 2)), np.eye(2))
    mass = np.kron(np.diag(rng.uniform(1.0, 1.2, count // 2)), np.eye(2))
    damping = 0.01 * mass + 0.02 * stiffness
    circulation = speed * sp.Matrix(0.02 * stiffness @ turn)
    system.matrices(mass, stiffness, C=damping, G=speed * sp.Matrix(0.1 * turn), N=circulation)
    whole_map = sweeps.survey(system=system, speed=[0.0, 1.0, 2.0, 3.0, 4.0])
    ds = whole_map.squeeze()
    assert (ds.status == 0).all()
    for speed in ds.speed.values:
        blocks = stiffness + speed * 0.02 * stiffness @ turn, damping + speed * 0.1 * turn
        matrix = np.block([[np.zeros_like(mass), np.eye(count)], [-np.linalg.solve(mass, block) for block in blocks]])
        right, at = np.linalg.eigvals(matrix), ds.sel(speed=speed)
        for suffix, error in (("", np.hypot(at.eigenvalue_real_error, at.eigenvalue_imag_error)), ("_theory", 1e-12)):
            values = at[f"eigenvalue_real{suffix}"].values + 1j * at[f"eigenvalue_imag{suffix}"].values
            distances = np.abs(values[:, None] - right)
            assert (distances.min(axis=1) <= np.asarray(error) + 1e-13).all()  # LAPACK's own error
            assert distances.min(axis=0).max() < 1e-9 * np.abs(right).max()  # none is missing
        is_stable = bool((right.real < 0.0).all())
        assert (at.regime == (0 if is_stable else 3)).all()
        assert (at.regime_theory == at.regime).all()
    assert sweeps.modes(whole_map).mode_shape_real.sel(speed=0.0).isnull().all()
