"""Multipliers, exponents and regimes against mpmath, on matrices with a prescribed spectrum."""

import mpmath
import numpy as np
import pytest
from scipy.linalg import expm

from kernels.flow import codes, floquet

NAMES = dict(zip(codes.REGIMES, range(-1, 6), strict=True))


def columns_of(M, error, period=1.0, reciprocal=True, turns=None):
    """Return the columns of matrices with errors of their entries, and the angles of their rotations over π."""
    M, error = np.asarray(M), np.broadcast_to(error, np.shape(M)).copy()
    return floquet.multiplier_columns(floquet.Matrices(M, error, turns), np.full(len(M), period), reciprocal)


def in_doubles(exact):
    """Return matrices of mpmath as doubles, and the rounding of their entries."""
    M = np.array([np.array(matrix.tolist(), dtype=float) for matrix in exact])
    return M, 2e-16 * np.abs(M).max(axis=(1, 2))[:, None, None]


def symplectic_matrix(rng, pairs):
    """Return a symplectic matrix with given pairs, each (kind, size, angle), in mpmath's 40 digits, and its class.

    J = [[0, 1], [-1, 0]]; the planted normal form is turned by a random symplectic matrix exp(J S).
    """
    blocks = mpmath.zeros(4)
    if len(pairs) == 1:  # a quadruple: r times a turn, and its inverse transposed
        _, r, angle = pairs[0]
        rotation = mpmath.matrix([[mpmath.cos(angle), -mpmath.sin(angle)], [mpmath.sin(angle), mpmath.cos(angle)]])
        blocks[:2, :2], blocks[2:, 2:] = r * rotation, rotation / r
    else:
        for k, (kind, r, angle) in enumerate(pairs):
            c, s = (mpmath.cos(angle), mpmath.sin(angle)) if kind == "turn" else (0, 0)
            sign = -1 if kind == "flip" else 1
            entries = ((c, -s), (s, c)) if kind == "turn" else ((sign * r, 0), (0, sign / mpmath.mpf(r)))
            for i in range(2):
                for j in range(2):
                    blocks[k + 2 * i, k + 2 * j] = entries[i][j]
    symmetric = rng.normal(size=(4, 4)) * 0.3
    J = np.block([[np.zeros((2, 2)), np.eye(2)], [-np.eye(2), np.zeros((2, 2))]])
    change = mpmath.expm(mpmath.matrix((J @ (symmetric + symmetric.T)).tolist()))
    return change * blocks * change**-1


CLASSES = [
    ([("turn", 1, 0.7), ("turn", 1, 2.1)], "stable"),
    ([("turn", 1, 0.7), ("turn", 1, -0.9)], "stable"),
    ([("real", 1.7, 0), ("turn", 1, 1.0)], "unstable"),
    ([("flip", 1.7, 0), ("turn", 1, 1.0)], "period_doubling"),
    ([("real", 3.0, 0), ("flip", 2.0, 0)], "unstable"),
    ([("real", 2.0, 0), ("flip", 3.0, 0)], "period_doubling"),
    ([("real", 2.0, 0), ("real", 1.5, 0)], "unstable"),
    ([("flip", 2.0, 0), ("flip", 1.5, 0)], "period_doubling"),
    ([("four", 1.2, 0.8)], "flutter"),
]


@pytest.mark.parametrize(("pairs", "regime"), CLASSES)
def test_four_multipliers_of_every_class_are_those_of_forty_digits(pairs, regime):
    rng = np.random.default_rng(3)
    with mpmath.workdps(40):
        exact = [symplectic_matrix(rng, pairs) for _ in range(3)]
        mus = [[complex(m) for m in mpmath.eig(matrix)[0]] for matrix in exact]
    M, error = in_doubles(exact)
    columns = columns_of(M, error, 2.0)
    assert (columns["regime"] == NAMES[regime]).all()
    for k, expected in enumerate(mus):
        ours = columns["multiplier_real"][k] + 1j * columns["multiplier_imag"][k]
        allowed = columns["multiplier_real_error"][k] + columns["multiplier_imag_error"][k]
        for mu, near in zip(ours, allowed, strict=True):
            assert min(abs(mu - multiplier) for multiplier in expected) <= near
        assert (
            abs(columns["growth_per_period"][k] - np.log(np.abs(expected).max()))
            <= columns["growth_per_period_error"][k] + 1e-14
        )
        assert (np.diff(np.abs(ours)) <= 1e-9 * np.abs(ours[:-1])).all()
    residuals = floquet.matrix_residuals(M)
    assert max(r.max() for r in residuals) < 1e-14


@pytest.mark.parametrize("second_pair", [("turn", 1, 1.0), ("real", 3, 0), ("flip", 3, 0)])
@pytest.mark.parametrize(("kind", "regime"), [("real", "unstable"), ("flip", "period_doubling")])
def test_a_multiplier_of_1e13_decides_alone(kind, regime, second_pair):
    """The matrix contains three digits of the second pair: the signs of det(M - 1) and det(M + 1) are unreliable."""
    rng = np.random.default_rng(4)
    with mpmath.workdps(60):
        exact = [symplectic_matrix(rng, [(kind, 1e13, 0), second_pair]) for _ in range(3)]
    columns = columns_of(*in_doubles(exact))
    assert (columns["regime"] == NAMES[regime]).all()
    np.testing.assert_allclose(columns["growth_per_period"], np.log(1e13), rtol=1e-13)  # ten roundings of the matrix


def test_errors_of_invariants_hold_for_random_changes_of_the_entries():
    """200 matrices, entries moved within their errors: each column moves within its own."""
    rng = np.random.default_rng(5)
    for d in (2, 4):
        J = np.kron(np.array([[0, 1], [-1, 0]]), np.eye(d // 2))
        S = rng.normal(size=(200, d, d)) * 0.6
        M = expm(J @ (S + S.swapaxes(1, 2)))
        error = 10.0 ** rng.uniform(-12, -3, (200, 1, 1)) * np.ones((d, d))
        invariants, names = (
            floquet.smooth_invariants(M, error),
            codes.INVARIANTS if d == 4 else ("trace", "determinant"),
        )
        changed_invariants = floquet.smooth_invariants(M + error * rng.uniform(-1, 1, M.shape), error)
        for name in names:
            assert (
                np.abs(changed_invariants[name] - invariants[name])
                <= invariants[f"{name}_error"] + 1e-12 * np.abs(invariants[name])
            ).all(), name


@pytest.mark.parametrize(
    ("entries", "regime"),
    [
        ([[0.5, -0.5], [0.5, 0.5]], "asymptotically_stable"),
        ([[1.1, -0.5], [0.5, 1.1]], "flutter"),
        ([[1.5, 0.0], [0.0, 0.2]], "unstable"),
        ([[-1.5, 0.0], [0.0, -0.2]], "period_doubling"),
        ([[1.5, 0.0], [0.0, 1.2]], "unstable"),
        ([[1.0, 0.0], [0.0, 0.5]], "marginal"),
        ([[np.nan, 0.0], [0.0, 0.5]], "undetermined"),
    ],
)
def test_regimes_with_damping(entries, regime):
    M = np.array([entries])
    exact, columns = (columns_of(M, error, reciprocal=False) for error in (0.0, 1e-14))
    assert exact["regime"] == columns["regime"] == NAMES[regime]
    if regime != "undetermined":
        expected = np.sort_complex(np.linalg.eigvals(M[0]))
        ours = np.sort_complex(columns["multiplier_real"][0] + 1j * columns["multiplier_imag"][0])
        np.testing.assert_allclose(ours, expected, atol=1e-14)


def test_exponents_of_a_turn_lie_on_the_branch_of_its_half_turns():
    for angle in (0.3, 2.9, 3.3, 6.0, 6.5, -0.4, -3.5, 20.0):
        c, s = np.cos(angle), np.sin(angle)
        M = np.array([[[c, -s], [s, c]]])
        columns = columns_of(M, 1e-15, 2.0, turns=np.floor([angle / np.pi]))
        np.testing.assert_allclose(np.abs(columns["exponent_imag"][0]), abs(angle) / 2.0, rtol=1e-13)
        multipliers = np.exp(2j * columns["exponent_imag"][0])
        np.testing.assert_allclose(
            multipliers, columns["multiplier_real"][0] + 1j * columns["multiplier_imag"][0], atol=1e-14
        )


@pytest.mark.parametrize("d", [3, 4, 6])
def test_errors_of_eigenvalues_cover_perturbed_matrices(d):
    """Random matrices and random changes within their errors, near a double multiplier too."""
    rng = np.random.default_rng(d)
    M = rng.normal(size=(300, d, d))
    M[::3] = np.where(np.eye(d, k=1), 1.0, np.eye(d)) * 0.9 + 1e-7 * M[::3]  # a Jordan block, split
    error = 10.0 ** rng.uniform(-13, -6, (300, 1, 1)) * np.ones((d, d))
    columns = columns_of(M, error, reciprocal=False)
    changed_columns = columns_of(M + error * rng.uniform(-1, 1, M.shape), error, reciprocal=False)
    for name in ("growth_rate", "growth_per_period", "trace"):
        assert (np.abs(columns[name] - changed_columns[name]) <= columns[f"{name}_error"]).all(), name
    eigenvalues, changed_eigenvalues = (
        c["multiplier_real"] + 1j * c["multiplier_imag"] for c in (columns, changed_columns)
    )
    nearest = np.abs(eigenvalues[:, :, None] - changed_eigenvalues[:, None]).min(axis=2)
    assert (nearest <= columns["multiplier_real_error"]).all()
    sure = (columns["regime"] != floquet.MARGINAL) & (changed_columns["regime"] != floquet.MARGINAL)
    assert (columns["regime"] == changed_columns["regime"])[sure].all()
    assert sure.mean() > 0.8


def test_an_error_that_reaches_from_growth_to_growth_holds_all_turning_between():
    for trace in (2.336, -2.336, 2.0, 0.3):
        M, error = np.array([[[trace, -1.0], [1.0, 0.0]]]), np.array([[[6.0, 0.0], [0.0, 0.0]]])
        columns = columns_of(M, error, turns=np.zeros(1))
        assert columns["regime"][0] == NAMES["marginal"]
        # of trace 0 the multipliers are ±i, as far from real multipliers as any
        reach = 1.0 - np.abs(columns["multiplier_imag"][0]).min()
        assert (columns["multiplier_imag_error"][0] >= reach).all()


@pytest.mark.parametrize(("d", "reciprocal"), [(2, True), (4, True), (4, False), (6, True)])
@pytest.mark.parametrize("by_point", [True, False])
def test_no_bit_depends_on_how_many_matrices_there_are(d, reciprocal, by_point):
    rng = np.random.default_rng(8)
    M = rng.normal(size=(60, d, d)) if by_point else np.moveaxis(rng.normal(size=(d, d, 60)), 2, 0)
    error, period = 1e-12 * np.abs(rng.normal(size=M.shape)), rng.uniform(1.0, 2.0, 60)
    together = columns_of(M, error, period, reciprocal)
    for count in (1, 3):
        for chunk in (slice(i, i + count) for i in range(0, 60, count)):
            alone = columns_of(M[chunk], error[chunk], period[chunk], reciprocal)
            assert [name for name in alone if alone[name].tobytes() != together[name][chunk].tobytes()] == []
