import mpmath
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from naive import coefficients, fractions, growing_share, linear_flow, seen_from
from scipy.integrate import solve_ivp
from strategies import moment_triples

from kernels import linear, rigid_body

ULP = 2.0**-52
AXES = np.array([1, 2, 3])
BODY = (1.0, 2.0, 2.7)  # axis 2 is the middle one


@given(moment_triples(), st.floats(1e-9, 1e6), st.sampled_from([1, -1]))
def test_omega_squared_against_fractions(moments, spin, sign):
    ours = linear.omega_squared(*moments, sign * spin, AXES)
    (omega0,) = fractions(spin)
    for axis, value in zip(AXES, ours, strict=True):
        Ia, Ib, Ic = seen_from(axis, *fractions(*moments))
        exact = (Ia - Ib) * (Ia - Ic) / (Ib * Ic) * omega0 * omega0
        # seven operations of half an ulp; the differences are rounded once, so the sign is exact
        assert abs(fractions(value)[0] - exact) <= 3.6 * ULP * abs(exact)
        assert np.sign(value) == (exact > 0) - (exact < 0)


@pytest.mark.parametrize("axis", [1, 2, 3])
def test_omega_squared_is_minus_the_squared_eigenvalue(axis):
    _, cb, cc = coefficients(*BODY, axis)
    eigenvalue = np.linalg.eigvals(3.0 * np.array([[0, cb], [cc, 0]]).astype(complex))[0]
    assert linear.omega_squared(*BODY, 3.0, axis) == pytest.approx(-(eigenvalue**2).real, rel=1e-14, abs=0)


@pytest.mark.parametrize("scale", [1e-300, 1.0, 1e160])
@pytest.mark.parametrize("ratios", [(1.0, 2.0, 3.0), (1.0, 1e3, 1e6), (1.0, 1.0 + 2**-52, 1e6)])
def test_omega_squared_keeps_its_sign_at_any_scale(scale, ratios):
    moments = [r * scale for r in ratios]
    assert np.sign(linear.omega_squared(*moments, 1.0, AXES)).tolist() == [1, -1, 1]
    # each moment is rounded once when it is scaled, which its difference from its neighbour magnifies
    if ratios[1] >= 2:
        expected = linear.omega_squared(*ratios, 1.0, AXES)
        np.testing.assert_allclose(linear.omega_squared(*moments, 1.0, AXES), expected, rtol=1e-14)


def test_omega_squared_broadcasts():
    squared = linear.omega_squared(np.ones((2, 1)), 2.0, np.full(5, 3.0), 1, 2)
    assert squared.shape == (2, 5)
    assert squared.dtype == np.float64
    assert (squared == -1 / 3).all()


def naive_regime(a, b, c):
    """By where I_a stands among the three."""
    if a == b == c:
        return linear.SPHERE
    if a in (b, c):
        return linear.MARGINAL
    return {0: linear.STABLE_MINOR, 1: linear.UNSTABLE, 2: linear.STABLE_MAJOR}[sorted([a, b, c]).index(a)]


@given(moment_triples())
def test_regimes_of_the_three_axes(moments):
    told = linear.regime(*moments, AXES)
    assert told.dtype == np.int8
    assert told.tolist() == [naive_regime(*seen_from(axis, *moments)) for axis in (1, 2, 3)]
    if rigid_body.shape(*moments) == rigid_body.ASYMMETRIC:
        assert sorted(told) == sorted([linear.STABLE_MINOR, linear.STABLE_MAJOR, linear.UNSTABLE])
    squared = linear.omega_squared(*moments, 1.0, AXES)
    assert ((squared < 0) == (told == linear.UNSTABLE)).all()
    assert ((squared == 0) == np.isin(told, [linear.MARGINAL, linear.SPHERE])).all()


def test_regimes_by_name():
    told = linear.regime([1, 1, 1, 1, 1, 2, 2], [2, 2, 2, 1, 1, 1, 1], [3, 3, 3, 2, 1, 1, 2], [1, 2, 3, 1, 2, 1, 1])
    expected = [linear.STABLE_MINOR, linear.UNSTABLE, linear.STABLE_MAJOR, linear.MARGINAL, linear.SPHERE]
    assert told.tolist() == [*expected, linear.STABLE_MAJOR, linear.MARGINAL]


def test_a_tie_of_the_other_two_is_no_margin():
    # about its own axis a symmetric top is stable, whatever the tie
    assert linear.regime(1.0, 2.0, 2.0, 1) == linear.STABLE_MINOR
    assert linear.regime(3.0, 2.0, 2.0, 1) == linear.STABLE_MAJOR


def test_rates():
    kinds = [linear.STABLE_MINOR, linear.STABLE_MAJOR, linear.UNSTABLE, linear.MARGINAL, linear.SPHERE, -1]
    growth_rate, frequency = linear.rates([4.0, 9.0, -16.0, -25.0, 36.0, 49.0], kinds)
    assert growth_rate.tolist() == [0, 0, 4, 0, 0, 0]
    assert frequency.tolist() == [2, 3, 0, 0, 0, 0]


@pytest.mark.parametrize("omega0", [2.0, -0.7])
@pytest.mark.parametrize("axis", [1, 2, 3])
@pytest.mark.parametrize("body", [BODY, (1.0, 1.0, 2.0), (1.0, 1.0 + 1e-9, 2.0), (1e-3, 1.0, 1.0005)])
def test_perturbation_against_the_matrix_exponential(body, axis, omega0):
    times = np.array([0.0, 0.3, -1.7, 20.0])
    _, cb, cc = coefficients(*body, axis)
    for phase in (0.6, 2.5):
        b, c = linear.perturbation(*body, omega0, axis, 1e-6, phase, times)
        start = 1e-6 * omega0 * np.cos(phase), 1e-6 * omega0 * np.sin(phase)
        turn = np.sqrt(abs(cb * cc)) * abs(omega0)
        # the sine's share goes as its rate's inverse, or as the time where that is shorter
        b_size = abs(start[0]) + abs(cb * omega0 * start[1]) / max(turn, 1 / 20)
        c_size = abs(start[1]) + abs(cc * omega0 * start[0]) / max(turn, 1 / 20)
        for i, t in enumerate(times):
            expected = linear_flow(cb, cc, omega0, start, t)
            growth = np.cosh(turn * t) if cb * cc > 0 else 1.0
            # the rate is rounded a few times, and turns the phase or the exponent by that times its angle
            allowed = 8 * ULP * (1 + turn * abs(t)) * growth
            assert abs(b[i] - expected[0]) <= allowed * b_size
            assert abs(c[i] - expected[1]) <= allowed * c_size


@pytest.mark.parametrize("axis", [1, 2, 3])
def test_perturbation_is_the_limit_of_the_equations_of_motion(axis):
    ca, cb, cc = coefficients(*BODY, axis)
    times, epsilon, omega0 = np.linspace(0, 3, 7), 1e-6, -2.0
    # transverse components in units of epsilon, so that SciPy's tolerances are relative to them
    motion = solve_ivp(
        lambda t, w: (ca * epsilon**2 * w[1] * w[2], cb * w[2] * w[0], cc * w[0] * w[1]),
        (0, 3),
        [omega0, omega0 * np.cos(0.6), omega0 * np.sin(0.6)],
        method="DOP853",
        t_eval=times,
        rtol=1e-13,
        atol=1e-14,
    ).y
    ours = np.array(linear.perturbation(*BODY, omega0, axis, epsilon, 0.6, times)) / epsilon
    # off by the square of the perturbation, which grows to 45e-6 at most
    np.testing.assert_allclose(ours, motion[1:], rtol=1e-9)


def test_perturbation_at_equal_moments_is_secular():
    times = np.array([0.0, 1.0, 2.0, 1e6])
    b, c = linear.perturbation(1.0, 1.0, 2.0, 3.0, 1, 1e-6, 0.6, times)
    slope = (2.0 - 1.0) / 1.0 * 3.0 * (1e-6 * np.sin(0.6) * 3.0)
    np.testing.assert_allclose(b, 3e-6 * np.cos(0.6) + slope * times, rtol=4 * ULP)
    assert (c == c[0]).all()


def test_perturbation_of_a_long_growth():
    b, c = linear.perturbation(*BODY, 1.0, 2, 1e-6, 0.6, np.array([1000.0, 1300.0]))
    with mpmath.workdps(30):
        _, cb, cc = (mpmath.mpf(float(x)) for x in coefficients(*BODY, 2))
        rate = mpmath.sqrt(cb * cc)
        phase = mpmath.mpf(0.6)
        grown = [mpmath.exp(rate * t) / 2 * mpmath.mpf(1e-6) for t in (1000, 1300)]
        expected = [float(g * (mpmath.cos(phase) + cb * mpmath.sin(phase) / rate)) for g in grown]
    # the exponent, up to 670, is rounded a few times
    np.testing.assert_allclose(b, expected, rtol=2e3 * ULP)
    np.testing.assert_allclose(c / b, float(rate / cb), rtol=1e-14)


@given(st.floats(0, 6.3), st.sampled_from([1.0, -2.5, 1e-100]), moment_triples(0.1, 10.0))
def test_growing_fraction_against_eigenvectors(phase, omega0, moments):
    ours = linear.growing_fraction(*moments, omega0, AXES, phase)
    unstable = linear.regime(*moments, AXES) == linear.UNSTABLE
    assert (ours[~unstable] == 0).all()
    assert ((ours >= 0) & (ours <= 1 + 4 * ULP)).all()
    for axis in AXES[unstable]:
        _, cb, cc = coefficients(*moments, axis)
        share = growing_share(cb, cc, np.sign(omega0), phase)
        # a sum of squares over its greatest value: a few roundings of one
        assert ours[axis - 1] == pytest.approx(share, rel=0, abs=8 * ULP)


@given(st.floats(0, 6.3), moment_triples(0.1, 10.0))
def test_backwards_in_time_the_shares_change_places(phase, moments):
    forwards = linear.growing_fraction(*moments, 1.0, AXES, phase)
    backwards = linear.growing_fraction(*moments, -1.0, AXES, phase)
    unstable = linear.regime(*moments, AXES) == linear.UNSTABLE
    np.testing.assert_allclose((forwards + backwards)[unstable], 1.0, rtol=4 * ULP)
    assert (linear.growing_fraction(*moments, -1.0, AXES, -phase) == forwards).all()


def test_growing_fraction_is_one_on_the_mode_and_nothing_across_it():
    body = (1.0, 2.0, 3.0)
    _, cb, cc = coefficients(*body, 2)
    grows = np.arctan2(np.sqrt(cc), np.sqrt(cb)) if cb > 0 else -np.arctan2(np.sqrt(-cc), np.sqrt(-cb))
    assert linear.growing_fraction(*body, 1.0, 2, grows) == pytest.approx(1.0, abs=4 * ULP)
    assert linear.growing_fraction(*body, 1.0, 2, -grows) == pytest.approx(0.0, abs=4 * ULP)
    assert linear.growing_fraction(*body, -1.0, 2, grows) == pytest.approx(0.0, abs=4 * ULP)
