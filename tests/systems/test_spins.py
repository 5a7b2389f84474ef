"""Spins of free bodies as `body` predicts them, against DOP853 and mpmath, and their words."""

import json
import math

import euler
import mpmath
import numpy as np
import pytest
from calls import python

import sweeps
from kernels.compile import jit
from sweeps.systems.bodies.variables import VERDICTS
from sweeps.systems.motion import format_span
from sweeps.systems.rigid_body.presentation.appearance import APPEARANCE
from sweeps.systems.rigid_body.spin_outcomes import describe_spin, predict_spins

RACKET = (0.00121, 0.01638, 0.01748)  # Brody (1985)


@pytest.mark.parametrize(
    ("moments", "axis", "spun", "regime"),
    [(RACKET, 2, (10.0, 1e-2, 0.6), "unstable"), ((1.0, 1.9, 2.0), 3, (1.0, 0.9, 0.6), "stable_major")],
)
def test_the_flip_period_is_that_of_scipy(moments, axis, spun, regime):
    """A large perturbation also turns over a spin that is stable."""
    spin = predict_spins(moments, *spun)[axis - 1]
    run = euler.rotate(moments, euler.spin(axis, *spun), 60 / abs(spun[0]), events=lambda _, y: y[axis - 1])
    first, second, *_ = run.t_events[0]
    # DOP853 at rtol 1e-12, its error grown e^(λT) ~ 1e3 times until the flip
    assert spin.flip_period == pytest.approx(second - first, rel=1e-8)
    assert (spin.regime, spin.max_tilt > 90) == (regime, True)
    assert ("too large" in describe_spin(spin)) == (regime == "stable_major")


def test_angles_are_given_to_machines_in_rad():
    tilts = [axis["max_tilt"] for axis in sweeps.body("racket").facts["axes"]]
    assert tilts[1] == pytest.approx(math.pi, rel=1e-5)  # it flips
    assert max(tilts[0], tilts[2]) < 1e-5


def test_times_of_linear_theory_are_those_of_mpmath():
    I1, I2, I3 = map(mpmath.mpf, RACKET)
    rate = 10 * mpmath.sqrt((I2 - I1) * (I3 - I2) / (I1 * I3))
    wobbles = [
        20 * mpmath.pi / 100 / mpmath.sqrt((a - b) * (a - c) / (b * c)) for a, b, c in ((I1, I2, I3), (I3, I1, I2))
    ]
    minor, middle, major = predict_spins(RACKET, 10.0, 1e-6, 0.6)
    # a few roundings, the differences of the moments among them
    assert middle.e_folding_time == pytest.approx(float(1 / rate), rel=1e-13)
    assert minor.euler_period == pytest.approx(float(wobbles[0]), rel=1e-13)
    assert major.euler_period == pytest.approx(float(wobbles[1]), rel=1e-13)
    assert [spin.regime for spin in (minor, middle, major)] == ["stable_minor", "unstable", "stable_major"]


def test_symmetric_bodies_and_spheres_neither_wobble_nor_flip():
    sphere = predict_spins((2.0, 2.0, 2.0), 1.0, 1e-6, 0.6)
    assert {(s.regime, s.e_folding_time, s.flip_period, s.euler_period) for s in sphere} == {("sphere", *[None] * 3)}
    top = predict_spins((1.0, 1.0, 2.0), 1.0, 1e-6, 0.6)
    assert [spin.regime for spin in top] == ["marginal", "marginal", "stable_major"]
    assert top[0].e_folding_time is None
    assert top[2].euler_period == pytest.approx(2 * math.pi, rel=1e-15)  # (I3 - I1)/I1 = 1


def turned_about_l(moments, axis, omega0, epsilon, phase):
    """The wobble period and the mean period of the spin axis about L."""
    start = euler.spin(axis, omega0, epsilon, phase)

    def across(_, y):
        return y[axis % 3]

    across.direction = 1.0
    run = euler.rotate(moments, start, 60 / abs(omega0), events=across, dense_output=True)
    first, second = run.t_events[0][:2]
    states = run.sol(np.linspace(first, second, 400))
    angle = euler.azimuth(euler.in_space(states, np.eye(3)[axis - 1]), moments * start)
    return second - first, 2 * math.pi * (second - first) / abs(angle[-1] - angle[0])


@pytest.mark.parametrize(
    ("moments", "axis", "omega0", "epsilon", "phase"),
    [
        ((5.0, 10.0, 13.0), 1, -2.0, 0.3, 2.0),
        ((1.0, 1.9, 2.0), 1, 1.0, 0.9, 0.6),
        ((13.0, 5.0, 10.0), 1, 1.0, 0.5, 3.0),
        (RACKET, 3, 10.0, 0.15, 0.6),
        ((2.0, 2.0, 3.0), 3, 1.0, 0.7, 0.1),
    ],
)
def test_periods_are_those_of_the_motion_with_its_perturbation(moments, axis, omega0, epsilon, phase):
    spin = predict_spins(moments, omega0, epsilon, phase)[axis - 1]
    wobble, about_l = turned_about_l(moments, axis, omega0, epsilon, phase)
    # DOP853 at rtol 1e-12 over some turns
    assert spin.wobble_period == pytest.approx(wobble, rel=1e-8)
    assert spin.precession_period == pytest.approx(about_l, rel=1e-8)
    assert spin.precession_turns == pytest.approx(about_l * abs(omega0) / (2 * math.pi), rel=1e-8)
    text = describe_spin(spin)
    assert f"wobble period {format_span(wobble)} (body frame" in text
    assert f"precession period about L {format_span(about_l)} (inertial frame" in text
    limits = [format_span(limit) for limit in (spin.euler_period, spin.space_period)]
    for period, limit in zip((wobble, about_l), limits, strict=True):
        assert (f"{limit} as ε → 0" in text) == (limit != format_span(period))


def test_periods_at_a_small_perturbation_are_their_limits():
    for axis in (1, 3):
        spin = predict_spins(RACKET, 10.0, 1e-7, 0.6)[axis - 1]
        # the shift is of the order ε², 1e-14; the racket's differences of moments cost two digits
        assert spin.wobble_period == pytest.approx(spin.euler_period, rel=1e-12)
        assert spin.precession_period == pytest.approx(spin.space_period, rel=1e-12)
        assert "ε → 0" not in describe_spin(spin)


@pytest.mark.parametrize(
    ("moments", "axis", "words"),
    [
        ((1.0, 1.0, 0.5), 2, "marginal: two moments are equal, and the axis drifts away in proportion to time"),
        ((1.0, 1.0, 1.5), 1, "marginal: two moments are equal"),
        ((2.0, 2.0, 2.0), 3, "sphere: all moments are equal"),
        ((1.0, 2.0, 2.5), 1, "it ends in a flat spin (major-axis rule)"),
        ((1.0, 1.0, 0.5), 3, "it ends in a flat spin (major-axis rule)"),
        ((1.0, 2.0, 2.5), 2, "unstable: "),
        ((1.0, 2.0, 2.5), 3, "stable, greatest inertia: "),
    ],
)
def test_the_command_words_a_spin_as_its_verdict_does(moments, axis, words):
    spin = predict_spins(moments, 1.0, 0.01, 0.6)[axis - 1]
    text, verdict = describe_spin(spin), VERDICTS[spin.regime]
    assert words in text
    assert text.startswith(f"{verdict.words}: ")
    assert verdict.more in text
    assert APPEARANCE.words(spin.regime) == verdict.words  # of figures, `show` and the page
    assert ("flat spin" in text) == (spin.regime == "stable_minor")


ODD = """
import math
from dataclasses import asdict
from sweeps.systems.rigid_body.spin_outcomes import predict_spins
BODIES = [(0.3, 1.7, 1.1), (2e-3, 1.0, 0.9999), (1.0, 1.0, 2.0), (1.0, 2.0, 2.0), (1.0, 1.0, 1.0), (1.0, 5.0, 9.0)]
BODIES += [(1.0, 2.0, math.nextafter(2.0, 3.0)), (3e-300, 4e-300, 5e-300), (7.0, 5.0, 4.0)]
ASKED = [(1.0, 1e-6, 0.6), (-10.0, 0.3, 2.0), (3.0, 0.0, 0.0), (1e-9, 1e-200, 0.5)]
found = [[asdict(spin) for spin in predict_spins(body, *asked)] for body in BODIES for asked in ASKED]
"""
PLAIN = """
import json, sys
import sweeps
from kernels.compile import jit
assert jit.leave_out_compiler()
"""


def test_plain_kernels_answer_as_the_compiled_ones():
    code = PLAIN + ODD + "assert 'numba' not in sys.modules; print(json.dumps(found))"
    plain = json.loads(python(code))
    compiled: dict = {}
    exec(ODD, compiled)
    for answers, expected in zip(plain, compiled["found"], strict=True):
        for answer, compiled_answer in zip(answers, expected, strict=True):
            for name, value in compiled_answer.items():
                if isinstance(value, float):  # contraction moves a last digit, and decides nothing
                    value = pytest.approx(value, rel=1e-14, abs=0.0, nan_ok=True)
                assert answer[name] == value


def test_a_process_with_numba_keeps_its_kernels_compiled():
    assert not jit.leave_out_compiler()
