"""The free symmetric top, spun at any angle to its figure axis: its definition, its columns and its references."""

from collections.abc import Mapping

import numpy as np

from kernels.triangle import triangle_margin
from sweeps.schema.definition import Definition, Integration
from sweeps.schema.parameters import grid_model
from sweeps.schema.values import TOLERANCE, Positive, Tolerance, key, mapping
from sweeps.systems.symmetric_top import variables
from sweeps.systems.system import Dynamics, Kernel

A_POINT = {"ratio": 1.5, "omega3": 1.0, "half_angle": 30.0}

TopGrid = grid_model("TopGrid", variables.PARAMETERS, __name__)


class TopIntegration(Integration):
    """How each run of a symmetric top is made."""

    rotations: Positive = key("length of a run in rotations, 2π/|omega3|: > 0", 4.0)
    tolerance: Tolerance = key(f"relative error allowed on the transverse part, {TOLERANCE}", 1e-12)


class SymmetricTopDefinition(Definition):
    """A sweep of symmetric tops."""

    grid: TopGrid = mapping("what is varied", TopGrid, required=True)
    integration: TopIntegration = mapping("how each run is made", TopIntegration)


class SymmetricTop(Dynamics):
    """Euler's equations without torque for I1 = I2, at any angle to the figure axis."""

    name = "symmetric_top"
    method_text = "direct integration of Euler's equations"
    kernels = ("symmetric_top",)
    existence = ("ratio",)
    compiled = (Kernel("symmetric_top", "survey", example=(A_POINT, 1.0, 16, 1e-9), seconds=4.0),)
    model = SymmetricTopDefinition
    tables = variables
    references = "Landau and Lifshitz, Mechanics, sections 33 and 36"
    caption = "measured precession of the free symmetric top about its figure axis, compared with the closed form"
    picture_seconds = 2.5
    samples_per_second = 18_000_000  # two motions each, angles and cones

    def columns(self, points: Mapping[str, np.ndarray], integration: TopIntegration) -> dict[str, np.ndarray]:
        """Return the closed form and the measured columns; see `kernels.symmetric_top`."""
        from kernels import symmetric_top

        settings = (integration.rotations, integration.samples_per_rotation, integration.tolerance)
        return symmetric_top.survey(points, *settings)

    def impossible(self, points: Mapping[str, np.ndarray]) -> np.ndarray:
        """Return where I3 exceeds the sum of the two other moments."""
        return triangle_margin(1.0, 1.0, points["ratio"]) < 0


SYSTEM = SymmetricTop()
