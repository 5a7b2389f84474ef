"""Signatures of Numba's operators are remembered while kernels are compiled, and are the same ones."""

import itertools
import math
import operator

import pytest
from numba import boolean, float32, float64, int64, njit, types
from numba.core.errors import TypingError
from numba.core.registry import cpu_target

from sweeps.run.typing_once import operators_typed_once

OPERATORS = (operator.add, operator.mul, operator.truediv, operator.pow, operator.lt, operator.and_, operator.getitem)
TYPES = (boolean, int64, float32, float64, types.literal(2), float64[::1], float64[:, ::1], types.UniTuple(int64, 2))


def signatures(context):
    """Of every operator for pairs of types; None where there is none."""
    told = {}
    for function, *pair in itertools.product(OPERATORS, TYPES, (int64, float64)):
        try:
            told[function, *pair] = context.resolve_function_type(function, tuple(pair), {})
        except TypingError:
            told[function, *pair] = None
    return told


@pytest.mark.compiled
def test_what_is_remembered_is_what_would_be_found():
    context = cpu_target.typing_context
    find = types.Function.get_call_type
    context.refresh()
    found = signatures(context)
    assert len(set(found.values())) > 15
    with operators_typed_once():
        assert signatures(context) == found
        assert signatures(context) == found
    assert types.Function.get_call_type is find


@pytest.mark.compiled
def test_a_function_is_still_looked_up_for_what_it_is_called_with():
    with operators_typed_once():
        root = njit(lambda x: math.sqrt(x) + x)
        assert root(4) == 6.0
        assert root(2.25) == 3.75
        assert njit(lambda x, at: x[at])((1, 2), 1) == 2
