"""A free body whose moments of inertia change periodically: its definition and columns."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import numpy as np
from pydantic import Field

from sweeps.schema.parameters import Range, grid_model, mapping, spread
from sweeps.schema.values import choice
from sweeps.systems import described
from sweeps.systems.bodies.body import AXES
from sweeps.systems.bodies.shapes import RATIOS
from sweeps.systems.bodies.variables import Axes
from sweeps.systems.periodic.system import OnePeriod, Periodic, PeriodicDefinition
from sweeps.systems.pumped_body import variables
from sweeps.systems.system import Dynamics, Kernel, Points

if TYPE_CHECKING:
    from sweeps.mechanics.model import Model

PHASES = 32
REFINED = 5  # parabolas through three phases, each an eighth as far apart

PumpedGrid = grid_model("PumpedGrid", variables.PARAMETERS, __name__, RATIOS)


class PumpedDefinition(PeriodicDefinition):
    """A sweep of free bodies whose moments of inertia change periodically."""

    axes: Axes = Field((1, 2, 3), description=AXES)
    modulation: Annotated[str, choice(("moment", "inverse"))] = Field(
        "moment", description="what is I (1 + depth cos(frequency t + lag)): each moment, or its inverse"
    )
    grid: PumpedGrid = mapping("what is varied", PumpedGrid, required=True)


class PumpedBody(Dynamics):
    """A free body with moments that change with time, by its Floquet multipliers.

    Args:
        inverse: whether the inverses of the moments are modulated.
    """

    name = "pumped_body"
    method_text = "direct integration of the angular momentum over one period, certified by the variational flow"
    kernels = (*Periodic.kernels, "triangle")
    existence = variables.CHANGING
    compiled = Periodic.compiled
    model = PumpedDefinition
    tables = variables
    references = "Yakubovich and Starzhinskii, Linear Differential Equations with Periodic Coefficients (1975)"
    caption = "measured multipliers of a spin whose moments of inertia change periodically, beside linear theory"
    samples_per_second = 8_000

    def __init__(self, inverse: bool = False):
        self.inverse = inverse

    def bound(self, definition: PumpedDefinition) -> "PumpedBody":
        """Return the system with the definition's kind of modulation."""
        return PumpedBody(definition.modulation == "inverse")

    def dimensions(self, definition: PumpedDefinition) -> dict[str, Range | np.ndarray]:
        """Return (axis, I1, I2, I3, depths, lags, frequency, omega0, epsilon, phase)."""
        varied = (parameter.name for parameter in variables.PARAMETERS)
        return {"axis": np.array(definition.axes, np.int8)} | {n: spread(getattr(definition.grid, n)) for n in varied}

    def further(self, definition: PumpedDefinition) -> dict[str, np.ndarray]:
        """Return the two multipliers of a point."""
        return {"multiplier": np.array([1, 2], np.int8)}

    def columns(self, points: Mapping[str, np.ndarray], integration: OnePeriod) -> dict[str, np.ndarray]:
        """Return the variational flow beside what is measured; see `motion`."""
        from sweeps.systems.pumped_body import motion

        columns = motion.survey(points, self.inverse, integration.tolerance)
        columns["triangle_margin"] = least_margin(points, self.inverse)
        return {name: columns[name] for name in variables.VARIABLES}

    def impossible(self, points: Mapping[str, np.ndarray]) -> np.ndarray:
        """Return where one moment exceeds the sum of the others at some time of the period."""
        return least_margin(points, self.inverse) < 0

    @property
    def mechanism(self) -> "Model":
        """The derived equations and what runs points through them."""
        from sweeps.systems.pumped_body import motion

        return motion.model(self.inverse)

    def kernels_of(self, definition: PumpedDefinition | None = None) -> tuple[Kernel, ...]:
        """Return what periodic systems share, and what the definition's kind of modulation needs, its code and all."""
        kinds = (PumpedBody(False), PumpedBody(True)) if definition is None else (self.bound(definition),)
        codes = [kind.mechanism.perturbed_code(True) for kind in kinds]
        steep = described.SEARCH[:1] if any(kind.mechanism.steepness.parts for kind in kinds) else ()
        return *super().kernels_of(definition), *steep, *(Kernel(str(c.path), seconds=c.compile_seconds) for c in codes)

    def proofs(self, grid: Points) -> tuple[str, ...]:
        """Return the symmetries that are used; they depend on no parameter."""
        parameters = self.mechanism.system.parameters.values()
        return self.mechanism.proofs([np.array([p.default]) for p in parameters])

    def fingerprint(self) -> str:
        """Return a hash of the kernels, the generated code, its generator and the equations."""
        equations = Path(__file__).with_name("motion.py").read_bytes()
        return described.fingerprint(self.kernels, self.mechanism.perturbed_code(True), equations)


def moments_at(points: Mapping[str, np.ndarray], phase: np.ndarray | float, inverse: bool) -> list[np.ndarray]:
    """Return the three moments at a phase of the period, rad; with `inverse`, 1/I_i is modulated, and not I_i."""
    factors = [1.0 + points[f"depth{i}"] * np.cos(phase + points[f"lag{i}"]) for i in (1, 2, 3)]
    return [points[f"I{i}"] * (1.0 / f if inverse else f) for i, f in enumerate(factors, 1)]


def least_margin(points: Mapping[str, np.ndarray], inverse: bool) -> np.ndarray:
    """Return the least triangle margin over the period, of points whose arrays broadcast together.

    The margin is the least of three smooth functions of the phase: where it is least, it is smooth.
    """
    from kernels.triangle import triangle_margin

    def margin(u):
        return triangle_margin(*moments_at(points, u, inverse))

    least, at = margin(0.0), 0.0
    for u in 2.0 * np.pi / PHASES * np.arange(1, PHASES):
        here = margin(u)
        least, at = np.minimum(least, here), np.where(here < least, u, at)
    apart = 2.0 * np.pi / PHASES
    for _ in range(REFINED):
        before, after = margin(at - apart), margin(at + apart)
        bent = before - 2.0 * least + after
        with np.errstate(divide="ignore", invalid="ignore"):
            moved = np.where(bent > 0.0, 0.5 * apart * (before - after) / bent, 0.0)
        here = margin(at + moved)
        least, at = np.minimum(least, here), np.where(here < least, at + moved, at)
        apart /= 8.0
    return least


SYSTEM = PumpedBody()
