"""Straight lines of arithmetic, compiled without Numba's own look at each of them.

A Taylor step, written for Euler's equations or for a system of somebody's own, is up to thousands of statements on
numbers. Numba finds the type of each and lowers each by itself, which takes several times as long as all that LLVM does
afterwards. Here they become LLVM's instructions at once, the very ones that Numba makes of them, in a loop that Numba
compiles.
"""

import ast
from collections.abc import Callable, Mapping, Sequence
from inspect import signature
from textwrap import indent

from kernels.blocks import LINE
from kernels.jit import is_plain, widen


def straight(name: str, arguments: Sequence[str], text: str, numbers: Mapping[str, float]) -> Callable:
    """Return a function of doubles that does what lines of text say, for compiled code as for Python.

    Its products and sums may contract, as those of :data:`kernels.jit.OPTIONS`.

    Parameters
    ----------
    name : str
        The function's name.
    arguments : sequence of str
        Its positional arguments.
    text : str
        Assignments ``name = …`` of ``+ - * /``, abs, numbers, and names of arguments, of numbers, and of what was
        assigned before, then the return of a tuple.
    numbers : mapping
        Name → value of further numbers that the text names.
    """
    scope = {"__name__": __name__, **numbers}
    body = ast.parse(f"def {name}({', '.join(arguments)}):\n{indent(text, ' ')}")
    exec(compile(body, name, "exec"), scope)
    function, statements = scope[name], body.body[0].body
    if is_plain():
        return function
    from numba import float64, types
    from numba.extending import lower_builtin, type_callable

    given, called_by = [float64] * len(arguments), signature(function)

    @type_callable(function)
    def find_type(_):
        def typed(*called):
            if all(isinstance(each, types.Number) for each in called):
                return types.UniTuple(float64, len(statements[-1].value.elts))(*given)

        typed.__signature__ = called_by
        return typed

    @lower_builtin(function, *given)
    def generate(context, builder, kind, values):
        writer = _Writer(builder, names=numbers, flags=("contract",))
        writer.known.update(zip(arguments, values, strict=True))
        return context.make_tuple(builder, kind.return_type, writer.write(statements))

    return function


def lines(text: str) -> Callable:
    """A function of S and lane, for compiled code, that does what lines of text say.

    Parameters
    ----------
    text : str
        Assignments ``name = …`` and ``S[row + lane] = …`` of ``+ - * /``, abs, numbers, names that were assigned
        before, and ``S[row + lane]``, row a whole number; S is an array of doubles in one piece, and is not asked for
        its length.
    """
    if is_plain():  # nothing is compiled, and Python reads them itself
        code = compile(text, "lines", "exec")
        return lambda S, lane: exec(code, {"S": S, "lane": lane})
    from numba import types
    from numba.extending import intrinsic

    @intrinsic
    def written(_, S, lane):
        def generate(context, builder, signature, arguments):
            data = context.make_array(S)(context, builder, arguments[0]).data
            _align(builder.function)
            _Writer(builder, data, arguments[1]).write(ast.parse(text).body)
            return context.get_dummy_value()

        return types.none(S, lane), generate

    return written


def _align(function):
    """Let what does not fit into registers lie in whole lines of the cache, and vectors be whole."""
    function.attributes.add("nounwind")  # the alignment is not written beside no attribute
    function.attributes.alignstack = LINE
    widen(function)


class _Writer:
    """Writes instructions where a builder stands, of doubles that `known` holds by name."""

    def __init__(self, builder, data=None, lane=None, names=None, flags=()):
        from llvmlite import ir

        self.builder, self.data, self.lane, self.names, self.flags = builder, data, lane, names or {}, flags
        self.known, self.double, self.long = {}, ir.DoubleType(), ir.IntType(64)
        binary = {ast.Add: builder.fadd, ast.Sub: builder.fsub, ast.Mult: builder.fmul, ast.Div: builder.fdiv}
        self._binary = {operator: (lambda a, b, of=of: of(a, b, flags=flags)) for operator, of in binary.items()}

    def write(self, statements):
        """Values of the tuple that is returned, if one is."""
        for statement in statements:
            if isinstance(statement, ast.Return):
                return [self._value(e) for e in statement.value.elts]
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
            return self.known[e.id] if e.id in self.known else self.double(float(self.names[e.id]))
        if isinstance(e, ast.Constant):
            return self.double(float(e.value))
        if isinstance(e, ast.UnaryOp):
            return self.builder.fsub(self.double(-0.0), self._value(e.operand), flags=self.flags)
        if isinstance(e, ast.Call):
            return self.builder.call(self._fabs(), [self._value(e.args[0])])
        return self.builder.load(self._place(e))

    def _place(self, e):
        """Pointer to S[row + lane]."""
        return self.builder.gep(self.data, [self.builder.add(self.long(e.slice.left.value), self.lane)])

    def _fabs(self):
        from llvmlite import ir
        from numba.core import cgutils

        kind = ir.FunctionType(self.double, [self.double])
        return cgutils.get_or_insert_function(self.builder.module, kind, "llvm.fabs.f64")
