"""Products of segments' matrices against products in 40 digits, and of their second halves from the first."""

import mpmath
import numpy as np
import pytest

from kernels.compile.blocks import W, rows_of
from kernels.flow import matrices, monodromy

STEPS, LANES = 10, 6


def segments(n, half):
    """Return the matrices of STEPS, or of half of them, by lane, in 40 digits, of Hamilton's equations with masses."""
    rng, m = np.random.default_rng(n), n // 2
    masses, exponentials = np.eye(m) + 0.3 * np.ones((m, m)), []
    for _ in range(LANES * (STEPS // 2 if half else STEPS)):
        K, A = rng.normal(size=(m, m)), mpmath.zeros(n)
        A[:m, m:], A[m:, :m] = mpmath.eye(m), mpmath.matrix(masses) ** -1 * mpmath.matrix(-2.0 * (K + K.T))
        exponentials.append(mpmath.expm(A))
    return [exponentials[lane::LANES] for lane in range(LANES)], masses


def compose(S, masses, coupled):
    """Return the columns of the product of segments, shape (rows, W); of half a period if there are masses."""
    n, num_segments = len(coupled), len(S[0])
    matrices, errors, rows = monodromy.zeros_of(num_segments, n), rows_of(num_segments), rows_of(2 * masses.size)
    for lane in range(W):
        for s, segment in enumerate(S[lane % len(S)]):
            matrices[s, :, lane] = [*segment]
        rows[:, lane] = [*masses.ravel(), *np.linalg.inv(masses).ravel()] if masses.size else []
    return monodromy.compose(matrices, errors, rows, STEPS, coupled, monodromy.work_of(num_segments, n))


def exact(S, n):
    """Return the product of segments, that of the cycle which begins later, and the trace of the second compound."""
    reflection = mpmath.diag([1] * (n // 2) + [-1] * (n // 2))
    S = [*S, *(reflection * segment**-1 * reflection for segment in reversed(S) if len(S) < STEPS)]
    M = later = mpmath.eye(n)
    for s in range(STEPS):
        M, later = S[s] * M, S[(s + round(monodromy.SECOND_PHASE * STEPS)) % STEPS] * later
    second = (sum(M[i, i] for i in range(n)) ** 2 - sum((M * M)[i, i] for i in range(n))) / 2
    return *(np.array(x.tolist(), dtype=float) for x in (M, later)), float(second)


@pytest.mark.parametrize("half", [False, True])
@pytest.mark.parametrize("n", [2, 4])
def test_products_and_second_compounds_are_those_of_forty_digits(n, half):
    with mpmath.workdps(40):
        S, masses = segments(n, half)
        expected = [exact(segment, n) for segment in S]
    columns, size, large = compose(S, masses if half else np.empty((0, 0)), np.ones((n, n), dtype=bool)), n * n, 0
    for lane, (M, later_cycle, second) in enumerate(expected):
        product, noise = columns[: 2 * size, lane].reshape(2, n, n)
        (minors, minors_noise), later = columns[2 * size + 1 :, lane][:2], columns[2 * size + 3 :, lane].reshape(n, n)
        assert (np.abs(product - M) <= monodromy.NOISE * noise).all()
        # the later cycle has no reported error: relative to its entries it may be some times as large
        limit = monodromy.NOISE * noise.max() * max(1.0, np.abs(later_cycle).max() / np.abs(M).max())
        assert np.abs(later - later_cycle).max() <= 30.0 * limit
        is_large = np.abs(M).max() > monodromy.LARGE_ENTRY
        large += is_large
        assert np.isfinite(minors) == is_large
        assert not is_large or abs(minors - second) <= 2.0 * monodromy.NOISE * minors_noise
    assert large


def test_states_apart_have_products_of_their_own():
    """Two states that do not act on each other: no entry and no turn but of each alone; 1e-15: some roundings."""
    factors = np.random.default_rng(5).uniform(0.8, 1.2, (STEPS, 2))
    columns = compose([[[x, 0.0, 0.0, y] for x, y in factors]], np.empty((0, 0)), matrices.find_coupled(2, []))[:, 0]
    np.testing.assert_allclose(columns[[0, 3]], factors.prod(axis=0), rtol=1e-15)
    assert not columns[[1, 2, 5, 6, 8]].any()
