import math

import mpmath
import numpy as np
import pytest
from naive import bodies, signed_rate

from kernels.estimator import reduction, uncertainty
from kernels.free import exact, linear
from kernels.free.taylor import ORDERS
from kernels.near_axis import survey

SETTINGS = (4.0, 16, 1e-10)


@pytest.mark.parametrize("x2", [0.25, 0.05, 1e-6, 0.0, -1e-6, -0.05, -0.25])
def test_constants_are_those_of_the_hyperbolic_functions(x2):
    with mpmath.workdps(40):
        x = mpmath.sqrt(mpmath.mpf(x2)) if x2 else mpmath.mpf(10) ** -15
        C, S = mpmath.cosh(x), mpmath.sinh(x)
        guess = float(mpmath.re(1 - C))
        formulas = (x / mpmath.tanh(x) - 1) / (4 * x * x), 2 * x * S, x * x * C, x**3 * S / 3, x * C / S, -x * x / S**2
        expected = [float(mpmath.re(value)) for value in formulas]
    # the series' rest, see the docstring; x² itself is known to the rounding of the guess
    np.testing.assert_allclose(reduction.constants(guess, 1.0), expected, rtol=2e-8, atol=1e-15)


def test_three_samples_of_a_linear_motion_obey_the_identity():
    """δ²β = p + 2(C - 1)β for β = e^{κθ} and its mirror image, sampled at uneven θ; p by its own series."""
    with mpmath.workdps(40):
        x = mpmath.mpf("0.3")
        for u1, u in ((0.01, 0.012), (-0.02, -0.013), (0.0, 0.005)):
            before, after = x * (1 + mpmath.mpf(u1)), x * (1 + mpmath.mpf(u))
            # even and odd solution together: β = cosh θ + 0.4 sinh θ
            at = [mpmath.cosh(t) + mpmath.mpf("0.4") * mpmath.sinh(t) for t in (-before, 0, after)]
            second = at[2] - 2 * at[1] + at[0]
            constants = reduction.constants(float(1 - mpmath.cosh(x)), 1.0)[1:]
            same_coefficient, across, _ = reduction.amplitude_part(u, u1, constants)
            residual = second - (same_coefficient * at[1] + across * (at[2] - at[0])) - 2 * (mpmath.cosh(x) - 1) * at[1]
            # the remainder of the series in μ and η is of the fourth order
            assert abs(residual) < 10 * max(abs(u), abs(u1)) ** 4 + 1e-9 * max(abs(u), abs(u1))


@pytest.mark.compiled
@pytest.mark.parametrize("samples", [7, 10, 20])
def test_errors_cover_the_roundings_of_a_short_run_that_hardly_moves(samples):
    """Two moments so near each other that Ω² drowns in the roundings of the samples, which do not average out."""
    rng, n = np.random.default_rng(3), 20_000
    Ia, phase = rng.uniform(0.5, 1.0, n), np.where(rng.random(n) < 0.5, 0.0, rng.uniform(0.0, 7.0, n))
    Ib = Ia * (1.0 + 10.0 ** rng.uniform(-14, -9, n) * rng.choice([-1, 1], n))
    points = {"I1": Ia, "I2": Ib, "I3": Ia * rng.uniform(0.01, 1.9, n), "axis": 1, "omega0": 1.0}
    points |= {"epsilon": 10.0 ** rng.uniform(-12, -6, n), "phase": phase}
    for each in (16, 84):
        columns = survey.survey(points, (samples - 1) / each, each, 1e-12)
        for name in ("omega_squared", "omega_squared_reduced"):
            deviation = np.abs(columns[name] - columns["omega_squared_theory"])
            assert (deviation <= columns[f"{name}_error"]).all()


@pytest.mark.compiled
@pytest.mark.parametrize("epsilon", [1e-2, 1e-1])
def test_the_reduced_rate_is_that_of_an_infinitesimal_nudge(epsilon):
    points = bodies(400, 3, omega0=3.0, epsilon=epsilon)
    for propagator in ("direct", "exact"):
        columns = survey.survey(points, *SETTINGS, propagator=propagator)
        theory = columns["omega_squared_theory"]
        deviation = np.abs(columns["omega_squared_reduced"] / theory - 1)
        plain = np.abs(columns["omega_squared"] / theory - 1)
        assert np.median(deviation) < {1e-2: 1e-12, 1e-1: 1e-9}[epsilon] < 1e-5 * np.median(plain)
        assert (np.abs(columns["omega_squared_reduced"] - theory) <= columns["omega_squared_reduced_error"]).all()
        assert (np.abs(columns["omega_squared"] - theory) <= columns["omega_squared_error"]).all()
        shift = columns["omega_squared"] - columns["omega_squared_reduced"]
        np.testing.assert_allclose(columns["amplitude_shift"], shift, rtol=0, atol=1e-14 * np.abs(theory).max())


@pytest.mark.compiled
def test_the_shift_of_a_stable_spin_is_that_of_its_own_frequency():
    """A whole number of turns: the mean clock is that of the closed form, and so is the shift of the frequency."""
    moments, epsilon = (1.0, 1.7, 2.3), 0.05
    points = dict(zip(("I1", "I2", "I3"), moments, strict=True)) | {"axis": 3, "omega0": 1.0, "phase": 0.6}
    columns = survey.survey(points | {"epsilon": epsilon}, 200.0, 16, 1e-12)
    frequency = exact.frequency(exact.set_up(*moments, epsilon * math.cos(0.6), epsilon * math.sin(0.6), 1.0))
    linear_rate = math.sqrt(linear.omega_squared(*moments, 1.0, 3))
    shift = columns["frequency"][0] - columns["frequency_reduced"][0]
    # the least squares weigh samples by their squares, which makes a few percent of the shift
    assert shift == pytest.approx(frequency - linear_rate, rel=0.1)
    assert columns["frequency_reduced"][0] == pytest.approx(linear_rate, rel=1e-9)


@pytest.mark.parametrize("propagator", ["direct", "exact"])
def test_the_terms_add_up(propagator):
    points = {"I1": 1.0, "I2": [1.2, 2.0, 2.9], "I3": 2.1, "axis": [1, 2, 3], "omega0": -2.0, "phase": 1.0}
    columns = survey.measure_points(points | {"epsilon": [1e-6, 1e-2, 0.2]}, *SETTINGS, propagator=propagator)
    terms = [columns[f"omega_squared_error_{x}"] for x in ("scatter", "integration", "amplitude", "rounding")]
    assert (np.array(terms) >= 0).all()
    np.testing.assert_allclose(sum(terms), columns["omega_squared_error"], rtol=1e-14)
    remainder = columns["omega_squared_error"] - np.abs(columns["amplitude_shift"])
    np.testing.assert_allclose(remainder, columns["omega_squared_reduced_error"], rtol=1e-9, atol=1e-15)


def error_of_rate(square, error):
    """Return the error of sqrt(max(square, 0)) for an error of the square of at most `error`."""
    high, square = math.sqrt(max(square + error, 0.0)), max(square, 0.0)
    return uncertainty.interval_distance(square, error, math.sqrt(square), math.sqrt(max(square - error, 0.0)), high)


@pytest.mark.parametrize(
    ("square", "error"), [(4.0, 3.9), (4.0, 0.1), (4.0, 7.0), (0.0, 1.0), (-1.0, 4.0), (1.0, 1e-12)]
)
def test_the_error_of_a_rate_reaches_the_farther_end_and_no_farther(square, error):
    rate, ends = math.sqrt(max(square, 0.0)), [math.sqrt(max(square + k * error, 0.0)) for k in (-1, 1)]
    far = max(abs(end - rate) for end in ends) if error > 1e-6 else 0.5 * error
    assert error_of_rate(square, error) == pytest.approx(far, rel=1e-11)


@pytest.mark.parametrize("turns", [0.03, 0.5, 2.0, 20.0])
def test_what_a_run_gathers_moves_the_rate_of_a_spin_that_turns_by_no_more_than_is_told(turns):
    """A frequency off by δ/T moves Ω² by 2Ωδ/T; within a small part of a turn a bend by δ moves it by 2δ/T²."""
    omega, T, delta = 0.3, 2 * np.pi * turns / 0.3, 1e-10
    bound = uncertainty.integration(omega**2, omega, delta, delta, 1 / T, 0.4)
    assert bound >= max(2 * omega * delta / T, 2 * delta / T**2)
    assert bound == pytest.approx(
        1e3 * uncertainty.integration(omega**2, omega, 1e-3 * delta, 1e-3 * delta, 1 / T, 0.4)
    )


@pytest.mark.parametrize("x", [0.02, 0.2, 0.5])
def test_an_error_at_the_start_of_a_decay_is_held_from_what_is_seen_of_it(x):
    """d = d0 (e^{-3λt} - e^{-λt}) added to e^{-λt}: its effect on the fit, bounded by its largest value alone."""
    t, d0 = x * np.arange(60 / x), 1e-9
    motion = np.exp(-t) + d0 * (np.exp(-3 * t) - np.exp(-t))
    rate2, _ = signed_rate(np.stack([motion, 0 * t], axis=1), x)
    size = d0 * np.abs(np.exp(-3 * t) - np.exp(-t)).max()
    bound = uncertainty.integration(-1.0, 1.0, size, uncertainty.end_error(size, 1.0, 0.0), 1 / t[-1], x)
    assert 0.3 * bound < abs(rate2 + 1) < bound  # a growing error is steeper over wide spacings, and covers both


@pytest.mark.parametrize("share", [0.0, 1.0, 1.4, 2.0])
@pytest.mark.parametrize("x", [0.02, 0.2])
def test_two_errors_that_hide_each_other_are_held_both(x, share):
    """Errors of e^{λt}, which grows sevenfold: a rate too small by l/T, and a term in e^{3λt} of opposite sign."""
    t, behind = x * np.arange(math.log(7.0) / x), 1e-9
    late = behind * share * (np.exp(3 * t) - np.exp(t)) / np.exp(2 * t[-1])
    deviation = late - behind * t / t[-1] * np.exp(t)
    rate2, _ = signed_rate(np.stack([np.exp(t) + deviation, 0 * t], axis=1), x)
    size = np.abs(deviation / np.exp(t)).max()
    bound = uncertainty.integration(-1.0, 1.0, size, uncertainty.end_error(size, 49.0, behind), 1 / t[-1], x)
    assert abs(rate2 + 1) < bound


@pytest.mark.parametrize("order", ORDERS)
def test_what_a_series_leaves_out_is_its_next_term(order):
    x = mpmath.mpf("0.1")
    remainder = 3 * (mpmath.exp(x) - sum(x**n / mpmath.factorial(n) for n in range(order + 1)))
    assert uncertainty.truncation_error(0.1, 3.0, float(order)) == pytest.approx(float(remainder), rel=0.02)


@pytest.mark.parametrize(("rate2", "fourth", "second"), [(-0.3, 1 / 4, 3 / 10), (0.3, 3 / 2000, 3 / 500)])
@pytest.mark.parametrize("T", [1e9, 1.0])
def test_what_the_reduction_leaves_goes_with_the_powers_of_its_documentation(rate2, fourth, second, T):
    x2, share = 0.3 * 0.4**2, min(1.0, 1 / (0.3 * T * T))
    fourth, second = fourth + share, second + 1.2 * share
    expected = 1e-3 * (0.1 * (fourth * x2**2 + second * x2 * 0.1 + 0.1**3) + x2**6 / 40000)
    rounded = 2 * 2.0**-53 * 0.9 / 0.4
    assert uncertainty.amplitude(rate2, 1e-3, 0.1, 0.4, 1 / T, 0.9) == pytest.approx(expected + rounded)
    assert uncertainty.amplitude(rate2 * 1e-20, 1e-3, 0.1, 0.4, 1 / T, 0.9) == pytest.approx(1e-3 * 0.1**4)
    assert uncertainty.amplitude(rate2, 1e-3, 0.6, 0.4, 1 / T, 0.9) == abs(rate2) + 0.9**2  # no rate² is beyond


def test_scatter_holds_what_a_third_harmonic_moves():
    """By the sums themselves; its phase in either component at random, and how far the motion turns between samples."""
    rng = np.random.default_rng(5)
    n = 65.0
    for _ in range(400):
        x, share, phase = rng.uniform(0.3, 0.5), rng.uniform(0, 1, 2), rng.uniform(0, 2 * np.pi, (2, 2))
        angle = x * np.arange(63)[:, None]
        motion, harmonic = share * np.cos(angle + phase[0]), rng.uniform(0, 1, 2) * np.cos(3 * angle + phase[1])
        change = abs(0.5 * (harmonic * motion).sum() / (motion**2).sum())  # of D
        squares = (harmonic**2).sum() / (motion**2).sum()
        bound = uncertainty.scatter(1.0, squares, n, x * x, 1.0)
        assert bound < np.sqrt(squares / (4 * (2 * n - 5)))
        assert change <= bound
    assert uncertainty.scatter(1.0, 4 * (2 * n - 5), n, -0.2, 1.0) == pytest.approx(np.sqrt(65 / 61))


@pytest.mark.parametrize("epsilon", [0.3, 0.5, 0.771])
def test_the_error_holds_where_the_spin_turns_back_well_within_a_turn(epsilon):
    """A stable spin, nearly equal moments, measured for a thirtieth of its turn: 4.4 to 6.8 errors without the term."""
    body = {"I1": 7.394918764465395, "I2": 18.913815229533264, "I3": 18.93530210981138, "axis": 3, "omega0": 1.0}
    points = {name: np.array([value]) for name, value in body.items()}
    points |= {"phase": np.array([1.564520115319418]), "epsilon": np.array([epsilon])}
    with mpmath.workdps(40):
        I1, I2, I3 = (mpmath.mpf(body[name]) for name in ("I1", "I2", "I3"))
        true = (I3 - I1) * (I3 - I2) / (I1 * I2)
    columns = survey.survey(points, 11 / 13, 13, 1e-10, propagator="exact")
    deviation = abs(float(mpmath.mpf(columns["omega_squared_reduced"][0]) - true))
    assert 1e-15 < deviation <= columns["omega_squared_reduced_error"][0] < 1e-10
