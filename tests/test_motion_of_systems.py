"""Motions of described systems: against closed forms and SciPy, with explicit time too, and refusals."""

import euler
import mpmath
import numpy as np
import pandas as pd
import pytest
import repeated
import sympy as sp
from described import flow, particle
from PIL import Image
from scipy.integrate import solve_ivp
from scipy.special import ellipj, ellipk

import sweeps
from sweeps.__main__ import main
from sweeps.mechanics import System, motions
from sweeps.schema.refusals import DefinitionError
from sweeps.systems import trajectories
from sweeps.systems.motion import MotionError
from sweeps.systems.reintegration import rates_of

TIMES = np.linspace(0.0, 20.0, 41)


@pytest.mark.parametrize("times", [TIMES, np.sort(np.random.default_rng(1).uniform(0.0, 20.0, 500))])
def test_pendulums_swing_as_elliptic_functions_say(times):
    """θ from rest at α: sin(θ/2) = k cd(√(g/l) t, k), k = sin(α/2); at samples at the ends of steps and inside."""
    starts = np.array([0.1, 1.0, 3.0])
    ds = sweeps.motion("pendulum", {"theta": starts}, times)
    assert ds["theta"].dims == ("run", "time")
    assert ds["status"].values.tolist() == [0, 0, 0]
    k = np.sin(starts / 2)[:, None]
    sn, *_ = ellipj(np.sqrt(9.80665) * (times - times[0]) + ellipk(k**2), k**2)  # sn(u + K) = cd(u)
    exact = 2 * np.arcsin(k * sn)
    deviation = np.abs(ds["theta"].values - exact)
    # the elliptic functions of SciPy are known to some roundings of their argument
    assert (deviation <= ds["theta_error"].values + 1e-13).all()
    assert ds["theta_error"].max() < 1e-10


def test_the_command_writes_the_motion_that_elliptic_functions_have(tmp_path, capsys):
    out = tmp_path / "pendulum.csv"
    start = ["--start", "theta=90 deg", "--parameter", "length=2"]
    assert main(["motion", "pendulum", *start, "--duration", "5 s", "--samples", "11", "-o", str(out)]) == 0
    assert capsys.readouterr().out.strip() == str(out)
    time, theta, error, *_ = np.loadtxt(out, delimiter=",", skiprows=1, unpack=True)
    sn, *_ = ellipj(np.sqrt(9.80665 / 2) * time + ellipk(0.5), 0.5)
    # the elliptic functions of SciPy are known to some roundings of their argument
    assert (np.abs(theta - 2 * np.arcsin(np.sqrt(0.5) * sn)) <= error + 1e-13).all()
    np.testing.assert_allclose(time, np.linspace(0.0, 5.0, 11), rtol=1e-15)  # a rounding of a product


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["pendulum", "--start", "theta=1"], "--duration: null"),
        (["pendulum", "--omega0", "3"], "--omega0: is of a body"),
        (["racket", "--start", "theta=1"], "--start, --parameter: are of a described system"),
        (
            ["pendulum", "--start", "tetha=1", "--duration", "1"],
            "start: tetha is unknown (did you mean theta?); theta is missing; allowed: theta (rad; ",
        ),
        (["pendulum", "--start", "theta=1", "--duration", "1", "--samples", "1"], "samples: 1 is out of range"),
        (["pendulum", "--start", "theta=1", "--duration", "1e9"], "motion: too_many_steps"),
    ],
)
def test_the_command_refuses_with_one_message(options, words, tmp_path, capsys):
    assert main(["motion", *options, "-o", str(tmp_path / "out.csv")]) == 2
    assert words in capsys.readouterr().err
    assert not (tmp_path / "out.csv").exists()


def test_a_motion_is_a_film(tmp_path, capsys):
    out = str(tmp_path / "p.gif")
    assert main(["motion", "pendulum", "--start", "theta=3", "--duration", "7 s", "-o", out]) == 0
    assert capsys.readouterr().out.strip() == out
    with Image.open(out) as animation:
        assert animation.n_frames == 7 * 50 // 3 + 2  # at 1000/60 a second, both ends included


def shaken():
    """Kapitza's pendulum with drag: its pivot moves to and fro."""
    system = System("Shaken pendulum")
    A = system.parameter("depth", "m", default=0.1, positive=True)
    nu = system.parameter("shaking", "rad s-1", default=20.0, positive=True)
    theta = system.coordinate("theta", "rad", bounds=(-4, 4), periodic=True)
    lift = A * sp.cos(nu * system.time)
    system.particle(1, (sp.sin(theta), lift - sp.cos(theta)))
    system.potential(9 * (lift - sp.cos(theta)))
    system.dissipation(system.velocity(theta) ** 2 / 20)
    return system


def van_der_pol():
    """x'' = mu (1 - x²) x' - x: its fast rate is about 3 mu, its slow phase lasts about 0.8 mu."""
    return flow(lambda x, y, mu: (y, mu * (1 - x**2) * y - x), "xy", mu=1.0)


def coupled():
    """Three coordinates whose velocities are all coupled in the kinetic energy."""

    def potential(x, y, z, k):
        return k * (x**2 + y**2 + z**2) / 2 + x * y * z / 3

    def coupling(x, y, z, u, v, w, k):
        return (u * v * sp.cos(z) + v * w + w * u) / 3

    return particle(potential, "xyz", kinetic=coupling, k=1.0)


COUPLED = {"x": 1.0, "y": 0.5, "z": -0.3, "x_dot": 0.2, "y_dot": -1.0, "z_dot": 0.5}
SWING, CYCLE = {"theta": 3.0, "theta_dot": 0.1}, {"x": 2.0, "y": 0.0}
BY_SCIPY = {  # name → system, start, parameters, times, error of SciPy, largest error of ours
    "shaken": (shaken, SWING, {"depth": 0.2}, np.linspace(0, 5, 21), 1e-10, 2e-10),
    # the sine of a time is known to a rounding of its angle, and DOP853's is no better
    "shaken, late": (shaken, SWING, {"depth": 0.2}, 1000 + np.linspace(0, 5, 21), 1e-7, 5e-7),
    # SciPy's inverse of the masses is LAPACK's
    "coupled": (coupled, COUPLED, {"k": 2.0}, np.linspace(0.0, 2.0, 9), 1e-10, 1e-9),
    # an attracting cycle, along which phase errors of each step add up
    **{
        f"van der Pol, {mu:g}": (van_der_pol, CYCLE, {"mu": mu}, np.array([0.0, end]), 1e-7, 1e-9)
        for mu, end in ((1.0, 20.0), (10.0, 40.0), (100.0, 300.0))
    },
}


@pytest.mark.compiled
@pytest.mark.parametrize("name", repeated.but(("shaken", "shaken, late", "van der Pol, 1"), BY_SCIPY))
def test_motions_are_scipys(name):
    """By DOP853 on the description's equations, as SymPy writes them for NumPy."""
    describe, start, parameters, times, error, largest = BY_SCIPY[name]
    system = describe()
    ds, equations = sweeps.motion(system, start, times, parameters=parameters), trajectories.model_of(system).equations
    numbers = [parameters.get(p.name, p.default) for p in system.parameters.values()] or [0.0]
    rates, options = rates_of(equations), {"t_eval": times, "rtol": 1e-13, "atol": 1e-14}
    run = solve_ivp(lambda t, x: rates(numbers, t, x), times[[0, -1]], [*start.values()], "DOP853", **options)
    errors = np.array([ds[f"{name}_error"] for name in start])
    assert ds.status < 2  # it may change by more than the tolerance, which is near the rounding of the time
    assert (np.abs(np.array([ds[name] for name in start]) - run.y) <= errors + error).all()
    assert errors.max() < largest


def test_an_error_covers_solutions_that_agree_at_one_time_by_chance():
    """A ball on a rotating saddle, with linear equations: its motion is a matrix exponential."""
    parameters = {"mass": 1.0368898059619107, "stiffness_x": 1.1666900399586864, "stiffness_y": -0.9432788400989257}
    parameters |= {"drag": 0.0, "spin_rate": 2.075190369888101}
    start = {"x": -0.4705979866637946, "y": -0.08574361402953934}
    start |= {"x_dot": 1.0006409423733347, "y_dot": -0.8768518458101385}
    ds = sweeps.motion("rotating_saddle", start, [3.7, 19.52462184076508], parameters=parameters, tolerance=1e-13)
    with mpmath.workdps(40):
        m, k1, k2, _, W = map(mpmath.mpf, parameters.values())
        matrix = mpmath.zeros(4)
        matrix[0, 2] = matrix[1, 3] = 1
        matrix[2, 0], matrix[3, 1], matrix[2, 3], matrix[3, 2] = W**2 - k1 / m, W**2 - k2 / m, 2 * W, -2 * W
        flow = mpmath.expm(matrix * (mpmath.mpf(19.52462184076508) - mpmath.mpf(3.7)))
        end = flow * mpmath.matrix(list(start.values()))
        for name, exact in zip(start, end, strict=True):
            assert abs(mpmath.mpf(ds[name].values.flat[-1]) - exact) <= ds[f"{name}_error"].values.flat[-1], name


@pytest.mark.slow
def test_an_error_covers_a_halving_that_undoes_a_rounding_of_the_time():
    """A fast drive makes of both the same change of the end, by chance; DOP853 is no better than the motion itself."""
    parameters = {"length": 1.1040558637716897, "gravity": 9.550734903766374, "amplitude": 0.10532819921313218}
    parameters |= {"frequency": 73.5639668043063, "damping": 0.0, "direction": 0.0}
    begin = {"theta": -0.7465117722446646, "theta_dot": -0.7145797210329641}
    times = [0.0, 2.0282120416163303]
    ds = sweeps.motion("kapitza_pendulum", begin, times, parameters=parameters)
    # by Gauss's method of order 16 in long doubles, and by mpmath's odefun in 30 digits
    exact = np.longdouble("0.714118490273320779"), np.longdouble("-6.690191948777583641")
    assert ds.status < 2  # it may change by more than the tolerance, which is near the rounding of the time
    for name, value in zip(begin, exact, strict=True):
        assert abs(float(ds[name][1] - value)) <= ds[f"{name}_error"][1]


@pytest.mark.parametrize("width", [0.3, 1e-2, 1e-6])
def test_no_step_passes_a_pulse(width):
    """From a state at which all terms are 0; also of the time. The result was once 0, with an error of 0."""

    def pulse(u):
        return sp.exp(-(((u - 5) / width) ** 2))

    system = flow(lambda x, y, z: (1, pulse(x), pulse(sp.Symbol("t", real=True))))
    ds = sweeps.motion(system, {"x": 0.0, "y": 0.0, "z": 0.0}, [0.0, 7.0, 10.0])
    for name in "yz":
        assert ds[f"{name}_error"][2] < 1e-6 * width  # a rounding of the place, 1e-15, in the narrowest
        assert abs(ds[name][2] - width * np.sqrt(np.pi)) <= ds[f"{name}_error"][2]


POWERS = ((17, 0.0), (40, 0.0), (40, 1e-9), (40, 1e-3), (100, 0.01), (256, 0.05))


@pytest.mark.parametrize(
    ("n", "begin"), [POWERS[0], *(pytest.param(*case, marks=pytest.mark.slow) for case in POWERS[1:-1]), POWERS[-1]]
)
def test_no_step_passes_the_maxima_of_a_high_power(n, begin):
    """The integral of sin^n over a turn, from a state at which all terms are 0 or small. Once 0, with an error of 0.

    An added exponential of the same argument allows longer steps.
    """
    system = flow(lambda x, y, z: (1, sp.sin(x) ** n, sp.exp(sp.sin(x))))
    ds = sweeps.motion(system, {"x": begin, "y": 0.0, "z": 0.0}, [0.0, 2.0 * np.pi])
    wallis = float(2 * sp.pi * sp.binomial(n, n // 2) / 2**n) if n % 2 == 0 else 0.0
    assert ds.y_error[1] < 1e-12
    assert abs(ds.y[1] - wallis) <= ds.y_error[1]


def test_an_error_covers_a_cosine_that_comes_back_from_large_arguments():
    """The integral of 1/cosh from -5 to 5; the reported error was once a third of the deviation."""
    system = flow(lambda x, y: (1, 1 / sp.cosh(x - 5)), "xy")
    ds = sweeps.motion(system, {"x": 0.0, "y": 0.0}, np.linspace(0.0, 10.0, 5))
    assert abs(ds.y[4] - 4 * np.arctan(np.tanh(2.5))) <= ds.y_error[4] + 4e-16  # roundings of the reference
    assert ds.y_error[4] < 2e-13


@pytest.mark.parametrize("steepness", repeated.but((1000.0,), (10.0, 100.0, 1000.0)))
def test_no_step_passes_a_switch(steepness):
    """A force -tanh(k x) in place of -sign x: v²/2 + ln(2 cosh k x)/k is conserved. Once off by 100 times itself."""
    system = flow(lambda x, v: (v, -sp.tanh(steepness * x)), "xv")
    ds = sweeps.motion(system, {"x": [1.0, 0.5, 0.7, 0.2], "v": [0.0, 0.3, 0.1, -0.3]}, np.linspace(0.0, 10.0, 5))
    energy = ds.v**2 / 2 + np.logaddexp(steepness * ds.x, -steepness * ds.x) / steepness
    assert ds.status.values.tolist() == [0] * 4
    # |force| <= 1; roundings of the energy itself
    assert (abs(energy - energy[:, 0]) <= ds.x_error + abs(ds.v) * ds.v_error + 4e-16).all()


def test_a_motion_that_ends_in_finite_time_is_missing():
    ds = sweeps.motion(flow(lambda x: [x**2], "x"), {"x": [0.5, 2.0]}, [0.0, 0.25, 1.0])
    assert ds["status"].values.tolist() == [0, 2]
    assert ds["x"].values[0] == pytest.approx(1 / (2 - np.array([0.0, 0.25, 1.0])), rel=1e-12)
    assert np.isnan(ds["x"].values[1]).all()


BODY = {"system": [1.0, 2.0, 2.6]}


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"system": "pendulun"}, "system: 'pendulun' is no described system"),
        ({"system": "double_pendulum", "start": {}}, "start: theta1, theta2 are missing"),
        ({"system": "gravity_gradient", "start": {"pitch": 0.1}}, "omega1, omega2, omega3, roll, yaw are missing"),
        ({"system": "pendulum", "start": {"theto": 1, "x": 2}}, "theto is unknown .*; x is unknown; theta is missing"),
        ({"parameters": {"lenght": 1, "mas": 2}}, r"lenght is unknown \(did you mean length\?\); mas is unknown"),
        (
            {"start": {"theta": 0.1, "phi": 1}},
            r"start: phi is unknown; allowed: theta \(rad; required\), theta_dot \(rad s-1; default 0\)",
        ),
        ({"start": {"theta": np.nan}}, "start: theta: nan"),
        ({"start": np.ones(2)}, "start: <ndarray>; allowed: a mapping with theta, theta_dot"),
        ({"start": {"theta": np.zeros((2, 2))}}, "start: theta: <ndarray>"),
        ({"start": {"theta": [1, 2], "theta_dot": [1, 2, 3]}}, "start, parameters: lists of different lengths"),
        ({"times": np.array([0, 1], dtype="m8[ms]")}, "times: allowed: two"),
        ({"times": np.ma.masked_greater([0.0, 1.0, 2.0], 1.5)}, "times: allowed: two"),
        ({"times": [0.0, -1.0]}, "times: allowed: two"),
        ({"parameters": {"length": -1.0}}, "length: -1.0; allowed: a finite number and > 0"),
        ({"tolerance": "1e-9"}, "tolerance: '1e-9'; allowed: 1e-13 to 0.001"),
        (BODY | {"start": [0.0, 0.0, 0.0]}, "at rest"),
        (BODY | {"start": {"axis": 4}}, "start.axis: 4; allowed: 1, 2 or 3"),
        (BODY | {"start": {"axis": np.array([1, 2])}}, "start.axis: <ndarray>; allowed: 1, 2 or 3"),
        (BODY | {"start": [10**400, 0, 1]}, "start.omega1: a whole number of 1329 bits"),
        (BODY | {"start": [1.0]}, "allowed: three angular velocities"),
        (BODY | {"start": [1.0, 2.0, 3.0, 4.0]}, "allowed: three angular velocities"),
        (BODY | {"start": b"fast"}, "allowed: three angular velocities"),
        (BODY | {"start": 2.0}, "start: 2.0; allowed: three angular velocities"),
        (BODY | {"start": {"omega1": 1.0, "axis": 1}}, "allowed: three angular velocities"),
        (BODY | {"start": {"omega1": "1 kg"}}, "start.omega1: '1 kg'; allowed: a finite number, in one of rad s-1"),
        (BODY | {"start": None, "times": "2 kg"}, "times: '2 kg'"),
        (BODY | {"start": None, "times": 0.0}, "allowed: instants, or a duration > 0"),
    ],
)
def test_what_is_wrong_is_named(change, message):
    arguments = {"system": "pendulum", "start": {"theta": 1.0}, "times": [0.0, 1.0]} | change
    with pytest.raises(DefinitionError, match=message):
        sweeps.motion(**arguments)


def test_a_free_body_moves_as_euler_s_equations_say():
    moments, start = np.array([1.0, 2.0, 2.6]), np.array([0.3, 5.0, -0.2])
    ds = sweeps.motion(moments, {f"omega{i + 1}": value for i, value in enumerate(start)}, np.linspace(1.0, 4.0, 31))
    run = euler.rotate(moments, start, 3.0, t_eval=ds.time.values - 1.0)
    np.testing.assert_allclose([ds[f"omega{i}"] for i in (1, 2, 3)], run.y[:3], atol=1e-9)
    assert ds.attrs["frame"] == "principal axes of the body"
    assert ds.q0[0] == 1.0
    assert abs(ds.q1[0]) < 1e-16  # a rounding of a product in it


def test_a_spin_and_its_point_of_a_map_have_the_same_motion():
    grid = {"I1": 1.0, "I2": 2.0, "I3": 2.6, "omega0": 3.0, "epsilon": 0.1, "phase": 0.4}
    point = sweeps.point(sweeps.survey(axes=[2], **grid))
    ours = sweeps.motion([1.0, 2.0, 2.6], {"axis": 2, "omega0": 3.0, "epsilon": "10 %", "phase": 0.4}, "2 s")
    theirs = sweeps.motion(point, times=2.0)
    np.testing.assert_array_equal(ours.q3, theirs.q3)
    assert ours.sizes["time"] == theirs.sizes["time"]  # a body also has its principal axes


def test_a_table_gives_a_run_in_each_row():
    table = pd.DataFrame({"theta": ["10 deg", "20 deg"], "theta_dot": [0.0, 1.0]})
    ours = sweeps.motion("pendulum", table, [0.0, 1.0])
    assert ours.identical(sweeps.motion("pendulum", table.to_dict("list"), [0.0, 1.0]))


def test_a_body_that_rotates_too_often_to_be_integrated_is_refused():
    """Ten million years step by step: once for ever."""
    with pytest.raises(MotionError, match=r"times: the body rotates 3.18e.14 times; allowed: 1e.06 times"):
        sweeps.motion([1.0, 2.0, 2.6], [1.0, 0.0, 0.2], "2e15 s")


@pytest.mark.compiled
@pytest.mark.slow
@pytest.mark.parametrize("mu", [1e4, 1e6])
def test_a_stiff_motion_is_named(mu):
    ds = sweeps.motion(van_der_pol(), CYCLE, [0.0, 2.0 * mu], parameters={"mu": mu})
    assert motions.STATUSES[int(ds.status)] == "stiff"
    assert np.isnan(ds.x).all()


def test_every_status_of_a_motion_has_its_message():
    assert set(trajectories.REASONS) == set(motions.STATUSES) - {"ok"}
