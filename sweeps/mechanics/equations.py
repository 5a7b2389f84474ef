"""The equations of motion of a system, x' = f(x, t; p), with forces, slopes, energy and symmetries."""

from dataclasses import dataclass
from functools import cached_property

import sympy as sp

from sweeps.mechanics.description import System

MAX_EXPANDED_OPERATIONS = 400  # longer expressions are not expanded: they grow with the product of their sums
MAX_SIMPLIFIED_OPERATIONS = 80  # longer expressions are not simplified: SymPy takes too long
MAX_SIMPLIFIED_POWER = 16  # higher powers are not expanded in simplifying
MAX_THIRD_OPERATIONS = 1500  # operations of V″ up to which its derivatives are computed
NO_PARAMETER = sp.Dummy("nothing", real=True)  # the only parameter of a system without parameters


def expand_short(e: sp.Expr) -> sp.Expr:
    """Return an expression, expanded if it is short."""
    return sp.expand(e, power_exp=False) if e.count_ops() <= MAX_EXPANDED_OPERATIONS else e


def simplify(e: sp.Expr) -> sp.Expr:
    """Simplify an expression except exponentials and high powers: exp(300 x) would become a polynomial."""
    steep_terms = (
        f
        for f in e.atoms(sp.exp, sp.Pow)
        if isinstance(f, sp.exp) or (f.exp.is_Integer and abs(f.exp) > MAX_SIMPLIFIED_POWER)
    )
    placeholders = {
        f: sp.Symbol(f"part {k}", real=True, positive=f.is_positive)
        for k, f in enumerate(sorted(steep_terms, key=sp.default_sort_key))
    }
    return sp.simplify(e.xreplace(placeholders)).xreplace({symbol: f for f, symbol in placeholders.items()})


def term_coefficients(expressions, moving) -> list[sp.Expr]:
    """Return the coefficients of the moving symbols in all terms: if all vanish, so do the expressions."""
    terms = [term for e in expressions for term in sp.Add.make_args(sp.expand(e, power_exp=False))]
    return [term.as_independent(*moving, as_Add=False)[0] for term in terms]


@dataclass(eq=False)
class Equations:
    """Rates of the states x; for coordinates x = (q, q̇), with forces in place of accelerations: a q̈ = f."""

    system: System  #: the description
    q: tuple[sp.Symbol, ...]  #: symbols of the coordinates that are kept, or of the states
    v: tuple[sp.Symbol, ...]  #: symbols of the velocities, which vanish at an equilibrium; none of states
    f: tuple[sp.Expr, ...]  #: rates of (q, v), of the velocities the forces
    a: sp.Matrix | None  #: kinetic matrix a_ij(q) of coordinates; None for states
    V: sp.Expr  #: effective potential of the coordinates, 0 for states
    #: all forces are those of V and of T = ½ a_ij q̇_i q̇_j, so that time reversal gives a motion
    natural: bool
    hamiltonian: bool  #: the forces are those of T and V alone: Hamilton's equations

    def __post_init__(self):
        #: symbols of the parameters, in the description's order, and of the switches, which are constant between jumps
        self.switches = tuple(switch.symbol for switch in self.system.switches)
        self.parameters = (*(p.symbol for p in self.system.parameters.values()),) or (NO_PARAMETER,)
        self.parameters += self.switches
        #: the coordinates or states that an equilibrium is a place of
        self.places = self.system.kept or tuple(self.system.states.values())
        self.states = (*self.q, *self.v)  #: symbols of coordinates, then velocities; or of states
        self.m, self.n = len(self.q), len(self.states)  #: numbers of coordinates (or states), and of all states
        self.still = dict.fromkeys(self.v, sp.Integer(0))  #: the velocities, all zero
        self.forces = self.f[len(self.v) :]  #: forces, or rates of states; at rest they vanish at an equilibrium
        #: True if the equations contain the time
        self.depends_on_time = any(e.has(self.system.time, *self.switches) for e in (*self.f, self.V, *(self.a or ())))
        #: True if the energy ½ a_ij q̇_i q̇_j + V of coordinates is conserved
        self.conservative = self.hamiltonian and not self.depends_on_time

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
        if self.V.count_ops() <= MAX_SIMPLIFIED_OPERATIONS // 2:  # two derivatives at once are factored too
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
        """All ∂³V/∂q_i∂q_j∂q_k and ∂a_ij/∂q_k: if all vanish, a perturbation has no error of first order.

        Empty if V″ is long: two runs a point take less time.
        """
        if sum(e.count_ops() for e in self.hessian) > MAX_THIRD_OPERATIONS:
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
        """True for conserved quantities without a gradient at the equilibria, which change in second order."""
        defaults = {p.symbol: p.default for p in self.system.parameters.values()}
        without_slope = []
        for row in self.gradients.tolist():
            sizes = []
            for place in self.system.labels.values():
                at_place = {x: sp.sympify(y).subs(defaults) for x, y in place.items()}
                at_place |= {s.symbol: s.size.subs(defaults) for s in self.places if s.symbol not in at_place}
                sizes += [abs(complex(e.subs(defaults).subs(at_place).evalf())) for e in row]
            without_slope.append(bool(sizes) and max(sizes) < 1e-12)
        return tuple(without_slope)
