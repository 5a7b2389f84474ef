"""A free body whose moments of inertia change periodically: its definition and columns."""

from collections.abc import Mapping

import numpy as np

from sweeps.schema.parameters import Range, spread
from sweeps.systems.kernel import Kernel
from sweeps.systems.periodic.definition import OnePeriod
from sweeps.systems.pumped_body import variables
from sweeps.systems.pumped_body.definition import PumpedDefinition
from sweeps.systems.system import Dynamics, Reference

TABLES = "float64[:, ::1], float64[:, ::1]"


class PumpedBody(Dynamics):
    """A free body with moments that change with time, by its Floquet multipliers.

    Args:
        inverse: whether the inverses of the moments are modulated.
    """

    name = "pumped_body"
    presentation = "sweeps.systems.pumped_body.presentation"
    kernels = ("pumped", "floquet", "statuses", "triangle")
    existence = variables.CHANGING
    compiled = (
        Kernel("pumped", "fill_moment", TABLES, seconds=7.0, when=lambda d: not is_inverse(d)),
        Kernel("pumped", "fill_inverse", TABLES, seconds=7.0, when=lambda d: is_inverse(d)),
    )
    model = PumpedDefinition
    tables = variables
    references = "Yakubovich and Starzhinskii, Linear Differential Equations with Periodic Coefficients (1975)"
    caption = "measured multipliers of a spin whose moments of inertia change periodically, beside linear theory"
    samples_per_second = 100_000

    def __init__(self, inverse: bool = False):
        self.inverse = inverse

    def bound(self, definition: PumpedDefinition) -> "PumpedBody":
        """Return the system with the definition's kind of modulation."""
        return PumpedBody(is_inverse(definition))

    def dimensions(self, definition: PumpedDefinition) -> dict[str, Range | np.ndarray]:
        """Return (axis, I1, I2, I3, depths, lags, frequency, omega0, epsilon, phase)."""
        varied = (parameter.name for parameter in variables.PARAMETERS)
        return {"axis": np.array(definition.axes, np.int8)} | {n: spread(getattr(definition.grid, n)) for n in varied}

    def further(self, definition: PumpedDefinition) -> dict[str, np.ndarray]:
        """Return the two multipliers of a point."""
        return {"multiplier": np.array([1, 2], np.int8)}

    def columns(self, points: Mapping[str, np.ndarray], integration: OnePeriod) -> dict[str, np.ndarray]:
        """Return the variational flow beside what is measured; see `kernels.pumped`."""
        from kernels import pumped
        from sweeps.systems.pumped_body.existence import least_margin

        columns = pumped.survey(points, self.inverse, integration.tolerance)
        columns["triangle_margin"] = least_margin(points, self.inverse)
        return {name: columns[name] for name in variables.VARIABLES}

    def impossible(self, points: Mapping[str, np.ndarray]) -> np.ndarray:
        """Return where one moment exceeds the sum of the others at some time of the period."""
        from sweeps.systems.pumped_body.existence import least_margin

        return least_margin(points, self.inverse) < 0

    def reference(self) -> Reference:
        """Return the trace by SciPy."""
        from sweeps.systems.pumped_body.references import reference

        return reference(self.inverse)

    def method(self, definition: PumpedDefinition) -> str:
        """Return how the motion was computed."""
        return "direct integration of the angular momentum over one period, certified by the variational flow"


def is_inverse(definition: PumpedDefinition) -> bool:
    """Return whether a definition modulates the inverses of the moments."""
    return definition.modulation == "inverse"


SYSTEM = PumpedBody()
