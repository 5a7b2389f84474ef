import math

import numpy as np
import pytest
from numba import njit

from kernels.free.sincos import MAX_ANGLE, cosine_sine, reduce_angle


@njit(error_model="numpy")
def fill(angles, out):
    for i in range(angles.size):
        out[i, 0], out[i, 1] = cosine_sine(reduce_angle(angles[i]))  # a tuple put into a row takes seconds to compile


def of(angles):
    angles = np.asarray(angles, dtype=float)
    out = np.empty((angles.size, 2))
    fill(angles, out)
    return out


@pytest.mark.parametrize("reach", [1.0, 7.0, 1e3, MAX_ANGLE])
def test_both_are_those_of_the_c_library(reach):
    angles = np.random.default_rng(11).uniform(-reach, reach, 20_000)
    expected = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    # each is within a unit in the last place of the truth
    assert (np.abs(of(angles) - expected) <= 2 * np.spacing(np.abs(expected))).all()
    assert (of(angles) != expected).mean() < 0.06  # and mostly it is the nearest number: one in 30 is not


def test_small_values_beside_multiples_of_a_quarter_turn_keep_their_digits():
    angles = np.arange(-60_000, 60_000, 7) * (0.5 * math.pi)
    expected = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    assert (np.abs(of(angles) - expected) <= 2 * np.spacing(np.abs(expected))).all()


def test_quarter_turns_signs_and_zero():
    assert of([0.0]).tolist() == [[1.0, 0.0]]
    assert of([0.5 * math.pi]).tolist() == [[math.cos(0.5 * math.pi), 1.0]]
    assert of([-math.pi])[0, 0] == -1.0


def test_angles_beyond_reach_keep_their_direction():
    angles = np.array([2e5, -1e9, 1e22])
    # a direction within half a turn is rounded once more
    assert of(angles) == pytest.approx(np.stack([np.cos(angles), np.sin(angles)], axis=1), abs=5e-16)


def test_no_angle_has_no_direction():
    assert np.isnan(of([math.nan, math.inf])).all()
