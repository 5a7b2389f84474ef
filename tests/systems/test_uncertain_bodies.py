"""Bodies as they are known: the draws against the normal distribution, Sobol indices, and the answers people get."""

import json
import math

import euler
import numpy as np
import pytest
import scipy

import sweeps
from kernels.free import exact, linear
from sweeps.__main__ import main
from sweeps.schema.definition import Integration
from sweeps.systems.uncertain_bodies import designs, measuring, possible
from sweeps.systems.uncertain_bodies.distribution import Distribution, relative_covariance
from sweeps.systems.uncertain_bodies.system import UncertainIntegration

BOXES = {"1U": (10, 10, 11.35), "3U": (10, 10, 34.05), "6U": (10, 22.63, 34.05), "12U": (22.63, 22.63, 34.05)}  # cm
SHARES = (0.01, 0.02, 0.05, 0.10)
# Probability that the greatest moment is the middle one, by two million plain draws, to their digits.
PUBLISHED = {
    "1U": (0.50, 0.50, 0.476, 0.392),
    "3U": (0.50, 0.50, 0.50, 0.50),
    "6U": (0.0, 0.0, 4e-5, 0.0245),
    "12U": (0.50, 0.50, 0.50, 0.4995),
}
DIGITS = {"1U": 6e-4, "3U": 6e-4, "6U": 6e-5, "12U": 6e-5}
TENSOR = np.array([[2.0, -0.5, 0.0], [-0.5, 2.0, 0.1], [0.0, 0.1, 3.0]])
SIX = np.array([TENSOR[i, j] for i, j in possible.ENTRIES.values()])


def box(name):
    a, b, c = BOXES[name]
    moments = np.sort([b * b + c * c, a * a + c * c, a * a + b * b])
    return moments / moments[2]


def of_moments(moments, shares, **spin):
    moments = np.array(moments, dtype=float)
    return Distribution(moments, np.eye(3), moments, relative_covariance(moments, shares), spin)


def of_tensor(covariance, **spin):
    values, vectors = np.linalg.eigh(TENSOR)
    rows = vectors.T.copy()
    rows[2] = np.cross(rows[0], rows[1])
    return Distribution(values, rows, SIX, covariance, spin)


def draw_inertia(distribution, draws, seed=1, method="sobol"):
    normals = designs.normals(method, distribution.dimension, draws, seed)
    return normals.shape[:2], distribution.inertia(normals.reshape(-1, distribution.dimension))


def middle(moments, axis):
    further_moments = np.delete(moments, axis - 1, axis=1)
    return (moments[:, axis - 1] > further_moments[:, 0]) != (moments[:, axis - 1] > further_moments[:, 1])


# ---------------------------------------------------------------------------------------------------------
# Draws


@pytest.mark.parametrize("name", BOXES)
def test_the_middle_axis_of_cubesats_is_as_likely_as_the_normal_distribution_says(name):
    for share, probability in zip(SHARES, PUBLISHED[name], strict=True):
        distribution = of_moments(box(name), share)
        theory = [distribution.middle_theory(axis) for axis in (1, 2, 3)]
        assert theory[2] == pytest.approx(probability, abs=DIGITS[name])
        assert sum(theory) == pytest.approx(1.0, abs=1e-9)
        shape, (moments, _, _) = draw_inertia(distribution, 10_000)
        for axis in (1, 2, 3):
            value, error = designs.probability(middle(moments, axis).reshape(shape).mean(axis=1), len(moments))
            assert abs(value - theory[axis - 1]) <= 4 * error


def test_the_probability_of_the_middle_is_scipys_bivariate_normal():
    rng = np.random.default_rng(3)
    for number in range(24):
        moments, root = rng.uniform(1.0, 1.2, 3), 0.1 * rng.normal(size=(3, 3))
        if number % 3 == 0:
            moments[1] = moments[2]  # a mean difference of zero
        covariance = np.diag([0.0, 0.0, 0.01]) if number % 8 == 7 else root @ root.T  # the first: fully correlated
        for rows, axis in (([[1, -1, 0], [1, 0, -1]], 1), ([[-1, 0, 1], [0, -1, 1]], 3)):
            spread = np.array(rows) @ covariance @ np.transpose(rows)
            if (np.diag(spread) > 0).all():
                normal = scipy.stats.multivariate_normal(-np.array(rows) @ moments, spread, allow_singular=True)
                expected = (
                    2 - scipy.stats.norm.cdf(normal.mean / np.sqrt(np.diag(spread))).sum() - 2 * normal.cdf([0.0, 0.0])
                )
                probability = possible.middle_probability(moments, covariance, axis)
                assert probability == pytest.approx(expected, abs=2e-8)  # the tolerance of SciPy's integration


@pytest.mark.parametrize("method", designs.METHODS)
def test_standard_errors_are_those_of_other_seeds(method):
    distribution, means = of_moments(box("1U"), 0.1), []
    for seed in range(40):
        shape, (moments, _, _) = draw_inertia(distribution, 512, seed, method)
        means.append(designs.mean(middle(moments, 3).reshape(shape).mean(axis=1)))
    values, errors = np.array(means).T
    z = (values - distribution.middle_theory(3)) / errors
    assert 0.7 < math.sqrt(np.mean(z**2)) < 1.4  # 40 seeds: 1 +- 0.11, and Student's distribution of 15 degrees


def test_what_is_drawn_is_a_body_and_every_other_draw_stays_as_it_was():
    for moments, share in (((1.0, 1.0, 2.0), 0.1), ((0.159, 1.0, 1.0), 0.3), ((1e-9, 1.0, 1.0), 0.9)):
        distribution = of_moments(moments, share)
        normals = designs.normals("sobol", 3, 4096, 3).reshape(-1, 3)
        plain = np.array(moments) * (1 + share * normals)
        moments_drawn, impossible, _ = distribution.inertia(normals)
        second = second_moments(plain)
        assert (impossible == (second < 0).any(axis=1)).all()
        assert impossible.mean() > 0.02
        assert (moments_drawn > 0).all()
        assert (moments_drawn.sum(axis=1) - 2 * moments_drawn.max(axis=1) >= 0).all()
        is_unchanged = (second >= distribution.delta).all(axis=1)
        assert np.allclose(moments_drawn[is_unchanged], plain[is_unchanged], rtol=1e-14)
        distinct = np.abs(np.diff(np.sort(plain), axis=1)).min(axis=1) > 1e-9
        assert (np.argsort(moments_drawn) == np.argsort(plain))[distinct & (second > -1e3).all(axis=1)].all()


def second_moments(moments):
    """J_i = (I_j + I_k − I_i)/2, along the last dimension."""
    return moments.sum(axis=-1, keepdims=True) / 2 - moments


def test_what_keeps_second_moments_positive_is_smooth_and_rises():
    values = possible.project_second_moments(np.array([-1.0, 0.0, 1.0 - 1e-9, 1.0, 7.0]), 1.0)
    assert np.allclose(values, [1 / 3, 1 / 2, 1.0 - 1e-9, 1.0, 7.0], rtol=1e-15)


@pytest.mark.parametrize("unit", [1.0, 1e-3, 1e-30])
def test_moments_of_the_draws_are_those_asked_for_in_any_unit(unit):
    moments = np.array([1.0, 1.3, 1.6]) * unit
    covariance = 1e-4 * np.array([[4.0, 5.7, 0.0], [5.7, 9.0, 0.0], [0.0, 0.0, 16.0]]) * unit**2  # correlated by 0.95
    distribution = Distribution(moments, np.eye(3), moments, covariance, {})
    assert distribution.inputs == ("I1+I2", "I3")
    _, (sample, impossible, _) = draw_inertia(distribution, 2**14)
    assert not impossible.any()
    assert np.allclose(sample.mean(axis=0), moments, rtol=1e-5)
    assert np.allclose(np.cov(sample.T), covariance, rtol=0.02, atol=2e-6 * unit**2)
    plain = scipy.stats.multivariate_normal(moments / unit, covariance / unit**2).rvs(2**14, random_state=5)
    for level in (0.05, 0.5, 0.95):  # 2^14 plain draws determine a quantile to 0.02 standard deviations
        shift = np.quantile(sample, level, axis=0) - np.quantile(plain * unit, level, axis=0)
        assert (np.abs(shift) < 0.06 * np.sqrt(np.diag(covariance))).all()


def test_the_bias_of_a_nearly_flat_body_is_that_of_a_normal_variable_kept_above_zero():
    moments = box("6U")
    distribution = of_moments(moments, 0.1)
    second = second_moments(moments)
    sigma = 0.05 * math.sqrt(np.sum(moments**2))
    z = second[2] / sigma
    clipped_mean = second[2] * scipy.stats.norm.cdf(z) + sigma * scipy.stats.norm.pdf(z)  # mean of max(J3, 0)
    _, (sample, impossible, _) = draw_inertia(distribution, 2**15)
    assert impossible.mean() == pytest.approx(scipy.stats.norm.cdf(-z), abs=1e-3)
    # g leaves a small fraction of δ where max(J3, 0) is 0
    assert second_moments(sample).mean(axis=0)[2] == pytest.approx(clipped_mean, abs=0.3 * distribution.delta)
    assert clipped_mean / second[2] - 1 == pytest.approx(0.11, abs=0.01)  # as in the module's docstring
    rejection_mean = second[2] + sigma * scipy.stats.norm.pdf(z) / scipy.stats.norm.cdf(z)
    assert rejection_mean / second[2] - 1 == pytest.approx(0.35, abs=0.01)


def test_a_drawn_tensor_turns_the_axes_and_the_spin_starts_where_it_was():
    distribution = of_tensor(np.diag([0.1, 0.1, 0.1, 0.08, 0.08, 0.08]) ** 2)
    normals = designs.normals("sobol", 6, 1024, 1).reshape(-1, 6)
    moments, impossible, axes = distribution.inertia(normals)
    assert not impossible.any()
    start = np.array([1e-3 * math.cos(0.6), 1e-3 * math.sin(0.6)])
    spin = measuring.SpinSettings(2, 3.0, 1e-3, 0.6)
    points = measuring._kernel_points(distribution, moments, axes, normals, spin)
    omega = 3.0 * (distribution.axes[1] + start[0] * distribution.axes[2] + start[1] * distribution.axes[0])
    drawn_entries = SIX + normals * 0.1 * np.array([1, 1, 1, 0.8, 0.8, 0.8])
    tensors = np.empty((len(normals), 3, 3))
    for k, (i, j) in enumerate(possible.ENTRIES.values()):
        tensors[:, i, j] = tensors[:, j, i] = drawn_entries[:, k]
    momentum = tensors @ omega
    a, b, c = points["omega0"], *(points["omega0"] * points["epsilon"] * f(points["phase"]) for f in (np.cos, np.sin))
    rates = np.stack([c, a, b], axis=1)  # about axis 2: (a, b, c) are the axes 2, 3, 1
    assert np.allclose((moments * rates * rates).sum(axis=1), momentum @ omega, rtol=1e-12)  # twice the energy
    assert np.allclose(((moments * rates) ** 2).sum(axis=1), (momentum**2).sum(axis=1), rtol=1e-12)
    assert np.allclose(np.linalg.det(axes), 1.0)


# ---------------------------------------------------------------------------------------------------------
# Sobol indices


def test_sobol_indices_of_ishigamis_function():
    def ishigami(z):
        x = math.pi * (2 * scipy.stats.norm.cdf(z) - 1)
        return np.sin(x[:, 0]) + 7 * np.sin(x[:, 1]) ** 2 + 0.1 * x[:, 2] ** 4 * np.sin(x[:, 0])

    # Ishigami and Homma (1990), a = 7, b = 0.1
    first, total = [0.313905, 0.442411, 0.0], [0.557589, 0.442411, 0.243684]
    groups, z = ((0,), (1,), (2,)), []
    for seed in range(8):
        indices = designs.sobol_indices(ishigami, groups, 4096, seed)
        z += [(indices["first"] - first) / indices["first_error"], (indices["total"] - total) / indices["total_error"]]
    assert np.abs(z).max() < 4
    assert 0.6 < math.sqrt(np.mean(np.square(z))) < 1.5


def test_inputs_that_depend_on_each_other_count_as_one():
    indices = designs.sobol_indices(lambda z: z[:, 0] + z[:, 1] + 2 * z[:, 2], ((0, 1), (2,)), 1024, 1)
    assert indices["first"] == pytest.approx([1 / 3, 2 / 3], abs=0.05)
    assert indices["total"] == pytest.approx([1 / 3, 2 / 3], abs=0.05)


# ---------------------------------------------------------------------------------------------------------
# Measured


@pytest.fixture(scope="module")
def measured():
    """The 6U CubeSat at 10 %, about its axes 2 and 3."""
    distribution = of_moments(box("6U"), 0.1, phase="any")
    spins = [measuring.SpinSettings(axis, -2.0, 1e-3, 0.6) for axis in (2, 3)]
    sampling = measuring.BodySampling(draws=1024, seed=5)
    pairs = list(measuring.measure_spins(distribution, spins, sampling, UncertainIntegration()))
    return distribution, sampling, spins, pairs


def test_rates_of_draws_are_linear_theorys_far_better_than_their_draws_scatter(measured):
    _, _, spins, pairs = measured
    for spin, (_, draws) in zip(spins, pairs, strict=True):
        omega_squared = linear.omega_squared(*(draws[f"I{i}"] for i in (1, 2, 3)), spin.omega0, spin.axis)
        is_large = np.abs(omega_squared) > 1e-4  # spin 2: nearer to zero the square is still right, its root less so
        for name, sign in (("growth_rate", -1.0), ("frequency", 1.0)):
            rate = np.sqrt(np.maximum(sign * omega_squared, 0.0))
            np.testing.assert_allclose(draws[name][is_large], rate[is_large], rtol=1e-7)


def test_measured_probabilities_are_the_normal_distributions(measured):
    distribution, _, spins, pairs = measured
    for spin, (summary, draws) in zip(spins, pairs, strict=True):
        theory = distribution.middle_theory(spin.axis)
        assert summary["probability_middle_theory"] == theory
        for name in ("probability_middle", "probability_unstable"):
            assert abs(summary[name] - theory) <= 4 * summary[f"{name}_error"]
        assert summary["undecided"] < 0.01
        moments = np.stack([draws[name] for name in ("I1", "I2", "I3")], axis=1)
        assert (middle(moments, spin.axis) == (draws["regime"] == measuring.UNSTABLE)).mean() > 0.999


def test_quantiles_are_those_of_the_draws(measured):
    _, _, _, pairs = measured
    for summary, draws in pairs:
        rate = np.sort(np.nan_to_num(draws["growth_rate"]))
        for level, value in zip(designs.QUANTILES, summary["growth_rate_quantile"], strict=True):
            assert (rate < value).mean() < level <= (rate <= value).mean()
        flips = np.sort(np.where(np.isnan(draws["flip_period"]), np.inf, draws["flip_period"]))
        expected = flips[math.ceil(0.5 * flips.size) - 1]
        assert summary["flip_period_quantile"][2] == expected or not np.isfinite(expected)


def test_flips_of_draws_are_the_closed_forms(measured):
    distribution, sampling, _, pairs = measured
    draws = pairs[0][1]
    normals = designs.normals(sampling.method, distribution.dimension, sampling.draws, sampling.seed)
    normals = normals.reshape(-1, distribution.dimension)
    phase = 0.6 + 2 * math.pi * scipy.stats.norm.cdf(normals[:, 3])
    start = -2.0 * np.stack([1e-3 * np.sin(phase), np.ones_like(phase), 1e-3 * np.cos(phase)], axis=1)
    flips = np.flatnonzero(np.isfinite(draws["flip_period"]))
    assert len(flips) > 0.9 * len(phase)
    for k in flips[:50]:
        top = exact.set_up(*(float(draws[f"I{i}"][k]) for i in (1, 2, 3)), *start[k].tolist())
        period = exact.flip_period(top)
        assert draws["flip_period"][k] == pytest.approx(period, rel=1e-8)


def test_a_draw_whose_axes_lie_far_off_is_followed_from_there():
    distribution = of_tensor(np.diag([0.0, 0.0, 0.0, 0.5, 0.5, 0.5]) ** 2)
    ((summary, draws),) = measuring.measure_spins(
        distribution, [measuring.SpinSettings(1, 1.0, 1e-6, 0.6)], measuring.BodySampling(128), Integration()
    )
    assert distribution.inputs == ("Ixy", "Ixz", "Iyz")
    assert np.isfinite(draws["max_tilt"]).all()
    assert summary["max_tilt_quantile"][2] > 0.1  # rad: the nudge alone would keep it at 1e-6
    assert math.isnan(summary["probability_middle_theory"])


# ---------------------------------------------------------------------------------------------------------
# Questions of users:


def test_uncertainty_from_python_is_the_map_of_its_definition():
    ds = sweeps.uncertainty(box("6U"), "10 %", omega0=0.1, draws=64, axes=[3])
    assert ds.sizes == {"body": 1, "axis": 1, "epsilon": 1, "phase": 1, "quantile": 5, "input": 3}
    point = ds.squeeze()
    assert abs(point["probability_unstable"] - 0.0245) <= 4 * point["probability_unstable_error"]
    assert point["sensitivity_total"].sel(input="I1") < point["sensitivity_total"].sel(input="I3")
    assert point.attrs["system"] == "uncertain_bodies"
    assert int(point["draws"]) == 64


def test_body_answers_in_numbers_words_and_a_picture(tmp_path, capsys):
    call = ["body", "--tensor", *map(str, TENSOR.ravel()), "--uncertainty", "5%", "--draws", "64", "--seed", "1"]
    assert main([*call, "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert [axis["axis"] for axis in answer["axes"]] == [1, 2, 3]
    assert answer["axes"][1]["probability_unstable"] > 0.9
    assert len(answer["axes"][1]["growth_rate_quantile"]) == len(answer["quantile"]) == 5
    assert answer["input"] == ["Ixx", "Iyy", "Izz", "Ixy", "Iyz"]
    assert answer["draws"] == 64
    picture = tmp_path / "cloud.png"
    assert main([*call, "--omega0", "0.1", "--axis", "2", "--figure", str(picture)]) == 0
    out = capsys.readouterr().out
    assert "axis 2 P(unstable) " in " ".join(out.split())
    assert "Sobol index" in out
    assert picture.read_bytes().startswith(b"\x89PNG")


def test_twists_of_draws_are_those_of_the_motion_integrated_by_scipy():
    """A racket about its two great moments, either may be the intermediate axis."""
    body = {"name": "racket", "I1": 0.07, "I2": 0.94, "I3": 1.0}
    settings = {"draws": 64, "twist": True, "keep": True, "axes": [2, 3], "grid": {"epsilon": 0.02, "phase": 1.2}}
    ds = sweeps.uncertainty([body], "1 %", omega0=2.0, **settings).squeeze()
    assert not np.isnan(ds["twist_quantile"]).any()
    for axis, k in ((2, 0), (2, 17), (3, 5)):
        draw = ds.sel(axis=axis, draw=k)
        moments = np.array([float(draw[f"I{i}_draw"]) for i in (1, 2, 3)])
        omega = euler.spin(axis, 1.0, 0.02, 1.2)
        side = np.cross(moments * omega, [1.0, 0.0, 0.0])  # The handle begins to rotate about L this way.

        def side_of_handle(_, y, side=side):
            return y[3:].reshape(3, 3)[:, 0] @ side

        side_of_handle.direction = 1.0
        run = euler.rotate(moments, omega, 20.0, events=side_of_handle)
        (end, *_) = run.y_events[0][run.t_events[0] > 0.1]
        states = np.column_stack([run.y[:, run.t < run.t_events[0][run.t_events[0] > 0.1][0]], end])
        # the azimuth of L about the handle
        azimuth = euler.azimuth((states[:3] * moments[:, None]).T, np.array([1.0, 0.0, 0.0]))
        assert float(draw["twist_draw"]) == pytest.approx(abs(azimuth[-1] - azimuth[0]), abs=1e-8)
