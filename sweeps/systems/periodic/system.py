"""A described system whose equations are periodic in time, by its Floquet multipliers: its definition and columns.

One `Periodic` a description: those of `sweeps/mechanics/library/periodic`, and any Python file that says a period.
"""

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from pydantic import Field

from sweeps.schema.definition import Definition
from sweeps.schema.parameters import Strict, mapping
from sweeps.schema.values import Tolerance
from sweeps.schema.variables import Variable, table
from sweeps.systems.described import MECHANICS, PATHS, SEARCH, Described
from sweeps.systems.periodic import variables as tables
from sweeps.systems.periodic.variables import BRANCH, INVARIANTS, VARIABLES
from sweeps.systems.system import Kernel

if TYPE_CHECKING:
    from sweeps import mechanics
    from sweeps.mechanics.taylor import Code


class OnePeriod(Strict):
    """How each period is followed."""

    tolerance: Tolerance = Field(
        1e-12, description="truncation that the steps of one period may make, relative to the motion: 1e-13 to 1e-3"
    )

    @property
    def samples(self) -> int:
        """Return what stands for a run's length where time is estimated."""
        return 1


class PeriodicDefinition(Definition):
    """A sweep of systems that are periodic in time; each system's own model has its parameters in `grid`."""

    integration: OnePeriod = mapping("how each period is followed", OnePeriod)


class Periodic(Described):
    """The full equations of a described system near a motion of their own period, by its multipliers."""

    samples_per_second = 5_000
    start_seconds = 2.5
    method_text = "direct integration of the full equations over one period, certified by the variational flow"
    kernels = (
        *("enclosures", "floquet", "jacobians", "matrices", "monodromy", "paths", "runs", "statuses", "straight"),
        "variational",
    )
    compiled = (Kernel("monodromy", seconds=8.0), Kernel("variational", seconds=1.0), PATHS)
    library = MECHANICS / "library" / "periodic"
    base_model = PeriodicDefinition
    tables = tables
    marker = "phase_residual"
    literature = "Yakubovich and Starzhinskii, Linear Differential Equations with Periodic Coefficients (1975)"
    shown = "measured multipliers of a periodic motion, beside the variational flow"

    @staticmethod
    def describes(description: "mechanics.System") -> bool:
        """Return True if a description says a period."""
        return description.given_period is not None

    def numbers(self) -> dict[str, np.ndarray]:
        """Return no dimension: multipliers are a further one of variables."""
        return {}

    def further(self, definition: Definition) -> dict[str, np.ndarray]:
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
        moving = self.description.kept or self.description.states.values()
        names = [(p.name, p.unit, p.meaning) for p in moving]
        if self.description.kept:
            names += [(p.velocity.name, f"{p.unit} s-1", f"rate of change of {p.meaning}") for p in moving]
        return table(*(Variable(f"{n}_start", unit, f"{words}, where a period begins") for n, unit, words in names))

    def columns(self, points: Mapping[str, np.ndarray], integration: OnePeriod) -> dict[str, np.ndarray]:
        """Return the variational flow beside what is measured; see `sweeps.mechanics.periodic`."""
        from sweeps.mechanics import periodic

        columns = periodic.survey(self.mechanism, self.slots(points), integration.tolerance)
        missing = np.full(len(columns["trace"]), np.nan)
        return {name: columns.get(name, missing) for name in self.variables(PeriodicDefinition)}

    def refusal(self, values: list[np.ndarray]) -> str:
        """Return why none of these points has a periodic motion to measure; nothing if one has."""
        from sweeps.mechanics import periodic

        return periodic.refusal(self.mechanism, values)

    def kernels_of(self, definition: Definition | None = None) -> tuple[Kernel, ...]:
        """Return what all periodic systems call, and what encloses functions of the time that are no plain waves."""
        encloses = self.mechanism.steepness.parts or self.description.switches
        return *super().kernels_of(definition), *(SEARCH[:1] if encloses else ())

    def _code(self) -> "Code":
        return self.mechanism.perturbed_code(True)


KIND = Periodic
