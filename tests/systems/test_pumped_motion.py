"""A body with moments that change with time: against Mathieu's equation in long doubles and SciPy's DOP853."""

import math

import numpy as np
import pytest
from multipliers import TRACES, check_errors
from scipy.optimize import brentq
from scipy.special import mathieu_a, mathieu_b

import sweeps
from kernels.estimator import statuses
from kernels.flow import floquet
from sweeps.systems.pumped_body import equations
from sweeps.systems.pumped_body.presentation import figure_shapes
from sweeps.systems.pumped_body.system import least_margin, trace_by_scipy

STABLE, UNSTABLE, PERIOD_DOUBLING = floquet.STABLE, floquet.UNSTABLE, floquet.PERIOD_DOUBLING
AT_REST = {f"{name}{i}": 0.0 for name in ("depth", "lag") for i in (1, 2, 3)}


def points(**values):
    """Return points about axis 3 at epsilon 1e-9, all else as given."""
    body = AT_REST | {"axis": 3, "I1": 1.0, "I2": 2.0, "I3": 2.0, "omega0": 0.5, "epsilon": 1e-9, "phase": 0.6} | values
    columns = np.broadcast_arrays(*(np.atleast_1d(value) for value in body.values()))
    dtypes = {"axis": np.int64}
    return {name: column.astype(dtypes.get(name, float)) for name, column in zip(body, columns, strict=True)}


def mathieu(a, q, **values):
    """Return the points at which the perturbation obeys y'' + (a - 2 q cos 2 tau) y = 0: L = 1, c = 1/2, nu = 0.3."""
    square = 0.09
    mean, depth = np.asarray(a) * square / 2.0, np.asarray(q) * square
    I2 = 1.0 / (0.5 + mean)
    return points(I2=I2, depth2=depth * I2, frequency=0.3, **values)


def test_traces_of_mathieus_equation():
    a, q = np.array(list(TRACES), dtype=float).T
    columns, traces = equations.survey(mathieu(a, q), True), np.array(list(TRACES.values()))
    assert (columns["status"] == statuses.OK).all()
    assert (np.abs(columns["trace"] - traces) <= 1e-12 + columns["trace_error"]).all()
    assert (columns["trace_error"] < 1e-9).all()
    assert (np.abs(columns["trace_theory"] - traces) <= 2e-12).all()  # the last digit of the table
    regimes = np.where(np.abs(traces) < 2, STABLE, np.where(traces > 2, UNSTABLE, PERIOD_DOUBLING))
    assert (columns["regime"] == regimes).all()
    assert (columns["regime_theory"] == regimes).all()


def test_pumped_stable_axis():
    rate = math.sqrt(0.5 / 6.0)  # 0.288675134595
    columns = equations.survey(points(I2=1.5, depth2=0.05, frequency=2.0 * rate), True)
    assert columns["growth_rate"][0] / rate == pytest.approx(0.0499415701984, abs=1e-12)
    assert columns["regime"] == PERIOD_DOUBLING


def test_kapitzas_racket_is_stable_and_without_modulation_is_not():
    I2 = 1.0 / (0.5 - 0.0045)
    moments = [I2, 1.0 / (0.4955 + 0.045), 1.0 / (0.4955 - 0.045)]
    assert moments == pytest.approx([2.0182, 1.8501, 2.2198], abs=5e-5)
    columns = equations.survey(points(I2=I2, depth2=0.045 * I2, frequency=0.3), True)
    assert columns["regime"] == STABLE
    assert np.abs(columns["exponent_imag"]) == pytest.approx(0.156844738313 * 0.15, abs=1e-12)
    assert np.hypot(columns["multiplier_real"], columns["multiplier_imag"]) == pytest.approx(1.0, abs=1e-14)
    still = equations.survey(points(I2=I2, frequency=0.3), True)
    assert still["growth_rate"][0] == pytest.approx(0.047434, abs=1e-6)
    square = np.array([0.3, 0.54, 0.56]) ** 2  # the same a and q at further frequencies, as long as it is a body
    I2 = 1.0 / (0.5 - 0.05 * square)
    faster = points(I2=I2, depth2=0.5 * square * I2, frequency=np.sqrt(square))
    assert equations.survey(faster, True)["trace"] == pytest.approx(2.0 * np.cos(0.156844738313 * np.pi), abs=1e-11)
    assert (least_margin(faster, True) >= 0.0).tolist() == [True, True, False]
    unmodulated = equations.survey(mathieu(-0.2, 0.5), True)
    assert unmodulated["growth_rate"][0] / 0.15 == pytest.approx(0.295611078056, abs=1e-11)


def test_critical_frequencies_and_the_drawn_law_are_on_mathieus_characteristic_curves():
    """a = b1(q) and a = a1(q) with q = 2 a d, d the depth, by SciPy's Mathieu functions, right for such small q."""
    grid = {"I1": 1.0, "I2": 1.5, "I3": 2.0, "omega0": 0.5, "frequency": [0.4, 0.5, 0.58, 0.7], "depth2": [0.04, 0.05]}
    ds = sweeps.survey(system="pumped_body", modulation="inverse", axes=[3], **grid)
    changes = sweeps.critical(ds, "frequency")
    _, curves = figure_shapes.mathieu(3, ds.sel(axis=3).squeeze(), "frequency", "depth2")
    for depth in grid["depth2"]:
        values = [
            brentq(lambda a, f=f, d=depth: f(1, 2 * a * d) - a, 0.5, 1.5, xtol=1e-14) for f in (mathieu_a, mathieu_b)
        ]
        exact, line = np.sqrt(4.0 / 12.0 / np.array(values)), changes.isel(change=(changes.depth2 == depth).values)
        assert line.kind.values.tolist() == ["period_doubling", "restabilised"]
        difference = np.abs(line.critical_value.values - exact)  # a = 4 L² c b0/ν²
        assert (difference <= line.critical_value_error + 1e-12).all()  # SciPy's functions have 12 digits
        nearest = [f[np.nanargmin(np.abs(d - depth))] for f, d in curves if np.isfinite(d).any()]
        assert np.abs(np.subtract.outer(exact, nearest)).min(axis=1).max() < 1e-3  # between the points of a curve


def bodies(seed, n, epsilon=None):
    """Return random possible bodies about all axes, with moments of three depths and lags."""
    rng = np.random.default_rng(seed)
    second = rng.uniform(0.05, 1.0, (3, n))
    parameters = dict(zip(("I1", "I2", "I3"), second.sum(axis=0) - second, strict=True))
    parameters |= {f"depth{i}": rng.uniform(-0.6, 0.6, n) * (rng.random(n) < 0.7) for i in (1, 2, 3)}
    parameters |= {f"lag{i}": rng.uniform(-4.0, 4.0, n) for i in (1, 2, 3)}
    parameters |= {
        "frequency": 10 ** rng.uniform(-0.7, 1.0, n),
        "omega0": rng.uniform(0.3, 3.0, n) * rng.choice([-1, 1], n),
    }
    size = 10 ** rng.uniform(-12, -1, n) if epsilon is None else np.full(n, epsilon)
    return points(**parameters, axis=rng.integers(1, 4, n), epsilon=size, phase=rng.uniform(-4.0, 4.0, n))


@pytest.mark.parametrize("inverse", [False, True])
def test_random_bodies_are_those_of_scipy(inverse):
    parameters = bodies(1, 6, 1e-10)
    columns = equations.survey(parameters, inverse)
    for k in range(6):
        expected = trace_by_scipy({name: values[k] for name, values in parameters.items()}, inverse)
        scale = max(1.0, abs(expected))
        assert abs(columns["trace_theory"][k] - expected) <= 1e-11 * scale  # DOP853 at 1e-13, some hundred steps
        if columns["status"][k] == statuses.OK:
            assert abs(columns["trace"][k] - expected) <= columns["trace_error"][k] + 1e-11 * scale
    assert (columns["status"] == statuses.OK).sum() > 3


@pytest.mark.parametrize("inverse", [False, True])
@pytest.mark.parametrize("count", [60, pytest.param(2_000, marks=pytest.mark.slow)])
def test_every_error_holds_and_no_regime_is_wrong(count, inverse):
    """Perturbations from 1e-12 to 0.1: at least 99.9 % within the error."""
    columns = equations.survey(bodies(2, count), inverse)
    is_measured = np.isfinite(columns["trace"])
    assert is_measured.mean() > 0.5
    assert (columns["status"] == statuses.OK).sum() >= 0.999 * is_measured.sum()  # all four entries within their errors
    check_errors(columns, 0.999)
    assert (columns["regime"][is_measured] != floquet.MARGINAL).mean() > 0.8


def test_a_large_perturbation_has_no_number_and_says_so():
    columns = equations.survey(points(I2=2.5, I3=2.0, depth2=0.1, frequency=0.1, omega0=1.0, epsilon=0.3), True)
    assert columns["status"] == statuses.PERTURBATION_TOO_LARGE
    assert np.isnan(columns["trace"]).all()
    assert columns["regime"] == floquet.UNDETERMINED
    assert np.isfinite(columns["trace_theory"]).all()
