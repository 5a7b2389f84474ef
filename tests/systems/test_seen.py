"""Throws and tumbling bodies: their maps, refusals, motions, and the text of `body`."""

import math

import numpy as np
from calls import run_command
from scipy.spatial.transform import Rotation

import sweeps
from sweeps.maps import storage, verify
from sweeps.points.loading import read_definition
from sweeps.systems import resolve
from sweeps.systems.tumbling.presentation.figure_tumbling import herpolhode

RACKET = {"name": "racket", "I1": 0.00121, "I2": 0.01638, "I3": 0.01748}
THROWS = {"system": "twist", "bodies": [RACKET], "grid": {"chi": [0.01, 0.13201, 0.5], "omega0": [1.0, 10.0]}}


def test_a_racket_reverses_its_ends_beyond_a_quarter_turn_whatever_the_spin_rate():
    throws = sweeps.survey(THROWS | {"grid": {"chi": np.geomspace(1e-4, 0.5, 60), "omega0": [1.0, 10.0]}}).squeeze()
    np.testing.assert_array_equal(throws["ends_reversed"], np.abs(throws["twist"]) > 0.5 * math.pi)
    assert 0 < throws["ends_reversed"].sum() < 120
    np.testing.assert_allclose(throws["time_of_turn"].sel(omega0=1.0), 10 * throws["time_of_turn"].sel(omega0=10.0))


def test_energies_that_a_body_cannot_have_are_flagged():
    tumbles = sweeps.survey(system="tumbling", I1=[0.3, 0.5], I2=0.8, I3=1.0, energy=[1.1, 1.4, 2.5])
    modes = tumbles["mode"].attrs["flag_meanings"].split()
    flags = tumbles["mode"].isel(I2=0, I3=0, omega0=0).values
    words = [[modes[flag + 1] for flag in row] for row in flags.tolist()]
    assert words == [["sam", "lam", "lam"], ["sam", "lam", "impossible"]]
    assert np.isnan(tumbles["period_psi"].values.squeeze()[1, 2])


def test_a_spin_or_separatrix_without_a_period_is_verified(tmp_path):
    """E = 1 and I3/I1 are spins about principal axes, E = I3/I2 the separatrix: their periods are missing."""
    grid = {"I1": 1.0, "I2": 1.5, "I3": 2.0, "energy": [1.0, 1.2, 2.0 / 1.5, 1.5, 2.0], "omega0": 1.0}
    storage.write_map(sweeps.survey({"system": "tumbling", "grid": grid}), tmp_path / "map.nc")
    checks = {check.name: check for check in verify.verify(tmp_path / "map.nc", points=5)}
    assert not any(check.findings for check in checks.values())
    assert checks["SciPy DOP853"].covers.startswith("2 points")


def test_verify_sees_quaternions_that_are_another_motions(tmp_path, monkeypatch):
    from sweeps.systems.twist.system import SYSTEM

    path, honest = tmp_path / "map.nc", SYSTEM.motion

    def disturbed_motion(*point_and_rest):
        return honest(*point_and_rest).assign(q1=lambda ds: ds["q1"] + 1e-7)

    storage.write_map(sweeps.survey(THROWS), path)
    monkeypatch.setattr(SYSTEM, "motion", disturbed_motion)
    (check_of_attitude,) = (check for check in verify.verify(path, points=2) if check.name == "attitude")
    assert "the closed form is" in check_of_attitude.findings[0]


def test_every_system_takes_a_body_by_its_tensor_and_names_its_axes():
    axes = Rotation.from_euler("xyz", (0.3, -0.8, 1.1)).as_matrix()
    tensor = axes @ np.diag([0.3, 0.8, 1.0]) @ axes.T
    bodies = [{"name": "turned", "tensor": ((tensor + tensor.T) / 2).tolist()}]
    grids = {"twist": {"chi": 0.1}, "tumbling": {"energy": 1.1}}
    for (system, grid), name in zip(grids.items(), ("twist_exact", "period_psi_exact"), strict=True):
        settings = {"system": system, "grid": grid}
        ratios = {"I1": 0.3, "I2": 0.8, "I3": 1.0}
        ds = sweeps.survey(settings | {"bodies": [*bodies, {"name": "straight", "ratios": ratios}]})
        values = ds[name].values.reshape(2, -1)
        np.testing.assert_allclose(values[0], values[1], rtol=1e-13)  # the eigenproblem's rounding
        assert "principal moments and axes" in read_definition(settings | {"bodies": bodies}).remarks[0][1]


def test_a_motion_holds_the_attitude_both_ways():
    point = {"I1": 0.00121, "I2": 0.01638, "I3": 0.01748, "chi": 0.05, "theta": 0.5 * math.pi, "omega0": 10.0}
    trajectory = resolve("twist").motion(point, None, 50, 1e-12)
    exact, direct = (np.stack([trajectory[f"q{i}{way}"] for i in range(4)], axis=1) for way in ("", "_direct"))
    attitude = Rotation.from_quat(exact, scalar_first=True)
    assert (attitude.inv() * Rotation.from_quat(direct, scalar_first=True)).magnitude().max() < 1e-9
    L = attitude.apply(np.stack([trajectory[f"omega{i}"] for i in (1, 2, 3)], axis=1) * [0.00121, 0.01638, 0.01748])
    np.testing.assert_allclose(L, np.tile(L[0], (50, 1)), atol=1e-12)
    assert "scalar first" in trajectory["q0"].attrs["comment"]


def test_the_herpolhode_stays_between_its_circles():
    from kernels.free import exact

    moments, omega = np.array([0.4, 0.8, 1.0]), np.array([0.3, 0.0, 1.0])
    times = np.linspace(0, 3 * exact.period(exact.set_up(*moments, *omega)), 500)
    w = exact.rotation(moments, omega, times)
    along = (moments * omega * omega).sum() / np.linalg.norm(moments * omega)
    squares = (herpolhode(moments, omega, times) ** 2).sum(axis=1)
    np.testing.assert_allclose(squares, (w**2).sum(axis=1) - along**2, atol=1e-13)


def test_a_body_is_told_as_seen_from_space(capsys):
    turns = {"earth": "(inertial frame; 0.9967 of a turn)", "plate": "(inertial frame; 0.5 of a turn)"}
    for name, sentence in (turns | {"racket": "up to 167°"}).items():
        assert sentence in " ".join(run_command(capsys, "body", name).split())
