"""Motions and answers in the axes of a tensor or a mesh, compared with Euler's equations integrated in these axes."""

import math

import euler
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import sweeps
from sweeps.__main__ import main
from sweeps.schema.refusals import DefinitionError

OMEGAS = ("omega1", "omega2", "omega3")
QUATERNION = ("q0", "q1", "q2", "q3")
TENSOR = [[2.0, -0.5, 0.0], [-0.5, 2.0, 0.1], [0.0, 0.1, 3.0]]


def random_tensor(rng):
    """Return the tensor of a random body in random axes."""
    squares = rng.uniform(0.2, 1.0, 3)
    axes = Rotation.random(random_state=rng).as_matrix()
    return axes @ np.diag(squares.sum() - squares) @ axes.T


def states_of(motion, way=""):
    """Return ω and the axes of space in the body, as `euler.rotate` has them."""
    quaternions = np.transpose([motion[f"{name}{way}"] for name in QUATERNION])
    matrices = Rotation.from_quat(quaternions, scalar_first=True).as_matrix()
    return np.concatenate([[motion[name] for name in OMEGAS], matrices.reshape(-1, 9).T])


def test_a_motion_is_in_the_axes_of_its_tensor():
    rng, times = np.random.default_rng(5401), np.linspace(0.0, 6.0, 61)
    for _ in range(5):
        tensor, omega = random_tensor(rng), rng.normal(size=3)
        attitude = Rotation.random(random_state=rng).as_quat(scalar_first=True)
        start = dict(zip(OMEGAS, omega, strict=True)) | {"attitude": attitude}
        ours = sweeps.motion(tensor.tolist(), start, times)
        axes = Rotation.from_quat(attitude, scalar_first=True).as_matrix()
        expected = euler.rotate(tensor, omega, 6.0, axes, t_eval=times).y
        for way in ("", "_direct"):
            # DOP853 at 1e-12 accumulates some 1e-11 over 6 s; the principal axes are exact to some 1e-15
            np.testing.assert_allclose(states_of(ours, way), expected, atol=1e-9)
        assert ours.attrs["frame"] == "axes of the tensor"
        assert "axis 1 of the tensor" in ours.omega1.attrs["long_name"]


def test_an_exact_motion_about_an_axis_of_a_tensor_is_certified():
    ds = sweeps.motion(TENSOR, [0.1, 0.2, 1.0], "20 s")
    assert sweeps.certify(ds, TENSOR).attrs["verdict"] == "pass"


def test_a_mesh_s_frame_is_that_of_its_file(tmp_path, monkeypatch):
    trimesh = pytest.importorskip("trimesh")
    monkeypatch.chdir(tmp_path)
    turn = Rotation.from_euler("xyz", [20, 35, 50], degrees=True).as_matrix()
    box = trimesh.creation.box((1.0, 2.0, 3.0))
    box.vertices = box.vertices @ turn.T + [4.0, 5.0, 6.0]
    box.export("box.off")
    body = {"mesh": {"file": "box.off", "mass": 12.0}}
    omega, times = turn @ [0.2, 1.0, 0.1], np.linspace(0.0, 5.0, 21)
    ours = sweeps.motion(body, omega, times)
    tensor = turn @ np.diag([13.0, 10.0, 5.0]) @ turn.T  # of a box: m (b² + c²)/12
    # the file has eight decimals or more, so its coordinates are off by 1e-8 at most
    np.testing.assert_allclose(states_of(ours), euler.rotate(tensor, omega, 5.0, t_eval=times).y, atol=1e-6)
    assert ours.attrs["frame"] == "axes of the mesh"
    along = sweeps.body(body, omega=turn[:, 2]).facts["rotation"]
    assert (along["mode"], along["axis"]) == ("principal", 1)


@pytest.mark.parametrize("seed", range(3))
def test_mode_tilts_and_periods_are_those_of_the_integrated_motion(seed):
    rng = np.random.default_rng(5402 + seed)
    tensor, omega = random_tensor(rng), rng.normal(size=3)
    facts = sweeps.body(tensor.tolist(), omega=omega).facts["rotation"]
    moments, axes = np.linalg.eigh(tensor)
    times = np.linspace(0.0, facts["period_psi"], 2001)
    states = euler.rotate(tensor, omega, times[-1], t_eval=times).y
    rates = states[:3].T
    np.testing.assert_allclose(rates[-1], rates[0], atol=1e-8)  # DOP853's error over one period
    # no earlier return: the component about the middle axis changes its sign twice in a period
    assert np.count_nonzero(np.diff(np.signbit(rates @ axes[:, 1]))) == 2
    momentum, energy = np.linalg.norm(tensor @ omega), omega @ tensor @ omega
    is_short_axis = momentum**2 > energy * moments[1]
    assert (facts["mode"], facts["axis"]) == (("short_axis", 3) if is_short_axis else ("long_axis", 1))
    encircled = axes[:, facts["axis"] - 1]
    for name, vectors in (("max_tilt", rates), ("max_nutation", rates @ tensor)):
        angles = np.arccos(np.abs(vectors @ encircled) / np.linalg.norm(vectors, axis=1))
        # 2,000 samples a period miss a maximum by some (2π/2000)²/8 of the range
        assert angles.max() == pytest.approx(facts[name], rel=1e-4)
    # mean precession about L, by the azimuth of an axis after one period
    for name, axis in (("period_phi_long_axis", axes[:, 0]), ("period_phi_encircled", encircled)):
        azimuth = euler.azimuth(euler.in_space(states, axis), tensor @ omega)
        period = 2 * np.pi * facts["period_psi"] / abs(azimuth[-1] - azimuth[0])
        assert period == pytest.approx(facts[name], rel=1e-7)  # DOP853's error over one period


def test_symmetric_bodies_have_the_periods_of_textbooks():
    """Landau and Lifshitz, section 35: in the body Ω = (I3 − I1)/I1 ω3; about L the rate L/I1."""
    for third, mode, axis in ((1.7, "short_axis", 3), (0.4, "long_axis", 1)):
        facts = sweeps.body(np.diag([1.0, 1.0, third]).tolist(), omega=[0.3, 0.0, 2.0]).facts["rotation"]
        momentum = math.hypot(0.3, third * 2.0)
        assert (facts["mode"], facts["axis"]) == (mode, axis)
        # some roundings
        assert facts["period_psi"] == pytest.approx(2 * np.pi / abs((third - 1.0) * 2.0), rel=1e-13)
        assert facts["period_phi_encircled"] == pytest.approx(2 * np.pi / momentum, rel=1e-13)
        assert facts["max_tilt"] == pytest.approx(math.atan2(0.3, 2.0), rel=1e-13)
        assert facts["max_nutation"] == pytest.approx(math.atan2(0.3, third * 2.0), rel=1e-13)


@pytest.mark.parametrize(
    ("body", "omega", "mode", "axis"),
    [
        ([1.0, 2.0, 3.0], [0.0, -1.0, 0.0], "principal", 2),
        ([1.0, 2.0, 2.0], [0.0, 0.6, 0.8], "principal", 3),  # across the axis of a symmetric body
        ([2.0, 2.0, 2.0], [0.3, 0.6, 0.8], "principal", 3),
        ([1.0, 2.0, 3.0], [math.sqrt(3.0), 1.0, 1.0], "separatrix", 2),  # 3 (3 − 2) 1 = 1 (2 − 1) 3
        ([3.0, 2.0, 1.0], [1.0, 0.1, 1.7], "short_axis", 1),
        ([3.0, 2.0, 1.0], [1.0, 0.1, 1.74], "long_axis", 3),
    ],
)
def test_modes(body, omega, mode, axis):
    for factor in (1e-100, 1.0, 1e100):  # units change nothing
        moments, rates = [factor * value for value in body], [value / factor for value in omega]
        facts = sweeps.body(moments, omega=rates).facts["rotation"]
        assert (facts["mode"], facts["axis"]) == (mode, axis)


def test_the_command_answers_for_a_spin_about_any_direction(capsys):
    entries = [str(value) for row in TENSOR for value in row]
    main(["body", "--tensor", *entries, "--omega", "0", "0", "5 rpm"])
    text = " ".join(capsys.readouterr().out.split())
    assert "ω = (0, 0, 0.5236) rad s⁻¹, axes of the tensor" in text
    assert "short-axis mode: ω at most 8.61° and L at most 7.13° from principal axis 3" in text
    separatrix = sweeps.body([1.0, 2.0, 3.0], omega=[math.sqrt(3.0), 1.0, 1.0])
    assert "on the separatrix" in str(separatrix)
    assert "no period" in str(separatrix)
    _, (title, text) = sweeps.body([1.0, 2.0, 3.0], omega=[2.0, 0.1, 0.2]).tables[0][1]
    assert title == "ω = (2, 0.1, 0.2) rad s⁻¹, principal axes of the body"
    assert text.startswith("long-axis mode: ω at most")


def test_the_command_names_the_frame_of_a_motion(tmp_path, capsys):
    entries, path = [str(value) for row in TENSOR for value in row], tmp_path / "spin.csv"
    attitude = ["0.7071", "0", "0.7071", "0"]
    main(["motion", "--tensor", *entries, "--omega", "0", "0", "1", "--attitude", *attitude, "-o", str(path)])
    captured = capsys.readouterr()
    assert captured.out == f"{path}\n"
    assert "in the axes of the tensor" in captured.err
    table = np.genfromtxt(path, delimiter=",", names=True, max_rows=1)
    first = [float(table[name]) for name in ("omega1_rad_s1", "omega3_rad_s1", "q0_1", "q2_1")]
    # omega passes through the principal axes and back; the quaternion is normalised
    np.testing.assert_allclose(first, [0.0, 1.0, math.sqrt(0.5), math.sqrt(0.5)], atol=1e-15)


@pytest.mark.parametrize(
    ("call", "wrong"),
    [
        (lambda: sweeps.body([1.0, 2.0, 3.0], omega=[0, 0, 0]), "omega: .*allowed: three angular velocities"),
        (lambda: sweeps.body([1.0, 2.0, 3.0], omega=[1, 2]), "omega: .*allowed: three angular velocities"),
        (lambda: sweeps.body([1.0, 2.0, 3.0], omega=[1, 2, "3 kg"]), "body: omega: '3 kg'; allowed: a finite number"),
        (lambda: sweeps.body([1.0, 2.0, 3.0], omega=[1, 2, 3], axis=2), "omega: is given beside axis"),
        (lambda: sweeps.body([1.0, 2.0, 3.0], omega=[1, 2, 3], uncertainty=0.1), "omega: is given beside uncertainty"),
        (lambda: sweeps.motion([1.0, 2.0, 3.0], {"attitude": [1, 0, 0]}), "start.attitude: .*a unit quaternion"),
        (lambda: sweeps.motion([1.0, 2.0, 3.0], {"attitude": [1, 1, 0, 0]}), "start.attitude: .*a unit quaternion"),
        (lambda: sweeps.motion([1.0, 2.0, 3.0], {"attitude": ["fast", 0, 0, 0]}), "start.attitude: 'fast'"),
    ],
)
def test_refusals(call, wrong):
    with pytest.raises(DefinitionError, match=wrong):
        call()
