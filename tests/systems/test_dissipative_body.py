"""Bodies that lose energy: spectra, times and final sense against closed forms, printed figures and SciPy."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import sweeps
from kernels.estimator import statuses
from kernels.events import dissipation
from sweeps.systems.dissipative_body.system import SYSTEM, time_by_scipy

POINT = {"I1": 1.0, "I2": 2.0, "I3": 3.0, "loss": 0.1, "from_angle": 0.5, "phase": 0.6, "to_angle": 0.01, "omega0": 1.0}


def survey(tolerance=1e-12, **values):
    return dissipation.survey(POINT | values, tolerance)


def final_components(loss, from_angle, phase):
    """Components of L/|L| along axis 3 of bodies 1, 2, 3 long after their starts, by the double bracket as written."""

    def bracket(_, state):
        L = state.reshape(3, -1)
        torque = np.cross(L, L / np.array([[1.0], [2.0], [3.0]]), axis=0)
        return (torque + loss * np.cross(L, torque, axis=0)).ravel()

    start = [np.cos(from_angle), np.sin(from_angle) * np.cos(phase), np.sin(from_angle) * np.sin(phase)]
    run = solve_ivp(bracket, (0.0, 40.0 / loss), np.ravel(start), "DOP853", rtol=1e-11, atol=1e-13)
    return run.y.reshape(3, from_angle.size, -1)[2, :, -1]


def test_the_published_spectrum_about_each_axis():
    """I = (1, 2, 3), alpha = 0.02, L = 3, all printed digits; theory is the quadratic's root."""
    ds = sweeps.survey(system="dissipative_body", I1=1.0, I2=2.0, I3=3.0, loss=0.06, omega0=3.0).squeeze()
    expected = [[0.105 - 1.73198585j, 0.105 + 1.73198585j], [-0.89810138, 0.83810138]]
    expected += [[-0.075 - 0.99898699j, -0.075 + 0.99898699j]]
    measured, theory = ({p: ds[f"eigenvalue_{p}{kind}"].values for p in ("real", "imag")} for kind in ("", "_theory"))
    np.testing.assert_allclose(measured["real"] + 1j * measured["imag"], expected, atol=6e-9)
    assert (ds["rates_status"] == statuses.OK).all()
    J = np.array([1.0, 1 / 2, 1 / 3])
    for k in range(3):
        a, b = J[k - 2] - J[k], J[k - 1] - J[k]
        roots = np.roots([1.0, 0.06 * 3.0 * (a + b), 9.0 * a * b * (1.0 + 0.06**2)])
        # a few roundings of the roots
        np.testing.assert_allclose(np.sort(theory["real"][k]), np.sort(roots.real), atol=1e-14)
    for part in ("real", "imag"):
        assert (np.abs(measured[part] - theory[part]) <= ds[f"eigenvalue_{part}_error"].values).all()


def test_the_published_crossing_times_and_senses():
    """I = (1, 2, 3), alpha = 0.01, L = 1, from axis 1 with equal parts along 2 and 3: all printed digits."""
    columns = survey(loss=0.01, from_angle=[1e-3, 1e-2, 1e-1], phase=math.pi / 4)
    np.testing.assert_allclose(columns["crossing_time"], [1353.541, 971.113, 565.333], atol=6e-4)
    assert columns["final_sense"].tolist() == [0, 0, 1]


def test_the_symmetric_body_in_closed_form():
    """tan(theta) goes with exp(-alpha L^2 (1/I_t - 1/I_s) t): an oblate body's settling, a prolate one's motion."""
    theta, phi, loss, moments = np.array([0.3, 0.9, 1.4]), np.array([0.2, 1.0, 2.5]), 0.05, (2.0, 2.0, 3.0)
    names = dict(zip(("I1", "I2", "I3"), moments, strict=True))
    columns = survey(**names, loss=loss, from_angle=theta, phase=phi, to_angle=0.02, omega0=4.0)
    tilt = np.arccos(np.sin(theta) * np.sin(phi))
    exact = np.log(np.tan(tilt) / math.tan(0.02)) / (loss * 4.0 * (1.0 - 2.0 / 3.0))
    assert (np.abs(columns["settling_time"] - exact) <= columns["settling_time_error"]).all()
    assert (columns["settling_time_error"] <= 1e-10 * exact).all()
    prolate = POINT | {"I2": 2.0, "I3": 2.0, "loss": 0.02, "from_angle": 0.01, "omega0": 2.0}
    motion = SYSTEM.motion(prolate, 200.0, 50, 1e-12)
    L = np.array([motion[f"omega{i}"].values * prolate[f"I{i}"] for i in (1, 2, 3)])
    # the figure has 12 digits; DOP853 at 1e-12 keeps 10
    assert math.atan2(math.hypot(*L[1:, -1]), L[0, -1]) == pytest.approx(0.499766776686, abs=1e-9)
    q = np.array([motion[f"q{i}"].values for i in range(4)])
    in_space = L + 2.0 * (q[0] * np.cross(q[1:], L, axis=0) + np.cross(q[1:], np.cross(q[1:], L, axis=0), axis=0))
    np.testing.assert_allclose(in_space, np.tile(L[:, :1], 50), atol=1e-8)  # L stays fixed; as above, over 64 turns


@pytest.mark.parametrize("tolerance", [1e-3, 1e-12])
def test_errors_bound_the_deviation_over_bodies_losses_and_starts(tolerance):
    rng, n = np.random.default_rng(3), 300
    low = np.where(np.arange(n) % 2, 10.0 ** rng.uniform(-1.0, -0.01, n), 1.0 - 10.0 ** rng.uniform(-5.0, -1.0, n))
    middle = rng.uniform(0.0, 1.0, n)
    values = {"I1": low, "I2": low + middle * (1.0 - low), "I3": 1.0, "loss": 10.0 ** rng.uniform(-1.5, 1.0, n)}
    values |= {"from_angle": 10.0 ** rng.uniform(-9.0, 0.19, n), "phase": rng.uniform(0.0, 2.0 * math.pi, n)}
    values["to_angle"] = 10.0 ** rng.uniform(-8.0, -0.5, n)
    columns, finer = survey(tolerance, **values), survey(1e-13, **values)
    for name in ("crossing_time", "settling_time"):
        assert (np.abs(columns[name] - finer[name]) <= columns[f"{name}_error"] + finer[f"{name}_error"]).all()
        # rounding over some thousand steps; a few starts pass the saddle closely, where it grows
        assert np.median(columns[f"{name}_error"] / (1.0 + finer[name])) <= 1e-11
    for i in range(0, n, 30):
        point = POINT | {name: float(np.broadcast_to(x, n)[i]) for name, x in values.items()}
        for name in ("crossing_time", "settling_time"):
            expected = time_by_scipy(point, name=name)
            # DOP853 at 1e-13 over up to 1300 rad
            assert math.isnan(expected) or abs(finer[name][i] - expected) <= 1e-8 * (1.0 + expected)


def test_units_and_the_spin_rate_scale_times_alone():
    slow, fast = survey(), survey(I1=4.0, I2=8.0, I3=12.0, omega0=2.0)  # powers of two round nothing
    for name, values in slow.items():
        scale = 0.5 if "time" in name else 1.0
        assert fast[name].tobytes() == (scale * values).astype(values.dtype).tobytes(), name


def test_a_body_turned_about_its_least_axis_ends_in_the_other_sense():
    phase = np.linspace(0.1, 3.1, 40)
    one, other = survey(phase=phase, from_angle=0.2), survey(phase=phase + math.pi, from_angle=0.2)
    assert (one["final_sense"] + other["final_sense"] == 1).all()
    assert 0 < one["final_sense"].sum() < 40


def test_senses_are_undetermined_on_the_border_alone():
    """Starts on both sides of a basin's border, at distances down to the rounding of the angle."""
    angles = np.linspace(0.3, 0.9, 40)
    senses = survey(from_angle=angles)["final_sense"]
    k = int(np.flatnonzero(np.diff(senses))[0])
    first, (inside, outside) = senses[k], angles[k : k + 2]
    while outside - inside > 1e-16 and inside < 0.5 * (inside + outside) < outside:
        middle = 0.5 * (inside + outside)
        is_inside = (survey(from_angle=middle)["z_crossing"][0] > 0.0) == (first == 1)
        inside, outside = (middle, outside) if is_inside else (inside, middle)
    distance = 10.0 ** -np.arange(2.0, 16.0)
    angles = inside + np.concatenate([-distance, distance])
    sense = survey(from_angle=angles)["final_sense"]
    expected = np.repeat([first, 1 - first], distance.size)
    is_known = sense >= 0
    np.testing.assert_array_equal(sense[is_known], expected[is_known])
    assert is_known[np.tile(distance, 2) > 1e-10].all()  # the error of the steps moves a start by some 1e-13
    assert not is_known[np.tile(distance, 2) < 1e-14].any()


def test_senses_over_the_hemisphere_are_those_of_long_runs():
    theta, phi = np.random.default_rng(5).uniform(0.0, 1.0, (2, 60)) * np.array([[0.5 * math.pi], [2.0 * math.pi]])
    z = final_components(0.1, theta, phi)
    assert (np.abs(z) > 0.999).all()
    np.testing.assert_array_equal(survey(from_angle=theta, phase=phi)["final_sense"], z > 0.0)


def test_what_never_settles_and_what_has_settled_before():
    """Without a difference of both greater moments, or of any, no axis is the last one; below an energy it is past."""
    never, times = survey(I1=[1.0, 3.0], I2=3.0), ("crossing_time", "settling_time")
    assert np.isnan([never[name] for name in times]).all()
    assert never["final_sense"].tolist() == [-1, -1]
    below = survey(from_angle=1.5, phase=-1.5, to_angle=0.3)
    assert [below[name][0] for name in (*times, "final_sense")] == [0.0, 0.0, 0]
    ds = sweeps.survey(system="dissipative_body", I1=[1.0, 3.0], I2=3.0, I3=3.0, loss=0.1)
    assert ds["status"].values.ravel().tolist() == [statuses.SHORT_WINDOW, statuses.NO_TIME_SCALE]
