"""Products of segments' matrices against products in 40 digits, and of their second halves from the first."""

import mpmath
import numpy as np
import pytest

from kernels.compile.blocks import W, rows_of
from kernels.flow import matrices, monodromy

STEPS, LANES = 10, 8


def segments(n, half):
    """Return the matrices of STEPS, or of half of them, by lane, in 40 digits, of Hamilton's equations with masses."""
    rng, m = np.random.default_rng(n), n // 2
    masses, found = np.eye(m) + 0.3 * np.ones((m, m)), []
    for _ in range(LANES * (STEPS // 2 if half else STEPS)):
        K, A = rng.normal(size=(m, m)), mpmath.zeros(n)
        A[:m, m:], A[m:, :m] = mpmath.eye(m), mpmath.matrix(masses) ** -1 * mpmath.matrix(-2.0 * (K + K.T))
        found.append(mpmath.expm(A))
    return [found[lane::LANES] for lane in range(LANES)], masses


def composed(S, masses, joined):
    """Return what is known of the product of segments, shape (rows, W); of half a period where there are masses."""
    n, followed = len(joined), len(S[0])
    matrices, off, rows = monodromy.zeros_of(followed, n), rows_of(followed), rows_of(2 * masses.size)
    for lane in range(W):
        for s, one in enumerate(S[lane % len(S)]):
            matrices[s, :, lane] = [*one]
        rows[:, lane] = [*masses.ravel(), *np.linalg.inv(masses).ravel()] if masses.size else []
    return monodromy.compose(matrices, off, rows, STEPS, joined, monodromy.work_of(followed, n))


def exact(S, n):
    """Return the product of segments, that of the cycle which begins later, and the trace of the second compound."""
    turned = mpmath.diag([1] * (n // 2) + [-1] * (n // 2))
    S = [*S, *(turned * one**-1 * turned for one in reversed(S) if len(S) < STEPS)]
    M = other = mpmath.eye(n)
    for s in range(STEPS):
        M, other = S[s] * M, S[(s + round(monodromy.SECOND_PHASE * STEPS)) % STEPS] * other
    second = (sum(M[i, i] for i in range(n)) ** 2 - sum((M * M)[i, i] for i in range(n))) / 2
    return *(np.array(x.tolist(), dtype=float) for x in (M, other)), float(second)


@pytest.mark.parametrize("half", [False, True])
@pytest.mark.parametrize("n", [2, 4])
def test_products_and_second_compounds_are_those_of_forty_digits(n, half):
    with mpmath.workdps(40):
        S, masses = segments(n, half)
        expected = [exact(one, n) for one in S]
    told, size, large = composed(S, masses if half else np.empty((0, 0)), np.ones((n, n), dtype=bool)), n * n, 0
    for lane, (M, other, second) in enumerate(expected):
        found, noise = told[: 2 * size, lane].reshape(2, n, n)
        (minors, minors_noise), later = told[2 * size + 1 :, lane][:2], told[2 * size + 3 :, lane].reshape(n, n)
        assert (np.abs(found - M) <= monodromy.NOISE * noise).all()
        # of the other cycle no error is told: relative to its entries it may be some times as large
        limit = monodromy.NOISE * noise.max() * max(1.0, np.abs(other).max() / np.abs(M).max())
        assert np.abs(later - other).max() <= 30.0 * limit
        is_large = np.abs(M).max() > monodromy.LARGE_ENTRY
        large += is_large
        assert np.isfinite(minors) == is_large
        assert not is_large or abs(minors - second) <= 2.0 * monodromy.NOISE * minors_noise
    assert large


def test_states_apart_have_products_of_their_own():
    """Two states that do not act on each other: no entry and no turn but of each alone; 1e-15: some roundings."""
    factors = np.random.default_rng(5).uniform(0.8, 1.2, (STEPS, 2))
    told = composed([[[x, 0.0, 0.0, y] for x, y in factors]], np.empty((0, 0)), matrices.find_coupled(2, []))[:, 0]
    np.testing.assert_allclose(told[[0, 3]], factors.prod(axis=0), rtol=1e-15)
    assert not told[[1, 2, 5, 6, 8]].any()
