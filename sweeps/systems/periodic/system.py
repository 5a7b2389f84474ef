"""A described system with equations that are periodic in time, by its Floquet multipliers.

The descriptions are those of `sweeps/mechanics/library/periodic`, and any Python file that defines a period.
"""

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cache, partial
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from pydantic import Field

from kernels.flow.codes import INVARIANTS as NAMES
from kernels.flow.codes import REGIMES
from sweeps.schema.definition import Definition
from sweeps.schema.parameters import Strict, mapping
from sweeps.schema.values import Tolerance
from sweeps.schema.variables import Role, Variable, table
from sweeps.systems import invariants
from sweeps.systems.described import ENCLOSURES, MECHANICS, PATHS, Described
from sweeps.systems.invariants import Columns, Invariant, SpectralSystem
from sweeps.systems.reintegration import integrate_monodromy, rates_of
from sweeps.systems.shared_variables import make_epsilon, make_layout, make_status, parse_rows, regime_pair, with_theory
from sweeps.systems.system import Example, Reference

if TYPE_CHECKING:
    from sweeps import mechanics
    from sweeps.mechanics.mode_shapes import ModeShapes
    from sweeps.mechanics.taylor import Generated


_BRANCH = "continuous from small modulation; multiples of 2 pi/T lie between the branches"
_PER_MULTIPLIER = ("multiplier",)
MULTIPLIER = Variable("multiplier", "1", "multiplier, by falling modulus, then argument", "i1")
LONG_NAMES = ("trace a of the monodromy matrix M", "(a² - tr M²)/2", "a² - 4b + 8", "det(M - 1)", "det(M + 1)")


_ERROR = "a bound: what the steps leave out, what the size changes, and rounding"


def _measured(*names: str, comment: str = "", **more) -> tuple[Variable, ...]:
    return with_theory(*names, _ERROR, comment=comment, **more)


MULTIPLIERS = parse_rows(
    *_measured("multiplier_real", "1", "real part of the multiplier over one period", over=_PER_MULTIPLIER),
    *_measured("multiplier_imag", "1", "imaginary part of the multiplier over one period", over=_PER_MULTIPLIER),
    *_measured("exponent_real", "s-1", "real part of the exponent: growth, or decay below 0", over=_PER_MULTIPLIER),
    *_measured(
        "exponent_imag", "s-1", "imaginary part of the exponent: turning", comment=_BRANCH, over=_PER_MULTIPLIER
    ),
    *_measured("growth_rate", "s-1", "largest real part of the exponents", role=Role.MEASUREMENT),
    *_measured("growth_per_period", "1", "growth rate times the period"),
    *_measured("trace", "1", "trace of the monodromy matrix", scale="trace_error"),
    *regime_pair(
        REGIMES,
        "by the smooth invariants of the monodromy matrix, or of its independent blocks, and their errors; unstable, "
        "too, where the kind of growth is open; marginal where the errors leave it open",
    ),
    """
    determinant_residual  1  f4  distance of the measured determinant from that of Liouville's formula, relative to its
        terms
    reciprocity_residual  1  f4  distance of the measured multipliers from pairs of product 1, likewise; of the
        determinant without pairs
    phase_residual        1  f4  distance of the traces of the variational flow from two phases of the period, relative
        to the matrix [check]
    propagation_error     1  f4  largest distance of the measured monodromy matrix from the variational flow's, relative
        to the matrix [certificate]
        comment: the certificate: the variational flow over one period shares no code with the measurement
    steps                 1  i4  number of segments of a period from whose ends perturbed motions start
    """,
    make_status(),
)
VARIABLES = MULTIPLIERS | parse_rows(
    """
    base_residual  1  distance of the base motion from where it began a period before, relative to the states' sizes
        comment: 0 for an equilibrium at all times
    """
)
INVARIANTS = table(  # additional variables of two degrees of freedom, by Hamilton's equations
    *(v for name, words in zip(NAMES, LONG_NAMES, strict=True) for v in with_theory(name, "1", words, _ERROR))
)
BRANCH = parse_rows(  # additional variable of descriptions that request further branches
    """
    branch  1  i1  number of the motion on the curve that leads from the named place as the drive grows; 0 if missing
        comment: 1 before the first fold; each fold adds 1
    """
)

_WHERE = "where a segment of the period begins, relative to the states' sizes"
PERTURBATION_PARAMETERS = (make_epsilon(1e-8, "the size of the system", _WHERE),)
REQUIRED = [name for name, variable in VARIABLES.items() if not variable.over]  # slices have no multipliers
LAYOUT = replace(
    make_layout(PERTURBATION_PARAMETERS, MULTIPLIER, 24, VARIABLES | INVARIANTS | BRANCH, REQUIRED),
    spare=(MULTIPLIER.name,),
)
COORDINATES = LAYOUT.coordinates


class OnePeriod(Strict):
    """Accuracy of the integration of each period."""

    tolerance: Tolerance = Field(
        1e-12, description="truncation that the steps of one period may make, relative to the motion: 1e-13 to 1e-3"
    )

    @property
    def samples(self) -> int:
        """Return 1: the time estimate counts periods, not samples."""
        return 1


class PeriodicDefinition(Definition):
    """A sweep of systems that are periodic in time; each system's own model has its parameters in `grid`."""

    integration: OnePeriod = mapping("how each period is followed", OnePeriod)


class FloquetSystem(SpectralSystem):
    """A system with a motion of known period at each point, and its multipliers."""

    kernels: tuple[str, ...] = (
        *(
            "search.enclosures",
            "flow.floquet",
            "flow.jacobians",
            "flow.matrices",
            "flow.monodromy",
            "flow.paths",
            "flow.runs",
            "estimator.statuses",
            "compile.llvm_formulas",
        ),
        "flow.variational",
    )
    compiled = (Example("flow.variational"), PATHS)  # the tangent flow is composed by kernels of flow.monodromy
    change_kinds: Mapping[str, str] = {
        "unstable": "positive_multiplier",
        **{name: name for name in ("period_doubling", "flutter")},
    }
    paired_change_kinds: Mapping[str, str] = {"flutter": "krein"}

    def has_pairs(self, columns: Columns) -> np.ndarray:
        """Return True if the measured multipliers come in pairs of product 1 but for rounding."""
        return ~(columns["reciprocity_residual"] > invariants.MAX_RECIPROCITY_RESIDUAL)

    def invariants(self, columns: Columns, has_pairs: np.ndarray) -> Invariant:
        """Return the invariants of multipliers in pairs, and of growth."""
        growth = [invariants.of_column(columns, "growth_per_period")]
        return invariants.stack(invariants.of_multipliers(columns), growth, has_pairs)

    def critical_modes(self, columns: Columns) -> tuple[np.ndarray, np.ndarray]:
        """Return number and frequency of the multiplier that grows fastest."""
        return invariants.fastest_mode(columns["exponent_real_theory"], columns["exponent_imag_theory"])


class Periodic(FloquetSystem, Described):
    """The full equations of a described system near a motion of their own period, by its multipliers."""

    samples_per_second = 5_000
    start_seconds = 2.5
    shared_seconds = 13.0
    method_text = "direct integration of the full equations over one period, certified by the variational flow"
    library = MECHANICS / "library" / "periodic"
    base_model = PeriodicDefinition
    marker = "phase_residual"
    literature = "Yakubovich and Starzhinskii, Linear Differential Equations with Periodic Coefficients (1975)"
    map_content = "measured multipliers of a periodic motion, compared with the variational flow"

    @staticmethod
    def describes(description: "mechanics.System") -> bool:
        """Return True if a description defines a period."""
        return description.given_period is not None

    def numbers(self) -> dict[str, np.ndarray]:
        """Return no dimension, as multipliers are an extra dimension of variables."""
        return {}

    def extra_dimensions(self, definition: Definition) -> dict[str, np.ndarray]:
        """Return the multipliers of a point."""
        return {"multiplier": np.arange(1, self.mechanism.equations.n + 1, dtype=np.int8)}

    def variables(self, definition: Definition | None = None) -> dict[str, Variable]:
        """Return name → variable, with the invariants of two degrees of freedom, a requested branch and the start."""
        if definition is None:
            return VARIABLES
        optional = INVARIANTS if self.mechanism.equations.n == 4 else {}
        if max(self.description.branches.values(), default=1) > 1:
            optional = optional | BRANCH
        return VARIABLES | optional | self.places()

    def places(self) -> dict[str, Variable]:
        """Return name → variable of the base motion's start along each coordinate, velocity or state."""
        variables = self.description.kept or self.description.states.values()
        names = [(p.name, p.unit, p.meaning) for p in variables]
        if self.description.kept:
            names += [(p.velocity.name, f"{p.unit} s-1", f"rate of change of {p.meaning}") for p in variables]
        return table(*(Variable(f"{n}_start", unit, f"{words}, where a period begins") for n, unit, words in names))

    def columns(self, points: Mapping[str, np.ndarray], integration: OnePeriod) -> dict[str, np.ndarray]:
        """Return the columns of the variational flow and of the measurement; see `sweeps.mechanics.periodic`."""
        from sweeps.mechanics import periodic

        columns = periodic.survey(self.mechanism, self.slots(points), integration.tolerance)
        missing = np.full(len(columns["trace"]), np.nan)
        return {name: columns.get(name, missing) for name in self.variables(PeriodicDefinition)}

    def components(self) -> list[str]:
        """Return the names of all states, velocities too: those at the start of a period make a mode."""
        return [str(state) for state in self.mechanism.equations.states]

    def complex_rates(self, columns: Any) -> Any:
        """Return the measured exponents and their errors."""
        errors = np.hypot(columns["exponent_real_error"], columns["exponent_imag_error"])
        return columns["exponent_real"] + 1j * columns["exponent_imag"], errors

    def mode_shapes(
        self, arguments: Mapping[str, np.ndarray], integration: Any = None
    ) -> "tuple[ModeShapes, ModeShapes, np.ndarray]":
        """Return predicted shapes, measured shapes, and theory's states, as of `Described.mode_shapes`."""
        from sweeps.mechanics import mode_shapes

        tolerance = integration.tolerance if integration else None
        return mode_shapes.floquet_shapes(self.mechanism, self.slots(arguments), tolerance)

    def refusal(self, values: list[np.ndarray]) -> str:
        """Return why none of these points has a periodic motion to measure; "" if one has."""
        from sweeps.mechanics import periodic

        return periodic.refusal(self.mechanism, values)

    def examples(self, definition: Definition | None = None) -> tuple[Example, ...]:
        """Return the calls of all periodic systems, and the enclosures of functions of time other than sine waves."""
        encloses = self.mechanism.steepness.functions or self.description.switches
        return *super().examples(definition), *([ENCLOSURES] if encloses else [])

    def _code(self) -> "Generated":
        return self.mechanism.perturbed_code(True)

    def reference(self) -> Reference:
        """Return the trace of the monodromy matrix by SciPy."""
        return reference_of(self)


STEP = 1e-30  # complex step of a derivative; its square is below the rounding
MAX_PERIOD_ANGLE = 1000.0  # rad, the fastest rate times the period; SciPy does not integrate longer periods


def reference_of(system: Periodic) -> Reference:
    """Return the trace by SciPy's DOP853 on the variational equations.

    The equations are the description's, as SymPy writes them for NumPy, differentiated by a complex step, without code
    of the generated integrators or theory's Jacobian. Only the states of the base motion at the starts of segments are
    theirs; segments are so short that no large multiplier ruins the motion.
    """
    from sweeps.mechanics.periodic import BaseMotions

    model = system.mechanism
    rates = rates_of(model.equations)

    @cache
    def trace(parameter_values, slot):
        """Return the trace of the monodromy matrix, or NaN if the period is too long for a tolerable error."""
        base = BaseMotions(model, [np.array([value]) for value in parameter_values], np.array([slot]))
        count, period = model.equations.n, float(base.period[0])
        num_segments, product = int(max(base.num_nodes, base.num_pieces)[0]), np.eye(count)
        if not period * base.scale[0] < MAX_PERIOD_ANGLE:
            return np.nan

        def jacobian(values, time, state):
            """Return the derivatives of the rates by the states."""
            return np.array([rates(values, time, state + step).imag / STEP for step in 1j * STEP * np.eye(count)]).T

        starts, _, parameters = base.between_jumps(np.arange(num_segments) / num_segments)  # they end at the jumps
        parameters = np.array([np.broadcast_to(values, (num_segments, 1))[:, 0] for values in parameters])
        for number, times in enumerate(pairwise(period * np.append(starts, 1.0))):
            node = base.nodes[0, min(number, int(base.num_nodes[0]) - 1)]
            functions = (partial(function, tuple(parameters[:, number])) for function in (rates, jacobian))
            product = integrate_monodromy(*functions, node, product, times)[1]
        return float(np.trace(product))

    def of_point(point):
        parameter_values = tuple(float(point[name]) for name in model.names) or (0.0,)
        return trace(parameter_values, model.system.names.index(str(point["equilibrium"])))

    return trace_reference(of_point)


def trace_reference(trace: Callable[[Mapping], float]) -> Reference:
    """Return a reference for traces, from the function that computes that of a point."""

    def allowed(point, _):
        return 1e-9 * max(1.0, abs(trace(point)))

    return Reference("trace", {"SciPy DOP853": lambda point, _: trace(point)}, allowed, within_error=True)


KIND = Periodic
