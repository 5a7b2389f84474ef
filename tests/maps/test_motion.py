import math

import euler
import numpy as np
import pytest
import xarray as xr

from sweeps.maps import motion
from sweeps.reading.attitude_files import AttitudeMessage
from sweeps.reading.files import FileBytes
from sweeps.schema.refusals import RefusedError
from sweeps.systems.rigid_body.system import SYSTEM as RIGID_BODY
from sweeps.systems.symmetric_top.system import SYSTEM as TOP

POINT = {"I1": 0.00121, "I2": 0.01638, "I3": 0.01748, "axis": 2, "omega0": -10.0, "epsilon": 1e-2, "phase": 0.6}
OMEGA = ["omega1", "omega2", "omega3"]


def row_of(point, system="rigid_body"):
    """Return the point of a map with these coordinates."""
    return xr.Dataset(coords=point, attrs={"system": system})


@pytest.mark.parametrize("axis", [1, 2, 3])
def test_both_ways_agree_with_scipy(axis):
    point = POINT | {"axis": axis}
    trajectory = RIGID_BODY.motion(point, 2.0, 101, 1e-10)
    moments, times = [point[name] for name in ("I1", "I2", "I3")], trajectory.time.values
    start = euler.spin(*(point[name] for name in ("axis", "omega0", "epsilon", "phase")))
    expected = euler.rotate(moments, start, times[-1], t_eval=times).y[:3].T
    # SciPy's own error over two seconds and a flip, against an angular velocity of 10
    np.testing.assert_allclose(np.stack([trajectory[name] for name in OMEGA], 1), expected, atol=1e-7)
    np.testing.assert_allclose(np.stack([trajectory[f"{name}_direct"] for name in OMEGA], 1), expected, atol=1e-7)


def test_the_length_of_its_own_holds_two_flips():
    trajectory = RIGID_BODY.motion(POINT, None, None, 1e-10)
    assert (np.diff(np.sign(trajectory.omega2.values)) != 0).sum() == 2
    np.testing.assert_allclose(trajectory.omega2[-1], trajectory.omega2[0], rtol=1e-6)  # a whole period
    stable = RIGID_BODY.motion(POINT | {"axis": 3}, None, None, 1e-10)
    assert (np.diff(np.sign(stable.omega1.values)) != 0).sum() == 4  # two turns of the nudge


@pytest.mark.parametrize("change", [{"epsilon": 1e-300, "axis": 1, "I2": 0.00121}, {"I1": 1.0, "I2": 1.0, "I3": 1.0}])
def test_what_never_comes_back_is_followed_for_four_rotations(change):
    trajectory = RIGID_BODY.motion(POINT | change, None, None, 1e-10)
    assert trajectory.time[-1].item() <= 10_000 * 2 * math.pi / 10
    assert np.isfinite(trajectory.omega1).all()


def test_a_symmetric_top_turns_by_its_formula():
    point = {"ratio": 1.5, "omega3": 4.0, "half_angle": 30.0}
    trajectory = TOP.motion(point, None, None, 1e-10)
    assert trajectory.time[-1].item() == pytest.approx(2 * 2 * math.pi / (0.5 * 4.0), rel=1e-15)
    angle = np.unwrap(np.arctan2(trajectory.omega2, trajectory.omega1))
    np.testing.assert_allclose(angle, 0.5 * 4.0 * trajectory.time, atol=1e-12)
    np.testing.assert_allclose(
        np.hypot(trajectory.omega1, trajectory.omega2) / trajectory.omega3, math.tan(math.pi / 6), rtol=1e-14
    )


def test_csv_and_netcdf_hold_the_same_numbers(tmp_path):
    trajectory = RIGID_BODY.motion(POINT, 1.0, 11, 1e-10)
    motion.write_motion(trajectory, tmp_path / "m.nc")
    motion.write_motion(trajectory, tmp_path / "m.csv")
    heading = (tmp_path / "m.csv").read_text().splitlines()[0].split(",")
    assert heading[:2] == ["time (s)", "omega1 (rad s-1)"]
    table = np.loadtxt(tmp_path / "m.csv", delimiter=",", skiprows=1)
    with xr.open_dataset(tmp_path / "m.nc") as read:
        for column, name in zip(table.T, ["time", *trajectory.data_vars], strict=True):
            np.testing.assert_array_equal(column, read[name].values)
            np.testing.assert_array_equal(column, trajectory[name].values)


def test_an_attitude_message_holds_the_same_bits(tmp_path):
    trajectory = RIGID_BODY.motion(POINT, math.pi, 101, 1e-10)
    motion.write_motion(trajectory, tmp_path / "m.aem")
    with FileBytes(tmp_path / "m.aem") as file:
        message = AttitudeMessage(file)
        (rows,) = message.read_rows(range(8))
        assert not message.space_to_body
    assert [name for name, _ in message.headings] == ["time", "q1", "q2", "q3", "qc", "w1", "w2", "w3"]
    np.testing.assert_array_equal(rows[:, 0], trajectory.time)
    np.testing.assert_array_equal(rows[:, 1:5], np.stack([trajectory[f"q{i}"] for i in (1, 2, 3, 0)], 1))
    np.testing.assert_array_equal(rows[:, 5:], np.degrees(np.stack([trajectory[name] for name in OMEGA], 1)))
    text = (tmp_path / "m.aem").read_text()
    assert "STOP_TIME = 2000-01-01T00:00:03.14159265358979312\n" in text


def test_an_attitude_message_needs_an_attitude_and_years_of_four_digits(tmp_path):
    trajectory = RIGID_BODY.motion(POINT, 1.0, 3, 1e-10)
    with pytest.raises(motion.MotionError, match=r"has no q0 for a \.aem file; allowed"):
        motion.write_motion(trajectory.drop_vars("q0"), tmp_path / "m.aem")
    long = RIGID_BODY.motion(POINT | {"omega0": 1e-9}, 3e11, 3, 1e-10)
    with pytest.raises(motion.MotionError, match=r"ends after 3e\+11 s; allowed in a \.aem file"):
        motion.write_motion(long, tmp_path / "m.aem")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("system", "duration", "samples", "words"),
    [
        ("rigid_body", -1.0, None, "duration: -1.0"),
        ("rigid_body", 0.0, None, "duration: 0.0"),
        ("rigid_body", math.nan, None, "duration: nan"),
        ("rigid_body", None, 1, "samples: 1"),
        ("rigid_body", None, 10_000_001, "samples: 10000001"),
        ("pendulum", None, None, "pendulum has none at its points"),
    ],
)
def test_what_cannot_be_followed_is_refused(system, duration, samples, words):
    with pytest.raises(RefusedError) as error:
        motion.point_motion(row_of(POINT, system), duration, 1e-10, samples)
    assert words in str(error.value)
    assert "allowed: " in str(error.value)


def test_two_samples_of_any_duration_are_a_motion_and_so_are_ten_million():
    motion.check_length(1e-3, 10_000_000)
    trajectory = motion.point_motion(row_of(POINT), 1e-3, 1e-10, 2)
    assert trajectory.time.values.tolist() == [0.0, 1e-3]


def test_a_motion_that_doubles_cannot_hold_is_refused():
    """Products of these moments overflow: once a file of nothing but NaN."""
    point = {"I1": 0.5, "I2": 0.75, "I3": 1.7e308, "axis": 2, "omega0": 1.0, "epsilon": 1e-6, "phase": 0.6}
    with pytest.raises(motion.MotionError, match="omega1 is not finite"):
        motion.point_motion(row_of(point), None, 1e-10)
