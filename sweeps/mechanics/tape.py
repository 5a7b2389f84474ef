"""Expressions as tapes for `kernels.enclosures`: one row an operation, nothing expanded, equal parts once.

What holds no variable is a constant: it is enclosed once a point, by a tape of its own whose variables are the
parameters. A function of parameters alone that no tape has (a Bessel function, `Max`, `Piecewise`) is a number, too:
the one that NumPy or SciPy returns, but for some roundings.
"""

import numpy as np
import sympy as sp

from kernels import codes
from sweeps.mechanics.graph import lambdified
from sweeps.schema.refusals import DescriptionError

FUNCTIONS = (  # in the order of their codes
    *(sp.exp, sp.log, sp.sin, sp.cos, sp.tan, sp.asin, sp.acos, sp.atan),
    *(sp.sinh, sp.cosh, sp.tanh, sp.asinh, sp.acosh, sp.atanh, sp.erf),
)
CODES = dict(zip(FUNCTIONS, range(codes.EXP, codes.ERF + 1), strict=True))
MOST_WHOLE = 1 << 20
OF_LIBRARY = 8.0 * codes.UNIT  # relative error allowed to a function of parameters that NumPy or SciPy evaluates


class Tape:
    """Functions of variables and parameters, ready to be enclosed."""

    def __init__(self, expressions, variables, parameters):
        self.variables, self.parameters = tuple(variables), tuple(parameters)
        self._constants, self._numbers = [], {}
        self._rows: list[tuple[int, int, int]] = []
        self._known: dict = {}
        self.outputs = np.array([self._row(sp.sympify(e)) for e in expressions], dtype=np.int64)
        self.rows = np.array(self._rows, dtype=np.int64).reshape(-1, 3)
        are_numbers = all(e.is_number for e in self._constants)
        self._fixed = None if are_numbers else _Numbers(self._constants, self.parameters)
        self._values = np.array([literal(e) for e in self._constants if are_numbers]).reshape(-1, 2)
        #: whether constants are enclosed for a range of parameters too, and not at single points alone
        self.has_ranges = are_numbers or not self._fixed.evaluated

    def constants(self, parameters, high=None) -> np.ndarray:
        """Return enclosures of the constants, (points, constants, 2), for one array (points,) for each parameter.

        With `high`, for all values of the parameters from the first to these.
        """
        points = max((np.size(p) for p in parameters), default=1)
        if self._fixed:
            return self._fixed.values(parameters, parameters if high is None else high, points)
        return np.ascontiguousarray(np.broadcast_to(self._values, (points, *self._values.shape)))

    def slopes(self, constants, owner, low, high, count=None):
        """Enclose f and its first derivatives, shape (boxes, functions, 1 + count, 2); return the boxes' states too."""
        from kernels import enclosures  # compiled by its import

        count = len(self.variables) if count is None else count
        values = np.empty((owner.size, self.outputs.size, 1 + count, 2))
        states = np.empty(owner.size, dtype=np.int64)
        arrays = _plain(owner, np.int64), _plain(low), _plain(high)
        enclosures.slopes(self.formulas(_plain(constants)), *arrays, values, states)
        return values, states

    def formulas(self, constants) -> codes.Formulas:
        """Return the functions with the constants of points, as kernels take them."""
        return codes.Formulas(self.rows, self.outputs, constants)

    # -- building

    def _add(self, code, a, b=0):
        key = (code, a, b)
        if key not in self._known:
            self._known[key] = len(self._rows)
            self._rows.append(key)
        return self._known[key]

    def _row(self, e):
        if e not in self._known:
            self._known[e] = self._built(e)
        return self._known[e]

    def _built(self, e):
        if not e.free_symbols & set(self.variables):
            return self._constant(e)
        if e.is_Symbol:
            return self._add(codes.VARIABLE, self.variables.index(e))
        if e.is_Add or e.is_Mul:
            return self._joined(e)
        if e.is_Pow and e.base != sp.E:
            return self._power(e)
        if e.is_Pow:
            return self._add(codes.EXP, self._row(e.exp))
        if type(e) in CODES:
            return self._add(CODES[type(e)], self._row(e.args[0]))
        raise DescriptionError(f"{type(e).__name__}: {e} cannot be enclosed; allowed: {allowed()}")

    def _constant(self, e):
        if e not in self._numbers:
            self._numbers[e] = len(self._constants)
            self._constants.append(e)
        return self._add(codes.CONSTANT, self._numbers[e])

    def _joined(self, e):
        code = codes.ADD if e.is_Add else codes.MUL
        fixed = [part for part in e.args if not part.free_symbols & set(self.variables)]
        rows = [self._row(part) for part in e.args if part.free_symbols & set(self.variables)]
        result = rows[0]
        for row in rows[1:]:
            result = self._add(code, result, row)
        return self._add(code, self._constant(e.func(*fixed)), result) if fixed else result

    def _power(self, e):
        if e.exp.is_Integer and abs(int(e.exp)) < MOST_WHOLE:
            return self._add(codes.WHOLE_POWER, self._row(e.base), int(e.exp))
        if e.exp.free_symbols & set(self.variables):
            return self._row(sp.exp(e.exp * sp.log(e.base), evaluate=False))
        return self._add(codes.POWER, self._row(e.base), self._constant(e.exp))


def _plain(x, dtype=np.float64):
    """Return an array as compiled code takes it: contiguous and writable."""
    return np.require(x, dtype, ["C", "W"])


class _Numbers(Tape):
    """A tape whose variables are parameters and whose constants are numbers."""

    def __init__(self, expressions, parameters):
        self.evaluated: list[sp.Expr] = []  #: functions of parameters that no tape has: variables after the parameters
        super().__init__(expressions, parameters, ())
        self._evaluate = lambdified(parameters, self.evaluated)

    def _built(self, e):
        try:
            return super()._built(e)
        except DescriptionError:
            self.evaluated.append(e)
            return self._add(codes.VARIABLE, len(self.variables) + len(self.evaluated) - 1)

    def values(self, low, high, points):
        """Return enclosures, shape (points, expressions, 2)."""
        ends = [np.stack([np.broadcast_to(p, points) for p in end], axis=-1) for end in (low, high)]
        if self.evaluated:
            numbers = np.stack(self._evaluate(*ends[0].T), axis=-1)
            known = np.isfinite(numbers) & (ends[0] == ends[1]).all(axis=1)[:, None]
            error = np.where(known, OF_LIBRARY * np.abs(numbers), np.inf)
            numbers = np.where(known, numbers, 0.0)
            ends = [np.hstack([ends[0], numbers - error]), np.hstack([ends[1], numbers + error])]
        numbers, owner = self.constants([]), np.zeros(points, dtype=np.int64)
        return np.ascontiguousarray(self.slopes(numbers, owner, *ends, 0)[0][:, :, 0])


def literal(e) -> tuple[float, float]:
    """Return two doubles that enclose a number, equal if it is a double."""
    value = float(e)
    if e.is_Float or not np.isfinite(value) or (e.is_Rational and sp.Rational(value) == e):
        return value, value
    return float(np.nextafter(value, -np.inf)), float(np.nextafter(value, np.inf))


def allowed() -> str:
    """Return the allowed parts of an expression, in words."""
    return "+, ×, /, powers and " + ", ".join(f.__name__ for f in FUNCTIONS) + ", sqrt"
