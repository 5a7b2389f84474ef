"""Relative equilibria of a described system: what its definition, and its columns are.

One `RelativeEquilibrium` a description: those of `sweeps/mechanics/library/relative`, and any Python file that a
definition names and whose equations are of first order (see `sweeps.mechanics.equations`).
"""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated

import numpy as np
from pydantic import BeforeValidator

from sweeps.process.machine import cores
from sweeps.schema.definition import Definition, Integration
from sweeps.schema.parameters import key, mapping
from sweeps.schema.values import Positive, Tolerance, whole
from sweeps.schema.variables import Variable
from sweeps.systems.described import MECHANICS, PLANNING, SEARCH, Described
from sweeps.systems.relative_equilibrium import variables as tables
from sweeps.systems.relative_equilibrium.variables import INVARIANTS, VARIABLES
from sweeps.systems.shared_variables import rows
from sweeps.systems.system import Cost, Kernel

if TYPE_CHECKING:
    from sweeps import mechanics


MOST_RUNS = 4
NUMBER = whole(1, MOST_RUNS, f"a whole number from 1 to {MOST_RUNS}")


class FlowIntegration(Integration):
    """How the runs from a relative equilibrium are made."""

    rotations: Positive = key("length of a run in cycles of the system's scale, 2π/rate_scale: > 0", 4.0)
    tolerance: Tolerance = key("relative error allowed on the motion, 1e-13 to 1e-3", 1e-12)
    runs: Annotated[int | None, BeforeValidator(lambda runs: runs if runs is None else NUMBER.func(runs))] = key(
        f"runs of each point, in different directions: 1 to {MOST_RUNS}; equal modes need one each; "
        "default one for every two eigenvalues, from two to four"
    )


class FlowDefinition(Definition):
    """A sweep of relative equilibria; each system's own model has its parameters in `grid`."""

    integration: FlowIntegration = mapping("how each run is made", FlowIntegration)


SAMPLE_BYTES = 256  # one number of each motion of a block


class RelativeEquilibrium(Described):
    """The full equations of a described system near each of its relative equilibria, by their eigenvalues."""

    samples_per_second = 2_000_000  # all that is worked out of a point included
    picture_seconds = 2.5
    method_text = "direct integration of the full equations of motion"
    kernels = ("flows", "enclosures", "roots", "jacobians", "matrices")
    compiled = (
        Kernel("dense", seconds=3.5),
        Kernel("runs", seconds=1.5),
        Kernel("invariants", seconds=3.0, stage=1),
        Kernel("projection", seconds=1.5, stage=1),
        Kernel("spectrum", seconds=2.5, stage=2),
        Kernel("flows", seconds=1.5, stage=3),
        *SEARCH,
        *PLANNING,
    )
    library = MECHANICS / "library" / "relative"
    base_model = FlowDefinition
    tables = tables
    marker = "eigenvalue"
    spectrum = ("eigenvalue",)
    several: Mapping[str, str] = {**Described.several, "eigenvalue": "eigenvalues"}
    literature = "Merkin, Introduction to the Theory of Stability, chapter 6"
    shown = "measured eigenvalues of motions about each equilibrium, compared with linear theory"

    @staticmethod
    def describes(description: "mechanics.System") -> bool:
        """Return True if a description has other forces than those of a potential and of T = ½ a_ij q̇_i q̇_j."""
        from sweeps.mechanics.derivation import derive

        return not derive(description).natural

    def numbers(self) -> dict[str, np.ndarray]:
        """Return the eigenvalues of an equilibrium."""
        return {"eigenvalue": np.arange(1, self.mechanism.n + 1, dtype=np.int8)}

    def variables(self, definition: Definition | None = None) -> dict[str, Variable]:
        """Return name → variable, with invariants of four eigenvalues, drifts and equilibrium states."""
        if definition is None:
            return VARIABLES
        model = self.mechanism
        change = "  1  largest change of the conserved {}, relative [check]"
        drifts = rows(*(f"{name}_drift{change.format(name.replace('_', ' '))}" for name in model.quantities))
        return VARIABLES | (INVARIANTS if model.n == 4 else {}) | drifts | self.places()

    def columns(self, points: Mapping[str, np.ndarray], integration: Integration) -> dict[str, np.ndarray]:
        """Return linear theory and the measured columns; see `sweeps.mechanics.relative`."""
        self._compiled()
        settings = (integration.rotations, integration.samples_per_rotation, integration.tolerance)
        return self.mechanism.survey(self.slots(points), *settings, integration.runs)

    def motions(self, points: Mapping[str, np.ndarray], integration: Integration) -> int:
        """Return the number of runs of each equilibrium, which all its eigenvalues share."""
        return next(iter(points.values())).size * self._runs(integration) // self.mechanism.n

    def _runs(self, integration: Integration) -> int:
        """Return the number of runs of a point."""
        from sweeps.mechanics.relative import usual_runs

        return integration.runs or usual_runs(self.mechanism)

    def cost(self, definition: Definition) -> Cost:
        """Return the samples, and the memory for those of the points that each processor has in work."""
        from sweeps.mechanics.relative import CHUNK, CHUNK_BYTES, W

        runs, samples = self._runs(definition.integration), definition.integration.samples
        block = SAMPLE_BYTES * runs * samples * (self.mechanism.n + 1)
        return Cost(samples, cores() * max(block, min(CHUNK_BYTES, CHUNK // W * block)))


KIND = RelativeEquilibrium
