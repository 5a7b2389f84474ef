"""Discontinuous functions of the time in expressions, and their symbols: switches.

`sign`, `floor` and the conditions of `Piecewise` are constant between jumps. With a symbol in place of each all that is
left of an expression is smooth: |g| is sign(g) g. `sweeps.mechanics.jumps` finds when they jump.
"""

from typing import NamedTuple

import sympy as sp

from sweeps.schema.refusals import DescriptionError


class Switch(NamedTuple):
    """A quantity that is constant between jumps."""

    symbol: sp.Symbol
    value: sp.Expr  #: a function of the time, the parameters and earlier switches
    root: sp.Expr  #: vanishes where the value jumps


def deciding_symbols(function: sp.Expr) -> set[sp.Symbol]:
    """Return the symbols that decide which value a discontinuous function takes."""
    conditions = [condition for _, condition in function.args] if function.func is sp.Piecewise else function.args
    return set().union(*(e.free_symbols for e in conditions))


class Rewriting:
    """Writes expressions with switches in place of discontinuous functions of the time; new switches are added."""

    def __init__(self, time: sp.Symbol, switches: list[Switch], moving: set[sp.Symbol]):
        self.time, self.switches, self.moving = time, switches, moving
        self.rewriters = {
            sp.sign: self._rewrite_sign,
            sp.Abs: lambda g: self._rewrite_sign(g) * g,
            sp.Heaviside: lambda g, _=0: (1 + self._rewrite_sign(g)) / 2,
            sp.Max: lambda *args: self._rewrite_extreme(1, *args),
            sp.Min: lambda *args: self._rewrite_extreme(-1, *args),
            sp.Piecewise: self._rewrite_piecewise,
            sp.floor: self._rewrite_floor,
            sp.ceiling: lambda g: -self._rewrite_floor(-g),
            sp.Mod: lambda g, m: g - m * self._rewrite_floor(g / m),
            sp.frac: lambda g: g - self._rewrite_floor(g),
        }

    def __call__(self, e: sp.Basic) -> sp.Basic:
        """Return the rewritten expression."""
        if not (e.free_symbols & self.moving and e.has(*self.rewriters)):
            return e
        args = [self(arg) for arg in e.args]
        return self.rewriters.get(e.func, e.func)(*args)

    def _depends_on_time(self, e):
        """Return True if an expression contains the time, or a switch, which depends on it."""
        return e.has(self.time, *(s.symbol for s in self.switches))

    def _find_or_add_switch(self, value, root):
        """Return the symbol of the switch with this value; if there is none, add one that jumps at the root's zeros."""
        for switch in self.switches:
            if switch.value == value:
                return switch.symbol
        self.switches.append(Switch(sp.Symbol(f"switch {len(self.switches)}", real=True), value, root))
        return self.switches[-1].symbol

    def _rewrite_sign(self, g):
        """Return sign(g), as a switch if g depends on the time."""
        return self._find_or_add_switch(sp.sign(g), g) if self._depends_on_time(g) else sp.sign(g)

    def _rewrite_floor(self, g):
        """Return floor(g), as a switch if g depends on the time."""
        return self._find_or_add_switch(sp.floor(g), sp.sin(sp.pi * g)) if self._depends_on_time(g) else sp.floor(g)

    def _rewrite_extreme(self, sense, result, *arguments):
        """Return the maximum (`sense` 1) or minimum (-1) of the arguments, by signs of their differences."""
        for argument in arguments:
            result = (result + argument + sense * self._rewrite_sign(result - argument) * (result - argument)) / 2
        return result

    def _rewrite_piecewise(self, *branches):
        """Return Σ indicator · value over the cases; the indicator is 1 for the first condition that is met, else 0."""
        total, unmet = sp.Integer(0), sp.Integer(1)
        for value, condition in branches:
            indicator = self._condition_indicator(condition)
            total, unmet = total + unmet * indicator * value, unmet * (1 - indicator)
        if condition != sp.true:
            raise DescriptionError(f"Piecewise: no value where not {condition}; allowed: a last case, (value, True)")
        return total

    def _condition_indicator(self, condition):
        """Return 1 if a condition is met, else 0: a product for And, a step of a switch for an inequality in time."""
        if isinstance(condition, sp.And):
            return sp.Mul(*map(self._condition_indicator, condition.args))
        if isinstance(condition, sp.Or):
            return 1 - sp.Mul(*(1 - self._condition_indicator(c) for c in condition.args))
        if not self._depends_on_time(condition):
            return sp.Piecewise((1, condition), (0, True))
        if isinstance(condition, sp.Eq | sp.Ne):
            return sp.Integer(isinstance(condition, sp.Ne))  # equal for a moment alone
        return (1 + self._rewrite_sign(condition.gts - condition.lts)) / 2
