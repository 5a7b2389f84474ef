r"""Equations of first order, ẋ = f(x), from any description: what gyroscopes, damping and quasi-velocities need.

Of coordinates, with T = T2 + T1 + T0 in q̇ (T1 = b_i q̇_i), V, a Rayleigh function R and forces Q,

.. math:: a_{ij}\ddot q_j + \Big(\frac{\partial a_{ij}}{\partial q_k} - \frac12\frac{\partial a_{jk}}{\partial q_i}\Big)
          \dot q_j\dot q_k + \Big(\frac{\partial b_i}{\partial q_j} - \frac{\partial b_j}{\partial q_i}\Big)\dot q_j
          + \frac{\partial V}{\partial q_i} = Q_i - \frac{\partial R}{\partial\dot q_i}

and x = (q, q̇). About an equilibrium, with K and B minus the derivatives of the forces by q and q̇, the Jacobian is
[[0, 1], [-a⁻¹K, -a⁻¹B]]. Of states, f is as it is given, and what is conserved is tested in 40 digits.

Source: Landau and Lifshitz, Mechanics, sections 5, 25 and 41; Goldstein, Classical Mechanics, sections 1.5 and 8.3;
Merkin, Introduction to the Theory of Stability, chapter 6.
"""

from dataclasses import dataclass
from functools import cached_property

import mpmath
import numpy as np
import sympy as sp

from sweeps.mechanics import derivation
from sweeps.mechanics.description import DescriptionError, System
from sweeps.mechanics.graph import SECOND

DIGITS = 40
TRIALS = 6  # random places at which what is conserved, and R, are looked at


@dataclass(frozen=True)
class Flow:
    """The equations of first order of a system.

    Attributes:
        system: the description.
        q: symbols of the states, x: for coordinates q, then q̇.
        rest: how many of them (the last ones) are velocities, which vanish at an equilibrium.
        f: rates of the states; for coordinates the forces in place of the accelerations.
        a: kinetic matrix of the coordinates; None for states.
        V: effective potential of the coordinates, 0 for states.
        conservative: whether the energy of coordinates is conserved.
    """

    system: System
    q: tuple[sp.Symbol, ...]
    rest: int
    f: tuple[sp.Expr, ...]
    a: sp.Matrix | None
    V: sp.Expr
    conservative: bool

    kinds = (SECOND,)

    @property
    def n(self) -> int:
        """Number of states."""
        return len(self.q)

    @property
    def parameters(self) -> tuple[sp.Symbol, ...]:
        """Symbols of the parameters, in the description's order."""
        return tuple(p.symbol for p in self.system.parameters.values())

    @property
    def states(self) -> tuple[sp.Symbol, ...]:
        """Symbols of all that moves."""
        return self.q

    @property
    def spelled(self) -> tuple[sp.Expr, ...]:
        """All expressions that a run needs."""
        return (*self.f, self.V, *self.system.conserved_quantities.values())

    @property
    def energy_terms(self) -> tuple[sp.Expr, ...]:
        """The energy of coordinates, where it is conserved."""
        return (self.energy,) if self.conservative else ()

    @property
    def places(self) -> tuple:
        """The coordinates or states that an equilibrium is a place of."""
        return self.system.kept or tuple(self.system.states.values())

    @property
    def still(self) -> dict[sp.Symbol, sp.Integer]:
        """The velocities, all zero."""
        return dict.fromkeys(self.q[self.n - self.rest :], sp.Integer(0))

    @cached_property
    def pulls(self) -> tuple[sp.Expr, ...]:
        """What vanishes at an equilibrium, an expression for each of `places`: forces at rest, or rates."""
        return tuple(e.subs(self.still) for e in self.f[self.rest :]) if self.rest else self.f

    @cached_property
    def slopes(self) -> sp.Matrix:
        """Derivatives of `f` (forces, rates) by the states, at rest; shape (len(places), n)."""
        rows = self.f[self.rest :] if self.rest else self.f
        return sp.Matrix([[e.diff(x).subs(self.still) for x in self.q] for e in rows])

    @property
    def jacobian(self) -> sp.Matrix:
        """The Jacobian at an equilibrium, symbolic; in numbers a⁻¹ is never formed."""
        if not self.rest:
            return self.slopes
        upper = sp.zeros(self.rest, self.rest).row_join(sp.eye(self.rest))
        return upper.col_join(self.a.subs(self.still).inv() * self.slopes)

    @cached_property
    def energy(self) -> sp.Expr:
        """½ a_ij q̇_i q̇_j + V of coordinates."""
        v = sp.Matrix(self.q[self.n - self.rest :])
        return (v.T * self.a * v)[0] / 2 + self.V

    @cached_property
    def second(self) -> tuple[bool, ...]:
        """Which conserved quantities have no slope at the equilibria, so that they change in second order."""
        defaults = {p.symbol: p.default for p in self.system.parameters.values()}
        told = []
        for row in self.gradients.tolist():
            sizes = []
            for place in self.system.labels.values():
                here = {x: sp.sympify(y).subs(defaults) for x, y in place.items()}
                here |= {s.symbol: s.size.subs(defaults) for s in self.places if s.symbol not in here}
                sizes += [abs(complex(e.subs(defaults).subs(here).evalf())) for e in row]
            told.append(bool(sizes) and max(sizes) < 1e-12)
        return tuple(told)

    @cached_property
    def curvatures(self) -> tuple[sp.Matrix, ...]:
        """Second derivatives of the conserved quantities by the states."""
        return tuple(sp.hessian(e, self.q) for e in self.system.conserved_quantities.values())

    @cached_property
    def gradients(self) -> sp.Matrix:
        """Derivatives of the conserved quantities by the states, shape (quantities, n)."""
        quantities = list(self.system.conserved_quantities.values())
        return sp.Matrix(len(quantities), self.n, lambda i, j: quantities[i].diff(self.q[j]))


def is_flow(system: System) -> bool:
    """Whether a description needs equations of first order: damping, forces, states, or gyroscopic terms."""
    if system.states or system.rates or system.dissipation_terms or system.forces or system.conserved_quantities:
        return True
    timed = any(system.time in part.free_symbols for _, place in system.particles for part in place)
    if not (timed or system.kinetic_terms or len(system.kept) < len(system.coordinates)):
        return False  # T is quadratic in q̇
    if len(system.kept) < 2:
        return False  # terms linear in one q̇ are a total derivative
    try:
        _, b, _ = derivation.reduced(system)
    except DescriptionError:
        return False  # said where it is derived
    return derivation.curl(b, tuple(c.symbol for c in system.kept)) is not None


def derive(system: System) -> Flow:
    """The equations of first order of a description.

    Raises:
        DescriptionError: for coordinates beside states, a state without a rate, an unbound symbol, a T that is not of
            degree two in q̇, an R of another degree or negative somewhere, and a conserved quantity that is not.
    """
    if system.states and (system.coordinates or system.particles or system.kinetic_terms):
        raise DescriptionError("states: beside coordinates; allowed: equations of first order, or T and V, not both")
    flow = _of_states(system) if system.states or system.rates else _of_coordinates(system)
    _check_conserved(flow)
    return flow


# -- coordinates


def _of_coordinates(system):
    if system.conserved_quantities:
        name = next(iter(system.conserved_quantities))
        raise DescriptionError(
            f"conserved {name}: beside coordinates; allowed: beside states (their energy is watched)"
        )
    if not system.kept:
        raise DescriptionError("coordinates: there is none; allowed: one at least that is not cyclic")
    a, b, V = derivation.reduced(system)
    q = tuple(c.symbol for c in system.kept)
    v = tuple(c.velocity for c in system.kept)
    R, Q = sum(system.dissipation_terms, sp.Integer(0)), system.forces
    _check_forces(system, R)
    quadratic = derivation.Equations(system, q, v, a, V)
    derivation.check_positive(quadratic)
    forces = []
    for i, x in enumerate(q):
        gyroscopic = sum((b[i].diff(q[j]) - b[j].diff(x)) * v[j] for j in range(len(q)))
        force = Q.get(x, sp.Integer(0)) - R.diff(v[i])
        forces.append(force - sp.simplify(gyroscopic) - quadratic.gradient[i] - quadratic.velocity_terms[i])
    conservative = R == 0 and not Q
    return Flow(system, (*q, *v), len(q), (*v, *forces), a, V, conservative)


def _check_forces(system, R):
    known = {p.symbol for p in system.parameters.values()}
    known |= {x for c in system.kept for x in (c.symbol, c.velocity)}
    for where, e in [("R", R)] + [(f"force on {x}", e) for x, e in system.forces.items()]:
        _check_expression(where, e, known)
    if cyclic := [x for x in system.forces if x not in {c.symbol for c in system.kept}]:
        raise DescriptionError(f"force: {cyclic[0]} has a momentum that is kept; allowed: the other coordinates")
    v = [c.velocity for c in system.kept]
    if R != 0 and not (R.is_polynomial(*v) and sp.Poly(R, *v).total_degree() <= 2):
        raise DescriptionError(f"R: not of degree two in the velocities ({R}); allowed: Rayleigh's function ½ c_ij q̇q̇")
    for values in _trials(system, known):
        if float(sp.re(R.subs(values).evalf())) < -1e-12:
            told = ", ".join(f"{x} = {float(y):.3g}" for x, y in values.items() if x in R.free_symbols)
            raise DescriptionError(f"R: negative at {told}; allowed: R ≥ 0 everywhere, for it takes energy away")


def _check_expression(where, e, known):
    """Refuse symbols that are not known, and what is complex or infinite."""
    if e.has(sp.nan, sp.zoo, sp.oo, -sp.oo, sp.I):
        raise DescriptionError(f"{where}: {e} is complex or infinite; allowed: real, finite expressions")
    if unbound := sorted(map(str, e.free_symbols - known)):
        names = ", ".join(sorted(map(str, known)))
        raise DescriptionError(f"{where}: unbound symbol {', '.join(unbound)}; allowed: {names}")


def _trials(system, known):
    """Values of symbols at random: parameters near their defaults, all else within its bounds."""
    rng = np.random.default_rng(0)
    for _ in range(TRIALS):
        values = {}
        for p in system.parameters.values():
            value = p.default * (1.0 + 0.1 * rng.random())
            values[p.symbol] = sp.Float(value if p.allows(value) else p.default, DIGITS)
        ends = dict(values)
        for place in (*system.kept, *system.states.values()):
            low, high = (sp.re(bound.subs(ends).evalf(DIGITS)) for bound in place.bounds)
            values[place.symbol] = low + (high - low) * sp.Float(rng.random(), DIGITS)
            if hasattr(place, "velocity"):
                values[place.velocity] = sp.Float(rng.normal(), DIGITS)
        yield {x: y for x, y in values.items() if x in known}


# -- states


def _of_states(system):
    missing = [s.name for s in system.states.values() if s.symbol not in system.rates]
    if missing or not system.states:
        told = f"rate of {missing[0]}: is missing" if missing else "states: there is none"
        raise DescriptionError(f"{told}; allowed: system.rate(x, f) for each state")
    if system.dissipation_terms or system.forces or system.potential_terms:
        raise DescriptionError("states: beside a potential, R or a force; allowed: all forces within the rates")
    parameters = {p.symbol for p in system.parameters.values()}
    known = parameters | {s.symbol for s in system.states.values()}
    found = [(f"rate of {x}", e, known) for x, e in system.rates.items()]
    found += [(f"conserved {name}", e, known) for name, e in system.conserved_quantities.items()]
    for s in system.states.values():
        found += [(f"bounds and size of {s.name}", e, parameters) for e in (*s.bounds, s.size)]
    for label, place in system.labels.items():
        found += [(f"equilibrium {label}", e, parameters) for e in place.values()]
    for where, e, allowed in found:
        _check_expression(where, e, allowed)
    symbols = tuple(s.symbol for s in system.states.values())
    f = tuple(system.rates[x] for x in symbols)
    return Flow(system, symbols, 0, f, None, sp.Integer(0), False)


def _check_conserved(flow):
    """dC/dt = ∂C/∂x · f at random places, in 40 digits, beside the sum of its terms' absolute values."""
    system = flow.system
    known = {*flow.parameters, *flow.q}
    for name, quantity in system.conserved_quantities.items():
        terms = [quantity.diff(x) * f for x, f in zip(flow.q, flow.f, strict=True)]
        for values in _trials(system, known):
            with mpmath.workdps(DIGITS):
                numbers = [complex(t.subs(values).evalf(DIGITS)) for t in terms]
                total = abs(complex(sum(terms, sp.Integer(0)).subs(values).evalf(DIGITS)))
            if total > 1e-12 * sum(map(abs, numbers)):
                raise DescriptionError(
                    f"conserved {name}: its rate of change is {total:.3g} at a place within the bounds, of terms of "
                    f"{sum(map(abs, numbers)):.3g}; allowed: what the rates leave constant"
                )
