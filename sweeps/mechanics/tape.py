"""Expressions as tapes for `kernels.search.enclosures`: one row an operation, nothing expanded, equal parts once.

An expression without variables is a constant: it is enclosed once for each point, by a second tape with the parameters
as variables. A function of parameters alone that no tape supports (a Bessel function, `Max`, `Piecewise`) is evaluated
by NumPy or SciPy, with an error of some roundings.
"""

import numpy as np
import sympy as sp

from kernels.search import codes
from sweeps.mechanics.graph import compile_expression
from sweeps.schema.refusals import DescriptionError

FUNCTIONS = (  # in the order of their codes
    *(sp.exp, sp.log, sp.sin, sp.cos, sp.tan, sp.asin, sp.acos, sp.atan),
    *(sp.sinh, sp.cosh, sp.tanh, sp.asinh, sp.acosh, sp.atanh, sp.erf),
)
CODES = dict(zip(FUNCTIONS, range(codes.EXP, codes.ERF + 1), strict=True))
MAX_WHOLE_POWER = 1 << 20
LIBRARY_ROUNDING = 8.0 * codes.UNIT  # relative error allowed to a function of parameters that NumPy or SciPy evaluates


class Tape:
    """Functions of variables and parameters, ready to be enclosed."""

    def __init__(self, expressions, variables, parameters):
        self.variables, self.parameters = tuple(variables), tuple(parameters)
        self._constants, self._constant_indices = [], {}
        self._rows: list[tuple[int, int, int]] = []
        self._rows_by_key: dict = {}
        self.outputs = np.array([self._row(sp.sympify(e)) for e in expressions], dtype=np.int64)
        self.rows = np.array(self._rows, dtype=np.int64).reshape(-1, 3)
        are_numbers = all(e.is_number for e in self._constants)
        self._parameter_tape = None if are_numbers else _Numbers(self._constants, self.parameters)
        self._values = np.array([enclose_number(e) for e in self._constants if are_numbers]).reshape(-1, 2)
        #: True if constants can be enclosed over ranges of parameters, and not only at single points
        self.has_ranges = are_numbers or not self._parameter_tape.numeric_functions

    def constants(self, parameters, high=None) -> np.ndarray:
        """Return enclosures of the constants, shape (points, constants, 2).

        Args:
            parameters: one array (points,) for each.
            high: upper ends of the parameters' ranges, if `parameters` are the lower ends.
        """
        points = max((np.size(p) for p in parameters), default=1)
        if self._parameter_tape:
            return self._parameter_tape.values(parameters, parameters if high is None else high, points)
        return np.ascontiguousarray(np.broadcast_to(self._values, (points, *self._values.shape)))

    def slopes(self, constants, owner, low, high, count=None):
        """Return enclosures of f and its derivatives, (boxes, functions, 1 + count, 2), and state codes, (boxes,).

        Args:
            constants: of points, as of :meth:`constants`.
            owner: the point of each box.
            low: lower ends of the boxes, shape (boxes, variables).
            high: upper ends.
            count: number of variables to differentiate by; by default all.
        """
        from kernels.search import enclosures  # compiled by its import

        count = len(self.variables) if count is None else count
        values = np.empty((owner.size, self.outputs.size, 1 + count, 2))
        states = np.empty(owner.size, dtype=np.int64)
        arrays = _as_kernel_array(owner, np.int64), _as_kernel_array(low), _as_kernel_array(high)
        enclosures.enclose_boxes(self.formulas(_as_kernel_array(constants)), *arrays, values, states)
        return values, states

    def formulas(self, constants) -> codes.Formulas:
        """Return the arguments of kernels: the functions, with the constants of points."""
        return codes.Formulas(self.rows, self.outputs, constants)

    # -- building

    def _add_row(self, code, a, b=0):
        """Return the index of the row (operation code, operands), which is added unless it is there already."""
        key = (code, a, b)
        if key not in self._rows_by_key:
            self._rows_by_key[key] = len(self._rows)
            self._rows.append(key)
        return self._rows_by_key[key]

    def _row(self, e):
        """Return the index of the row of an expression, which is built if it has none."""
        if e not in self._rows_by_key:
            self._rows_by_key[e] = self._build_row(e)
        return self._rows_by_key[e]

    def _build_row(self, e):
        """Add the rows of an expression and return the index of the last; refuse functions that no code encloses."""
        if not e.free_symbols & set(self.variables):
            return self._constant_row(e)
        if e.is_Symbol:
            return self._add_row(codes.VARIABLE, self.variables.index(e))
        if e.is_Add or e.is_Mul:
            return self._build_sum(e)
        if e.is_Pow and e.base != sp.E:
            return self._build_power(e)
        if e.is_Pow:
            return self._add_row(codes.EXP, self._row(e.exp))
        if type(e) in CODES:
            return self._add_row(CODES[type(e)], self._row(e.args[0]))
        raise DescriptionError(f"{type(e).__name__}: {e} cannot be enclosed; allowed: {allowed_words()}")

    def _constant_row(self, e):
        """Return the row of an expression without variables, which becomes a constant of the tape."""
        if e not in self._constant_indices:
            self._constant_indices[e] = len(self._constants)
            self._constants.append(e)
        return self._add_row(codes.CONSTANT, self._constant_indices[e])

    def _build_sum(self, e):
        """Return the row of a sum or product: one operation for each further term, constants joined into one."""
        code = codes.ADD if e.is_Add else codes.MUL
        constant_terms = [term for term in e.args if not term.free_symbols & set(self.variables)]
        rows = [self._row(term) for term in e.args if term.free_symbols & set(self.variables)]
        result = rows[0]
        for row in rows[1:]:
            result = self._add_row(code, result, row)
        return self._add_row(code, self._constant_row(e.func(*constant_terms)), result) if constant_terms else result

    def _build_power(self, e):
        """Return the row of a power: whole, constant, or exp(y log x) if the exponent has a variable."""
        if e.exp.is_Integer and abs(int(e.exp)) < MAX_WHOLE_POWER:
            return self._add_row(codes.WHOLE_POWER, self._row(e.base), int(e.exp))
        if e.exp.free_symbols & set(self.variables):
            return self._row(sp.exp(e.exp * sp.log(e.base), evaluate=False))
        return self._add_row(codes.POWER, self._row(e.base), self._constant_row(e.exp))


def _as_kernel_array(x, dtype=np.float64):
    """Return a contiguous, writable array."""
    return np.require(x, dtype, ["C", "W"])


class _Numbers(Tape):
    """A tape of the constants: its variables are the parameters, and its constants are numbers."""

    def __init__(self, expressions, parameters):
        self.numeric_functions: list[
            sp.Expr
        ] = []  #: functions that no tape supports; they are variables after the parameters
        super().__init__(expressions, parameters, ())
        self._evaluate = compile_expression(parameters, self.numeric_functions)

    def _build_row(self, e):
        """Return the row of an expression; a function that no tape supports becomes a further variable."""
        try:
            return super()._build_row(e)
        except DescriptionError:
            self.numeric_functions.append(e)
            return self._add_row(codes.VARIABLE, len(self.variables) + len(self.numeric_functions) - 1)

    def values(self, low, high, points):
        """Return enclosures for variables from `low` to `high` at so many `points`, (points, expressions, 2)."""
        ends = [np.stack([np.broadcast_to(p, points) for p in end], axis=-1) for end in (low, high)]
        if self.numeric_functions:
            numbers = np.stack(self._evaluate(*ends[0].T), axis=-1)
            is_known = np.isfinite(numbers) & (ends[0] == ends[1]).all(axis=1)[:, None]
            error = np.where(is_known, LIBRARY_ROUNDING * np.abs(numbers), np.inf)
            numbers = np.where(is_known, numbers, 0.0)
            ends = [np.hstack([ends[0], numbers - error]), np.hstack([ends[1], numbers + error])]
        numbers, owner = self.constants([]), np.zeros(points, dtype=np.int64)
        return np.ascontiguousarray(self.slopes(numbers, owner, *ends, 0)[0][:, :, 0])


def enclose_number(e) -> tuple[float, float]:
    """Return two doubles that enclose a number, equal if it is a double."""
    value = float(e)
    if e.is_Float or not np.isfinite(value) or (e.is_Rational and sp.Rational(value) == e):
        return value, value
    return float(np.nextafter(value, -np.inf)), float(np.nextafter(value, np.inf))


def allowed_words() -> str:
    """Return the allowed parts of an expression, in words."""
    return "+, ×, /, powers and " + ", ".join(f.__name__ for f in FUNCTIONS) + ", sqrt"
