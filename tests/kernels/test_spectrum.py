"""Eigenvalues from samples: against LAPACK, against the Cramér-Rao bound, and through a collision."""

import math
from typing import NamedTuple

import numpy as np
import pytest
from scipy import linalg

from kernels.compile.blocks import W

pytestmark = pytest.mark.slow  # their kernels take as long to compile as those of all quick tests

# The spectra of the experiment that chose the method: eigenvalues (one of each conjugate pair), number of samples.
CASES = {
    "centres": ([1j, 2.3j], 100),
    "near centres": ([1j, 1.05j], 100),
    "nearer centres": ([1j, 1.01j], 100),
    "quadruple": ([0.2 + 1.3j, -0.2 + 1.3j], 100),
    "near a collision": ([0.01 + 1.3j, -0.01 + 1.3j], 100),
    "slow and fast": ([0.05j, 3j], 100),
    "saddle and centre": ([0.3, -0.3, 1.7j], 40),
    "four centres": ([0.7j, 1.5j, 2.2j, 3.1j], 150),
    "damped": ([-0.01, -1.0], 100),
    "odd": ([-0.01 + 1j, -0.3, -0.5 + 2j], 100),
}
SPACING, NOISE, DRAWS = 0.25, 1e-8, 150  # noise far above rounding, far below effects of curvature


@pytest.fixture(scope="module", autouse=True)
def compiled():
    """The kernels, imported for the tests that are chosen alone: importing compiles them."""
    global codes, dense, spectrum
    from kernels.flow import codes, dense, spectrum


class Spectrum(NamedTuple):
    """Measured spectra: arrays over the points, with the eigenvalues, or S, D and S² - 4D, along the last axis."""

    eigenvalues: np.ndarray
    errors: np.ndarray
    invariants: np.ndarray
    invariant_errors: np.ndarray
    scatter: np.ndarray
    excitation: np.ndarray


def measure(samples, spacing, num_samples=None):
    """Measure sampled motions, shape (..., runs, count, n), with standard errors; ``used`` samples of each run."""
    runs, count, n = samples.shape[-3:]
    flat = samples.reshape(-1, runs, count, n)
    raw = np.empty((len(flat), codes.HEAD + 4 * n))
    weight = np.repeat((np.arange(count) < (count if num_samples is None else num_samples)).astype(float), runs * W)
    weight = np.ascontiguousarray(np.moveaxis(weight.reshape(count, runs, W), 0, 1)).reshape(-1, W)
    for first in range(0, len(flat), W):
        lanes = min(W, len(flat) - first)
        block = flat[first + np.minimum(np.arange(W), lanes - 1)].reshape(W, -1).T
        Y = np.where(np.repeat(weight, n, axis=0) > 0.0, block, 0.0)
        measures, nothing = np.empty((W, raw.shape[1])), np.zeros(W)
        numbers = (runs, count, n, np.full(W, spacing), nothing, nothing, 0.0, lanes)
        spectrum.fit_block(Y, weight, *numbers, measures)
        raw[first : first + lanes] = measures[:lanes]
    raw = raw.reshape(*samples.shape[:-3], -1)
    re, im, e_re, e_im = (raw[..., codes.HEAD + i * n : codes.HEAD + (i + 1) * n] for i in range(4))
    values = raw[..., [codes.SUM, codes.PRODUCT, codes.DISCRIMINANT]]
    errors = raw[..., [codes.SUM_ERROR, codes.PRODUCT_ERROR, codes.DISCRIMINANT_ERROR]]
    scatter, excitation = raw[..., codes.SCATTER], raw[..., codes.EXCITATION]
    return Spectrum(re + 1j * im, e_re + 1j * e_im, values, errors, scatter, excitation)


def generator(values, seed=1):
    """A real matrix with these eigenvalues, in random orthogonal axes; conjugates are added."""
    blocks = [[[v.real, v.imag], [-v.imag, v.real]] if complex(v).imag else [[v]] for v in values]
    A = linalg.block_diag(*[np.real(np.array(b)) for b in blocks])
    Q = linalg.qr(np.random.default_rng(seed).normal(size=A.shape))[0]
    return Q @ A @ Q.T


def motions(A, count, runs, seed=2):
    starts = np.random.default_rng(seed).normal(size=(runs, len(A)))
    steps = np.array([linalg.expm(A * SPACING * k) for k in range(count)])
    return np.einsum("kij,rj->rki", steps, starts)


def sorted_eigenvalues(A):
    values = linalg.eigvals(A)
    re, im = values.real.copy(), values.imag.copy()
    dense.sort_eigenvalues(re, im, len(A), codes.MIN_IMAG_GAP / SPACING)
    return re + 1j * im


def bound(A, clean):
    """Cramér-Rao bound of the eigenvalues' parts for noise of one: slopes of all samples by M and the starts."""
    runs, count, n = clean.shape
    M, starts = linalg.expm(A * SPACING), clean[:, 0]

    def run(M, starts):
        out = [starts]
        for _ in range(count - 1):
            out.append(out[-1] @ M.T)
        return np.array(out).ravel()

    h, base = 1e-7, np.concatenate([M.ravel(), starts.ravel()])

    def at(p):
        return run(p[: n * n].reshape(n, n), p[n * n :].reshape(runs, n))

    G = np.array([(at(base + h * e) - at(base - h * e)) / (2 * h) for e in np.eye(base.size)]).T
    covariance = np.linalg.inv(G.T @ G)[: n * n, : n * n]
    values, left_vectors, right_vectors = linalg.eig(M, left=True)
    slopes = []
    for k in range(n):
        w, v = left_vectors[:, k].conj(), right_vectors[:, k]
        slopes.append(np.outer(w, v).ravel() / (w @ v) / values[k] / SPACING)
    slopes = np.array(slopes)
    rates = np.log(values) / SPACING
    number = [np.abs(rates - x).argmin() for x in sorted_eigenvalues(A)]
    errors = [np.sqrt(np.einsum("ki,ij,kj->k", s, covariance, s)) for s in (slopes.real, slopes.imag)]
    return (errors[0] + 1j * errors[1])[number]


@pytest.mark.parametrize("runs", [1, 2])
@pytest.mark.parametrize("name", CASES)
def test_errors_are_the_bound_and_cover(name, runs):
    values, count = CASES[name]
    A = generator(values)
    clean = motions(A, count, runs)
    noise = NOISE * np.random.default_rng(4).normal(size=(DRAWS, *clean.shape))
    spectra = measure(clean + noise, SPACING)
    true, bounds = sorted_eigenvalues(A), NOISE * bound(A, clean)
    assert 0.99 < np.median(spectra.scatter) / NOISE < 1.01
    errors = np.median(spectra.errors, axis=0)
    for error_part, bound_part in ((errors.real, bounds.real), (errors.imag, bounds.imag)):
        real = bound_part > 1e-4 * np.abs(bounds).max()  # the imaginary part of a real eigenvalue has no error
        np.testing.assert_allclose(error_part[real], bound_part[real], rtol=0.06)  # the start's own errors
    deviation = spectra.eigenvalues - true
    z = np.concatenate(
        [
            ratios[:, np.abs(ratios).max(0) > 0].ravel()
            for ratios in (deviation.real / errors.real, deviation.imag / errors.imag)
        ]
    )
    z = z[np.isfinite(z)]
    assert 0.85 < np.sqrt(np.mean(z**2)) < 1.15  # draws of correlated numbers: a few per cent either way
    assert 0.60 < np.mean(np.abs(z) < 1) < 0.80
    assert np.mean(np.abs(z) < 2) > 0.92
    if len(true) == 4:
        S, D = 0.5 * np.sum(true**2).real, np.prod(true).real
        z = (spectra.invariants - [S, D, S * S - 4 * D]) / spectra.invariant_errors
        assert (np.sqrt(np.mean(z**2, axis=0)) < 1.2).all()
        assert (np.sqrt(np.mean(z**2, axis=0)) > 0.8).all()


@pytest.mark.parametrize("gap", [1.0, 1e-2, 1e-4, 1e-6, 1e-8, 0.0, -1e-8, -1e-4, -1e-2])
def test_invariants_are_smooth_through_a_collision(gap):
    """ν² - p ν + P = 0 in space, x = p² - 4 P: the rates lose half their digits at x = 0, S and D do not."""
    p = 2.0
    P = (p * p - gap) / 4
    A = np.array([[0, 0, 1, 0], [0, 0, 0, 1], [P, 0, 0, -p], [0, P, p, 0]]) + 0.0
    clean = motions(A, 100, 2)
    noise = 1e-13 * np.random.default_rng(5).normal(size=(60, *clean.shape))
    spectra = measure(clean + noise, SPACING)
    S, D = -(p * p - 2 * P), P * P  # of λ = ±iν
    nu = (p + np.array([1, -1]) * np.sqrt(complex(gap))) / 2
    true = np.array([1j, -1j])[:, None] * nu
    re, im = true.real.ravel().copy(), true.imag.ravel().copy()
    dense.sort_eigenvalues(re, im, 4, codes.MIN_IMAG_GAP / SPACING)
    deviation = np.abs(spectra.invariants - [S, D, S * S - 4 * D])
    assert (np.median(deviation, axis=0) < 1e-11).all()
    assert (deviation < 5 * spectra.invariant_errors).all()  # standard errors, 60 draws
    rates = np.abs(spectra.eigenvalues - (re + 1j * im))
    allowed = np.hypot(spectra.errors.real, spectra.errors.imag)
    assert (rates < 5 * allowed).all()
    if gap == 0.0:
        assert np.median(rates.max(axis=-1)) > 1e-8  # therefore S and D are reported


def test_equal_modes_need_a_second_run():
    A = generator([1j, 1j])
    assert np.isnan(measure(motions(A, 80, 1), SPACING).eigenvalues).all()
    spectra = measure(motions(A, 80, 2), SPACING)
    np.testing.assert_allclose(spectra.eigenvalues, sorted_eigenvalues(A), atol=1e-12)


def test_a_mode_that_was_not_moved_is_said():
    A = generator([1j, 2.3j])
    clean = motions(A, 80, 1)
    values, right = linalg.eig(A)
    share = linalg.inv(right)[np.abs(values.imag) > 2] @ clean[0, 0]  # take the fast mode out of the start
    start = clean[0, 0] - (right[:, np.abs(values.imag) > 2] @ share).real
    still = np.array([[linalg.expm(A * SPACING * k) @ start for k in range(80)]])
    spectra = measure(still, SPACING)
    assert spectra.excitation < codes.MIN_EXCITATION
    assert np.isnan(spectra.eigenvalues).all()


def test_time_scales_out():
    clean = motions(generator([0.2 + 1.3j, -0.2 + 1.3j]), 70, 2)
    slow, fast = measure(clean, SPACING), measure(clean, SPACING / 1024)
    np.testing.assert_array_equal(fast.eigenvalues, slow.eigenvalues * 1024)
    np.testing.assert_array_equal(fast.errors, slow.errors * 1024)
    np.testing.assert_array_equal(fast.invariants, slow.invariants * [2.0**20, 2.0**40, 2.0**40])


def test_samples_beyond_those_used_do_not_count():
    clean = motions(generator([1j, 2.3j]), 70, 2)
    spoilt = clean.copy()
    spoilt[:, 50:] = math.nan
    short, cut = measure(spoilt, SPACING, num_samples=50), measure(clean[:, :50], SPACING)
    np.testing.assert_array_equal(short.eigenvalues, cut.eigenvalues)
