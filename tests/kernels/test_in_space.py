"""A perturbed spin in the inertial frame: against the closed form over many rotations, and with disturbed steps."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from kernels.events import in_space, tumbling
from kernels.free import exact
from sweeps.points import catalogue
from sweeps.systems.rigid_body.system import SYSTEM, RigidBodyIntegration, initial_state

pytestmark = pytest.mark.slow  # their kernels take some 20 s to compile, and few definitions request them
ATTITUDE = RigidBodyIntegration(attitude=True)


@pytest.fixture(scope="module")
def racket():
    """Some points of the default sweep, and their columns."""
    grid = catalogue.plan_sweep(catalogue.find_definition("tennis_racket")).sweep.grid
    points = {name: values[::331] for name, values in grid.points(0, grid.size).items()}
    return points, SYSTEM.columns(points, ATTITUDE)


def test_the_default_sweeps_attitude_is_certified(racket):
    _, columns = racket
    # the bound by a tolerance of 1e-10; the measured deviation was 3e-14
    assert columns["attitude_error"].max() <= 1e-9
    assert columns["geometric_phase_residual"].max() <= 1e-12


def test_what_was_measured_before_stays_as_it_was(racket):
    points, columns = racket
    for name, values in SYSTEM.columns(points, RigidBodyIntegration()).items():
        np.testing.assert_array_equal(columns[name], values)


def errors_cover(moments, min_share, random, **values):
    """Assert that errors cover the distance to the closed form, of bodies of which a share has one; return columns."""
    n, integration = moments.shape[1], RigidBodyIntegration(attitude=True, **values.pop("run", {}))
    points = dict(zip(("I1", "I2", "I3"), moments, strict=True)) | {"axis": random.integers(1, 4, n)}
    points |= {"omega0": random.choice([-1.0, 1.0], n), "phase": random.uniform(0, 2 * math.pi, n)} | values
    columns = SYSTEM.columns({name: np.broadcast_to(value, n) for name, value in points.items()}, integration)
    distance = np.abs(columns["space_rate"] - columns["space_rate_exact"])
    has_distance = np.isfinite(distance)
    assert has_distance.mean() > min_share
    assert (distance[has_distance] <= columns["space_rate_error"][has_distance]).all()
    return columns


@pytest.mark.parametrize("epsilon", [1e-6, 1e-3, 0.1])
def test_errors_cover_the_distance_to_the_closed_form(epsilon):
    random = np.random.default_rng(4)
    spins = random.choice([-1, 1], 1000) * 10.0 ** random.uniform(-3, 3, 1000)
    columns = errors_cover(random.uniform(0.1, 1.0, (3, 1000)), 0.6, random, epsilon=epsilon, omega0=spins)
    assert columns["attitude_error"].max() <= 1e-9


@pytest.mark.parametrize("epsilon", [1e-4, 1e-2])
def test_errors_cover_the_distance_near_symmetric_bodies(epsilon):
    """The wobble is slow, and a run shows its beginning: the wobble grows beyond its measured size."""
    random, n = np.random.default_rng(5), 1000
    moments = np.sort(random.uniform(0.3, 0.6, (3, n)), axis=0)
    moments[1] = moments[random.choice([0, 2], n), np.arange(n)] * (1.0 - 10.0 ** random.uniform(-8, -2, n))
    errors_cover(moments, 0.3, random, epsilon=epsilon)


def test_errors_cover_a_short_piece_of_a_wide_wobble_of_the_momentum():
    """A small perturbation of a needle's spin tilts its angular momentum far."""
    random = np.random.default_rng(6)
    moments = np.vstack([np.ones(1000), 10.0 ** random.uniform(0, 5, (2, 1000))])
    epsilon = 10.0 ** random.uniform(-2, 0, 1000) / moments.max(axis=0)
    run = {"rotations": 0.1, "samples_per_rotation": 160}
    errors_cover(moments, 0.5, random, axis=1, omega0=1.0, epsilon=epsilon, run=run)


@pytest.mark.parametrize("axis", [1, 3])
def test_the_rate_is_that_of_the_axis_followed_for_many_turns(axis):
    """The azimuth of the spin axis about L from quaternions, over a hundred periods of the wobble."""
    point = {"I1": 0.5, "I2": 0.8, "I3": 1.0, "axis": axis, "omega0": -3.0, "epsilon": 0.05, "phase": 0.6}
    columns = SYSTEM.columns({name: np.array([value]) for name, value in point.items()}, ATTITUDE)
    moments, omega = initial_state(point)
    times = np.linspace(0.0, 100 * exact.period(exact.set_up(*moments, *omega)), 40_001)
    attitudes = Rotation.from_quat(exact.attitude(moments, omega, times), scalar_first=True)
    end = attitudes.apply(np.eye(3)[axis - 1]).T
    L = moments * omega / np.linalg.norm(moments * omega)
    first = np.cross(L, [0.0, 1.0, 0.0])
    first /= np.linalg.norm(first)
    azimuth = np.unwrap(np.arctan2(np.cross(L, first) @ end, first @ end))
    rate = (azimuth[-1] - azimuth[0]) / times[-1]
    assert columns["space_rate_exact"][0] == pytest.approx(rate, rel=1e-11)
    assert abs(columns["space_rate"][0] - rate) <= columns["space_rate_error"][0]


@pytest.mark.parametrize("name", ["ka", "kb", "kc", "half_step"])
def test_a_coefficient_of_the_direct_step_bent_by_1e9_is_seen(name):
    """About the intermediate axis at ε = 0.3, at which every coefficient rotates the body."""
    row, scratch = getattr(in_space.row, name), np.zeros(len(in_space.row) * in_space.W)
    omega = 1.0, 0.3 * math.cos(0.6), 0.3 * math.sin(0.6)

    def deviation(bend):
        for lane in range(in_space.W):
            in_space._load(scratch, lane, (2 / 3, 1.0, 1 / 3), omega, 0.4, 2)
        scratch[row : row + in_space.W] *= 1.0 + bend
        for _ in range(64):
            in_space._advance(scratch, 2)
            in_space._advance_exact(scratch)
            in_space._compare_attitudes(scratch)
        return 2.0 * math.sqrt(scratch[in_space.row.distance])

    assert deviation(0.0) < 1e-12
    assert deviation(1e-9) > 1e-10


def test_the_turn_of_a_period_is_montgomerys():
    rng = np.random.default_rng(6)
    for _ in range(200):
        moments, omega = rng.uniform(0.3, 1.2, 3), rng.normal(size=3)
        assert tumbling.phase_residual(*moments, *omega) <= 1e-13
