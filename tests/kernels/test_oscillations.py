import math
from functools import cache

import numpy as np
import pytest

from kernels.compile.jit import PASSED, njit
from kernels.estimator import statuses
from kernels.flow import oscillations
from kernels.flow.runs import Integrator, Runs, Sampling

STATES = 2  # x, v in units of epsilon; then 1, the step, energy and its terms, k
SAMPLING = Sampling(64, 0.4, 1e-10)


def _advance(S, steps):
    """x'' = -k x with k in the last row, exactly."""
    for _ in range(steps):
        for lane in range(32):
            x, v, h, k = S[lane], S[32 + lane], S[96 + lane], S[192 + lane]
            w = math.sqrt(abs(k))
            if k > 0:
                c, s = math.cos(w * h), math.sin(w * h)
                S[lane], S[32 + lane] = c * x + s * v / w, c * v - w * s * x
            elif k < 0:
                c, s = math.cosh(w * h), math.sinh(w * h)
                S[lane], S[32 + lane] = c * x + s * v / w, c * v + w * s * x
            else:
                S[lane] = x + v * h


def _energy(S):
    """Kinetic and potential energy."""
    for lane in range(32):
        kinetic, potential = 0.5 * S[32 + lane] ** 2, 0.5 * S[192 + lane] * S[lane] ** 2
        S[128 + lane] = kinetic + potential
        S[160 + lane] = kinetic + abs(potential)


@cache
def compiled():
    """Return both kernels, compiled on first use."""
    return njit("void(float64[::1], int64)", **PASSED)(_advance), njit("void(float64[::1])", **PASSED)(_energy)


def run(k, *, start=1.0, speed=0.0, intervals=64, spacing=0.4, size=1e-6, advance=None):
    """The raw result of linear oscillators with these k, scale 1, or of another function `advance`."""
    k = np.atleast_1d(np.asarray(k, dtype=np.float64))
    rows = np.zeros((k.size, 1, 6, 7))
    rows[..., 0], rows[..., 1], rows[..., STATES], rows[..., 6] = start, speed, 1.0, k[:, None, None]
    unit = np.ones(k.size)
    zeros = np.zeros(k.size, dtype=np.int64)
    exact, energy = compiled()
    starts = np.stack([unit, 0.0 * unit], axis=1)
    runs = Runs(rows, np.tile(np.eye(2), (k.size, 1, 1)), unit, size * unit, zeros, zeros, starts)
    integrator, sampling = Integrator(advance or exact, energy, STATES), Sampling(intervals, spacing, 1e-10)
    return oscillations.measure_points(integrator, runs, sampling)


@pytest.mark.parametrize("speed", [0.0, -0.5, 2.0])
def test_signed_rates_of_exact_motions(speed):
    k = np.array([1.0, 0.3, 1e-3, -1e-3, -0.3, -1.0])
    raw = run(k, speed=speed)
    # rounding of a sample, 1e-16, over the second difference k h²
    assert np.abs(raw[:, oscillations.RAW.rate2] - k).max() <= 1e-13
    assert (oscillations.row_status(raw, SAMPLING) == statuses.OK).all()


def test_window_ends_where_the_motion_has_grown_tenfold():
    raw = run([-1.0, 1.0])
    inside = int(math.acosh(10.0) / 0.4) + 1  # samples with cosh(0.4 k) <= 10, that at 0 among them
    assert raw[:, oscillations.RAW.samples].tolist() == [inside, 65]


def test_nothing_that_pulls_is_marginal():
    raw = run([0.0, 1e-16, 1e-3])
    _, error = oscillations.find_errors(raw, np.ones(3), 0.4)
    kinds = oscillations.find_regime(raw[:, oscillations.RAW.reduced], error)
    assert kinds.tolist() == [oscillations.MARGINAL, oscillations.MARGINAL, oscillations.STABLE]


def test_fast_growth_is_a_short_window_and_overflow_is_said():
    raw = run([-40.0], spacing=0.5)
    assert oscillations.row_status(raw, SAMPLING).tolist() == [statuses.SHORT_WINDOW]
    raw = run([1.0], start=np.nan)
    assert oscillations.row_status(raw, SAMPLING).tolist() == [statuses.NON_FINITE]


def test_log_slope_is_that_of_the_logarithms_in_its_window():
    k = np.array([-1.0, -0.3, 0.7])
    raw = run(k, speed=0.4, intervals=120)
    for row, rate in zip(raw[:2], np.sqrt(-k[:2]), strict=True):
        sizes = np.cosh(0.4 * rate * np.arange(121)) + 0.4 / rate * np.sinh(0.4 * rate * np.arange(121))
        (window,) = np.nonzero((sizes >= 2.0) & (sizes <= 1000.0))
        slope = np.polyfit(0.4 * window, np.log(sizes[window]), 1)[0]
        # a hundred samples' rounding, grown a thousandfold in the sums of squares
        assert row[oscillations.RAW.log_slope] == pytest.approx(slope, rel=1e-12)
        assert row[oscillations.RAW.e_folds] == pytest.approx(np.ptp(np.log(sizes[window])), rel=1e-12)
    assert np.isnan(raw[2, [oscillations.RAW.log_slope, oscillations.RAW.e_folds]]).all()
    result = run([-1.0], intervals=120, size=1e-4)[0]  # 0.01 of the system's size is 100 times the nudge
    assert math.log(100.0 / 2.0) - 0.8 <= result[oscillations.RAW.e_folds] <= math.log(100.0 / 2.0)


def test_halving_is_tried_where_the_motion_is_largest_and_scatter_is_that_of_least_squares():
    """A step with an error of h² x³ / 1000 in the speed: halving changes it by the cube of the size."""

    def step(x, v, h):
        return math.cos(h) * x + math.sin(h) * v, math.cos(h) * v - math.sin(h) * x + 1e-3 * h * h * x**3

    @njit("void(float64[::1], int64)", **PASSED)
    def faulty(S, steps):
        for _ in range(steps):
            for lane in range(32):
                x, v, h = S[lane], S[32 + lane], S[96 + lane]
                c, s = math.cos(h), math.sin(h)
                S[lane], S[32 + lane] = c * x + s * v, c * v - s * x + 1e-3 * h * h * x * x * x

    raw = run([1.0], speed=2.0, advance=faulty)[0]
    number = int(raw[oscillations.RAW.steps])

    def interval(state, number):
        for _ in range(number):
            state = step(*state, 0.4 / number)
        return state

    def expected(state):
        ends = zip(interval(state, number), interval(state, 2 * number), strict=True)
        return max(abs(a - b) for a, b in ends) / abs(largest[0])

    states = [(1.0, 2.0)]  # of every sample
    while len(states) <= 64:
        states.append(interval(states[-1], number))
    largest = max(states, key=lambda state: abs(state[0]))
    # rounding of the steps, 1e-14, over the change by halving
    assert raw[oscillations.RAW.halving] == pytest.approx(expected(largest), rel=1e-7)
    assert expected(largest) > 2.0 * expected(states[0])

    sizes = np.array(states)[:, 0]
    (twice_cosine,), (scatter,), *_ = np.linalg.lstsq(sizes[1:-1, None], sizes[2:] + sizes[:-2])
    angle, error = math.acos(0.5 * twice_cosine), math.sqrt(scatter / (62 * (sizes[1:-1] ** 2).sum()))
    # the runs of a half and of a quarter of the nudge are equal to this run, and so is their extrapolation
    estimates = raw[[oscillations.RAW.stderr, oscillations.RAW.spread]]
    np.testing.assert_allclose(estimates, angle / math.sin(angle) * error / 0.4**2, rtol=1e-9)


def test_another_mode_that_grows_ends_the_window():
    """Two modes: the perturbed mode oscillates, the second starts at a thousandth and grows."""

    @njit("void(float64[::1], int64)", **PASSED)
    def pair(S, steps):
        for _ in range(steps):
            for lane in range(32):
                h = S[5 * 32 + lane]
                x, v = S[lane], S[64 + lane]
                c, s = math.cos(h), math.sin(h)
                S[lane], S[64 + lane] = c * x + s * v, c * v - s * x
                S[32 + lane] *= math.exp(h)

    @njit("void(float64[::1])", **PASSED)
    def still(S):
        for lane in range(32):
            S[192 + lane], S[224 + lane] = 1.0, 1.0

    rows, project = np.zeros((1, 1, 6, 8)), np.zeros((1, 3, 4))
    rows[..., 0], rows[..., 1], rows[..., 4] = 1.0, 1e-3, 1.0
    project[0, [0, 1, 2], [0, 2, 1]] = 1.0
    unit, none = np.ones(1), np.zeros(1, dtype=np.int64)
    for allowed, ratio in ((0.0, 100.0), (10.0, 1e4)):  # the second mode grows to a tenth; to ten
        runs = Runs(rows, project, unit, unit * 1e-6, none, none, np.array([[1.0, allowed]]))
        (raw,) = oscillations.measure_points(Integrator(pair, still, 4), runs, Sampling(64, 0.4, 1e-10))
        assert raw[oscillations.RAW.samples] == int(math.log(ratio) / 0.4) + 1
        assert raw[oscillations.RAW.rate2] == pytest.approx(1.0, abs=1e-12)
