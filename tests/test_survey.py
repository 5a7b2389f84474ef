import numpy as np
import pytest
from naive import rate_squared, samples
from numba import config

from kernels import linear, survey

SETTINGS = (4.0, 16, 1e-10)
FEWER = 40 if config.DISABLE_JIT else 1  # lanes in plain Python are slow


def bodies(count, seed=1, **given):
    """Random points of bodies that can exist, every axis and both senses of spin."""
    rng = np.random.default_rng(seed)
    masses = rng.uniform(0.0, 1.0, (3, max(count // FEWER, 32)))  # second moments of mass: any triple can exist
    moments = masses.sum(axis=0) - masses
    n = masses.shape[1]
    points = dict(zip(("I1", "I2", "I3"), moments, strict=True))
    points |= {"axis": rng.integers(1, 4, n), "omega0": rng.choice([-1, 1], n) * rng.uniform(0.5, 20.0, n)}
    points |= {"epsilon": np.full(n, 1e-6), "phase": rng.uniform(0, 2 * np.pi, n)}
    return points | {name: np.broadcast_to(value, n) for name, value in given.items()}


def one(I1, I2, I3, axis, omega0=1.0, epsilon=1e-6, phase=0.6, settings=SETTINGS):
    values = {"I1": I1, "I2": I2, "I3": I3, "axis": axis, "omega0": omega0, "epsilon": epsilon, "phase": phase}
    return {name: column[0] for name, column in survey.survey(values, *settings).items()}


def relative_deviation(columns):
    """Of the rate, the square root of |Omega²|."""
    return np.abs(np.sqrt(np.abs(columns["omega_squared"] / columns["omega_squared_theory"])) - 1)


def test_rates_agree_with_linear_theory_at_every_body_that_can_exist():
    points = bodies(20_000)
    columns = survey.survey(points, *SETTINGS)
    squared = np.abs(columns["omega_squared_theory"]) / points["omega0"] ** 2
    deviation = relative_deviation(columns)
    clear, small = squared >= 1e-3, (squared >= 1e-6) & (squared < 1e-3)
    # a nudge of 1e-6 grown tenfold biases by its square, 1e-10, times ratios of the moments
    assert deviation[clear].max() < 1e-8
    stderr = columns["omega_squared_stderr"] / (2 * np.abs(columns["omega_squared"]))
    assert (deviation[small] < 1e-3).all()
    assert (deviation[small] <= 5 * stderr[small] + 1e-6).all()
    assert (columns["regime"] == columns["regime_theory"])[clear | small].all()
    assert (columns["status"] == survey.OK).all()


def test_needles_and_plates_and_what_cannot_exist():
    rng = np.random.default_rng(2)
    thin = 10 ** rng.uniform(-6, -2, 32)
    for I1, I2, I3 in ((thin, 1.0, 1.0 + thin), (0.4, 0.6, 1.0), (0.3, 0.5, 1.0 + thin), (1e-3, 0.2, 1.0)):
        for axis in (1, 2, 3):
            points = {"I1": I1, "I2": I2, "I3": I3, "axis": axis, "omega0": 3.0, "epsilon": 1e-6, "phase": 0.6}
            points = {name: np.broadcast_to(value, 32) for name, value in points.items()}
            columns = survey.survey(points, *SETTINGS)
            clear = np.abs(columns["omega_squared_theory"]) / 9.0 >= 1e-3
            greatest = max(np.max(np.abs((I2 - I3) / I1)), np.max(np.abs((I3 - I1) / I2)), 1.0)
            possible = (columns["triangle_margin"] >= 0).all()
            assert (relative_deviation(columns)[clear] < 1e-6 * (1.0 if possible else greatest**2)).all()


@pytest.mark.parametrize("epsilon", [1e-8, 1e-6, 1e-4, 1e-2])
@pytest.mark.parametrize("axis", [1, 2, 3])
def test_equal_moments_are_marginal_and_never_grow(epsilon, axis):
    other = [1.0, 2.0, 0.6][axis - 1]
    for equal in (1.0, np.nextafter(1.0, 2.0), np.nextafter(1.0, 0.0)):
        for phase in (0.0, 0.6, np.pi / 4, 2.0, 4.0):
            for last in (0.7, 1.3):
                moments = np.roll([1.0, equal, last], axis - 1) * other
                columns = one(*moments, axis, epsilon=epsilon, phase=phase)
                assert columns["regime"] == linear.MARGINAL
                assert columns["growth_rate"] == 0.0


def test_sphere():
    columns = one(2.0, 2.0, 2.0, 2)
    assert columns["regime"] == columns["regime_theory"] == linear.SPHERE
    assert columns["growth_rate"] == columns["frequency"] == 0.0


@pytest.mark.parametrize(("axis", "sign"), [(1, 1), (2, -1), (3, 1)])
def test_deviation_falls_with_the_square_of_the_nudge(axis, sign):
    epsilon = np.geomspace(1e-5, 1e-2, 16)
    points = {"I1": 1.0, "I2": 2.0, "I3": 2.5, "axis": axis, "omega0": 1.0, "phase": 0.6, "epsilon": epsilon}
    points = {name: np.broadcast_to(value, 16) for name, value in points.items()}
    columns = survey.survey(points, 4.0, 16, 1e-12)
    assert (np.sign(columns["omega_squared"]) == sign).all()
    deviation = np.abs(columns["omega_squared"] / columns["omega_squared_theory"] - 1)
    fitted = (deviation > 1e-11) & (deviation < 1e-2)
    slope = np.polyfit(np.log(epsilon[fitted]), np.log(deviation[fitted]), 1)[0]
    assert fitted.sum() >= 6
    assert abs(slope - 2.0) < 0.1


def dimensionless(points):
    """Columns with the spin rate divided out."""
    columns = survey.survey(points, *SETTINGS)
    spin = np.abs(points["omega0"])
    return {
        "rate2": columns["omega_squared"] / spin / spin,
        "regime": columns["regime"],
        "rate": columns["growth_rate"] / spin,
    }


@pytest.mark.parametrize("factor", [2.0**66, 2.0**-66])
def test_moments_scaled_by_a_power_of_two_give_the_same_bits(factor):
    points = bodies(500)
    scaled = points | {name: points[name] * factor for name in ("I1", "I2", "I3")}
    plain, other = survey.survey(points, *SETTINGS), survey.survey(scaled, *SETTINGS)
    for name in plain:
        np.testing.assert_array_equal(plain[name], other[name], err_msg=name)


def test_any_scale_of_moments_and_spin_gives_the_same_dimensionless_results():
    points = bodies(500, omega0=1.0)
    I1, I2, I3 = (points[name] for name in ("I1", "I2", "I3"))
    apart = np.minimum(np.minimum(abs(I1 - I2), abs(I2 - I3)), abs(I3 - I1)) > 1e-1
    points = {name: value[apart] for name, value in points.items()}
    plain = dimensionless(points)
    for factor in (1e20, 1e-20):
        other = dimensionless(points | {name: points[name] * factor for name in ("I1", "I2", "I3")})
        np.testing.assert_allclose(other["rate2"], plain["rate2"], rtol=1e-12)
    for omega0 in (1e-9, 1e6, 1e-150, 1e150):
        other = dimensionless(points | {"omega0": np.full_like(points["omega0"], omega0)})
        # a spin of 1e-150 rad/s squared is 1e-300 s-2, still a normal double
        np.testing.assert_allclose(other["rate2"], plain["rate2"], rtol=1e-12)


@pytest.mark.parametrize("scale", [1e-300, 1e160])
@pytest.mark.parametrize("ratios", [(1.0, 2.0, 3.0), (1.0, 1e3, 1e6)])
def test_extreme_common_scales_keep_the_sign(scale, ratios):
    for axis, sign in ((1, 1), (2, -1), (3, 1)):
        columns = one(*(scale * r for r in ratios), axis)
        assert np.sign(columns["omega_squared"]) == np.sign(columns["omega_squared_theory"]) == sign
        assert columns["status"] == survey.OK


def test_any_split_and_order_gives_the_same_bits():
    points = bodies(300, seed=4)
    n = points["I1"].size
    whole = survey.survey(points, *SETTINGS)
    for pieces in (3, 7):
        for part in np.array_split(np.random.default_rng(5).permutation(n), pieces):
            columns = survey.survey({name: value[part] for name, value in points.items()}, *SETTINGS)
            for name in whole:
                np.testing.assert_array_equal(columns[name], whole[name][part], err_msg=name)


def test_no_measured_bit_depends_on_the_theory(monkeypatch):
    points = bodies(300, seed=6)
    honest = survey.survey(points, *SETTINGS)
    monkeypatch.setattr(linear, "omega_squared", lambda *a, **k: np.full(points["I1"].size, -7.0))
    monkeypatch.setattr(linear, "regime", lambda *a, **k: np.full(points["I1"].size, 3, np.int8))
    monkeypatch.setattr(linear, "growing_fraction", lambda *a, **k: np.zeros(points["I1"].size))
    nonsense = survey.survey(points, *SETTINGS)
    assert (nonsense["omega_squared_theory"] == -7.0).all()
    for name in survey.measured(points, *SETTINGS):
        np.testing.assert_array_equal(honest[name], nonsense[name], err_msg=name)


@pytest.mark.parametrize("epsilon", [1e-6, 1e-2])
def test_naive_twin_agrees(epsilon):
    points = bodies(12 * FEWER, seed=7, epsilon=epsilon)
    points = {name: value[:12] for name, value in points.items()}
    columns = survey.survey(points, *SETTINGS)
    spacing = 2 * np.pi / 16
    for i in range(12):
        I1, I2, I3, axis, omega0, phase = (points[n][i] for n in ("I1", "I2", "I3", "axis", "omega0", "phase"))
        motion = samples(I1, I2, I3, axis, np.sign(omega0), epsilon, phase, spacing, 64)
        value, stderr, used = rate_squared(motion[:, 1:], spacing)
        assert columns["samples_used"][i] == used
        # the twin's samples carry SciPy's 1e-13, amplified by 1/(Omega h)²
        assert columns["omega_squared"][i] == pytest.approx(value * omega0**2, rel=1e-9, abs=1e-11 * omega0**2)
        assert columns["omega_squared_stderr"][i] == pytest.approx(stderr * omega0**2, rel=1e-2, abs=1e-11 * omega0**2)


def test_drifts_stay_below_the_tolerance():
    columns = survey.survey(bodies(5000, seed=8), *SETTINGS)
    assert columns["perturbation_drift"].max() <= 1e-10
    # sums of products of order one, over 64 steps: rounding only
    assert columns["energy_drift"].max() <= 1e-13
    assert columns["momentum_drift"].max() <= 1e-13


def test_log_slope_agrees_where_it_has_a_window():
    points = bodies(2000, seed=9)
    columns = survey.survey(points, *SETTINGS)
    told = np.isfinite(columns["growth_rate_logslope"])
    assert (columns["e_folds"][told] >= 2.0).all()
    assert (columns["regime"][told] == linear.UNSTABLE).all()
    # from twice the start on, the decaying mode still bends the line by up to a few per cent
    ratio = columns["growth_rate_logslope"][told] / columns["growth_rate"][told]
    assert told.any()
    assert np.abs(np.median(ratio) - 1) < 0.02


# without the compiler NumPy's scalars warn of the NaN that is meant here
@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_a_point_that_is_no_number_leaves_its_neighbours_alone():
    points = bodies(100, seed=10)
    broken = {name: value.copy() for name, value in points.items()}
    broken["I1"][5] = np.nan
    broken["I2"][6] = np.inf
    plain, other = survey.survey(points, *SETTINGS), survey.measured(broken, *SETTINGS)
    assert (other["status"][[5, 6]] == survey.NON_FINITE).all()
    rest = np.setdiff1d(np.arange(points["I1"].size), [5, 6])
    for name in other:
        np.testing.assert_array_equal(plain[name][rest], other[name][rest], err_msg=name)
