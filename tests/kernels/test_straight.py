"""Straight lines that go to LLVM at once."""

import numpy as np
import pytest
from numba import njit
from numba.core.errors import TypingError

from kernels.jit import EXACT, OPTIONS
from kernels.straight import lines, straight

TEXT = """
a = S[0 + lane]
b = S[4 + lane]
c = -a * 2.5e-3 + abs(b - 1.0) / a
d = c
S[8 + lane] = ((a + b) - c) * d - 0.0
S[0 + lane] = -(b)
"""
THIRD = 1.0 / 3.0


def test_lines_do_what_python_does():
    step = lines(TEXT)

    @njit("void(float64[::1])", **EXACT)
    def run(S):
        for lane in range(4):
            step(S, lane)

    S = np.random.default_rng(3).normal(size=12)
    expected = S.tolist()
    for lane in range(4):
        exec(TEXT, {"S": expected, "lane": lane})
    run(S)
    assert S.tolist() == expected  # nothing contracts here, and each operation rounds as IEEE 754 says


def step(a, b, k):
    """Products and sums that may contract, a number of the module, a name of its own."""
    a1 = (k * THIRD) * (a * b + a * a)
    b1 = k * (a * a1 - b * a)
    return -a1 * b + abs(b1) / 3, (a + 2 * b1) - a1


STEP = (
    "step",
    ("a", "b", "k"),
    "a1 = (k * THIRD) * (a * b + a * a)\nb1 = k * (a * a1 - b * a)\nreturn -a1 * b + abs(b1) / 3, (a + 2 * b1) - a1",
)


@pytest.mark.compiled
def test_a_straight_function_has_the_bits_that_numba_gives_it():
    written, compiled = straight(*STEP, {"THIRD": THIRD}), njit(**OPTIONS)(step)  # Numba compiles it as any other

    @njit("void(float64[:, ::1], float64[:, :, ::1])", **OPTIONS)
    def run(given, out):
        for i in range(len(given)):
            a, b, k = given[i]
            out[i, 0, 0], out[i, 0, 1] = written(a, b, k)
            out[i, 1, 0], out[i, 1, 1] = compiled(a, b, k)

    given, out = np.random.default_rng(5).normal(size=(50, 3)), np.empty((50, 2, 2))
    run(given, out)
    assert (out[:, 0] == out[:, 1]).all()
    plain = np.array([written(*each) for each in given.tolist()])  # Python's own, which rounds every operation
    np.testing.assert_allclose(out[:, 0], plain, rtol=1e-13, atol=1e-15)
    assert (out[:, 0] != plain).any()


@pytest.mark.compiled
def test_a_straight_function_is_called_with_its_own_arguments():
    written = straight(*STEP, {"THIRD": THIRD})
    with pytest.raises(TypingError, match="missing a required argument"):
        njit(lambda a, b: written(a, b))(1.0, 2.0)
    with pytest.raises(TypingError, match="No implementation"):
        njit(lambda a, b: written(a, b, "c"))(1.0, 2.0)
