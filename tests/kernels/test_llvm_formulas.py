"""Straight lines that go to LLVM at once."""

import math
from fractions import Fraction

import numpy as np
import pytest
from numba import njit
from numba.core.errors import TypingError

from kernels.compile.blocks import W
from kernels.compile.jit import OPTIONS
from kernels.compile.llvm_formulas import formula, lines, parse_formula

TEXT = """
a = S[0 + lane]
b = S[32 + lane]
c = -a * 2.5e-3 + abs(b - 1.0) / a
d = c
S[64 + lane] = ((a + b) - c) * d - 0.0
S[0 + lane] = -(b)
"""
THIRD = 1.0 / 3.0


def test_lines_do_what_python_does():
    step = lines(TEXT)

    @njit("void(float64[::1])", **OPTIONS)
    def run(S):
        step(S)

    S = np.random.default_rng(3).normal(size=3 * W)
    expected = S.tolist()
    for lane in range(W):
        exec(TEXT, {"S": expected, "lane": lane})
    run(S)
    np.testing.assert_allclose(S, expected, rtol=1e-15)  # a product and a sum are rounded once


def step(a, b, k):
    """Products and sums, a number of the module, a name of its own."""
    a1 = (k * THIRD) * (a * b + a * a)
    b1 = k * (a * a1 - b * a)
    return -a1 * b + abs(b1) / 3, (a + 2 * b1) - a1


STEP = (
    "step",
    ("a", "b", "k"),
    "a1 = (k * THIRD) * (a * b + a * a)\nb1 = k * (a * a1 - b * a)\nreturn -a1 * b + abs(b1) / 3, (a + 2 * b1) - a1",
)


def multiply_add(a, b, c):
    """Return a b + c, rounded once."""
    return float(Fraction(a) * Fraction(b) + Fraction(c))


def fused_step(a, b, k):
    """Return the result of step with products and sums rounded once (fused multiply-add)."""
    a1 = (k * THIRD) * multiply_add(a, a, a * b)
    b1 = k * multiply_add(-b, a, a * a1)
    return multiply_add(-a1, b, abs(b1) / 3), multiply_add(2.0, b1, a) - a1


@pytest.mark.compiled
def test_a_formula_rounds_products_and_sums_once_where_it_says_whoever_calls_it():
    parsed_step, compiled_step = parse_formula(*STEP, {"THIRD": THIRD}), formula(step)

    @njit(**OPTIONS)
    def run(arguments, out):
        for i in range(len(arguments)):
            a, b, k = arguments[i]
            out[i, 0, 0], out[i, 0, 1] = parsed_step(a, b, k)
            first, second = compiled_step(a, b, k)  # not the only use of its parts: LLVM might fuse further operations
            out[i, 1, 0], out[i, 1, 1] = first, second
            out[i, 2, 0] = first * k + second

    arguments, out = np.random.default_rng(5).normal(size=(50, 3)), np.empty((50, 3, 2))
    run(arguments, out)
    assert (out[:, 0] == out[:, 1]).all()
    with_fma, without_fma = (
        np.array([rounded(*each) for each in arguments.tolist()]) for rounded in (fused_step, step)
    )
    assert (out[:, 0] == with_fma).all() or (out[:, 0] == without_fma).all()  # by processors without the operation
    assert (out[:, 2, 0] == out[:, 0, 0] * arguments[:, 2] + out[:, 0, 1]).all()  # rounded twice outside a formula
    assert (with_fma != without_fma).any()


TABLE = (0.25, 2.0)


@formula
def pair_of(a, b):
    return a, b


@formula
def scaled(x, y, k):
    return x * (2 * TABLE[0]), math.copysign(y, k) + pair_of(0.0, 1.0)[1]


@formula
def mixed_formula(pair, angle, back):
    """Selections, comparisons, numbers of the module, a tuple, a truth value, and another formula."""
    x, y = pair
    far = (abs(angle) > TABLE[1]) | ~(angle == angle)
    size = min(math.sqrt(x * x), max(y, -THIRD))
    x, y = (y, -x) if back & ~far else (x, size)
    return scaled(x, y, np.floor(angle))


@pytest.mark.compiled
def test_a_formula_does_what_python_does():
    @njit(**OPTIONS)
    def run(x, y, angle, back):
        return mixed_formula((x, y), angle, back)

    numbers = np.random.default_rng(6).normal(scale=2.0, size=(200, 3)).tolist()
    for x, y, angle in [*numbers, (0.0, -0.0, 3.0), (1.0, 2.0, math.nan), (math.inf, 1.0, -2.0)]:
        for back in (False, True):
            assert run(x, y, angle, back) == mixed_formula((x, y), angle, back)


@pytest.mark.compiled
def test_what_a_formula_may_not_call_is_named():
    @formula
    def sine(x):
        return math.sin(x)

    with pytest.raises(Exception, match=r"math.sin\(x\): a formula calls min, max, abs, sqrt"):
        njit(lambda x: sine(x))(1.0)


@pytest.mark.compiled
def test_a_straight_function_is_called_with_its_own_arguments():
    parsed_step = parse_formula(*STEP, {"THIRD": THIRD})
    with pytest.raises(TypingError, match="missing a required argument"):
        njit(lambda a, b: parsed_step(a, b))(1.0, 2.0)
    with pytest.raises(TypingError, match="No implementation"):
        njit(lambda a, b: parsed_step(a, b, "c"))(1.0, 2.0)
