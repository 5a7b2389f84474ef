"""Kernels are compiled by our own `njit`, without a change of Numba for its further users."""

import time

import llvmlite.binding as llvm
import pytest
from calls import python

from kernels.compile import jit


def test_a_closure_needs_a_name_of_its_own():
    factor = 2.0
    with pytest.raises(ValueError, match=r"double is a closure; allowed: njit\(name=…\)"):

        @jit.njit()
        def double(x):
            return factor * x

    @jit.njit(name="double")
    def double(x):
        return factor * x

    assert double.__name__ == "double"
    assert double(3.0) == 6.0


@pytest.mark.compiled
def test_a_function_with_a_signature_is_compiled_at_once_and_for_no_other():
    @jit.njit("float64(float64)", **jit.OPTIONS)
    def half(x):
        return x / 2

    assert [str(signature) for signature in half.signatures] == ["(float64,)"]
    assert half(3) == 1.5
    with pytest.raises(TypeError):
        half("a")


@pytest.mark.compiled
def test_a_function_with_a_signature_is_called_by_others_and_not_compiled_into_them():
    new = f"_{time.time_ns()}"  # of code that comes from the cache Numba shows nothing

    @jit.njit("float64(float64)", name="third" + new, **jit.OPTIONS)
    def third(x):
        return x / 3

    @jit.njit("float64(float64)", name="ninth" + new, **jit.OPTIONS)
    def ninth(x):
        return third(third(x))

    lines = ninth.inspect_llvm(ninth.signatures[0]).splitlines()
    assert any(line.startswith("declare") and "third" in line for line in lines)
    assert ninth(9.0) == 1.0


@pytest.mark.compiled
def test_a_product_rounds_by_itself_wherever_it_is_inlined():
    @jit.njit(name="product", **jit.INLINE)
    def product(x, y):
        return x * y

    @jit.njit(name="remainder", **jit.OPTIONS)
    def remainder(x, y, z):
        return product(x, y) + z

    x = 1.0 + 2.0**-30
    assert remainder(x, x, -1.0 - 2.0**-29) == 0.0  # with one rounding for both it would be 2^-60


@pytest.mark.compiled
def test_a_kernel_for_kernels_alone_refuses_to_be_called_by_python():
    @jit.njit("float64(float64)", **jit.INNER)
    def quarter(x):
        return x / 4

    @jit.njit("float64(float64)", name="sixteenth", **jit.OPTIONS)
    def sixteenth(x):
        return quarter(quarter(x))

    assert sixteenth(8.0) == 0.5
    with pytest.raises(TypeError, match="quarter is called by kernels alone"):
        quarter(8.0)


PLAIN = """
import sys
from kernels.compile import jit
assert jit.leave_out_compiler() and jit.is_plain()
from importlib import import_module
for module in "{}".split(): import_module(f"kernels.{{module}}")
assert "numba" not in sys.modules and "llvmlite" not in sys.modules
"""


def test_plain_kernels_load_no_compiler():
    modules = "search.roots flow.spectrum flow.projection near_axis.survey events.tumbling events.twist"
    python(PLAIN.format(modules))


VECTORS = """
import numpy as np
from kernels.compile import jit

@jit.njit("void(float64[::1])", **jit.OPTIONS)
def doubled(S):
    for lane in range(S.size):
        S[lane] = 2.0 * S[lane] + 1.0

print(jit.takes_whole_vectors(), next(iter(doubled.inspect_asm().values())).count("zmm") > 0)
"""


@pytest.mark.slow
@pytest.mark.compiled
@pytest.mark.skipif(not llvm.get_host_cpu_features().get("avx512f"), reason="no vectors of 512 bits here")
@pytest.mark.parametrize(("processor", "features", "whole"), [
    ("icelake-server", "", "True True"), ("skylake-avx512", "", "False False"),
    ("icelake-server", "+avx512f,+avx512vl,+prefer-256-bit", "False False"),  # a user's own features
])  # fmt: skip
def test_vectors_are_whole_where_llvm_takes_half_of_them_and_the_clock_stays(processor, features, whole):
    settings = {"NUMBA_CPU_NAME": processor} | ({"NUMBA_CPU_FEATURES": features} if features else {})
    assert python(VECTORS, **settings).strip() == whole
