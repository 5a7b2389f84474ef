"""Motions on a report's page, in a browser if there is one, against SciPy, mpmath and the closed form."""

import itertools
import math
import re

import mpmath
import numpy as np
import pytest
from report_pages import parsed, shown_point, state_of
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

import sweeps
from kernels.free import direct, exact
from sweeps.__main__ import main
from sweeps.maps.storage import open_map, write_map
from sweeps.systems.bodies.variables import VERDICTS
from sweeps.systems.rigid_body import spin_outcomes


def test_a_click_shows_the_motion_of_the_point(tab, plane):
    tab.get_by_label("2", exact=True).check()
    tab.evaluate("polhode.choose({ epsilon: null })")  # the map's own, in place of a visible size
    flips = set()
    for cell in ((1, 3), (8, 4), (6, 1)):
        tab.mouse.click(*tab.center(*cell))
        point = shown_point(tab, plane)
        assert float(point.I1) == plane.I1.values[cell[0]]
        period = float(tab.locator("#flip-period").get_attribute("value"))
        true = exact.flip_period(exact.set_up(*np.concatenate(state_of(point))))
        assert period == pytest.approx(true, rel=1e-12)  # both carry all digits; the bar is 1e-6
        assert parsed(tab.locator("#flip-period").text_content()) == pytest.approx(true, rel=1e-6)
        flips.add(period)
        times, *traces = tab.evaluate("(([one, ...more]) => [one.x, one.y, ...more.map(({ y }) => y)])(traces.data)")
        assert times[-1] == tab.evaluate("polhode.motion.end")
        expected = exact.rotation(*state_of(point), times)
        np.testing.assert_allclose(np.transpose(traces), expected, atol=1e-11 * abs(float(point.omega0)))
    assert len(flips) == 3


def test_play_turns_the_body_and_pause_holds_it(tab):
    picture = "document.getElementById('body-canvas').toDataURL()"
    before = tab.evaluate(picture)
    tab.get_by_role("button", name="Play").click()
    tab.until("polhode.motion.t > 0.05 * polhode.motion.end")
    tab.get_by_role("button", name="Pause").click()
    paused_picture = tab.evaluate(picture)
    assert paused_picture != before
    tab.wait_for_timeout(100)
    assert tab.evaluate(picture) == paused_picture
    ball = tab.evaluate(picture.replace("body", "polhode"))
    canvas = tab.locator("#polhode-canvas")
    canvas.drag_to(canvas, source_position={"x": 100, "y": 100}, target_position={"x": 160, "y": 120})
    assert tab.evaluate(picture) != paused_picture
    assert tab.evaluate(picture.replace("body", "polhode")) != ball


def test_only_what_flips_has_a_flip_period(tab, plane):
    outcomes = set()
    for axis in (1, 2, 3):
        tab.get_by_label(str(axis), exact=True).check()
        point = shown_point(tab, plane)
        flips = exact.max_tilt(exact.set_up(*np.concatenate(state_of(point))), axis) > math.pi / 2
        assert tab.locator("#flip-line").is_visible() == flips
        outcomes.add(bool(flips))
    assert outcomes == {True, False}


def assert_motion_is_that_of_scipy(tab, slope, **tolerance):
    """Compare the motion shown with DOP853 of the equations written by hand, from the same start; return both."""
    times, shown, start = tab.evaluate(
        "(({ times, followed, motion }) => [times, followed, motion[0]])(polhode.map.mode)"
    )
    true = solve_ivp(slope, (0, times[-1]), start, "DOP853", times[: len(shown[0])], rtol=1e-12, atol=1e-15).y
    np.testing.assert_allclose(shown, true[: len(shown)], **tolerance)
    return np.array(start), np.array(shown)


@pytest.mark.slow
def test_an_unstable_motion_is_followed_by_its_full_equations(visit_map):
    """A bead at the bottom of a hoop; the nudge is 0.01 rad."""
    grid = {"radius": [0.5, 1.0, 1.5], "spin_rate": [2.0, 6.0]}
    link = "#radius=1&spin_rate=6&equilibrium=bottom&_x=radius&_y=spin_rate"
    tab = visit_map({"system": "bead_on_hoop", "grid": grid}, link)
    slope = lambda t, y: [y[1], (36.0 * math.cos(y[0]) - 9.80665) * math.sin(y[0])]  # noqa: E731
    # its tolerance, 1e-11 rad, grown with the motion a hundredfold out, and as much again back near the bottom
    start, (theta,) = assert_motion_is_that_of_scipy(tab, slope, atol=1e-6)
    along = [0.01, 0.01 * math.sqrt(36.0 - 9.80665)]  # the mode that grows
    np.testing.assert_allclose(start, along, rtol=1e-6)  # slopes by differences of the page's forces
    assert max(theta) > 1
    words = tab.locator("#mode-words").inner_text()
    assert parsed(re.search(r"at most ([\d.]+)", words)[1]) == pytest.approx(max(theta), rel=5e-3)  # three digits
    markers = tab.evaluate(
        "document.getElementById('places-plot').data.filter(({ mode }) => mode === 'markers')"
        ".flatMap((trace) => trace.x.map((x, i) => [x, trace.y[i]]))"
    )
    tilt = math.acos(9.80665 / 36.0)
    assert any(x == 1.0 and y == pytest.approx(tilt, rel=1e-6) for x, y in markers)


@pytest.mark.slow
def test_a_motion_near_l4_is_that_of_two_attracting_bodies(visit_map):
    """In axes that turn with the bodies: their attraction, Coriolis's force and the centrifugal one."""

    def slope(t, state):
        place, velocity = state[:2], state[2:]
        pulls = [
            share * (at - place) / np.hypot(*(at - place)) ** 3 for share, at in ((0.99, [-0.01, 0]), (0.01, [0.99, 0]))
        ]
        return [*velocity, *(place + np.sum(pulls, axis=0) + [2 * velocity[1], -2 * velocity[0]])]

    definition = {"system": "lagrange_points", "grid": {"mass_ratio": [0.01, 0.02]}}
    tab = visit_map(definition, "#mass_ratio=0.01&equilibrium=L4&_epsilon=0.01")
    # its tolerance, 1e-11, over some ten periods of motions that do not grow
    _, shown = assert_motion_is_that_of_scipy(tab, slope, atol=1e-8)
    theory = tab.evaluate("polhode.map.mode.theory")
    np.testing.assert_allclose(theory, shown, atol=2e-3)  # linear theory: ε² and its growth in phase
    assert tab.locator("#mechanism").is_visible()


@pytest.mark.slow
def test_a_shaken_pendulum_stays_upside_down(visit_map):
    grid = {"amplitude": [0.1, 0.2], "frequency": [30.0, 60.0]}
    link = "#amplitude=0.1&frequency=60&equilibrium=inverted&_epsilon=0.1"
    tab = visit_map({"system": "kapitza_pendulum", "grid": grid}, link)
    slope = lambda t, y: [y[1], -(9.80665 - 0.1 * 3600 * math.cos(60 * t)) * math.sin(y[0])]  # noqa: E731
    # its tolerance, 1e-10, of some thousand steps
    start, (theta,) = assert_motion_is_that_of_scipy(tab, slope, atol=1e-7)
    np.testing.assert_allclose(start, [math.pi + 0.1, 0.0], rtol=1e-12, atol=1e-12)
    assert np.abs(theta - np.pi).max() < 0.5
    assert "stay bounded" in tab.locator("#say").inner_text()


@pytest.mark.slow
def test_equations_and_picture_of_the_double_pendulum(visit_map):
    """Against the accelerations of textbooks, solved by hand for equal rods and masses of one."""
    grid = {"mass2": [1.0, 2.0], "length2": [1.0, 2.0], "gravity": 9.8}
    page = visit_map({"system": "double_pendulum", "grid": grid}, "#mass2=1&length2=1")
    theta1, theta2, speed1, speed2 = state = [0.7, -0.4, 1.3, 0.8]
    sine, cosine = math.sin(theta1 - theta2), math.cos(theta1 - theta2)
    pull = -9.8 * (3 * math.sin(theta1) + math.sin(theta1 - 2 * theta2))
    first = pull - 2 * sine * (speed2**2 + speed1**2 * cosine)
    second = 2 * sine * (2 * speed1**2 + 2 * 9.8 * math.cos(theta1) + speed2**2 * cosine)
    expected = np.array([first, second]) / (3 - math.cos(2 * (theta1 - theta2)))
    slope, parts = page.evaluate(
        "(y) => (({ equations: e }) => [e.slope(0, y), e.picture(0, y)])(polhode.map.mode)", state
    )
    np.testing.assert_allclose(slope, [speed1, speed2, *expected], rtol=1e-13)
    upper = [math.sin(theta1), -math.cos(theta1)]
    lower = [upper[0] + math.sin(theta2), upper[1] - math.cos(theta2)]
    places = [[[0.0, 0.0], upper], [upper, lower], [[0.0, 0.0]], [upper], [lower]]
    assert [part["kind"] for part in parts] == ["line", "line", "body", "mass", "mass"]
    for part, points in zip(parts, places, strict=True):
        np.testing.assert_allclose(part["points"], points, rtol=1e-15)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("shape", "moments"),
    [
        ({"a_over_b": [1.2, 1.3], "b_over_c": 1.25}, [(1 + 0.64) / 2.69, (1.69 + 0.64) / 2.69, 1.0]),
        ({"k1": [0.3, 0.5], "k3": 0.2}, [0.5 / 0.9, 0.8 / 0.9, 1.0]),
        ({"I1": [1.0, 2.0], "I2": 2.5, "I3": 4.0}, [0.5, 0.625, 1.0]),
    ],
)
def test_a_body_moves_on_its_orbit_as_scipy_has_it(shape, moments, visit_map):
    """Euler's equations with the torque of a point mass, in quaternions, from the map's reference motion and a tilt."""
    ds = sweeps.survey({"system": "orbit", "grid": {**shape, "eccentricity": [0.05, 0.1]}})
    name, values = next(iter(shape.items()))
    page = visit_map(ds, f"#{name}={values[1]}&eccentricity=0.1&plane=out_of_plane")
    shown, states = page.evaluate("[polhode.orbiting.moments, polhode.orbiting.states]")
    np.testing.assert_allclose(shown, moments, rtol=1e-14)  # a rounding or two
    point = ds.squeeze().sel({name: values[1], "eccentricity": 0.1, "plane": "out_of_plane"})
    np.testing.assert_allclose(states[0][6], 1.1**2 * (1 + float(point.rate_start)), rtol=1e-4)  # cosine of the tilt
    assert np.hypot(*states[0][1:3]) == pytest.approx(0.5e-2 * math.hypot(1, 0.6), rel=1e-4)  # half of the tilt, rad

    def rates(anomaly, state):
        q, w, radius = state[:4], state[4:], 1.0 + 0.1 * math.cos(anomaly)
        u = Rotation.from_quat(np.roll(q, -1)).inv().apply([math.cos(anomaly), math.sin(anomaly), 0.0])
        torque = np.cross(moments * w, w) + 3.0 * radius**3 * np.cross(u, moments * u)
        vector = 0.5 * (q[0] * w + np.cross(q[1:], w))
        return np.concatenate([[-0.5 * q[1:] @ w], vector, torque / moments]) / radius**2

    end = solve_ivp(rates, (0.0, 4 * math.pi), states[0], "DOP853", rtol=1e-12, atol=1e-13).y[:, -1]
    np.testing.assert_allclose(states[480], end, atol=1e-6)  # the page's tolerance, grown over two orbits


def test_a_growing_motion_starts_along_its_floquet_vector(visit_map):
    """x'' + (a - 2 q cos 2t) x = 0 in the first tongue: each period of π multiplies the motion by one multiplier."""
    tab = visit_map({"system": "mathieu", "grid": {"a": [1.0, 1.1], "q": [0.3, 0.5]}}, "#a=1&q=0.5&_epsilon=0.001")
    slope = lambda t, y: [y[1], -(1 - np.cos(2 * t)) * y[0]]  # noqa: E731
    start, _ = assert_motion_is_that_of_scipy(tab, slope, rtol=1e-8, atol=1e-11)  # its tolerance, grown
    period = [solve_ivp(slope, (0, np.pi), e, "DOP853", rtol=1e-12, atol=1e-14).y[:, -1] for e in np.eye(2)]
    values, vectors = np.linalg.eig(np.transpose(period))
    fastest = np.argmax(np.abs(values))
    assert np.abs(values[fastest]) > 1.5
    amplitude = 1e-3 * tab.evaluate("polhode.map.mode.sizes[0]")
    # the matrix on the page is a difference quotient: its vector is off by some 1e-9
    np.testing.assert_allclose(start, amplitude * vectors[:, fastest] / vectors[0, fastest], rtol=1e-7)


@pytest.mark.slow
def test_a_chosen_eigenvalue_moves_in_the_shape_of_its_mode(visit_map):
    """A satellite in the Lagrange region: started in the shape of any other mode, it would leave linear theory."""
    grid = {"k1": [0.55, 0.6], "k3": [0.2, 0.3]}
    tab = visit_map({"system": "gravity_gradient", "grid": grid}, "#k1=0.6&k3=0.3&_epsilon=1e-6")
    words = tab.evaluate("polhode.map.mode.words")
    for number in (2, 1, 3, 4, 5, 6):  # 1 is that with which the page opens
        tab.locator("[data-dimension=eigenvalue] select").select_option(label=str(number))
        tab.until("(words) => polhode.map.mode.words !== words", words)
        tab.wait_for_timeout(300)
        period = f"{2 * math.pi / abs(parsed(tab.row('eigenvalue_imag')[1])):.4g} s"
        assert period in words.replace("\xa0", " ")
        shown = tab.inner_text("#mode-words").replace("\xa0", " ")
        assert shown.startswith(f"Perturbations oscillate with period {period}.")
        followed, theory, rest = tab.evaluate(
            "(({ followed, theory, rest }) => [followed, theory, rest.slice(0, followed.length)])(polhode.map.mode)"
        )
        amplitude = np.abs(np.transpose(followed) - rest).max()
        assert amplitude > 1e-7  # epsilon is 1e-6, over sizes of about 1
        np.testing.assert_allclose(followed, theory, atol=1e-3 * amplitude)  # the integration's error is 1e-4 of it
        assert f"_mode={number}" in tab.evaluate("polhode.link()")


BEADS = """
from sympy import cos, sin
from sweeps.mechanics import System

system = System("Beads on a turning hoop")
W = system.parameter("spin_rate", "rad s-1", default=3.0)
R = system.parameter("radius", "m", default=0.5, positive=True)
q = system.coordinate("angle", "rad", bounds=(-3, 3))
system.particle(1.0, (R * sin(q) * cos(W * system.time), R * sin(q) * sin(W * system.time), -R * cos(q)))
system.potential(-9.81 * R * cos(q))
system.equilibrium("bottom", {q: 0})
"""


@pytest.mark.slow
def test_an_own_system_moves_its_particles_if_the_definition_is_given(visit, pages, tmp_path, monkeypatch, capsys):
    """Without a picture of its own; its file is not run for a report of the map alone."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "beads.py").write_text(BEADS, encoding="utf-8")
    definition = "system: beads.py\ngrid: {spin_rate: [1.0, 2.0], radius: [0.3, 0.5]}\n"
    (tmp_path / "beads.yaml").write_text(definition, encoding="utf-8")
    write_map(sweeps.survey(tmp_path / "beads.yaml"), tmp_path / "map.nc")
    words = ["report", "map.nc", "-o", str(tmp_path / "page.html")]
    assert main(words) == 0
    assert '"equations":null' in (tmp_path / "page.html").read_text(encoding="utf-8")
    assert main([*words, "--definition", "tiny"]) == 2
    assert "is not the map's; allowed: the definition that made the map" in capsys.readouterr().err
    assert main([*words, "--definition", "beads.yaml"]) == 0
    tab = visit(tmp_path / "page.html", "#spin_rate=2&radius=0.5&_epsilon=0.3")
    assert tab.locator("#mechanism-canvas").is_visible()
    angles, places = tab.evaluate(
        """() => {
            const { motion, times, equations } = polhode.map.mode;
            const place = (y, k) => equations.picture(times[k], y, "mass")[0].points[0];
            return [motion.map(([angle]) => angle), motion.map(place)];
        }"""
    )
    expected = 0.5 * np.transpose([np.sin(angles), -np.cos(angles)])
    np.testing.assert_allclose(places, expected, atol=1e-12)  # roundings
    assert np.ptp(angles) > 0.5  # from 0.3 to −0.3


@pytest.mark.slow
def test_a_bodys_own_mesh_turns_and_no_file_is_read_for_it(visit_map, tmp_path):
    trimesh = pytest.importorskip("trimesh")
    trimesh.creation.box((3.0, 2.0, 1.0)).export(tmp_path / "brick.stl")
    mesh = {"file": str(tmp_path / "brick.stl"), "mass": 1.0}
    box = {"name": "Box", "I1": 1.0, "I2": 2.0, "I3": 2.5}
    ds = sweeps.survey({"bodies": [{"name": "Brick", "mesh": mesh}, box], "grid": {"omega0": 1.0, "epsilon": 0.01}})
    write_map(ds, tmp_path / "mesh.nc")
    (tmp_path / "brick.stl").unlink()
    with open_map(tmp_path / "mesh.nc") as map_with_mesh:
        tab = visit_map(map_with_mesh, "#body=Brick&axis=2")
    corners = tab.evaluate("polhode.motion.faces.map((face) => face.corners)")
    half = np.array([1.5, 1.0, 0.5]) / np.linalg.norm([1.5, 1.0, 0.5])
    np.testing.assert_allclose(np.abs(corners), np.broadcast_to(half, (12, 3, 3)), atol=1e-4)  # of 16 bits
    assert tab.locator("#shape").input_value() == "own"
    tab.follow("#body=Box&axis=2")
    assert tab.locator("#shape").input_value() != "own"
    assert tab.locator("#shape option[value=own]").is_disabled()


@pytest.mark.slow
def test_elliptic_functions_of_the_page_against_mpmath(tab):
    """Error of a phase: some 1e-16 of u; 1e-12 is the bar, and dn and cn keep it without further care."""
    parameters = [(m, 1 - m) for m in (0.0, 1e-9, 0.3, 0.5, 0.9, 1 - 1e-6)] + [(1.0, 1e-12)]  # m and its complement
    with mpmath.workdps(40):
        for (m, m1), u in itertools.product(parameters, (0.0, 1e-9, 0.4, 1.9, -3.3, 31.0, 47.0)):
            values = tab.evaluate("([u, m, m1]) => polhode.jacobi(u, m, m1)", [u, m, m1])
            expected = [float(mpmath.ellipfun(kind, u, m=1 - mpmath.mpf(m1))) for kind in ("sn", "cn", "dn")]
            assert values == pytest.approx(expected, abs=1e-12, rel=1e-12)
            K = tab.evaluate("([m, m1]) => polhode.completeK(m, m1)", [m, m1])
            assert pytest.approx(float(mpmath.ellipk(1 - mpmath.mpf(m1))), rel=1e-12) == K
    limit = tab.evaluate("polhode.jacobi(2, 1, 0)")
    assert limit == pytest.approx([math.tanh(2), 1 / math.cosh(2), 1 / math.cosh(2)], rel=1e-15)
    assert tab.evaluate("polhode.completeK(1, 0) === Infinity")


BODIES = {
    "asymmetric": ([1.0, 2.0, 2.7], [1e-4, 10.0, -2e-4]),
    "near the separatrix": ([1.0, 2.0, 3.0], [1e-9, 1.0, 2e-9]),
    "on the separatrix": ([1.0, 2.0, 3.0], [1.0, 0.5, 0.5773502691896258]),
    "oblate": ([1.0, 1.0, 1.8], [0.2, -0.1, 3.0]),
    "prolate, transverse": ([2.0, 2.0, 0.5], [3.0, 1e-3, 2e-3]),
    "sphere": ([1.3, 1.3, 1.3], [0.3, 0.2, -1.0]),
    "principal spin": ([1.0, 2.0, 3.0], [0.0, 2.0, 0.0]),
    "molecule": ([1.0e-47, 1.9e-47, 2.9e-47], [1e9, 1e13, -3e9]),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", BODIES)
def test_rotations_and_attitudes_of_the_page_are_the_closed_form(tab, name):
    moments, start = BODIES[name]
    speed = np.linalg.norm(start)
    times = np.concatenate([np.linspace(0.0, 15.0, 7), np.linspace(-9.0, 200.0, 12)]) / speed
    rates, quaternions = tab.evaluate(
        """([I, w, times]) => {
            const one = new polhode.Trajectory(I, w), attitude = new polhode.Attitude(one);
            return [times.map((t) => one.at(t)), [0, ...times].map((t) => attitude.at(t))];
        }""",
        [moments, start, times.tolist()],
    )
    # the direct solution's own tolerance, grown by up to e^(0.6·15) about the middle axis
    np.testing.assert_allclose(rates[:7], direct.rotation(moments, start, times[:7], 1e-13), atol=1e-9 * speed)
    np.testing.assert_allclose(rates[:7], exact.rotation(moments, start, times[:7]), atol=1e-13 * speed)
    first, *attitudes = (Rotation.from_quat(q, scalar_first=True) for q in quaternions)
    L = np.multiply(moments, start)
    np.testing.assert_allclose(first.apply(L / np.linalg.norm(L)), [0, 0, 1], atol=1e-14)
    for q, expected in zip(attitudes, exact.attitude(moments, start, times), strict=True):
        assert (q.inv() * first * Rotation.from_quat(expected, scalar_first=True)).magnitude() <= 1e-10


SPUN = [(1.0, 1.0, 0.5), (1.0, 1.0, 1.5), (1.0, 2.0, 2.5), (2.5, 1.0, 2.0), (2.0, 2.0, 2.0), (1.0, 1.9, 2.0)]


@pytest.mark.slow
def test_the_page_words_each_spin_as_the_command_does(visit, plane_path):
    page, epsilon = visit(plane_path), 0.9
    for moments in SPUN:
        for spin in spin_outcomes.predict_spins(moments, 10.0, epsilon, 0.6):
            verdict = VERDICTS[spin.regime]
            outcome = page.evaluate("(more) => polhode.axisOutcome(...more)", [moments, spin.axis, 10.0, epsilon, 0.6])
            assert outcome["regime"] == spin.regime
            if linear := spin.e_folding_time or spin.euler_period:
                times_two_pi = 1 if spin.e_folding_time else 2 * math.pi
                assert times_two_pi / outcome["rate"] == pytest.approx(linear, rel=1e-12)  # roundings
            if spin.flip_period:
                assert outcome["period"] == pytest.approx(spin.flip_period, rel=1e-12)
            assert outcome["words"].startswith(f"{verdict.words}: ")
            assert verdict.more in outcome["words"]
            assert bool(outcome["flips"]) == (spin.flip_period is not None)
            page.evaluate(
                "([moments, axis, epsilon]) => polhode.choose({ moments, spin: 10, epsilon, named: null, "
                "place: polhode.state.place.map((k, i) => (polhode.map.order[i] === 'axis' ? axis - 1 : k)) })",
                [moments, spin.axis, epsilon],
            )
            sentence = page.locator("#motion-words").inner_text()
            assert sentence.split(".")[0].split(",")[0].lower() == verdict.words.split(",")[0]
            assert ("wobbles with period" in sentence) == (spin.wobble_period is not None)
            assert ("flips" in sentence) == (spin.flip_period is not None)
            assert ("flat spin" in sentence) == (spin.regime == "stable_minor")
            assert ("drifts away" in sentence) == (spin.regime == "marginal")


THROWS = {
    "symmetric_top": {"grid": {"ratio": [0.4, 1.6], "omega3": [-2.0, 5.0], "half_angle": [10.0, 40.0]}},
    "twist": {"grid": {"I1": 0.3, "I2": 1.0, "I3": 1.2, "chi": [0.01, 0.1]}},
    "tumbling": {"grid": {"I1": 0.3, "I2": 0.8, "I3": 1.0, "energy": [1.1, 2.0]}},
    "dissipative_body": {"grid": {"I1": 1.0, "I2": 2.0, "I3": 2.5, "loss": [0.1, 0.2], "phase": [0.1, 2.0]}},
    "pumped_body": {
        "axes": [3],
        "grid": {"I1": 1.0, "I2": 1.9, "I3": 2.0, "depth2": [0.0, 0.2], "frequency": 0.25, "omega0": 0.5},
    },
}


@pytest.mark.slow
@pytest.mark.parametrize("system", THROWS)
def test_bodies_of_other_systems_move_as_the_command_has_it(visit_map, system):
    """Against DOP853 of the angular momentum's equation from the same start, of changing moments too."""
    end, moments, starts, rates, depth, loss = visit_map({"system": system, **THROWS[system]}).evaluate(
        "(({ end, moments, trajectory, shaken }) => [end, moments, trajectory.at(0), trajectory.at(0.3 * end), "
        "shaken?.depths[1] ?? 0, shaken?.loss ?? 0])(polhode.motion)"
    )
    inertia = lambda t: np.array(moments) * np.array([1, 1 + depth * math.cos(0.25 * t), 1])  # noqa: E731
    L = inertia(0) * starts
    loss /= np.linalg.norm(L)
    slope = lambda t, L: (turn := np.cross(L, L / inertia(t))) + loss * np.cross(L, turn)  # noqa: E731
    true = solve_ivp(slope, (0, 0.3 * end), L, "DOP853", rtol=1e-12, atol=1e-14).y[:, -1] / inertia(0.3 * end)
    # of the page's own integrations, lines between the steps: (2 pi/160)^2/8 of the rates
    atol = 1e-3 if system in ("pumped_body", "dissipative_body") else 1e-8
    np.testing.assert_allclose(rates, true, atol=atol * np.abs(starts).max())
