"""Durations, and principal axes, in words."""

import math

import pytest

from sweeps.systems.bodies.inertia import Principal, axis_lines, describe_axis
from sweeps.systems.motion import format_span


@pytest.mark.parametrize(
    ("seconds", "words"),
    [
        (5.158e-12, "5.158e-12 s"),
        (0.1126, "0.1126 s"),
        (7199.0, "7199 s"),
        (7200.0, "2 hours"),
        (86164.1, "23.93 hours"),
        (108_000.0, "30 hours"),
        (303.74 * 86400, "303.7 days"),
        (27262.99 * 86400, "27,263 days (74.64 years)"),
        (math.inf, "never"),
    ],
)
def test_durations_come_in_the_unit_that_fits(seconds, words):
    assert format_span(seconds) == words


def test_axes_are_named_where_they_are_the_coordinates():
    assert describe_axis((0.0, 1.0, 0.0)) == "y"
    assert describe_axis((0.0, 0.0, -1.0)) == "−z"
    assert describe_axis((0.6, -0.8, -1e-9)) == "(0.600000, −0.800000, 0.000000)"
    assert describe_axis((0.0, 1.0, 0.0), "file") == "body +y"


def test_principal_axes_take_a_line_each_and_a_note():
    lines = list(axis_lines(Principal((1.0, 2.0, 2.5), ((1, 0, 0), (0, 1, 0), (0, 0, 1)), ("so it is",))))
    assert lines == ["I1 = 1 kg m²  about x", "I2 = 2 kg m²  about y", "I3 = 2.5 kg m²  about z", "note: so it is"]
