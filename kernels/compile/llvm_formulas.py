"""Formulas of doubles, compiled to LLVM's instructions without Numba's analysis of each operation.

A Taylor step, generated for Euler's equations or for a described system, is up to thousands of statements on numbers.
Numba infers the type of each and lowers each by itself, which takes several times as long as all of LLVM's work. Here
they become LLVM's instructions directly, when the function that calls them is compiled.

A product and a sum or difference become one operation with one rounding if the processor has it (a b + c, and in
a b + c d the last product). The choice depends on the formula alone: the last bits of a formula depend neither on the
caller nor on the functions that were compiled before.
"""

import ast
import inspect
import math
from collections.abc import Callable, Mapping, Sequence
from textwrap import dedent, indent

import numpy as np

from kernels.compile.blocks import LINE, W
from kernels.compile.jit import is_plain

FUNCTIONS = {  # functions that formulas may call, other than formulas → LLVM's name
    **{abs: "llvm.fabs.f64", math.sqrt: "llvm.sqrt.f64", np.sqrt: "llvm.sqrt.f64"},
    **{np.floor: "llvm.floor.f64", math.copysign: "llvm.copysign.f64"},
}
NAMES = {"sqrt": math.sqrt}  # names that lines may use in addition to Python's
COMPARISONS = {ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.Eq: "==", ast.NotEq: "!="}
_formulas = {}  # function → names of its arguments, statements, values of its global names


def formula(function: Callable) -> Callable:
    """Let compiled callers inline a function of doubles; in Python it is unchanged.

    Args:
        function (callable): Assignments to names, then the return of a value or a tuple. Allowed on the right are ``+ -
            * /``, numbers (also as names of the module), comparisons, ``& | ~``, ``a if c else b``, abs, min, max, the
            functions of FUNCTIONS, and formulas defined before. Its positional arguments are doubles, tuples of them,
            or truth values.
    """
    if is_plain():
        return function
    (definition,) = ast.parse(dedent(inspect.getsource(function))).body
    return _register_formula(function, definition)


def parse_formula(name: str, arguments: Sequence[str], text: str, numbers: Mapping) -> Callable:
    """Return a :func:`formula` from lines of text.

    Args:
        name (str): The function's name.
        arguments (sequence of str): Its positional arguments.
        text (str): Its statements.
        numbers (mapping): Name → number, or tuple of numbers, for all further names in the text.
    """
    scope = {"__name__": __name__, **numbers}
    body = ast.parse(f"def {name}({', '.join(arguments)}):\n{indent(text, ' ')}")
    exec(compile(body, name, "exec"), scope)
    return scope[name] if is_plain() else _register_formula(scope[name], body.body[0])


def _register_formula(function, definition):
    """Register a function and its statements with Numba."""
    from numba import float64, types
    from numba.extending import lower_builtin, type_callable

    arguments = [argument.arg for argument in definition.args.args]
    statements = [s for s in definition.body if not isinstance(s, ast.Expr)]  # without the docstring
    _formulas[function] = arguments, statements, function.__globals__
    signature, count = inspect.signature(function), _tuple_length(function)
    result = types.UniTuple(float64, count) if count else float64

    def as_double_type(kind):
        if isinstance(kind, types.BaseTuple):
            return types.UniTuple(float64, len(kind))
        return kind if kind == types.boolean else float64 if isinstance(kind, types.Number) else None

    @type_callable(function)
    def find_type(_):
        """Return the function by which Numba infers a call's type: doubles, truth values and tuples of doubles."""

        def result_type(*kinds):
            doubles = [as_double_type(kind) for kind in kinds]
            return None if None in doubles else result(*doubles)

        result_type.__signature__ = signature
        return result_type

    @lower_builtin(function, types.VarArg(types.Any))
    def generate_code(context, builder, kind, values):
        """Return the LLVM value of a call, its statements written in place."""
        from numba.core import cgutils

        pairs = zip(kind.args, values, strict=True)
        operands = [cgutils.unpack_tuple(builder, v) if isinstance(t, types.BaseTuple) else v for t, v in pairs]
        value = _Writer(builder).call(function, operands)
        return context.make_tuple(builder, kind.return_type, value) if count else value

    return function


def _tuple_length(function):
    """Return the length of the tuple that a formula returns; 0 if it returns a number."""
    _, statements, scope = _formulas[function]
    value = statements[-1].value
    if isinstance(value, ast.Tuple):
        return len(value.elts)
    formula_called = _evaluate_name(value.func, scope) if isinstance(value, ast.Call) else None
    return _tuple_length(formula_called) if formula_called in _formulas else 0


def _evaluate_name(e, scope):
    """Return the value of an expression of names of the module."""
    return eval(compile(ast.Expression(e), "formula", "eval"), scope)


def lines(text: str) -> Callable:
    """Return a function of S, for compiled code, that executes lines of text in each of W lanes.

    Args:
        text (str): Assignments ``name = …`` and ``S[row + lane] = …`` of ``+ - * /``, abs, sqrt, numbers, names that
            were assigned before, and ``S[row + lane]``, row an integer; S is a contiguous array of doubles, and indices
            are not checked.
    """
    if is_plain():  # nothing is compiled, and Python executes the text
        code = compile(text, "lines", "exec")
        return lambda S: [exec(code, {"S": S, "lane": lane, **NAMES}) for lane in range(W)]
    from numba import types
    from numba.extending import intrinsic

    @intrinsic
    def write_lines(_, S):
        """Return the type of a call with the array S, and the function that generates its code."""

        def generate_code(context, builder, signature, arguments):
            """Write the loop over the lanes, with the statements of the text in it."""
            from numba.core import cgutils

            data = context.make_array(S)(context, builder, arguments[0]).data
            _align_stack(builder.function)
            with cgutils.for_range(builder, context.get_constant(types.intp, W)) as loop:
                _Writer(builder, scope=NAMES, data=data, lane=loop.index).write(ast.parse(text).body)
            return context.get_dummy_value()

        return types.none(S), generate_code

    return write_lines


def _align_stack(function):
    """Let the stack be aligned to cache lines, for values that do not fit into registers."""
    function.attributes.add("nounwind")  # llvmlite writes the alignment only if there is an attribute
    function.attributes.alignstack = LINE


class _Writer:
    """Writer of instructions at a builder's position: `variables` are doubles by name, `scope` all further names."""

    def __init__(self, builder, variables=None, scope=None, data=None, lane=None):
        from llvmlite import ir

        self.builder = builder
        self.variables = variables or {}
        self.scope = scope or {}
        self.data = data
        self.lane = lane
        self.double, self.bit, self.long = ir.DoubleType(), ir.IntType(1), ir.IntType(64)
        self._binary = {
            **{ast.Add: builder.fadd, ast.Sub: builder.fsub, ast.Mult: builder.fmul, ast.Div: builder.fdiv},
            **{ast.BitAnd: builder.and_, ast.BitOr: builder.or_},
        }

    def call(self, function, values):
        """Return the value of a formula."""
        arguments, statements, scope = _formulas[function]
        return _Writer(self.builder, dict(zip(arguments, values, strict=True)), scope).write(statements)

    def write(self, statements):
        """Return the value that the text returns, if any."""
        for statement in statements:
            value = self._value(statement.value)
            if isinstance(statement, ast.Return):
                return value
            for target in statement.targets:
                self._assign(target, value)

    def _assign(self, target, value):
        """Store a value under a name, under each name of a tuple, or at S[row + lane]."""
        if isinstance(target, ast.Tuple):
            for element, item in zip(target.elts, value, strict=True):
                self._assign(element, item)
        elif isinstance(target, ast.Name):
            self.variables[target.id] = value
        else:
            self.builder.store(value, self._place(target))

    def _value(self, e):
        """Return the LLVM value of an expression; one without variables becomes a constant."""
        if isinstance(e, ast.Tuple):
            return [self._value(item) for item in e.elts]
        if not any(
            isinstance(item, ast.Name) and (item.id in self.variables or item.id == "S") for item in ast.walk(e)
        ):
            return self._constant(_evaluate_name(e, self.scope))
        return getattr(self, f"_{type(e).__name__.lower()}")(e)

    def _constant(self, value):
        if isinstance(value, tuple):
            return [self._constant(item) for item in value]
        return self.bit(value) if isinstance(value, bool) else self.double(float(value))

    def _name(self, e):
        return self.variables[e.id]

    def _binop(self, e):
        """Return the value of a sum, product or quotient; a b + c is one call, which LLVM may fuse."""
        if isinstance(e.op, ast.Add | ast.Sub):
            for product, summand in ((e.right, e.left), (e.left, e.right)):
                if isinstance(product, ast.BinOp) and isinstance(product.op, ast.Mult):
                    a, b, c = (self._value(item) for item in (product.left, product.right, summand))
                    if isinstance(e.op, ast.Sub):  # c - a b, or a b - c
                        a, c = (self.builder.fneg(a), c) if product is e.right else (a, self.builder.fneg(c))
                    return self._intrinsic("llvm.fmuladd.f64", a, b, c)
        return self._binary[type(e.op)](self._value(e.left), self._value(e.right))

    def _unaryop(self, e):
        value = self._value(e.operand)
        return self.builder.not_(value) if isinstance(e.op, ast.Invert) else self.builder.fneg(value)

    def _compare(self, e):
        (operator,), (right,) = e.ops, e.comparators
        compare = self.builder.fcmp_unordered if isinstance(operator, ast.NotEq) else self.builder.fcmp_ordered
        return compare(COMPARISONS[type(operator)], self._value(e.left), self._value(right))

    def _ifexp(self, e):
        return self._select(self._value(e.test), self._value(e.body), self._value(e.orelse))

    def _select(self, test, if_true, if_false):
        if isinstance(if_true, list):
            return [self._select(test, *pair) for pair in zip(if_true, if_false, strict=True)]
        return self.builder.select(test, if_true, if_false)

    def _call(self, e):
        """Return the value of a call of min, max, a function of FUNCTIONS, or another formula."""
        function = _evaluate_name(e.func, self.scope)
        values = []
        for argument in e.args:
            is_star = isinstance(argument, ast.Starred)
            values += self._value(argument.value) if is_star else [self._value(argument)]
        if function in (min, max):
            a, b = values
            return self.builder.select(self.builder.fcmp_ordered("<" if function is min else ">", b, a), b, a)
        if function in FUNCTIONS:
            return self._intrinsic(FUNCTIONS[function], *values)
        if function not in _formulas:
            allowed = ["min", "max", *(item.__name__ for item in FUNCTIONS)]
            raise NotImplementedError(f"{ast.unparse(e)}: a formula calls {', '.join(allowed)} and formulas")
        return self.call(function, values)

    def _subscript(self, e):
        if isinstance(e.slice, ast.Constant):
            return self._value(e.value)[e.slice.value]
        return self.builder.load(self._place(e))

    def _place(self, e):
        """Return a pointer to S[row + lane]."""
        return self.builder.gep(self.data, [self.builder.add(self.long(e.slice.left.value), self.lane)])

    def _intrinsic(self, name, *values):
        """Return the value of a function of LLVM's own, of doubles."""
        from llvmlite import ir
        from numba.core import cgutils

        kind = ir.FunctionType(self.double, [self.double] * len(values))
        return self.builder.call(cgutils.get_or_insert_function(self.builder.module, kind, name), values)
