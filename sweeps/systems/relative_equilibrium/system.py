"""Relative equilibria of a described system, by their eigenvalues.

The descriptions are those of `sweeps/mechanics/library/relative`, and any Python file named in a definition with
equations of first order (see `sweeps.mechanics.equations`).
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import pairwise
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from pydantic import BeforeValidator

from sweeps.process.machine import num_processors
from sweeps.schema.definition import Definition, Integration
from sweeps.schema.parameters import key, mapping
from sweeps.schema.values import Positive, Tolerance, integer
from sweeps.schema.variables import Role, Variable, table
from sweeps.systems import invariants
from sweeps.systems.described import MECHANICS, PLANNING, SEARCH, Described
from sweeps.systems.invariants import Columns, Invariant
from sweeps.systems.reintegration import rates_of
from sweeps.systems.shared_variables import make_epsilon, make_layout, parse_rows, regime_pair, run_rows, with_theory
from sweeps.systems.system import Cost, Example, Reference

if TYPE_CHECKING:
    from sweeps import mechanics
    from sweeps.mechanics.model import Model


# Regimes in the order of their codes in a map, from -1.
REGIMES = ("undetermined", "asymptotically_stable", "stable", "unstable", "flutter", "marginal")

_BOUND = "bound of scatter, rounding, integration error and the effect of the finite perturbation, each at its worst"
_RATE = {"error": f"{_BOUND}; grows as a root of the noise where eigenvalues meet", "scale": "rate_scale"}
_REAL = "real part of the eigenvalue (positive: growth, negative: decay)"
_IMAG = "imaginary part of the eigenvalue (angular frequency)"
_GROWTH = "largest real part of all eigenvalues (negative: decay)"


def _measured(name: str, units: str, long_name: str, error: str = _BOUND, **more) -> tuple[Variable, ...]:
    return with_theory(name, units, long_name, error, name, **more)


VARIABLES = parse_rows(
    *_measured("eigenvalue_real", "s-1", _REAL, **_RATE),
    *_measured("eigenvalue_imag", "s-1", _IMAG, **_RATE),
    *_measured("growth_rate", "s-1", _GROWTH, role=Role.MEASUREMENT, **_RATE),
    *regime_pair(
        REGIMES,
        "stable, too, where motions end at a family of equilibria, or a conserved quantity or the energy is proved to "
        "be definite; unstable, too, where the kind of growth is open; marginal where errors leave it open",
    ),
    """
    eigenvalue_condition     1  condition number of the eigenvalue, linear theory: sensitivity to changes of the
        equations
        comment: product of the norms of its left and right eigenvectors, in units of the states; infinite where two
        meet
    smallest_singular_value  1  ratio of the smallest singular value of the samples to the largest
        comment: below 1.5e-4 a mode was not excited, and nothing is reported
    """,
    *run_rows("the Jacobian", ", of the shortest run"),
)

INVARIANTS = table(  # additional variables of systems with four eigenvalues
    *_measured("sum_of_squares", "s-2", "half the sum of the squared eigenvalues (pairs ±a, ±b: a² + b²)"),
    *_measured("product_of_squares", "s-4", "product of the eigenvalues (pairs ±a, ±b: a² b²)"),
    *_measured("discriminant", "s-4", "sum_of_squares² - 4 product_of_squares (pairs ±a, ±b: (a² - b²)²)"),
)

_UNITS = "; motions are carried in units of it, so that none is too small"
PERTURBATION_PARAMETERS = (make_epsilon(1e-30, "the size of the system", "relative to the size of the system", _UNITS),)

_EIGENVALUE = Variable("eigenvalue", "1", "eigenvalue, by ascending imaginary, then real part", "i1")
LAYOUT = make_layout(PERTURBATION_PARAMETERS, _EIGENVALUE, 60, VARIABLES | INVARIANTS, VARIABLES)
COORDINATES = LAYOUT.coordinates  # the coordinates without the parameters


MAX_RUNS = 4
NUMBER = integer(1, MAX_RUNS, f"a whole number from 1 to {MAX_RUNS}")


class FlowIntegration(Integration):
    """Length, accuracy and number of the runs from a relative equilibrium."""

    rotations: Positive = key("length of a run in cycles of the system's scale, 2π/rate_scale: > 0", 4.0)
    tolerance: Tolerance = key("relative error allowed on the motion, 1e-13 to 1e-3", 1e-12)
    runs: Annotated[int | None, BeforeValidator(lambda runs: runs if runs is None else NUMBER.func(runs))] = key(
        f"runs of each point, in different directions: 1 to {MAX_RUNS}; equal modes need one each; "
        "default one for every two eigenvalues, from two to four"
    )


class FlowDefinition(Definition):
    """A sweep of relative equilibria; each system's own model has its parameters in `grid`."""

    integration: FlowIntegration = mapping("how each run is made", FlowIntegration)


SAMPLE_BYTES = 256  # memory of a number for each motion of a block


class RelativeEquilibrium(Described):
    """The full equations of a described system near each of its relative equilibria, by their eigenvalues."""

    samples_per_second = 2_000_000  # including the evaluation of a point
    picture_seconds = 2.5
    method_text = "direct integration of the full equations of motion"
    kernels = ("flow.flows", "search.enclosures", "search.roots", "flow.jacobians", "flow.matrices")
    shared_seconds = 20.0
    compiled = (Example("flow.flows"), SEARCH, PLANNING)
    library = MECHANICS / "library" / "relative"
    base_model = FlowDefinition
    marker = "eigenvalue"
    num_jumping_invariants = 1  # the squared difference jumps if a third eigenvalue grows faster
    spectrum = ("eigenvalue",)
    several: Mapping[str, str] = {**Described.several, "eigenvalue": "eigenvalues"}
    literature = "Merkin, Introduction to the Theory of Stability, chapter 6"
    map_content = "measured eigenvalues of motions about each equilibrium, compared with linear theory"

    @staticmethod
    def describes(description: "mechanics.System") -> bool:
        """Return True if a description has forces that are not those of a potential and of T = ½ a_ij q̇_i q̇_j."""
        from sweeps.mechanics.derivation import derive

        return not derive(description).natural

    def constants(self) -> dict[str, Any]:
        """Return how bodies and moments give the points of a satellite's system; {} of other systems."""
        from sweeps.systems.bodies import satellites

        parameters = self.description.parameters
        meanings = {name: parameters[name].meaning for name in satellites.RATIOS if name in parameters}
        return {"list_points": staticmethod(satellites.list_points)} if meanings == satellites.RATIOS else {}

    def numbers(self) -> dict[str, np.ndarray]:
        """Return the eigenvalues of an equilibrium."""
        return {"eigenvalue": np.arange(1, self.mechanism.n + 1, dtype=np.int8)}

    def variables(self, definition: Definition | None = None) -> dict[str, Variable]:
        """Return name → variable, with invariants of four eigenvalues, drifts and equilibrium states."""
        if definition is None:
            return VARIABLES
        model = self.mechanism
        change = "  1  largest change of the conserved {}, relative [check]"
        drifts = parse_rows(*(f"{name}_drift{change.format(name.replace('_', ' '))}" for name in model.quantities))
        return VARIABLES | (INVARIANTS if model.n == 4 else {}) | drifts | self.places()

    def has_pairs(self, columns: Columns) -> np.ndarray:
        """Return True if the odd power sums of the eigenvalues vanish but for rounding."""
        return ~(invariants.odd_power_sums(columns) > invariants.MAX_ODD_SUM)

    def invariants(self, columns: Columns, has_pairs: np.ndarray) -> Invariant:
        """Return the invariants of eigenvalues in pairs, of growth, and of the meeting of two eigenvalues."""
        growth = [invariants.of_column(columns, "growth_rate"), invariants.squared_difference(columns)]
        return invariants.stack(invariants.of_paired_eigenvalues(columns), growth, has_pairs)

    def critical_modes(self, columns: Columns) -> tuple[np.ndarray, np.ndarray]:
        """Return number and frequency of the eigenvalue that grows fastest."""
        return invariants.fastest_mode(columns["eigenvalue_real_theory"], columns["eigenvalue_imag_theory"])

    def complex_rates(self, columns: Any) -> Any:
        """Return the measured eigenvalues and their errors."""
        errors = np.hypot(columns["eigenvalue_real_error"], columns["eigenvalue_imag_error"])
        return columns["eigenvalue_real"] + 1j * columns["eigenvalue_imag"], errors

    def columns(self, points: Mapping[str, np.ndarray], integration: FlowIntegration) -> dict[str, np.ndarray]:
        """Return linear theory and the measured columns; see `sweeps.mechanics.relative`."""
        self._load_code()
        settings = (integration.rotations, integration.samples_per_rotation, integration.tolerance)
        return self.mechanism.survey(self.slots(points), *settings, integration.runs)

    def motions(self, points: Mapping[str, np.ndarray], integration: FlowIntegration) -> int:
        """Return the number of runs of each equilibrium, which all its eigenvalues share."""
        return next(iter(points.values())).size * self._runs(integration) // self.mechanism.n

    def _runs(self, integration: FlowIntegration) -> int:
        """Return the number of runs of a point."""
        from sweeps.mechanics.relative import usual_runs

        return integration.runs or usual_runs(self.mechanism)

    def cost(self, definition: Definition) -> Cost:
        """Return the samples, and the memory for the points that all processors measure at a time."""
        from sweeps.mechanics.relative import CHUNK_BYTES, MAX_CHUNK_POINTS, W

        runs, samples = self._runs(definition.integration), definition.integration.samples
        block = SAMPLE_BYTES * runs * samples * (self.mechanism.n + 1)
        return Cost(samples, num_processors() * max(block, min(CHUNK_BYTES, MAX_CHUNK_POINTS // W * block)))

    def reference(self) -> Reference:
        """Return independent eigenvalues: theory by LAPACK, measured values by SciPy from motions."""
        return reference_of(self)


STEP = 1e-30  # complex step of a derivative, relative to the states' sizes; its square is below the rounding
PERTURBATION = 3e-5  # deviation of a motion over the states' sizes; its cube is like DOP853's tolerance over it
TOLERANCE = 1e-13  # relative error allowed on a motion
MIN_SINGULAR_VALUE = 1e-9  # singular value of the conserved quantities' gradients over the largest; below: dependent
MAX_RATE = 1e-9  # rates of the states at an equilibrium, relative to the scale times the states' sizes
JACOBIAN_ERROR, MOTION_ERROR = 1e-12, 1e-7  # errors of both methods over the scale, for a condition number of 1
AMBIGUOUS_GAP = (1e-7, 1e-4)  # differences of imaginary parts over the scale for which their order is uncertain
MAX_CACHED_POINTS = 10_000  # points with stored eigenvalues, which all variables of a point share
POWERS = {"sum_of_squares": 2, "product_of_squares": 4, "discriminant": 4}


@dataclass(frozen=True)
class Eigenvalues:
    """Eigenvalues of a point in order (NaN if the order is uncertain), condition numbers, scale and relative error."""

    values: np.ndarray
    condition: np.ndarray
    scale: float
    error: float


class Linearised:
    """The eigenvalues of points, by LAPACK from a differenced Jacobian and by SciPy from motions.

    The Jacobian is differentiated by a complex step. Motions are integrated for 1/S from both sides of the equilibrium
    in every direction that does not change the conserved quantities; the logarithms of the eigenvalues of this map,
    times S, are the eigenvalues of the Jacobian.

    The equations are the description's, as SymPy writes them for NumPy; nothing here shares code with the generated
    integrators, the estimator or theory's Jacobian. Of the model, the equations, the names and the positions of the
    equilibria are used, and only that the rates vanish there is checked.
    """

    def __init__(self, model: "Model"):
        import sympy as sp

        self.model, equations = model, model.equations
        self.rates = rates_of(equations)
        conserved_quantities = list(equations.system.conserved_quantities.values())
        self._conserved_values = sp.lambdify((*equations.parameters, *equations.states), conserved_quantities, "numpy")
        self._cached_solve = lru_cache(MAX_CACHED_POINTS)(self._solve)

    def at(self, point: Mapping[str, float | str]) -> tuple[Eigenvalues, Eigenvalues]:
        """Return eigenvalues at a point from a differenced Jacobian and from motions."""
        parameters = tuple(float(point[name]) for name in self.model.names) or (0.0,)
        return self._cached_solve(parameters, self.model.system.names.index(str(point["equilibrium"])))

    def _solve(self, parameters, slot):
        """Return eigenvalues from the Jacobian and from integrated motions; NaN if theory's state is no equilibrium."""
        point = {name: np.array([value]) for name, value in zip(self.model.names, parameters, strict=False)}
        theory = self.model.theory(point | {"equilibrium": np.array([slot])})
        x, S, sizes = np.zeros(self.model.equations.n), float(theory["scale"][0]), theory["sizes"][0]
        x[: self.model.equations.m] = theory["place"][0]
        nan_result = Eigenvalues(np.full(self.model.n, np.nan), np.ones(self.model.n), S, 0.0)
        if (
            not (np.isfinite(x).all() and np.isfinite(S))
            or np.abs(self.rates(parameters, 0.0, x) / sizes).max() > MAX_RATE * S
        ):
            return nan_result, nan_result
        basis = self._free_directions(parameters, x, sizes)
        steps = 1j * STEP * sizes * np.eye(x.size)
        J = np.array([self.rates(parameters, 0.0, x + step).imag / STEP / sizes for step in steps]).T
        propagator = self._propagate(parameters, x, sizes, basis, 1.0 / S)
        by_matrix = _sort_eigenvalues(np.linalg.eig(basis.T @ J @ basis), S, JACOBIAN_ERROR)
        multipliers, right = np.linalg.eig(basis.T @ propagator)
        return by_matrix, _sort_eigenvalues((np.log(multipliers.astype(complex)) * S, right), S, MOTION_ERROR)

    def _free_directions(self, parameters, x, sizes):
        """Return the directions that do not change the conserved quantities, in units of the sizes."""
        if not self.model.system.conserved_quantities:
            return np.eye(x.size)
        steps = 1j * STEP * sizes * np.eye(x.size)
        slopes = [np.imag(self._conserved_values(*parameters, *(x + step))) / STEP for step in steps]
        _, singular, vh = np.linalg.svd(np.array(slopes, dtype=float).T)
        return vh[int((singular > MIN_SINGULAR_VALUE * singular.max()).sum()) :].T

    def _propagate(self, parameters, x, sizes, basis, duration):
        """Return perturbations in each direction of the basis after `duration`, over their size, from both sides."""
        from scipy.integrate import solve_ivp

        starts = np.concatenate([basis.T, -basis.T]) * (PERTURBATION * sizes)

        def rates(_, deviations):
            states = x + deviations.reshape(starts.shape)
            return np.array([self.rates(parameters, 0.0, state) for state in states]).ravel()

        tolerances = TOLERANCE * PERTURBATION * np.tile(sizes, len(starts))
        solution = solve_ivp(rates, (0.0, duration), starts.ravel(), "DOP853", rtol=TOLERANCE, atol=tolerances)
        ends = solution.y[:, -1].reshape(starts.shape) / (PERTURBATION * sizes)
        return 0.5 * (ends[: basis.shape[1]] - ends[basis.shape[1] :]).T


def _sort_eigenvalues(values_and_vectors, S, error):
    """Return eigenvalues in a map's order, with condition numbers; NaN if the order depends on their errors."""
    values, right = values_and_vectors
    order = np.argsort(values.imag)
    values, right = values[order].astype(complex), right[:, order]
    gaps = np.diff(values.imag) / S
    has_clear_order = not ((gaps > AMBIGUOUS_GAP[0]) & (gaps < AMBIGUOUS_GAP[1])).any()
    group_starts = np.concatenate([[0], np.flatnonzero(gaps > AMBIGUOUS_GAP[0]) + 1, [values.size]])
    sorted_numbers = np.concatenate([a + np.argsort(values.real[a:b]) for a, b in pairwise(group_starts)])
    values, right = values[sorted_numbers], right[:, sorted_numbers]
    with np.errstate(all="ignore"):
        try:
            condition = np.linalg.norm(np.linalg.inv(right), axis=1)
        except np.linalg.LinAlgError:
            condition = np.full(values.size, np.inf)
    return Eigenvalues(values if has_clear_order else np.full(values.size, np.nan), condition, S, error)


def _error_bound(eigenvalues: Eigenvalues, number: int) -> float:
    """Return a bound of the method's error, s-1: that of the matrix times the condition number, or its n-th root."""
    n = eigenvalues.values.size
    return eigenvalues.scale * min(
        10.0 * eigenvalues.error * float(eigenvalues.condition[number]), (n * eigenvalues.error) ** (1.0 / n)
    )


def _eigenvalue(name: str) -> Callable:
    return lambda eigenvalues, k: (getattr(eigenvalues.values[k], name), _error_bound(eigenvalues, k))


def _growth(eigenvalues: Eigenvalues, _) -> tuple[float, float]:
    return eigenvalues.values.real.max(), max(_error_bound(eigenvalues, k) for k in range(eigenvalues.values.size))


def _invariant(name: str) -> Callable:
    """Return (eigenvalues, _) → (value, error) of an invariant of two modes: S = Σλ²/2, D = Πλ or S² - 4D."""

    def value(eigenvalues, _):
        S, D = 0.5 * (eigenvalues.values**2).sum().real, eigenvalues.values.prod().real
        values = {"sum_of_squares": S, "product_of_squares": D, "discriminant": S * S - 4.0 * D}
        return values[name], 100.0 * JACOBIAN_ERROR * eigenvalues.scale ** POWERS[name]

    return value


def _reference_functions(equations: Linearised, quantity: Callable, index: int) -> tuple[Callable, Callable]:
    """Return a quantity by method `index`, and the allowed deviation, as functions of a point."""

    def at(point):
        return quantity(equations.at(point)[index], int(point["eigenvalue"]) - 1)

    return lambda point, _: float(at(point)[0]), lambda point, _: float(at(point)[1])


def reference_of(system: RelativeEquilibrium) -> Reference:
    """Return references: linear theory by LAPACK, and measured values by SciPy, which may deviate by their errors.

    Invariants, which are determinants of the Jacobian, come from LAPACK both times.
    """
    equations, references = Linearised(system.mechanism), []
    quantities = {f"eigenvalue_{name}": _eigenvalue(name) for name in ("real", "imag")} | {"growth_rate": _growth}
    quantities |= {name: _invariant(name) for name in POWERS if system.mechanism.n == 4}
    for name, quantity in quantities.items():
        for suffix in ("_theory", ""):
            by_motions = not suffix and name not in POWERS
            value, allowed = _reference_functions(equations, quantity, by_motions)
            method = "SciPy DOP853" if by_motions else "LAPACK"
            references.append(Reference(f"{name}{suffix}", {method: value}, allowed, within_error=not suffix))
    return replace(references[0], more=tuple(references[1:]))


KIND = RelativeEquilibrium
