"""The racket's twist against quadrature, Taylor series in more digits and the published law."""

import math

import mpmath as mp
import numpy as np
import precise
import pytest

from kernels.estimator import statuses
from kernels.events import twist
from sweeps.systems.bodies.body import Once
from sweeps.systems.twist.system import SYSTEM

WILSON, PHONE, PLAIN, LONG = (1.21, 16.38, 17.48), (7.418, 30.975, 38.236), (1.0, 2.0, 3.0), (1.0, 5.0, 5.5)


def throw(body, chi, theta=0.5 * math.pi, tolerance=1e-10):
    points = dict(zip(("I1", "I2", "I3"), body, strict=True)) | {"chi": chi, "theta": theta, "omega0": 10.0}
    return twist.survey(points, tolerance)


@pytest.mark.parametrize(
    ("body", "growth", "exact", "asymptotic", "share"),
    [
        (WILSON, 0.88823061, 0.11494413, 0.11502117, 0.926824),
        (PHONE, 0.77656635, 0.14067931, 0.14060623, 0.910441),
        (PLAIN, 0.57735027, 0.21023630, 0.20871343, 0.866159),
        (LONG, 0.60302269, 0.27112150, 0.27177778, 0.827399),
    ],
)
def test_the_law_of_the_defect(body, growth, exact, asymptotic, share):
    """Figures from an independent quadrature of dchi/dphi."""
    a, b = body[1] / body[0] - 1.0, 1.0 - body[1] / body[2]
    assert math.sqrt(a * b) == pytest.approx(growth, abs=5e-9)
    eps = 0.5 * twist.defect_theory(*body)
    assert eps == pytest.approx(exact, abs=6e-9)
    law = 2 * math.sqrt(a / (a + b)) * math.exp(-math.sqrt(a * b) * (math.pi + math.atan(math.sqrt(b / a))))
    assert law == pytest.approx(asymptotic, abs=6e-9)
    assert 1.0 - 2.0 * eps / math.pi == pytest.approx(share, abs=6e-7)
    # a throw on the separatrix, from chi = -eps, ends at -(pi - eps): the full equations agree
    theta = math.atan(math.sqrt(a / b) / math.sin(eps))
    columns = throw(body, -eps, theta)
    assert columns["twist"][0] == pytest.approx(-(math.pi - 2.0 * eps), abs=1e-12)
    assert columns["twist_exact"][0] == pytest.approx(-(math.pi - 2.0 * eps), abs=1e-12)
    assert columns["growth"][0] == pytest.approx(growth, abs=5e-9)


@pytest.mark.parametrize(
    ("body", "best", "chi0", "symmetric"),
    [
        (WILSON, 0.886272, 0.13201, 0.23733526),
        (PHONE, 0.860800, 0.1621, 0.28966121),
        (PLAIN, 0.792185, 0.24639, 0.42554202),
    ],
)
def test_the_largest_twist_of_a_throw_across_the_handle(body, best, chi0, symmetric):
    chi = np.linspace(chi0 - 0.01, chi0 + 0.01, 401)
    twists = np.abs(throw(body, chi)["twist"]) / math.pi
    assert twists.max() == pytest.approx(best, abs=6e-7)
    assert chi[twists.argmax()] == pytest.approx(chi0, abs=2e-4)
    # the symmetric nudge ends with L across the handle again, as it began: chi0 + |chi(end)| = pi
    end = symmetric + throw(body, symmetric)["twist"][0]
    assert end == pytest.approx(math.pi - symmetric, abs=3e-7)


def test_measured_and_exact_agree_at_every_point():
    rng = np.random.default_rng(6)
    n = 600
    I1, I2 = rng.uniform(0.05, 1.0, n), rng.uniform(0.3, 1.0, n)
    chi, theta = rng.uniform(-math.pi, math.pi, n), rng.uniform(0.3, math.pi - 0.3, n)
    theta[::2] = 0.5 * math.pi
    columns = throw((I1, I2, np.ones(n)), chi, theta)
    for name in ("twist", "time_of_turn"):
        deviation = np.abs(columns[name] - columns[f"{name}_exact"])
        assert (deviation <= columns[f"{name}_error"]).all()
    assert np.median(columns["twist_error"]) < 1e-12


def test_no_turn_along_the_handle_and_no_law_for_a_symmetric_body():
    columns = throw(PLAIN, 0.3, 0.0)
    assert np.isnan(columns["twist"][0])
    assert np.isnan(columns["twist_exact"][0])
    assert np.isnan(throw((1.0, 2.0, 2.0), 0.3)["twist_defect_theory"][0])


BODIES = [
    (1.0, 2.0, 3.0),
    (0.3, 0.7, 1.0 - 1e-13),  # flat
    (0.6, 0.61 * (1.0 - 1e-12), 0.61),
    (0.61 * (1.0 - 1e-12), 0.61, 0.9),
    (0.7, 0.7 + 3e-12, 0.7 + 5e-12),  # a sphere but for 12 digits
    (0.03, 0.7, 0.705),  # a rod
]


def compare(bodies, chi, theta, digits):
    """Compare both twists and times with a Taylor integration; chi from 1e-12 to pi/2, of both signs."""
    I = np.resize(bodies, (chi.size, 3)).T  # noqa: E741
    twist_, time_ = precise.turns(*I, chi, np.full(chi.size, theta), digits).astype(float)
    points = dict(zip(("I1", "I2", "I3"), I, strict=True)) | {"chi": chi, "theta": theta, "omega0": 1.0}
    columns = twist.survey(points, 1e-10)
    # a rod turns many times about its handle meanwhile: rounding moves the time by as much, and the twist by that often
    spins = 1.0 + I[1] / I[0] * abs(math.cos(theta))
    np.testing.assert_array_less(np.abs(columns["twist_exact"] - twist_), 2e-14 * spins**2)
    np.testing.assert_array_less(np.abs(columns["time_of_turn_exact"] - time_), 2e-14 * spins)
    assert (np.abs(columns["twist"] - twist_) <= columns["twist_error"]).all()
    assert (np.abs(columns["time_of_turn"] - time_) <= columns["time_of_turn_error"]).all()


def test_a_throw_across_the_handle_is_that_of_22_digits():
    """With L next to axis 2 half a turn takes pi I2/L to rounding: phi counted modulo 2 pi may then lose a turn."""
    with mp.workdps(25):
        compare(BODIES, np.geomspace(1e-12, 0.5 * math.pi, 12) * np.tile([1.0, -1.0], 6), 0.5 * math.pi, 22)


@pytest.mark.skipif(np.finfo(np.longdouble).eps > 2e-19, reason="long doubles are no longer than doubles here")
@pytest.mark.parametrize("theta", [0.5 * math.pi + 1e-11, 1.1, 1e-9, math.pi - 1e-3])
def test_a_throw_at_any_angle_is_that_of_19_digits(theta):
    """Near the handle its components about L are differences of numbers near 1."""
    compare(BODIES, np.geomspace(1e-12, 0.5 * math.pi, 12) * np.tile([1.0, -1.0], 6), theta, None)


def test_a_nudge_of_many_turns_is_the_nudge_within_one():
    far, near = throw(PLAIN, 7e5), throw(PLAIN, math.atan2(math.sin(7e5), math.cos(7e5)))
    for name in far:
        np.testing.assert_array_equal(far[name], near[name])


def test_a_throw_that_takes_too_many_steps_is_missing_and_has_a_status():
    """A needle that turns a million times about its handle; along the handle nothing is there to measure."""
    points = {"I1": 1e-6, "I2": 1.0, "I3": 1.0, "chi": 0.1, "theta": np.array([1.0, 0.0]), "omega0": 1.0}
    columns = SYSTEM.columns(points, Once())
    assert np.isnan(columns["twist"]).all()
    assert columns["status"].tolist() == [statuses.NOT_CONVERGED, statuses.OK]
