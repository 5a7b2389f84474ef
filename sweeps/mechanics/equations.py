"""The equations of motion of a system, x' = f(x, t; p), and what is known of them: forces, slopes, energy, symmetry."""

from dataclasses import dataclass
from functools import cached_property

import sympy as sp

from sweeps.mechanics.description import System

SHORT = 400  # operations: longer expressions are not expanded,
SIMPLE = 80  # and longer ones not simplified
HIGH = 16  # powers above stay as they are
LONG = 1500
NOTHING = sp.Dummy("nothing", real=True)  # stands for the parameters of a system that has none


def expanded(e: sp.Expr) -> sp.Expr:
    """Return an expression expanded if it is short: a long one grows with the product of its sums."""
    return sp.expand(e, power_exp=False) if e.count_ops() <= SHORT else e


def simplify(e: sp.Expr) -> sp.Expr:
    """Simplify an expression but for exponentials and high powers: exp(300 x) would be a polynomial of degree 300."""
    parts = (f for f in e.atoms(sp.exp, sp.Pow) if isinstance(f, sp.exp) or (f.exp.is_Integer and abs(f.exp) > HIGH))
    kept = {
        f: sp.Symbol(f"part {k}", real=True, positive=f.is_positive)
        for k, f in enumerate(sorted(parts, key=sp.default_sort_key))
    }
    return sp.simplify(e.xreplace(kept)).xreplace({symbol: f for f, symbol in kept.items()})


def factors(expressions, moving) -> list[sp.Expr]:
    """Return what does not move of each term of expressions: where all of it vanishes, so do they."""
    terms = [term for e in expressions for term in sp.Add.make_args(sp.expand(e, power_exp=False))]
    return [term.as_independent(*moving, as_Add=False)[0] for term in terms]


@dataclass(eq=False)
class Equations:
    """Rates of the states x; of coordinates x = (q, q̇), and forces stand in place of accelerations, a q̈ = f."""

    system: System  #: the description
    q: tuple[sp.Symbol, ...]  #: symbols of the coordinates that are kept, or of the states
    v: tuple[sp.Symbol, ...]  #: symbols of the velocities, which vanish at an equilibrium; none of states
    f: tuple[sp.Expr, ...]  #: rates of (q, v), of the velocities the forces
    a: sp.Matrix | None  #: kinetic matrix a_ij(q) of coordinates; None for states
    V: sp.Expr  #: effective potential of the coordinates, 0 for states
    #: whether all forces are those of V and of T = ½ a_ij q̇_i q̇_j, so that the motion is the same backwards.
    natural: bool
    hamiltonian: bool  #: whether nothing but T and V makes the forces of coordinates: Hamilton's equations

    def __post_init__(self):
        #: symbols of the parameters, in the description's order, and of the switches, which are constant between jumps
        self.switches = tuple(switch.symbol for switch in self.system.switches)
        self.parameters = (*(p.symbol for p in self.system.parameters.values()),) or (NOTHING,)
        self.parameters += self.switches
        #: the coordinates or states that an equilibrium is a place of
        self.places = self.system.kept or tuple(self.system.states.values())
        self.states = (*self.q, *self.v)  #: symbols of all that moves: coordinates, then velocities; or states
        self.m, self.n = len(self.q), len(self.states)  #: how many these are: of an equilibrium, and of all that moves
        self.still = dict.fromkeys(self.v, sp.Integer(0))  #: the velocities, all zero
        self.forces = self.f[len(self.v) :]  #: forces, or rates of states: what vanishes at an equilibrium, at rest
        #: whether the time stands in the equations, which then need have no equilibrium
        self.timed = any(e.has(self.system.time, *self.switches) for e in (*self.f, self.V, *(self.a or ())))
        #: whether the energy ½ a_ij q̇_i q̇_j + V of coordinates is conserved
        self.conservative = self.hamiltonian and not self.timed

    @cached_property
    def pulls(self) -> tuple[sp.Expr, ...]:
        """Forces at rest, or rates: an expression for each of `places`."""
        return tuple(-self.gradient) if self.natural else tuple(e.subs(self.still) for e in self.forces)

    @cached_property
    def gradient(self) -> sp.Matrix:
        """∂V/∂q_i, shape (m, 1)."""
        return sp.Matrix([self.V.diff(x) for x in self.q])

    @cached_property
    def hessian(self) -> sp.Matrix:
        """V″: ∂²V/∂q_i∂q_j."""
        if self.V.count_ops() <= SIMPLE // 2:  # two derivatives at once are factored too
            return sp.Matrix(self.m, self.m, lambda i, j: self.V.diff(self.q[i], self.q[j]))
        upper = {(i, j): self.gradient[i].diff(self.q[j]) for i in range(self.m) for j in range(i, self.m)}
        return sp.Matrix(self.m, self.m, lambda i, j: upper[min(i, j), max(i, j)])

    @cached_property
    def slopes(self) -> sp.Matrix:
        """Derivatives of the forces or rates by the states, at rest; shape (m, n)."""
        if self.natural:
            return (-self.hessian).row_join(sp.zeros(self.m))
        return sp.Matrix([[e.diff(x).subs(self.still) for x in self.states] for e in self.forces])

    @cached_property
    def third(self) -> tuple[sp.Expr, ...]:
        """All ∂³V/∂q_i∂q_j∂q_k and ∂a_ij/∂q_k: where all vanish, a nudge has no error of first order.

        None where V″ is long: two runs a point are less work than to know.
        """
        if sum(e.count_ops() for e in self.hessian) > LONG:
            return ()
        m = range(self.m)
        cubic = [self.hessian[i, j].diff(self.q[k]) for i in m for j in m[i:] for k in m[j:]]
        return tuple(cubic + [self.a[i, j].diff(x) for i in m for j in m[i:] for x in self.q])

    @cached_property
    def gradients(self) -> sp.Matrix:
        """Derivatives of the conserved quantities by the states, shape (quantities, n)."""
        quantities = list(self.system.conserved_quantities.values())
        return sp.Matrix(len(quantities), self.n, lambda i, j: quantities[i].diff(self.states[j]))

    @cached_property
    def second(self) -> tuple[bool, ...]:
        """Which conserved quantities have no slope at the equilibria, so that they change in second order."""
        defaults = {p.symbol: p.default for p in self.system.parameters.values()}
        without_slope = []
        for row in self.gradients.tolist():
            sizes = []
            for place in self.system.labels.values():
                here = {x: sp.sympify(y).subs(defaults) for x, y in place.items()}
                here |= {s.symbol: s.size.subs(defaults) for s in self.places if s.symbol not in here}
                sizes += [abs(complex(e.subs(defaults).subs(here).evalf())) for e in row]
            without_slope.append(bool(sizes) and max(sizes) < 1e-12)
        return tuple(without_slope)
