"""The attitude against the differential equation in 50 digits, and against a textbook closed form."""

import math

import mpmath as mp
import numpy as np
import precise
import pytest
import repeated
from check_cases import azimuth_by_third_kind, closed_form
from precise import taylor
from scipy.spatial.transform import Rotation

from kernels.free import attitude, direct, exact, rigid_body

ULP = 2.0**-52
CASES = {
    "SAM": ((1, 2, 3), (0.1, 0.2, 1)),
    "LAM": ((1, 2, 3), (-1, 0.2, 0.1)),
    "other order": ((3, 1, 2), (-1, 0.2, -0.1)),
    "one ulp off oblate": ((1, 1 + ULP, 2), (0.3, 0.4, 1)),
    "one ulp off prolate": ((1, 2, 2 * (1 + ULP)), (0.3, 0.4, 1)),
    "one ulp off, across": ((1, 2, 2 * (1 + ULP)), (1e-8, 0.4, 1)),
    "oblate": ((1, 1, 2), (0.3, 0.4, 1)),
    "prolate": ((1, 2, 2), (0.3, 0.4, 1)),
    "sphere": ((1, 1, 1), (0.3, 0.4, 1)),
    "spin about 1": ((1, 2, 3), (1, 0, 0)),
    "spin about 2": ((1, 2, 3), (0, 1, 0)),
    "spin about 3": ((1, 2, 3), (0, 0, -1)),
    "m1 near 1e-15": ((1, 2, 3), (1e-8, 1, 1e-9)),
    "separatrix": ((1, 2, 3), (1.5, 0.3, 1.5 / math.sqrt(3))),
    "slender": ((0.001, 2, 2.0005), (1, 0.4, 0.6)),
}


@pytest.fixture(autouse=True)
def fifty_digits():
    with mp.workdps(50):
        yield


def multiply(a, b):
    return [
        a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
        a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
        a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
        a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
    ]


def angle(quaternion, expected):
    """Angle between two attitudes, rad; ``wanted`` in mpmath numbers. The sign must agree as well."""
    quaternion = [mp.mpf(float(x)) for x in quaternion]
    relative = multiply([quaternion[0], -quaternion[1], -quaternion[2], -quaternion[3]], expected)
    assert relative[0] > 0
    return float(2 * mp.sqrt(mp.fsum(x * x for x in relative[1:])))


def angles_between(a, b):
    """Angles between quaternions (n, 4), rad."""
    vector = a[:, :1] * b[:, 1:] - b[:, :1] * a[:, 1:] - np.cross(a[:, 1:], b[:, 1:])
    return 2 * np.linalg.norm(vector, axis=1)


def bar(start, duration):
    return 1e-14 + 4e-16 * abs(duration) * np.linalg.norm(start)


def in_plain_python(patch):
    """The direct integrator's steps, which take nine seconds to compile; the quick tests take few."""
    for name in ("_take_steps", "turn_12"):
        kernel = getattr(direct, name)
        patch.setattr(direct, name, getattr(kernel, "py_func", kernel))


@pytest.fixture
def plain(monkeypatch):
    in_plain_python(monkeypatch)


@pytest.mark.usefixtures("plain")
@pytest.mark.parametrize("name", repeated.but(("SAM", "LAM", "sphere", "spin about 2"), CASES))
def test_closed_form_and_direct_integration_solve_the_differential_equation(name):
    moments, start = CASES[name]
    for duration in (-2.3, 5.1):
        expected = taylor(moments, start, [duration], order=26, with_attitude=True)[0][3:]
        assert angle(exact.attitude(moments, start, [duration])[0], expected) <= bar(start, duration)
        assert angle(direct.attitude(moments, start, [duration], 1e-13)[0], expected) <= 1e-13


def textbook(moments, start, t):
    """The attitude by the azimuth's integral of the third kind, 50 digits; any time, asymmetric bodies."""
    J, w0 = (np.array([mp.mpf(x) for x in values]) for values in (moments, start))
    ((*q, _, _, _),) = closed_form(J, w0, [mp.mpf(t)], azimuth_by_third_kind)
    return q


def off_textbook(moments, start, t):
    q, expected = exact.attitude(moments, start, [t])[0], textbook(moments, start, t)
    sign = mp.sign(sum(float(x) * y for x, y in zip(expected, q, strict=True)))  # q and -q are one attitude
    return angle(sign * q, expected)


@pytest.mark.parametrize("seed", [3, pytest.param(4, marks=pytest.mark.slow)])
def test_ten_thousand_turns(seed):
    rng = np.random.default_rng(seed)
    for _ in range(3 if seed == 3 else 6):
        moments, start = rng.uniform(0.4, 1.2, 3), rng.normal(size=3)
        t = 2 * np.pi / np.linalg.norm(start) * 10.0 ** rng.uniform(0, 4)
        error, allowed = off_textbook(moments, start, t), bar(start, t)
        if error > allowed:  # the inputs' own roundings rotate the body further, by twice the change of the quaternion
            allowed = 8 * ULP * mp.norm(precise.sensitivity(textbook, moments, start, t))
        assert error <= allowed, (moments, start, t)


def test_far_on_the_separatrix_the_body_spins_on_about_its_middle_axis():
    moments, start = np.array([1.0, 4.0, 6.0]), np.array([1.0, 0.5, math.sqrt(0.25)])
    # N = I3 (I3 - I2) w3^2 - I1 (I2 - I1) w1^2 = 12/4 - 3 = 0 exactly
    assert exact.set_up(*moments, *start).m1 == 0.0
    times = np.array([2e3, 2e3 + 0.1, 1e5, 1e5 + 0.1])
    q = exact.attitude(moments, start, times)
    w2 = exact.rotation(moments, start, times[:1])[0, 1]
    for i in (0, 2):
        rotation = Rotation.from_quat(q[i], scalar_first=True).inv() * Rotation.from_quat(q[i + 1], scalar_first=True)
        # 0.1 s of turning about axis 2; the difference of two times near 1e5 s is known to 1e-11
        np.testing.assert_allclose(rotation.as_rotvec(), [0.0, 0.1 * w2, 0.0], atol=3e-11)


TURNING = [name for name in CASES if name not in ("sphere", "spin about 1", "spin about 2", "spin about 3")]


def step_attitudes(moments, start, h):
    """Return attitudes at 0, h … by the exact step, each from its predecessor, until rounding has grown."""
    top = attitude.prepare(moments, start)
    d, f = top.frame.d, top.frame.side
    arguments = tuple(moments), tuple(start), h
    steps = attitude.short_step_constants(*arguments)
    q = attitude.direction_coefficients(rigid_body.relabel(*exact.short_step_constants(*arguments), d), steps.g)
    (q0, *q_), m = attitude.attitude_at(0.0, top)
    m_d, m_j, m_k = rigid_body.relabel(*(f * x for x in m), d)
    qd, qj, qk = rigid_body.relabel(*(f * x for x in q_), d)
    m, R, size, out = (m_d, f * m_j, m_k), None, 0.5 / (1.0 + m_d), [(q0, *q_)]
    R = multiply((q0, qd, f * qj, qk), (1.0 + m_d, 0.0, -m[2], m[1]))
    # along the unstable axis each rounding grows as e^{pt}
    for _ in range(64 if top.motion.m1 >= 1e-3 else int(2.0 / abs(top.motion.p * top.motion.unit * h))):
        R, m = attitude.step_attitude(m, R, size, steps.x, steps.y), exact.step(*m, *q)
        q0, qd, qj, qk, size = attitude.complete_attitude(m, R)
        out.append((q0, *attitude.by_cyclic_axes(d, f * qd, qj, f * qk)))
    return np.array(out)


@pytest.mark.parametrize("name", repeated.but(("SAM", "m1 near 1e-15", "separatrix"), TURNING))
def test_exact_steps(name):
    moments, start = (np.array(x, dtype=float) / 4 for x in CASES[name])
    for h in (0.04, 1.1):
        attitudes = step_attitudes(moments, start, h)
        times = h * np.arange(float(len(attitudes)))
        expected, bar = exact.attitude(moments, start, times), 2e-15 * np.linalg.norm(start) * times + 1e-14
        assert (angles_between(attitudes, expected) <= bar).all(), (angles_between(attitudes, expected) / bar).max()
        np.testing.assert_allclose(np.linalg.norm(attitudes, axis=1), 1.0, rtol=7e-16)


@pytest.mark.parametrize("function", [exact.attitude, lambda *a, **k: direct.attitude(*a[:3], 1e-10, **k)])
def test_bad_input_is_named(function):
    with pytest.raises(ValueError, match="omega_start must not be zero"):
        function((1, 2, 3), (0, 0, 0), [1.0])
    with pytest.raises(ValueError, match="moments"):
        function((1, 2, -3), (1, 0, 0), [1.0])
