r"""Proofs from the equations alone that eigenvalues come in pairs ±μ, or that no motion gains energy.

Of coordinates, :math:`a\ddot q + \dots = -\partial V/\partial q + Q`, with Q all forces beside those of T and V:

* Reversal: forces that are even in the velocities, :math:`\ddot q = f(q, \dot q^2)`, symmetric or not.
* Energy: forces :math:`Q(q, 0)` without curl have a potential U. What velocities add has the power
  :math:`P = \dot q \cdot (Q - Q(q, 0))`. With P = 0, gyroscopic forces, T + V + U is conserved; it never grows where
  each term of :math:`P + 2R` is 0, or below as that of a drag :math:`-c\,\dot q|\dot q|`.

Of states: changing the sign of some of them, which vanish at the equilibrium, reverses the time.

A linear motion may have such pairs by chance, as at the threshold of a Hopf bifurcation, where terms of third order
decide. So a proof is of the whole equations: what would break it is expanded into terms, and their factors, which
depend on parameters alone, have to vanish.

Source: Merkin, Introduction to the Theory of Stability, chapters 3 and 6; Lamb and Roberts, Physica D 112 (1998) 1.
"""

from functools import cached_property

import numpy as np
import sympy as sp

from sweeps.mechanics.equations import Equations, factors
from sweeps.mechanics.graph import lambdified

MAX_REVERSALS = 64  # sign changes of states that are tried: each part that acts on itself alone doubles their number


class Symmetries:
    """Symmetries of a system's equations, proved at given parameters."""

    def __init__(self, equations: Equations):
        self.equations = equations
        self._reversals: dict = {}  # signs of the states → function of parameters

    @cached_property
    def _forces(self):
        """Functions of parameters: 0 where forces are even in q̇, where P = 0, where P + 2R is a drag, and this drag."""
        equations, system = self.equations, self.equations.system
        q, v, still = equations.q, equations.v, equations.still
        turned, R = {x: -x for x in v}, sum(system.dissipation_terms, sp.Integer(0))
        Q = [system.forces.get(x, sp.Integer(0)) - R.diff(y) for x, y in zip(q, v, strict=True)]
        rest = [e.subs(still) for e in Q]
        curls = [rest[i].diff(q[j]) - rest[j].diff(q[i]) for i in range(len(q)) for j in range(i)]
        power = sum((e - e0) * y for e, e0, y in zip(Q, rest, v, strict=True))
        lost = R + R.subs(turned, simultaneous=True) - 2 * R.subs(still)  # twice the part of second degree
        uneven = [e - e.subs(turned, simultaneous=True) for e in equations.forces]
        terms = sp.Add.make_args(sp.expand(power + lost, power_exp=False))
        drags = [e for e in terms if e.as_independent(*equations.states, as_Add=False)[1].is_nonnegative]
        others = [e for e in terms if e not in drags]
        return [self._factors(e) for e in (uneven, [*curls, power], [*curls, *others], drags)]

    def _factors(self, expressions):
        return lambdified(self.equations.parameters, factors(expressions, self.equations.states))

    def _holds(self, function, parameters):
        """Return where all factors vanish, shape (points,); equations that contain the time prove nothing."""
        holds = np.full(parameters[0].size, not self.equations.timed)
        for factor in function(*parameters):
            holds &= factor == 0.0
        return holds

    def keeps_energy(self, parameters) -> np.ndarray:
        """Return where no motion of coordinates gains energy: T, V and the potential of the forces at rest."""
        if self.equations.conservative:
            return np.ones(parameters[0].size, dtype=bool)
        if not self.equations.v:
            return np.zeros(parameters[0].size, dtype=bool)
        falls = [factor <= 0.0 for factor in self._forces[3](*parameters)]
        return self._holds(self._forces[2], parameters) & np.all(falls, axis=0)

    def has_pairs(self, parameters, place, terms) -> np.ndarray:
        """Return where the equations prove that eigenvalues come in pairs.

        Args:
            parameters: List of arrays (points,).
            place: Equilibria, shape (points, m).
            terms: Absolute values of the Jacobian's terms, (points, m, n): of states, what vanishes separates them into
                two classes, each of which acts on the other alone. Where each change of signs moves the equilibrium,
                these classes are all the proof there is.
        """
        if self.equations.conservative:
            return np.ones(len(place), dtype=bool)
        if self.equations.v:
            return np.any([self._holds(function, parameters) for function in self._forces[:2]], axis=0)
        n, proved = self.equations.n, np.zeros(len(place), dtype=bool)
        acting = terms + np.swapaxes(terms, 1, 2) > 0.0
        bits = np.packbits(np.concatenate([acting.reshape(-1, n * n), place != 0.0], axis=1), axis=1)
        _, first, number = np.unique(bits, axis=0, return_index=True, return_inverse=True)
        for k, i in enumerate(first):
            rows, changes = np.flatnonzero(number.ravel() == k), sign_changes(acting[i])
            fixed = [signs for signs in changes if not place[i][np.array(signs) < 0].any()][:MAX_REVERSALS]
            holds = [self._holds(self._reversal(signs), [p[rows] for p in parameters]) for signs in fixed]
            proved[rows] = np.any(holds, axis=0) if fixed else bool(changes)
        return proved

    def _reversal(self, signs):
        """Return the function of parameters that vanishes where x → signs x reverses the time."""
        if signs not in self._reversals:
            states, f = self.equations.states, self.equations.f
            flipped = {x: sign * x for x, sign in zip(states, signs, strict=True)}
            kept = [e.subs(flipped, simultaneous=True) + sign * e for e, sign in zip(f, signs, strict=True)]
            self._reversals[signs] = self._factors(kept)
        return self._reversals[signs]


def sign_changes(acting) -> list[tuple[int, ...]]:
    """Return the signs of states of two classes, each of which acts on the other alone: every choice of -1 and 1."""
    choices = [()]
    for i, row in enumerate(acting):
        others = np.flatnonzero(row[:i])
        choices = [(*signs, x) for signs in choices for x in (1, -1) if all(signs[j] != x for j in others)]
        choices = [] if row[i] else choices
    return choices
