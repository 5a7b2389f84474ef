"""Errors and regimes of described systems at every size of the perturbation: correct, or missing with a status."""

import described
import numpy as np
import pytest
import relative

from kernels.estimator.statuses import OK, PERTURBATION_TOO_LARGE, SHORT_WINDOW
from kernels.flow import codes, flows
from sweeps.mechanics.relative import _errors_of_exchange, regimes
from sweeps.systems.relative_equilibrium.system import REGIMES


def test_a_double_pendulum_that_saturates_is_refused_or_within_its_error():
    """Upright, with a heavy lower mass: at 0.1 the fast mode saturates within the window at all three sizes."""
    model, worst = described.model_of("double_pendulum"), 0.0
    for epsilon in (1e-8, 1e-4, 1e-2, 0.1, 0.5):
        points = described.points(model, 40, {"mass2": (10.0, 50.0), "length2": (0.5, 5.0)}, 5, epsilon=epsilon)
        columns = model.survey(points | {"phase": np.linspace(-3.0, 3.0, len(points["phase"]))})
        is_ok = columns["status"] == OK
        assert is_ok.mean() > (0.8 if epsilon < 0.01 else 0.3)
        for name in ("omega_squared", "omega_squared_reduced"):
            missing = np.isnan(columns[name]) & np.isnan(columns[f"{name}_error"])
            assert missing[columns["status"] == PERTURBATION_TOO_LARGE].all()
            deviation = np.abs(columns[name] - columns["omega_squared_theory"])[is_ok]
            # theory's own rounding, of a kinetic matrix with a condition of 50: 1e-14 of the scale
            deviation -= 1e-14 * columns["rate_scale"][is_ok] ** 2
            worst = max(worst, (deviation / columns[f"{name}_error"][is_ok]).max())
        differs = (columns["regime"] != columns["regime_theory"]) & (columns["regime"] < 2)
        assert not (differs & is_ok).any()
    assert worst <= 1.0


@pytest.mark.parametrize(
    ("name", "values", "has_pairs"),
    [
        ("foucault", {"drag": 0.0}, True),
        ("foucault", {"drag": 1e-3}, False),
        ("rotor", {}, False),
        ("lagrange_points", {}, True),
    ],
)
def test_eigenvalues_are_paired_where_the_equations_are_symmetric(name, values, has_pairs):
    theory = relative.theory_at(name, **values)
    assert theory["has_pairs"][0] == has_pairs
    eigenvalues = theory["eigenvalues"][0]
    distance = np.abs(eigenvalues[:, None] + eigenvalues).min(1).max() / theory["scale"][0]
    assert (distance < 1e-6) == has_pairs  # 1e-12 to the power of a half, if two eigenvalues meet


SPECTRA = [  # eigenvalues, their error, and the regime without a symmetry
    ([1j, -1j, 2j, -2j], 1e-8, "stable"),
    ([1j, -1j, (1 + 1e-9) * 1j, (-1 - 1e-9) * 1j], 1e-8, "marginal"),  # they may have met
    ([-1 + 1j, -1 - 1j, -2, -2], 1e-8, "asymptotically_stable"),
    ([1, -1, 1j, -1j], 1e-8, "unstable"),
    ([0.1 + 1j, 0.1 - 1j, -0.1 + 1j, -0.1 - 1j], 1e-8, "flutter"),
    ([1j, -1j, 1e-9 + 2j, -2j], 1e-8, "stable"),
    ([np.nan] * 4, 1e-8, "undetermined"),
    # a real eigenvalue and a pair with equal real parts: the kind of growth is open, and not the growth
    *(([0.5 - 2j, real + 1e-4, 0.5 + 2j, -1], e, word) for real, e, word in (
        (0.4, 1e-3, "flutter"), (0.5, 1e-3, "unstable"), (0.5, 1.0, "marginal"))),
    # two growing eigenvalues that may be a pair: two that meet within their errors may become one, and back
    *(([*first, -1 - 1j, -1 + 1j], 1e-3, word) for first, word in (
        ((0.5 + 1e-4j, 0.5 - 1e-4j), "unstable"), ((0.5, 0.5 + 1e-4), "unstable"), ((0.5, 0.3), "unstable"),
        ((5e-4, 4e-4), "marginal"), ((0.5 + 2e-3j, 0.5 - 2e-3j), "flutter"))),
]  # fmt: skip


@pytest.mark.parametrize(("values", "error", "regime"), SPECTRA)
def test_regimes_are_those_that_errors_leave(values, error, regime):
    values, errors = np.array([values], complex), np.full((1, 4), error)
    assert REGIMES[1 + regimes(values.real, values.imag, errors, errors)[0]] == regime


def test_without_the_symmetry_no_motion_is_called_stable():
    re, im = np.array([[-1e-9, -1e-9, 1e-9, 1e-9]]), np.array([[-2.0, -1.0, 1.0, 2.0]])
    error = np.full((1, 4), 1e-3)
    verdicts = [regimes(re, im, error, error, None, np.array([has_pairs]))[0] for has_pairs in (True, False)]
    assert verdicts == [codes.STABLE, codes.MARGINAL]


def test_pairs_whose_discriminant_is_open_are_unstable():
    """μ² of positive real part: two real pairs or a quartet that flutters, by the sign of S² - 4D."""
    re, im = np.array([[-2.0, 2.0, -2.0, 2.0]]), np.array([[-0.1, 0.1, 0.1, -0.1]])
    error = np.full((1, 4), 10.0)
    for total, product, regime in ((8.0, 1.0, codes.UNSTABLE), (8.0, 0.1, codes.FLUTTER), (-8.0, 1.0, codes.MARGINAL)):
        invariants = [(np.array([x]), np.array([e])) for x, e in ((total, 0.1), (16.0, 0.1), (-0.5, product))]
        assert regimes(re, im, error, error, invariants, np.array([True]))[0] == regime


@pytest.mark.parametrize(("name", "bar"), [("rotor", 1e-12), ("foucault", 1e-4)])
def test_eigenvalues_of_large_perturbations_are_those_of_zero_amplitude(name, bar):
    """A tenth of the states' sizes: extrapolated from six motions each (rotor: its equations are linear)."""
    model = described.model_of(name)
    columns = model.survey(described.points(model, 20, relative.RANGES[name], 4, epsilon=0.1))
    assert (columns["status"] == OK).all()
    relative.check_errors(columns)
    errors = [columns[f"eigenvalue_{part}_error"] / columns["rate_scale"] for part in ("real", "imag")]
    assert np.median(errors, axis=1).max() < bar


def test_errors_reach_an_eigenvalue_that_may_have_changed_places():
    """A quartet ±a ± ib: which of +a and -a comes first hangs on imaginary parts that are known to 1e-5."""
    re, im = np.array([[0.3, -0.3, 0.3, -0.3]]), np.array([[-1.0 - 1e-6, -1.0 + 1e-6, 1.0 - 1e-6, 1.0 + 1e-6]])
    error = np.full((1, 4), 1e-5)
    real, imaginary = _errors_of_exchange(re, im, error, error, np.ones(1))
    assert (real >= 0.6).all()
    assert (imaginary < 2e-5).all()
    small = np.full((1, 4), 1e-9)
    assert all(np.array_equal(x, small) for x in _errors_of_exchange(re, im, small, small, np.ones(1)))


def test_a_window_shorter_than_the_scale_is_refused():
    """Much less than a cycle: no digits are left of the normal equations, and the sixth order does not show."""
    model = described.model_of("double_pendulum")
    points = described.points(model, 5, {"mass2": (5.0, 20.0), "length2": (5.0, 20.0)}, epsilon=0.45)
    status = model.survey(points, 0.001, 24000)["status"]
    assert np.isin(status, (SHORT_WINDOW, PERTURBATION_TOO_LARGE)).all()
    model = described.model_of("viscous_slug")
    points = described.points(model, 20, relative.RANGES["viscous_slug"])
    assert (model.survey(points, 0.04, 500)["status"] == SHORT_WINDOW).all()


def test_an_amplitude_that_bends_the_samples_beyond_their_least_singular_value_is_refused():
    raw = np.zeros((4, flows.FIRST + codes.HEAD + 8))
    raw[:, flows.REMAINDER] = [1e-4, 1e-1, 1e-4, 1e-4]
    estimates = raw[:, flows.FIRST :]
    estimates[:, codes.EXCITATION] = 0.1
    estimates[2, codes.HEAD] = 2.0  # a rate above every possible one
    estimates[3, codes.ODD] = 2.0
    is_too_wide = flows.is_too_wide(raw, 0, 2, np.ones(4), np.ones(4) > 0)
    assert is_too_wide.tolist() == [False, True, True, True]
    assert flows.is_too_wide(raw, 0, 2, np.ones(4), np.ones(4) < 0).tolist() == [False, True, True, False]


@pytest.mark.slow
def test_eigenvalues_are_in_the_order_of_theorys_however_close_the_samples():
    """Pairs with imaginary parts 8e-6 of the scale apart, at a 16th and a 198th of a cycle between samples."""
    model = described.model_of("gravity_gradient_damped")
    points = described.points_at(model, epsilon=3.1e-6, k1=-0.4656, k3=-0.8553, slug=0.0022, drag=0.0135)
    for samples in (16, 198):
        relative.check_errors(model.survey(points, 1.182, samples))
