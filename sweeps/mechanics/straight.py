"""Straight lines of arithmetic, compiled without Numba's own look at each of them.

A step that was written for a system is thousands of statements on numbers. Numba finds the type of each and lowers each
by itself, which takes several times as long as all that LLVM does afterwards. Here they become LLVM's instructions at
once, the very ones that Numba makes of them, in a loop that Numba compiles.
"""

import ast
from collections.abc import Callable

from llvmlite import ir
from numba import config, types
from numba.core import cgutils
from numba.extending import intrinsic

from kernels.blocks import LINE

DOUBLE, LONG = ir.DoubleType(), ir.IntType(64)


def lines(text: str) -> Callable:
    """A function of S and lane, for compiled code, that does what lines of text say.

    Args:
        text: assignments ``name = …`` and ``S[row + lane] = …`` of +, -, *, /, abs, numbers, names that were assigned
            before, and ``S[row + lane]``, row a whole number; S is an array of doubles in one piece, and is not asked
            for its length.
    """
    if config.DISABLE_JIT:  # nothing is compiled, and Python reads them itself
        code = compile(text, "lines", "exec")
        return lambda S, lane: exec(code, {"S": S, "lane": lane})

    @intrinsic
    def straight(typing, S, lane):
        def generate(context, builder, signature, arguments):
            data = context.make_array(S)(context, builder, arguments[0]).data
            _align(builder.function)
            _Writer(builder, data, arguments[1]).write(text)
            return context.get_dummy_value()

        return types.none(S, lane), generate

    return straight


def _align(function):
    """Let what does not fit into registers lie in whole lines of the cache."""
    function.attributes.add("nounwind")  # the alignment is not written beside no attribute
    function.attributes.alignstack = LINE


class _Writer:
    """Writes instructions where a builder stands; names → values in `known`."""

    def __init__(self, builder, data, lane):
        self.builder, self.data, self.lane, self.known = builder, data, lane, {}
        self._binary = {ast.Add: builder.fadd, ast.Sub: builder.fsub, ast.Mult: builder.fmul, ast.Div: builder.fdiv}

    def write(self, text):
        for statement in ast.parse(text).body:
            (target,) = statement.targets
            value = self._value(statement.value)
            if isinstance(target, ast.Name):
                self.known[target.id] = value
            else:
                self.builder.store(value, self._place(target))

    def _value(self, e):
        if isinstance(e, ast.BinOp):
            return self._binary[type(e.op)](self._value(e.left), self._value(e.right))
        if isinstance(e, ast.Name):
            return self.known[e.id]
        if isinstance(e, ast.Constant):
            return ir.Constant(DOUBLE, float(e.value))
        if isinstance(e, ast.UnaryOp):
            return self.builder.fsub(ir.Constant(DOUBLE, -0.0), self._value(e.operand))
        if isinstance(e, ast.Call):
            return self.builder.call(self._fabs(), [self._value(e.args[0])])
        return self.builder.load(self._place(e))

    def _place(self, e):
        """Pointer to S[row + lane]."""
        row = ir.Constant(LONG, e.slice.left.value)
        return self.builder.gep(self.data, [self.builder.add(row, self.lane)])

    def _fabs(self):
        kind = ir.FunctionType(DOUBLE, [DOUBLE])
        return cgutils.get_or_insert_function(self.builder.module, kind, "llvm.fabs.f64")
