r"""From a description to its equations of motion, all symbolic: of any coordinates, or of states as they are given.

With r_k(q, t) and m_k, or T directly, the kinetic energy is written

    T = ½ a_ij q̇_i q̇_j + b_i q̇_i + T0,     a_ij = Σ_k m_k ∂r_k/∂q_i · ∂r_k/∂q_j

T0 joins the potential (for a hoop that turns it is minus the centrifugal potential). Coordinates that neither T nor V
contains keep their momenta p; they are removed after Routh,

    a → a_nn − a_nc a_cc⁻¹ a_cn,   V → V − T0 + ½ (p − b_c)ᵀ a_cc⁻¹ (p − b_c),   b → b_n + a_nc a_cc⁻¹ (p − b_c)

With a Rayleigh function R and forces Q, and everything a function of time too where the description says so,

.. math:: a_{ij}\ddot q_j + \Big(\frac{\partial a_{ij}}{\partial q_k} - \frac12\frac{\partial a_{jk}}{\partial q_i}\Big)
          \dot q_j\dot q_k + \Big(\frac{\partial b_i}{\partial q_j} - \frac{\partial b_j}{\partial q_i}
          + \frac{\partial a_{ij}}{\partial t}\Big)\dot q_j + \frac{\partial b_i}{\partial t}
          + \frac{\partial V}{\partial q_i} = Q_i - \frac{\partial R}{\partial\dot q_i}

Where b is a gradient (always so for one coordinate) it is a total derivative in the Lagrangian and leaves no force. The
system is natural where nothing but a and V is left. `System.kept` are the coordinates that are not cyclic, and
`System.switches` symbols of functions that jump in time. Of states, f is as it is given, and conserved quantities are
tested in 40 digits.

Source: Landau and Lifshitz, Mechanics, sections 5, 23, 25 and 41; Goldstein, Classical Mechanics, sections 1.5, 6.2 and
8.3; Merkin, Introduction to the Theory of Stability, chapter 6.
"""

from functools import cache

import mpmath
import numpy as np
import sympy as sp

from sweeps.mechanics import modes
from sweeps.mechanics.description import System
from sweeps.mechanics.equations import MAX_SIMPLIFIED_OPERATIONS, Equations, expand_short, simplify
from sweeps.schema.refusals import DescriptionError

DIGITS = 40
PERIOD_ROUNDING = 64.0 * float(np.finfo(np.float64).eps)  # relative error of a period: some roundings
TRIALS = 6  # random places at which conserved quantities and R are checked


@cache
def derive(system: System) -> Equations:
    """Derive the equations of motion of a description.

    Raises:
        DescriptionError: for coordinates and states together, a state without a rate, a T not of degree two in q̇, a
            complex or not positive a_ij, a cyclic coordinate that T or V contains, an R of another degree or negative
            somewhere, and a conserved quantity that is not.
    """
    if system.states and (system.coordinates or system.particles or system.kinetic_terms):
        raise DescriptionError("states: beside coordinates; allowed: equations of first order, or T and V, not both")
    equations = _derive_from_rates(system) if system.states or system.rates else _derive_from_energies(system)
    if system.given_period is not None:
        _check_period(equations)
    return equations


def _derive_from_rates(system):
    """Return the equations of first order of a system with states; refuse missing rates, potentials and forces."""
    missing = [s.name for s in system.states.values() if s.symbol not in system.rates]
    if missing or not system.states:
        problem = f"rate of {missing[0]}: is missing" if missing else "states: there is none"
        raise DescriptionError(f"{problem}; allowed: system.rate(x, f) for each state")
    if system.dissipation_terms or system.forces or system.potential_terms:
        raise DescriptionError("states: beside a potential, R or a force; allowed: all forces within the rates")
    q = tuple(s.symbol for s in system.states.values())
    f = tuple(system.rates[x] for x in q)
    equations = Equations(system, q, (), f, None, sp.Integer(0), natural=False, hamiltonian=False)
    _check_conserved(equations)
    return equations


def _derive_from_energies(system):
    """Return the equations a q̈ = f of the coordinates that are not cyclic, from T, V, R and Q (module docstring)."""
    if system.conserved_quantities:
        name = next(iter(system.conserved_quantities))
        raise DescriptionError(
            f"conserved {name}: beside coordinates; allowed: beside states (their energy is watched)"
        )
    if not system.kept:
        raise DescriptionError("coordinates: there is none; allowed: one at least that is not cyclic")
    a, b, V = reduce_energies(system)
    q, v = tuple(c.symbol for c in system.kept), tuple(c.velocity for c in system.kept)
    t, R, Q = system.time, sum(system.dissipation_terms, sp.Integer(0)), system.forces
    _check_dissipation(system, R)
    check_positive(system, q, a)
    inertial, external, n = [], [], range(len(q))
    for i, x in enumerate(q):
        terms = ((a[i, j].diff(q[k]) - a[j, k].diff(x) / 2) * v[j] * v[k] for j in n for k in n)
        inertial.append(expand_short(sp.Add(*terms)))
        gyroscopic = sum((b[i].diff(q[j]) - b[j].diff(x) + a[i, j].diff(t)) * v[j] for j in n)
        external.append(Q.get(x, sp.Integer(0)) - R.diff(v[i]) - simplify(gyroscopic) - b[i].diff(t))
    forces = [
        external_force - V.diff(x) - terms for external_force, x, terms in zip(external, q, inertial, strict=True)
    ]
    time_symbols = t, *(switch.symbol for switch in system.switches)
    if V.has(*time_symbols):  # terms without a coordinate cause no force
        V = sp.Add(*(term for term in sp.Add.make_args(expand_short(V)) if term.free_symbols & set(q)))
    natural = not any(external) and not any(e.has(*time_symbols) for e in (V, *forces, *a))
    return Equations(system, q, v, (*v, *forces), a, V, natural, hamiltonian=R == 0 and not Q)


def reduce_energies(system: System) -> tuple[sp.Matrix, sp.Matrix, sp.Expr]:
    """Return the matrix a_ij, the terms b_i linear in q̇ and the effective potential in the remaining coordinates."""
    T, V = _kinetic_energy(system), sum(system.potential_terms, sp.Integer(0))
    T, V = _replace_reciprocals(T), _replace_reciprocals(V)
    a, b, T0 = _quadratic_form(system, T)
    V = V - T0
    cyclic = [i for i, c in enumerate(system.coordinates.values()) if c.momentum is not None]
    remaining_indices = [i for i in range(len(system.coordinates)) if i not in cyclic]
    if cyclic:
        a, b, V = _eliminate_cyclic_coordinates(system, a, b, V, remaining_indices, cyclic)
    return a, b, V


def _kinetic_energy(system):
    """Return T(q, q̇, t): the given terms and ½ m ṙ² of each particle."""
    T = sum(system.kinetic_terms, sp.Integer(0))
    for mass, place in system.particles:
        for position in place:
            speed = position.diff(system.time)
            speed += sum(position.diff(c.symbol) * c.velocity for c in system.coordinates.values())
            T += mass * speed**2 / 2
    return T


def _replace_reciprocals(e):
    """Rewrite cot, sec, csc, coth, sech and csch in sin, cos, sinh and cosh."""
    for f, g in _RECIPROCALS.items():
        e = e.replace(f, g) if e.has(f) else e
    return e


_RECIPROCALS = {
    sp.cot: lambda u: sp.cos(u) / sp.sin(u),
    sp.sec: lambda u: 1 / sp.cos(u),
    sp.csc: lambda u: 1 / sp.sin(u),
    sp.coth: lambda u: sp.cosh(u) / sp.sinh(u),
    sp.sech: lambda u: 1 / sp.cosh(u),
    sp.csch: lambda u: 1 / sp.sinh(u),
}


def _quadratic_form(system, T):
    """Return the parts a, b, T0 of T = ½ a q̇q̇ + b q̇ + T0."""
    v = [c.velocity for c in system.coordinates.values()]
    at_rest = dict.fromkeys(v, 0)
    T = expand_short(T)
    slopes = [T.diff(x) for x in v]
    a = sp.zeros(len(v))
    for i in range(len(v)):
        for j in range(i + 1):
            a[i, j] = a[j, i] = simplify_trigonometric(slopes[i].diff(v[j]))
    b = sp.Matrix([simplify_trigonometric(slope.subs(at_rest)) for slope in slopes])
    T0 = simplify_trigonometric(T.subs(at_rest))
    a, b, T0 = (simplify(e) if system.time in e.free_symbols else e for e in (a, b, T0))
    if a.free_symbols & set(v):  # else T is its Taylor polynomial about rest
        raise DescriptionError(f"T: not quadratic in the velocities ({T}); allowed: ½ a_ij(q) q̇_i q̇_j")
    return a, b, T0


def simplify_trigonometric(e: sp.Expr) -> sp.Expr:
    """Simplify an expression if it is short, else apply cos A cos B + sin A sin B → cos(A − B) alone."""
    return simplify(e) if e.count_ops() <= MAX_SIMPLIFIED_OPERATIONS else sp.factor_terms(_combine_angles(e))


def _combine_angles(e):
    """Rewrite C cos A cos B + c sin A sin B → c cos(A − B), term by term."""
    terms, result = {}, []
    for term in sp.Add.make_args(sp.expand_mul(e)):
        key = _angle_product(term)
        terms[key] = terms.get(key, 0) + 1
    for (factor, kind, angles), count in terms.items():
        partner = (factor, "sin", angles)
        if kind == "cos" and partner in terms:
            count_of_pairs = min(count, terms[partner])
            result.append(count_of_pairs * factor * sp.cos(angles[0] - angles[1]))
            terms[partner], count = terms[partner] - count_of_pairs, count - count_of_pairs
        terms[factor, kind, angles] = count
    shapes = {"cos": sp.cos, "sin": sp.sin}
    result += [
        n * (factor if not a else factor * shapes[k](a[0]) * shapes[k](a[1])) for (factor, k, a), n in terms.items()
    ]
    return sp.Add(*result)


def _angle_product(term):
    """Return (remaining factor, "cos" or "sin", both angles) of a term with two of one kind, or (the term, "", ())."""
    for name, f in (("cos", sp.cos), ("sin", sp.sin)):
        factors = [x for base in sp.Mul.make_args(term) for x in _split_power(base)]
        waves = [x for x in factors if x.func is f]
        if len(waves) == 2 and len({x.func for x in factors} & {sp.cos, sp.sin}) == 1:
            angles = tuple(sorted((x.args[0] for x in waves), key=sp.default_sort_key))
            return term / (waves[0] * waves[1]), name, angles
    return term, "", ()


def _split_power(factor):
    """Return the factors of a first or second power, [x] or [x, x]; [factor] for other powers."""
    base, exponent = factor.as_base_exp()
    return [base] * int(exponent) if exponent in (1, 2) else [factor]


def _eliminate_cyclic_coordinates(system, a, b, V, remaining, cyclic):
    """Return a, b and V of the remaining coordinates, without the cyclic coordinates (Routh, module docstring).

    Args:
        system: the description, with the momenta of its cyclic coordinates.
        a: kinetic matrix of all coordinates.
        b: terms linear in the velocities, of all coordinates.
        V: potential, with -T0.
        remaining: indices of the remaining coordinates.
        cyclic: indices of the cyclic coordinates.

    Raises:
        DescriptionError: if a, b or V contains a cyclic coordinate.
    """
    coordinates = list(system.coordinates.values())
    for i in cyclic:
        if coordinates[i].symbol in a.free_symbols | b.free_symbols | V.free_symbols:
            name = coordinates[i].name
            raise DescriptionError(f"coordinate {name}: has a momentum, but T or V contains it; allowed: neither does")
    p = sp.Matrix([coordinates[i].momentum for i in cyclic]) - sp.Matrix([b[i] for i in cyclic])
    a_nn, a_nc, a_cc = a.extract(remaining, remaining), a.extract(remaining, cyclic), a.extract(cyclic, cyclic)
    inverse = a_cc.inv()
    reduced_a = (a_nn - a_nc * inverse * a_nc.T).applyfunc(simplify)
    linear = (sp.Matrix([b[i] for i in remaining]) + a_nc * inverse * p).applyfunc(simplify)
    return reduced_a, linear, V + simplify((p.T * inverse * p)[0] / 2)


def check_positive(system: System, q: tuple, a: sp.Matrix) -> None:
    """Check that `a` of a `system` is real and positive definite at random places `q`."""
    places = [*_random_values(system)]
    function = sp.lambdify([*places[0]], a.tolist(), "mpmath", cse=True)
    for values in places:
        numbers = _evaluate_matrix(function, values.values())
        where = ", ".join(f"{x} = {float(values[x]):.4g}" for x in q)
        if not np.isfinite(numbers).all() or np.abs(numbers.imag).max() > 0:
            raise DescriptionError(f"T: a_ij is complex or infinite at {where}; allowed: real, finite a_ij")
        if not modes.is_positive_definite(numbers.real[None])[0]:
            raise DescriptionError(f"T: a_ij is not positive at {where}: {numbers.real.tolist()}; allowed: positive T")


def _evaluate_matrix(matrix, values):
    """Return the values of a matrix of expressions at a place, NaN if mpmath fails."""
    try:
        return np.array([[complex(e) for e in row] for row in matrix(*map(mpmath.mpf, values))])
    except (ArithmeticError, ValueError):
        return np.array([[complex("nan")]])


def _check_dissipation(system, R):
    """Refuse forces along cyclic coordinates, and an R of degree above two in q̇ or negative at random places."""
    if cyclic := [x for x in system.forces if x not in {c.symbol for c in system.kept}]:
        raise DescriptionError(f"force: {cyclic[0]} has a momentum that is kept; allowed: the other coordinates")
    v = [c.velocity for c in system.kept]
    if R != 0 and not (R.is_polynomial(*v) and sp.Poly(R, *v).total_degree() <= 2):
        raise DescriptionError(f"R: not of degree two in the velocities ({R}); allowed: Rayleigh's function ½ c_ij q̇q̇")
    for values in _random_values(system):
        if float(sp.re(R.subs(values).evalf())) < -1e-12:
            place = ", ".join(f"{x} = {float(y):.3g}" for x, y in values.items() if x in R.free_symbols)
            raise DescriptionError(f"R: negative at {place}; allowed: R ≥ 0 everywhere, for it takes energy away")


def _random_values(system):
    """Yield random values of symbols: parameters near their defaults, all else within its bounds."""
    rng = np.random.default_rng(0)
    for _ in range(TRIALS):
        values = {}
        for p in system.parameters.values():
            shift = 0.1 * rng.random()
            value = p.default * (1.0 + shift) or shift  # not 0: a term could vanish
            values[p.symbol] = sp.Float(value if p.allows(value) else p.default, DIGITS)
        ends = dict(values)
        for place in (*system.kept, *system.states.values()):
            low, high = (sp.re(bound.subs(ends).evalf(DIGITS)) for bound in place.bounds)
            values[place.symbol] = low + (high - low) * sp.Float(rng.random(), DIGITS)
            if hasattr(place, "velocity"):
                values[place.velocity] = sp.Float(rng.normal(), DIGITS)
        values[system.time] = sp.Float(rng.normal(), DIGITS)
        yield values | {s.symbol: system.without_switches(s.symbol).subs(values) for s in system.switches}


def _check_period(equations):
    """Check the equations a period later, at random places and times, in 40 digits: but for the period's rounding."""
    system, t, places = equations.system, equations.system.time, [*_random_values(equations.system)]
    symbols = [x for x in places[0] if x not in equations.switches]
    entries = [(f"force {x}", e) for x, e in zip(equations.states, equations.f, strict=True)]
    for name, e in [*entries, *(("a_ij", e) for e in equations.a or ())]:
        expressions = [system.without_switches(each) for each in (e, e.diff(t))]
        function = sp.lambdify(symbols, [system.given_period, *expressions], "mpmath")
        for values in places if expressions[0].has(t) else ():
            with mpmath.workdps(2 * DIGITS):  # terms may cancel
                at = {x: mpmath.mpf(values[x]) for x in symbols}
                T, *_ = function(*at.values())
                begin = at[t] * T
                _, value, slope = function(*(at | {t: begin}).values())
                change = function(*(at | {t: begin + T}).values())[1] - value
            if abs(change) > PERIOD_ROUNDING * abs(slope * T) + 1e-30 * abs(value):
                raise DescriptionError(
                    f"period: {name} is {complex(value).real:.6g} at a time, and differs by {complex(change).real:.2g} "
                    "a period later; allowed: what leaves all equations the same, to all digits (2*pi/w, not 6.2832/w)"
                )


def _check_conserved(equations):
    """Check dC/dt = ∂C/∂t + ∂C/∂x · f at random places in 40 digits, relative to its terms' absolute values."""
    system = equations.system
    for name, quantity in system.conserved_quantities.items():
        terms = [quantity.diff(x) * f for x, f in zip(equations.q, equations.f, strict=True)]
        places = [*_random_values(system)]
        function = sp.lambdify([*places[0]], [*terms, quantity.diff(system.time)], "mpmath")
        for values in places:
            with mpmath.workdps(DIGITS):
                numbers = function(*map(mpmath.mpf, values.values()))
                total, size = abs(mpmath.fsum(numbers)), mpmath.fsum(numbers, absolute=True)
            if total > 1e-12 * size:
                raise DescriptionError(
                    f"conserved {name}: its rate of change is {float(total):.3g} at a place within the bounds, of "
                    f"terms of {float(size):.3g}; allowed: what the rates leave constant"
                )
