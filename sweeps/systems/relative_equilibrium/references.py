"""Eigenvalues of relative equilibria found again: by LAPACK from a differenced Jacobian, and by SciPy from motions.

A complex step differences the rates. Motions are carried for 1/S from both sides of the equilibrium in every direction
that what is conserved leaves free; the logarithms of that map's eigenvalues are the rates.

The equations are the description's, as SymPy writes them for NumPy; nothing here shares code with the generated
integrators, the estimator or theory's Jacobian. Of where the equilibrium is, only that it is one is looked at.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from sweeps.systems.reintegration import rates_of
from sweeps.systems.system import Reference

if TYPE_CHECKING:
    from sweeps.mechanics.model import Model
    from sweeps.systems.relative_equilibrium.system import RelativeEquilibrium

STEP = 1e-30  # of a complex step: its square is nothing beside a double
NUDGE = 3e-5  # of a motion: its cube, and DOP853's tolerance over it, weigh alike
TOLERANCE = 1e-13
RANK = 1e-9
STILL = 1e-9  # of the scale and the states' sizes: how far from rest an equilibrium may be
JACOBIAN, MOTION = 1e-12, 1e-7  # of the scale: errors of the two ways, for condition numbers of one
NEAR = (1e-7, 1e-4)  # of the scale: imaginary parts so far apart may be in either order
KEPT = 10_000  # points that are not looked at once more for the next variable
POWERS = {"sum_of_squares": 2, "product_of_squares": 4, "discriminant": 4}


@dataclass(frozen=True)
class Solved:
    """What one way finds at one point: eigenvalues in order (NaN where it cannot tell), conditions, S, the error."""

    values: np.ndarray
    condition: np.ndarray
    scale: float
    error: float


class Linearised:
    """The equations of a description as NumPy has them, and the eigenvalues of its points.

    Of the model, only the equations, the names and where the equilibria are is used.
    """

    def __init__(self, model: "Model"):
        import sympy as sp

        self.model, equations = model, model.equations
        self.rates = rates_of(equations)
        conserved = list(equations.system.conserved_quantities.values())
        self._conserved = sp.lambdify((*equations.parameters, *equations.states), conserved, "numpy")
        self._solved = lru_cache(KEPT)(self._solve)

    def at(self, point: Mapping[str, object]) -> tuple[Solved, Solved]:
        """Return eigenvalues at a point from a differenced Jacobian and from motions."""
        parameters = tuple(float(point[name]) for name in self.model.names) or (0.0,)
        return self._solved(parameters, self.model.system.names.index(str(point["equilibrium"])))

    def _solve(self, parameters, slot):
        point = {name: np.array([value]) for name, value in zip(self.model.names, parameters, strict=False)}
        theory = self.model.theory(point | {"equilibrium": np.array([slot])})
        x, S, sizes = np.zeros(self.model.equations.n), float(theory["scale"][0]), theory["sizes"][0]
        x[: self.model.equations.m] = theory["place"][0]
        none = Solved(np.full(self.model.n, np.nan), np.ones(self.model.n), S, 0.0)
        if not (np.isfinite(x).all() and np.isfinite(S)) or np.abs(self.rates(parameters, x) / sizes).max() > STILL * S:
            return none, none
        basis = self._free(parameters, x, sizes)
        steps = 1j * STEP * sizes * np.eye(x.size)
        J = np.array([self.rates(parameters, x + step).imag / STEP / sizes for step in steps]).T
        moved = self._moved(parameters, x, sizes, basis, 1.0 / S)
        by_matrix = _solved(np.linalg.eig(basis.T @ J @ basis), S, JACOBIAN)
        return by_matrix, _solved(_of_map(basis.T @ moved, 1.0 / S), S, MOTION)

    def _free(self, parameters, x, sizes):
        """Return the directions that leave the conserved quantities as they are, in units of the sizes."""
        if not self.model.system.conserved_quantities:
            return np.eye(x.size)
        steps = 1j * STEP * sizes * np.eye(x.size)
        slopes = [np.imag(self._conserved(*parameters, *(x + step))) / STEP for step in steps]
        _, singular, vh = np.linalg.svd(np.array(slopes, dtype=float).T)
        return vh[int((singular > RANK * singular.max()).sum()) :].T

    def _moved(self, parameters, x, sizes, basis, duration):
        """Return perturbations in each direction of the basis after a time, over their size; from both sides."""
        from scipy.integrate import solve_ivp

        starts = np.concatenate([basis.T, -basis.T]) * (NUDGE * sizes)

        def rates(_, deviations):
            states = x + deviations.reshape(starts.shape)
            return np.array([self.rates(parameters, state) for state in states]).ravel()

        least = TOLERANCE * NUDGE * np.tile(sizes, len(starts))
        solution = solve_ivp(rates, (0.0, duration), starts.ravel(), "DOP853", rtol=TOLERANCE, atol=least)
        ends = solution.y[:, -1].reshape(starts.shape) / (NUDGE * sizes)
        return 0.5 * (ends[: basis.shape[1]] - ends[basis.shape[1] :]).T


def _of_map(matrix, duration):
    values, right = np.linalg.eig(matrix)
    return np.log(values.astype(complex)) / duration, right


def _solved(values_and_vectors, S, error):
    """Return eigenvalues in a map's order, with condition numbers; NaN where the order depends on their errors."""
    values, right = values_and_vectors
    order = np.argsort(values.imag)
    values, right = values[order].astype(complex), right[:, order]
    gaps = np.diff(values.imag) / S
    clear = not ((gaps > NEAR[0]) & (gaps < NEAR[1])).any()
    first = np.concatenate([[0], np.flatnonzero(gaps > NEAR[0]) + 1, [values.size]])
    number = np.concatenate([a + np.argsort(values.real[a:b]) for a, b in pairwise(first)])
    values, right = values[number], right[:, number]
    with np.errstate(all="ignore"):
        try:
            condition = np.linalg.norm(np.linalg.inv(right), axis=1)
        except np.linalg.LinAlgError:
            condition = np.full(values.size, np.inf)
    return Solved(values if clear else np.full(values.size, np.nan), condition, S, error)


def _off(solved: Solved, number: int) -> float:
    """Return a bound of this way's error, s-1: the matrix's, times the condition or by its root."""
    n = solved.values.size
    return solved.scale * min(10.0 * solved.error * float(solved.condition[number]), (n * solved.error) ** (1.0 / n))


def _eigenvalue(part: str) -> Callable:
    return lambda solved, k: (getattr(solved.values[k], part), _off(solved, k))


def _growth(solved: Solved, _) -> tuple[float, float]:
    return solved.values.real.max(), max(_off(solved, k) for k in range(solved.values.size))


def _invariant(name: str) -> Callable:
    def value(solved, _):
        S, D = 0.5 * (solved.values**2).sum().real, solved.values.prod().real
        values = {"sum_of_squares": S, "product_of_squares": D, "discriminant": S * S - 4.0 * D}
        return values[name], 100.0 * JACOBIAN * solved.scale ** POWERS[name]

    return value


def _again(equations: Linearised, quantity: Callable, which: int) -> tuple[Callable, Callable]:
    """Return a quantity by one of the two ways, and the allowed deviation, as functions of a point."""

    def at(point):
        return quantity(equations.at(point)[which], int(point["eigenvalue"]) - 1)

    return lambda point, _: float(at(point)[0]), lambda point, _: float(at(point)[1])


def reference(system: "RelativeEquilibrium") -> Reference:
    """Return what `verify` measures again: theory with LAPACK, measured values with SciPy, within their errors.

    Invariants, which are determinants of the Jacobian, come from LAPACK both times.
    """
    equations, references = Linearised(system.mechanism), []
    quantities = {f"eigenvalue_{part}": _eigenvalue(part) for part in ("real", "imag")} | {"growth_rate": _growth}
    quantities |= {name: _invariant(name) for name in POWERS if system.mechanism.n == 4}
    for name, quantity in quantities.items():
        for suffix in ("_theory", ""):
            by_motions = not suffix and name not in POWERS
            value, allowed = _again(equations, quantity, by_motions)
            way = "SciPy DOP853" if by_motions else "LAPACK"
            references.append(Reference(f"{name}{suffix}", {way: value}, allowed, within_error=not suffix))
    return replace(references[0], more=tuple(references[1:]))
