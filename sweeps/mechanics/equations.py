"""The equations of motion of a system, x' = f(x, t; p), and what is known of them: forces, slopes, energy, symmetry."""

from dataclasses import dataclass
from functools import cached_property

import sympy as sp

from sweeps.mechanics.description import System

SHORT = 400  # operations: longer expressions are not expanded,
SIMPLE = 80  # and longer ones not simplified
LONG = 1500
NOTHING = sp.Dummy("nothing", real=True)  # stands for the parameters of a system that has none


def expanded(e: sp.Expr) -> sp.Expr:
    """Return an expression expanded if it is short: a long one grows with the product of its sums."""
    return sp.expand(e) if e.count_ops() <= SHORT else e


@dataclass(frozen=True)
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

    @property
    def parameters(self) -> tuple[sp.Symbol, ...]:
        """Symbols of the parameters, in the description's order."""
        return tuple(p.symbol for p in self.system.parameters.values()) or (NOTHING,)

    @property
    def places(self) -> tuple:
        """The coordinates or states that an equilibrium is a place of."""
        return self.system.kept or tuple(self.system.states.values())

    @property
    def states(self) -> tuple[sp.Symbol, ...]:
        """Symbols of all that moves: coordinates, then velocities; or states."""
        return (*self.q, *self.v)

    @property
    def m(self) -> int:
        """Number of coordinates or states, which an equilibrium is a place of."""
        return len(self.q)

    @property
    def n(self) -> int:
        """Number of all that moves."""
        return len(self.q) + len(self.v)

    @property
    def still(self) -> dict[sp.Symbol, sp.Integer]:
        """The velocities, all zero."""
        return dict.fromkeys(self.v, sp.Integer(0))

    @cached_property
    def timed(self) -> bool:
        """Return True if the time stands in the equations, which then need have no equilibrium."""
        return any(e.has(self.system.time) for e in (*self.f, self.V, *(self.a or ())))

    @property
    def conservative(self) -> bool:
        """Return True if the energy ½ a_ij q̇_i q̇_j + V of coordinates is conserved."""
        return self.hamiltonian and not self.timed

    @property
    def forces(self) -> tuple[sp.Expr, ...]:
        """Forces, or rates of states: what vanishes at an equilibrium, where it is at rest."""
        return self.f[len(self.v) :]

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

    @property
    def jacobian(self) -> sp.Matrix:
        """The Jacobian at an equilibrium, symbolic; in numbers a⁻¹ is never formed."""
        if not self.v:
            return self.slopes
        upper = sp.zeros(self.m, self.m).row_join(sp.eye(self.m))
        return upper.col_join(self.a.subs(self.still).inv() * self.slopes)

    @property
    def energy_terms(self) -> tuple[sp.Expr, ...]:
        """The terms of the energy of coordinates, where it is conserved: the kinetic one, and those of V."""
        v = sp.Matrix(self.v)
        return ((v.T * self.a * v)[0] / 2, *sp.Add.make_args(expanded(self.V))) if self.conservative else ()

    @property
    def spelled(self) -> tuple[sp.Expr, ...]:
        """All expressions that a run needs."""
        return (*self.f, self.V, *self.system.conserved_quantities.values())

    @cached_property
    def gradients(self) -> sp.Matrix:
        """Derivatives of the conserved quantities by the states, shape (quantities, n)."""
        quantities = list(self.system.conserved_quantities.values())
        return sp.Matrix(len(quantities), self.n, lambda i, j: quantities[i].diff(self.states[j]))

    @cached_property
    def curvatures(self) -> tuple[sp.Matrix, ...]:
        """Second derivatives of the conserved quantities by the states."""
        return tuple(sp.hessian(e, self.states) for e in self.system.conserved_quantities.values())

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
