r"""Proofs from the equations alone that eigenvalues come in pairs ±μ, or that no motion gains energy.

Of coordinates, :math:`a\ddot q + \dots = -\partial V/\partial q + Q`, with Q all forces except those of T and V:

* Reversal: forces that are even in the velocities, :math:`\ddot q = f(q, \dot q^2)`, symmetric or not.
* Energy: forces :math:`Q(q, 0)` without curl have a potential U. The terms in the velocities have the power
  :math:`P = \dot q \cdot (Q - Q(q, 0))`. If P = 0 (gyroscopic forces), T + V + U is conserved; it never grows if each
  term of :math:`P + 2R` is 0, or negative as for a drag :math:`-c\,\dot q|\dot q|`.

Of states: changing the sign of some of them, which vanish at the equilibrium, reverses the time.

A linear motion may have such pairs by chance, as at the threshold of a Hopf bifurcation, at which terms of third order
decide. So the whole equations are considered: the terms that would break a symmetry are expanded, and their
coefficients, which depend on parameters alone, have to vanish.

Source: Merkin, Introduction to the Theory of Stability, chapters 3 and 6; Lamb and Roberts, Physica D 112 (1998) 1.
"""

from functools import cached_property

import numpy as np
import sympy as sp

from sweeps.mechanics.equations import Equations, term_coefficients
from sweeps.mechanics.graph import compile_expression

MAX_REVERSALS = 64  # sign changes of states that are tried; each group of coupled states doubles their number


class Symmetries:
    """Symmetries of a system's equations, proved at given parameters."""

    def __init__(self, equations: Equations):
        self.equations = equations
        self._reversals: dict = {}  # signs of the states → function of parameters

    @cached_property
    def _forces(self):
        """Functions of parameters that vanish if forces are even in q̇, if P = 0, if P + 2R is a drag; and this drag."""
        equations, system = self.equations, self.equations.system
        q, v, still = equations.q, equations.v, equations.still
        mirror, R = {x: -x for x in v}, sum(system.dissipation_terms, sp.Integer(0))
        Q = [system.forces.get(x, sp.Integer(0)) - R.diff(y) for x, y in zip(q, v, strict=True)]
        at_rest = [e.subs(still) for e in Q]
        curls = [at_rest[i].diff(q[j]) - at_rest[j].diff(q[i]) for i in range(len(q)) for j in range(i)]
        power = sum((e - e0) * y for e, e0, y in zip(Q, at_rest, v, strict=True))
        dissipation = R + R.subs(mirror, simultaneous=True) - 2 * R.subs(still)  # twice the part of second degree
        odd_terms = [e - e.subs(mirror, simultaneous=True) for e in equations.forces]
        terms = sp.Add.make_args(sp.expand(power + dissipation, power_exp=False))
        drags = [e for e in terms if e.as_independent(*equations.states, as_Add=False)[1].is_nonnegative]
        remaining_terms = [e for e in terms if e not in drags]
        return [self._coefficients(e) for e in (odd_terms, [*curls, power], [*curls, *remaining_terms], drags)]

    def _coefficients(self, expressions):
        """Return the compiled function of parameters that returns all coefficients of the expressions in the states."""
        return compile_expression(self.equations.parameters, term_coefficients(expressions, self.equations.states))

    def _all_vanish(self, function, parameters):
        """Return True if all coefficients vanish, shape (points,); False if the equations contain the time."""
        vanishes = np.full(parameters[0].size, not self.equations.depends_on_time)
        for coefficient in function(*parameters):
            vanishes &= coefficient == 0.0
        return vanishes

    def keeps_energy(self, parameters) -> np.ndarray:
        """Return True if no motion of coordinates gains energy (T, V, and the potential of the forces at rest)."""
        if self.equations.conservative:
            return np.ones(parameters[0].size, dtype=bool)
        if not self.equations.v:
            return np.zeros(parameters[0].size, dtype=bool)
        is_dissipative = [coefficient <= 0.0 for coefficient in self._forces[3](*parameters)]
        return self._all_vanish(self._forces[2], parameters) & np.all(is_dissipative, axis=0)

    def has_pairs(self, parameters, place, terms) -> np.ndarray:
        """Return True if the equations prove that eigenvalues come in pairs, shape (points,).

        Args:
            parameters: List of arrays (points,).
            place: Equilibria, shape (points, m).
            terms: Absolute values of the Jacobian's terms, shape (points, m, n). Their zeros separate states into two
                classes that are coupled only with each other. If each change of signs moves the
                equilibrium, these classes are the only proof.
        """
        if self.equations.conservative:
            return np.ones(len(place), dtype=bool)
        if self.equations.v:
            return np.any([self._all_vanish(function, parameters) for function in self._forces[:2]], axis=0)
        n, is_proved = self.equations.n, np.zeros(len(place), dtype=bool)
        is_coupled = terms + np.swapaxes(terms, 1, 2) > 0.0
        bits = np.packbits(np.concatenate([is_coupled.reshape(-1, n * n), place != 0.0], axis=1), axis=1)
        _, first, pattern = np.unique(bits, axis=0, return_index=True, return_inverse=True)
        for k, i in enumerate(first):
            rows, changes = np.flatnonzero(pattern.ravel() == k), sign_changes(is_coupled[i])
            allowed_signs = [signs for signs in changes if not place[i][np.array(signs) < 0].any()][:MAX_REVERSALS]
            holds = [
                self._all_vanish(self._reversal_conditions(signs), [p[rows] for p in parameters])
                for signs in allowed_signs
            ]
            is_proved[rows] = np.any(holds, axis=0) if allowed_signs else bool(changes)
        return is_proved

    def _reversal_conditions(self, signs):
        """Return the function of parameters that vanishes if x → signs x reverses the time."""
        if signs not in self._reversals:
            states, f = self.equations.states, self.equations.f
            mirror = {x: sign * x for x, sign in zip(states, signs, strict=True)}
            residual = [e.subs(mirror, simultaneous=True) + sign * e for e, sign in zip(f, signs, strict=True)]
            self._reversals[signs] = self._coefficients(residual)
        return self._reversals[signs]


def sign_changes(is_coupled) -> list[tuple[int, ...]]:
    """Return all choices of signs such that states with equal signs are not coupled."""
    choices: list[tuple[int, ...]] = [()]
    for i, row in enumerate(is_coupled):
        coupled_before = np.flatnonzero(row[:i])
        choices = [(*signs, x) for signs in choices for x in (1, -1) if all(signs[j] != x for j in coupled_before)]
        choices = [] if row[i] else choices
    return choices
