r"""From a description to a_ij(q), the equations of motion and V″, all symbolic.

With r_k(q, t) and m_k, or T directly, the kinetic energy is written

    T = ½ a_ij(q) q̇_i q̇_j + b_i(q) q̇_i + T0(q),     a_ij = Σ_k m_k ∂r_k/∂q_i · ∂r_k/∂q_j

T0 joins the potential (for a hoop that turns it is minus the centrifugal potential). Coordinates that neither T nor V
contains keep their momenta p; they are removed after Routh,

    a → a_nn − a_nc a_cc⁻¹ a_cn,   V → V − T0 + ½ (p − b_c)ᵀ a_cc⁻¹ (p − b_c),   b → b_n + a_nc a_cc⁻¹ (p − b_c)

What is left of b is dropped where it is a gradient (a total derivative in the Lagrangian, always so for one
coordinate) and refused where it is not: gyroscopic forces make V″ v = ω² a v the wrong eigenproblem. What remains,

    a_ij q̈_j + (∂a_ij/∂q_k − ½ ∂a_jk/∂q_i) q̇_j q̇_k + ∂V/∂q_i = 0

is the full equation of motion, and linear about an equilibrium it is a η̈ + V″ η = 0.

Source: Landau and Lifshitz, Mechanics, sections 5, 23 and 41; Goldstein, Classical Mechanics, sections 6.2 and 8.3.
"""

from dataclasses import dataclass
from functools import cached_property

import mpmath
import numpy as np
import sympy as sp

from sweeps.mechanics import modes
from sweeps.mechanics.description import DescriptionError, System
from sweeps.mechanics.graph import ABSOLUTE, SECOND

SHORT = 400  # operations: longer expressions are not expanded,
SIMPLE = 80  # and longer ones not simplified
LONG = 1500
NOTHING = sp.Dummy("nothing", real=True)  # stands for the parameters of a system that has none


@dataclass(frozen=True)
class Equations:
    """The equations of a system in the coordinates that are kept.

    Attributes:
        system: the description.
        q, v: symbols of coordinates and velocities.
        a: the symmetric matrix a_ij(q).
        V: the (effective) potential.
    """

    system: System
    q: tuple[sp.Symbol, ...]
    v: tuple[sp.Symbol, ...]
    a: sp.Matrix
    V: sp.Expr

    @property
    def n(self) -> int:
        """Number of coordinates kept."""
        return len(self.q)

    @property
    def parameters(self) -> tuple[sp.Symbol, ...]:
        """Symbols of the parameters, in the description's order."""
        return tuple(p.symbol for p in self.system.parameters.values()) or (NOTHING,)

    @cached_property
    def gradient(self) -> sp.Matrix:
        """∂V/∂q_i, shape (n, 1)."""
        return sp.Matrix([self.V.diff(x) for x in self.q])

    @cached_property
    def hessian(self) -> sp.Matrix:
        """V″: ∂²V/∂q_i∂q_j."""
        if self.V.count_ops() <= SIMPLE // 2:  # two derivatives at once are factored too
            return sp.Matrix(self.n, self.n, lambda i, j: self.V.diff(self.q[i], self.q[j]))
        upper = {(i, j): self.gradient[i].diff(self.q[j]) for i in range(self.n) for j in range(i, self.n)}
        return sp.Matrix(self.n, self.n, lambda i, j: upper[min(i, j), max(i, j)])

    @cached_property
    def third(self) -> tuple[sp.Expr, ...]:
        """All ∂³V/∂q_i∂q_j∂q_k and ∂a_ij/∂q_k: where all vanish, a nudge has no error of first order.

        None where V″ is long: two runs a point are less work than to know.
        """
        if sum(e.count_ops() for e in self.hessian) > LONG:
            return ()
        n = range(self.n)
        cubic = [self.hessian[i, j].diff(self.q[k]) for i in n for j in n[i:] for k in n[j:]]
        return tuple(cubic + [self.a[i, j].diff(x) for i in n for j in n[i:] for x in self.q])

    @cached_property
    def velocity_terms(self) -> sp.Matrix:
        """(∂a_ij/∂q_k − ½ ∂a_jk/∂q_i) q̇_j q̇_k, shape (n, 1)."""
        n = range(self.n)
        rows = []
        for i in n:
            terms = (
                (self.a[i, j].diff(self.q[k]) - self.a[j, k].diff(self.q[i]) / 2) * self.v[j] * self.v[k]
                for j in n
                for k in n
            )
            rows.append(expanded(sp.Add(*terms)))
        return sp.Matrix(rows)

    kinds = (SECOND, ABSOLUTE)

    @property
    def rest(self) -> int:
        """How many of the states (the last ones) are velocities."""
        return self.n

    @property
    def states(self) -> tuple[sp.Symbol, ...]:
        """Symbols of all that moves: coordinates, then velocities."""
        return (*self.q, *self.v)

    @property
    def still(self) -> tuple[sp.Symbol, ...]:
        """The states that vanish at an equilibrium."""
        return self.v

    @cached_property
    def f(self) -> tuple[sp.Expr, ...]:
        """Velocities, then forces a q̈."""
        return (*self.v, *(-self.gradient - self.velocity_terms))

    @property
    def spelled(self) -> tuple[sp.Expr, ...]:
        """All expressions that a run needs."""
        return (*self.f, self.V)

    @property
    def energy_terms(self) -> tuple[sp.Expr, ...]:
        """The terms of the energy: the kinetic one, and those of V."""
        v = sp.Matrix(self.v)
        return ((v.T * self.a * v)[0] / 2, *sp.Add.make_args(expanded(self.V)))

    @property
    def accelerations(self) -> sp.Matrix:
        """q̈ = −a⁻¹(velocity terms + ∂V/∂q), for people and tests: kernels solve for it in numbers."""
        return -self.a.inv() * (self.velocity_terms + self.gradient)


def kinetic_matrix(system: System) -> sp.Matrix:
    """a_ij(q) over all coordinates, the cyclic ones included."""
    T = _kinetic_energy(system)
    _check_symbols(system, T, sp.Integer(0))
    return _quadratic(system, T)[0]


def derive(system: System) -> Equations:
    """Derives the equations of a system.

    Raises:
        DescriptionError: for an unbound symbol, a T that is not quadratic in q̇, a T or V that depends on time, a
            complex or not positive a_ij, a cyclic coordinate that T or V contains, or gyroscopic forces.
    """
    if not system.coordinates or not system.kept:
        raise DescriptionError("coordinates: there is none; allowed: one at least that is not cyclic")
    a, b, V = reduced(system)
    q = tuple(c.symbol for c in system.kept)
    _check_gyroscopic(b, q)
    velocities = tuple(c.velocity for c in system.kept)
    equations = Equations(system, q, velocities, a, V)
    check_positive(equations)
    return equations


def reduced(system: System) -> tuple[sp.Matrix, sp.Matrix, sp.Expr]:
    """The matrix a_ij, the terms b_i linear in q̇ and the effective potential over the coordinates that are kept."""
    T, V = _kinetic_energy(system), sum(system.potential_terms, sp.Integer(0))
    T, V = _by_sine_and_cosine(T), _by_sine_and_cosine(V)
    _check_smooth(system, T, V)
    _check_symbols(system, T, V)
    a, b, T0 = _quadratic(system, T)
    V = V - T0
    cyclic = [i for i, c in enumerate(system.coordinates.values()) if c.momentum is not None]
    kept = [i for i in range(len(system.coordinates)) if i not in cyclic]
    if cyclic:
        a, b, V = _without_cyclic(system, a, b, V, kept, cyclic)
    return a, b, V


def _kinetic_energy(system):
    T = sum(system.kinetic_terms, sp.Integer(0))
    for mass, place in system.particles:
        for part in place:
            speed = part.diff(system.time)
            speed += sum(part.diff(c.symbol) * c.velocity for c in system.coordinates.values())
            T += mass * speed**2 / 2
    return T


def _by_sine_and_cosine(e):
    """Writes out cot, sec, csc and their hyperbolic kin."""
    for f, g in _WRITTEN_OUT.items():
        e = e.replace(f, g) if e.has(f) else e
    return e


def _check_smooth(system, T, V):
    """Refuses what has a kink, by the name that its author wrote."""
    moving = {c.symbol for c in system.coordinates.values()}
    for where, e in (("T", T), ("V", V)):
        if e.has(sp.nan, sp.zoo, sp.oo, -sp.oo) or (where == "V" and e.has(sp.I)):
            raise DescriptionError(f"{where}: {e} is complex or infinite; allowed: real, finite expressions")
        for part in sorted(e.atoms(*_KINKED), key=str):
            if part.free_symbols & moving:
                wrong, allowed = _KINKED.get(type(part), _KINK)
                raise DescriptionError(f"{where}: {part} {wrong}; allowed: {allowed}")


_WRITTEN_OUT = {
    sp.cot: lambda u: sp.cos(u) / sp.sin(u),
    sp.sec: lambda u: 1 / sp.cos(u),
    sp.csc: lambda u: 1 / sp.sin(u),
    sp.coth: lambda u: sp.cosh(u) / sp.sinh(u),
    sp.sech: lambda u: 1 / sp.cosh(u),
    sp.csch: lambda u: 1 / sp.sinh(u),
}
_KINK = ("has a kink, about which nothing oscillates linearly", "sqrt(u**2 + d**2) in place of |u|, with a small d")
_KINKED = {
    **dict.fromkeys((sp.Abs, sp.sign, sp.Max, sp.Min, sp.Heaviside, sp.Piecewise), _KINK),
    **dict.fromkeys((sp.floor, sp.ceiling, sp.Mod, sp.frac), ("jumps", "what has a slope everywhere")),
    sp.atan2: ("has a cut", "2*atan(y/(sqrt(x**2 + y**2) + x)) in place of atan2(y, x)"),
}


def _check_symbols(system, T, V):
    velocities = {c.velocity for c in system.coordinates.values()}
    known = {c.symbol for c in system.coordinates.values()} | {p.symbol for p in system.parameters.values()}
    others = [part for _, place in system.particles for part in place] + [
        e for c in system.kept for e in (*c.bounds, c.size, c.hold) if e is not None
    ]
    others += [e for place in system.labels.values() for e in place.values()]
    for where, expression in [("T", T), ("V", V)] + [("positions, bounds and places", e) for e in others]:
        unbound = sorted(map(str, expression.free_symbols - known - velocities - {system.time}))
        if unbound:
            names = ", ".join(map(str, sorted(known, key=str)))
            raise DescriptionError(f"{where}: unbound symbol {', '.join(unbound)}; allowed: {names}")
    if system.time in V.free_symbols:
        raise DescriptionError(f"V: depends on time (t in {V}); allowed: a function of coordinates and parameters")
    if V.free_symbols & velocities:
        raise DescriptionError(f"V: depends on a velocity ({V}); allowed: a function of coordinates and parameters")


def _quadratic(system, T):
    """The parts a, b, T0 of T = ½ a q̇q̇ + b q̇ + T0."""
    if T.count_ops() > SHORT and not system.kinetic_terms:
        return _checked(system, *_of_particles(system))
    v = [c.velocity for c in system.coordinates.values()]
    rest = dict.fromkeys(v, 0)
    T = expanded(T)
    slopes = [T.diff(x) for x in v]
    a = sp.zeros(len(v))
    for i in range(len(v)):
        for j in range(i + 1):
            a[i, j] = a[j, i] = simplified(slopes[i].diff(v[j]))
    b = sp.Matrix([simplified(slope.subs(rest)) for slope in slopes])
    T0 = simplified(T.subs(rest))
    a, b, T0 = (_timeless(system, e) for e in (a, b, T0))
    if a.free_symbols & set(v):
        raise DescriptionError(f"T: not quadratic in the velocities ({T}); allowed: ½ a_ij(q) q̇_i q̇_j")
    remainder = T - (sp.Matrix(v).T * a * sp.Matrix(v))[0] / 2 - (b.T * sp.Matrix(v))[0] - T0
    if not vanishes(remainder):
        raise DescriptionError(f"T: not quadratic in the velocities ({T}); allowed: ½ a_ij(q) q̇_i q̇_j")
    return _checked(system, a, b, T0)


def _of_particles(system):
    """a, b, T0 of many particles: from their places' derivatives, whose equal products are simplified once.

    a_ij = Σ m ∂r/∂q_i · ∂r/∂q_j, b_i = Σ m ∂r/∂q_i · ∂r/∂t, T0 = ½ Σ m (∂r/∂t)².
    """
    symbols = [*(c.symbol for c in system.coordinates.values()), system.time]
    n, masses, short = len(symbols), {}, {}
    for mass, place in system.particles:
        slopes = [[_by_sine_and_cosine(part).diff(x) for x in symbols] for part in place]
        for i in range(n):
            for j in range(i + 1):
                product = sp.Add(*(slope[i] * slope[j] for slope in slopes))
                if product not in short:
                    paired = _paired(product)
                    short[product] = simplified(paired) if paired.is_Add else paired
                found = masses.setdefault((i, j), {})
                found[short[product]] = found.get(short[product], 0) + mass
    whole = sp.zeros(n)
    for (i, j), found in masses.items():
        whole[i, j] = whole[j, i] = sp.Add(*(product * mass for product, mass in found.items()))
    kept = list(range(n - 1))
    whole = _timeless(system, whole)
    return whole.extract(kept, kept), whole.extract(kept, [n - 1]), whole[n - 1, n - 1] / 2


def _checked(system, a, b, T0):
    """a, b, T0 that hold no time and nothing complex."""
    timed = [str(e) for e in (*a, *b, T0) if system.time in e.free_symbols]
    if timed:
        raise DescriptionError(
            f"T: depends on time ({timed[0]}); allowed: positions whose T, simplified, holds "
            "no t (a frame that turns steadily; of a pivot that is moved to and fro there is no equilibrium here)"
        )
    if a.has(sp.I):
        raise DescriptionError(f"T: a_ij is complex ({a.tolist()}); allowed: real positions and masses")
    return a, b, T0


def _timeless(system, e):
    """An expression or a matrix simplified as far as it goes where it still holds the time."""
    return sp.simplify(e) if system.time in e.free_symbols else e


def expanded(e: sp.Expr) -> sp.Expr:
    """An expression expanded, where it is short: what is long grows with the product of its sums."""
    return sp.expand(e) if e.count_ops() <= SHORT else e


def simplified(e: sp.Expr) -> sp.Expr:
    """An expression simplified, where it is short; else with cos A cos B + sin A sin B → cos(A − B) alone."""
    return sp.simplify(e) if e.count_ops() <= SIMPLE else sp.factor_terms(_paired(e))


def _paired(e):
    """C cos A cos B + c sin A sin B → c cos(A − B), term by term."""
    terms, result = {}, []
    for term in sp.Add.make_args(sp.expand_mul(e)):
        key = _turns(term)
        terms[key] = terms.get(key, 0) + 1
    for (rest, kind, angles), count in terms.items():
        other = (rest, "sin", angles)
        if kind == "cos" and other in terms:
            paired = min(count, terms[other])
            result.append(paired * rest * sp.cos(angles[0] - angles[1]))
            terms[other], count = terms[other] - paired, count - paired
        terms[rest, kind, angles] = count
    shapes = {"cos": sp.cos, "sin": sp.sin}
    result += [n * (rest if not a else rest * shapes[k](a[0]) * shapes[k](a[1])) for (rest, k, a), n in terms.items()]
    return sp.Add(*result)


def _turns(term):
    """(what is left, cos or sin, both angles) of a term with two of one, or (the term, "", ())."""
    for name, f in (("cos", sp.cos), ("sin", sp.sin)):
        factors = [x for part in sp.Mul.make_args(term) for x in _factors(part)]
        turning = [x for x in factors if x.func is f]
        if len(turning) == 2 and len({x.func for x in factors} & {sp.cos, sp.sin}) == 1:
            angles = tuple(sorted((x.args[0] for x in turning), key=sp.default_sort_key))
            return term / (turning[0] * turning[1]), name, angles
    return term, "", ()


def _factors(part):
    base, exponent = part.as_base_exp()
    return [base] * int(exponent) if exponent in (1, 2) else [part]


def vanishes(e: sp.Expr) -> bool:
    """Whether an expression is 0: by simplifying it where it is short, else at random places, beside its terms."""
    if e.count_ops() <= SIMPLE:
        return sp.simplify(e) == 0
    symbols, terms = sorted(e.free_symbols, key=str), sp.Add.make_args(e)
    places = np.random.default_rng(0).uniform(0.3, 1.7, (len(symbols), 8))
    values = np.array([np.broadcast_to(v, 8) for v in sp.lambdify(symbols, terms, "numpy", cse=True)(*places)])
    return bool((np.abs(values.sum(axis=0)) <= 1e-11 * np.abs(values).sum(axis=0)).all())


def _without_cyclic(system, a, b, V, kept, cyclic):
    coordinates = list(system.coordinates.values())
    for i in cyclic:
        if coordinates[i].symbol in a.free_symbols | b.free_symbols | V.free_symbols:
            name = coordinates[i].name
            raise DescriptionError(f"coordinate {name}: has a momentum, but T or V contains it; allowed: neither does")
    p = sp.Matrix([coordinates[i].momentum for i in cyclic]) - sp.Matrix([b[i] for i in cyclic])
    a_nn, a_nc, a_cc = a.extract(kept, kept), a.extract(kept, cyclic), a.extract(cyclic, cyclic)
    inverse = a_cc.inv()
    reduced = (a_nn - a_nc * inverse * a_nc.T).applyfunc(sp.simplify)
    linear = (sp.Matrix([b[i] for i in kept]) + a_nc * inverse * p).applyfunc(sp.simplify)
    return reduced, linear, V + sp.simplify((p.T * inverse * p)[0] / 2)


def curl(b: sp.Matrix, q: tuple) -> tuple | None:
    """The first (∂b_i/∂q_j - ∂b_j/∂q_i, q_j, q_i) that does not vanish; None where b is a gradient."""
    for i in range(len(q)):
        for j in range(i):
            found = sp.simplify(b[i].diff(q[j]) - b[j].diff(q[i]))
            if found != 0:
                return found, q[j], q[i]
    return None


def _check_gyroscopic(b, q):
    if found := curl(b, q):
        force, first, second = found
        raise DescriptionError(
            f"T: its terms linear in the velocities make a gyroscopic force ({force}) between {first} and {second}; "
            "allowed: terms that are a total derivative"
        )


def check_positive(equations: Equations) -> None:
    """Evaluates a at the defaults, at places inside the bounds: real and positive definite there."""
    system = equations.system
    defaults = {p.symbol: p.default for p in system.parameters.values()}
    corners = [[complex(bound.subs(defaults)).real for bound in c.bounds] for c in system.kept]
    fractions = (0.137, 0.411, 0.5, 0.689, 0.931)
    places = [[low + f * (high - low) for low, high in corners] for f in fractions]
    rng = np.random.default_rng(0)
    places += [[low + f * (high - low) for (low, high), f in zip(corners, rng.random(len(corners)), strict=True)]]
    a = sp.lambdify((*defaults, *equations.q), equations.a.tolist(), "mpmath", cse=True)
    for place in places:
        numbers = _complex(a, (*defaults.values(), *place))
        where = ", ".join(f"{x} = {y:.4g}" for x, y in zip(equations.q, place, strict=True))
        if not np.isfinite(numbers).all() or np.abs(numbers.imag).max() > 0:
            raise DescriptionError(f"T: a_ij is complex or infinite at {where}; allowed: real, finite a_ij")
        if not modes.positive(numbers.real[None])[0]:
            raise DescriptionError(f"T: a_ij is not positive at {where}: {numbers.real.tolist()}; allowed: positive T")


def _complex(matrix, values):
    """The values of a matrix of expressions at a place, NaN where mpmath has none."""
    try:
        return np.array([[complex(e) for e in row] for row in matrix(*map(mpmath.mpf, values))])
    except (ArithmeticError, ValueError):
        return np.array([[complex("nan")]])
