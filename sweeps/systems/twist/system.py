"""The tennis racket's twist: its definition, columns, motion and references."""

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from sweeps.schema.parameters import grid_model, key, mapping
from sweeps.systems.bodies.body import BODIES, Body, FollowedDefinition, Once, list_of
from sweeps.systems.bodies.family import MeasuredOnce
from sweeps.systems.bodies.shapes import RATIOS
from sweeps.systems.bodies.variables import MOMENTS, Spin
from sweeps.systems.system import Kernel
from sweeps.systems.twist import variables

A_POINT = {"I1": 1.0, "I2": 2.0, "I3": 3.0, "chi": 0.1, "theta": 1.5, "omega0": 1.0}

TwistGrid = grid_model("TwistGrid", variables.PARAMETERS, __name__, RATIOS)


class Racket(Body):
    """One body that is thrown."""

    omega0: Spin = key("L/I2 of this body, rad s-1: 1e-150 ≤ omega0 ≤ 1e150")


class TwistDefinition(FollowedDefinition):
    """A sweep of throws."""

    shareable: ClassVar = ("omega0",)
    grid: TwistGrid = mapping("what is varied", TwistGrid, required=True)
    bodies: list_of(Racket) = key(BODIES, ())


class Twist(MeasuredOnce):
    """A body thrown near its middle axis: what it has turned about its handle when that has come round."""

    name = "twist"
    kernels = ("twist", "statuses", "triangle")
    compiled = (Kernel("twist", "survey", example=(A_POINT, 1e-9), seconds=7.0),)
    model = TwistDefinition
    tables = variables
    closed = "attitude"
    references = "Landau and Lifshitz, Mechanics, section 37; Van Damme, Mardesic and Sugny, Physica D 338 (2017) 17"
    caption = "measured twist of a thrown body per revolution of its handle, compared with the closed form"
    samples_per_second = 400_000

    def start(self, point: Mapping[str, float]) -> tuple[np.ndarray, np.ndarray]:
        """Return moments (ascending, kg m2) and ω at time 0 (rad s-1) of a point: L = I2 omega0."""
        from kernels import twist

        moments = np.sort([float(point[name]) for name in MOMENTS])
        omega = np.array(twist.start(*moments / moments[1], float(point["chi"]), float(point["theta"])))
        return moments, omega * float(point["omega0"])

    def survey(self, points: Mapping[str, np.ndarray], integration: Once) -> dict[str, np.ndarray]:
        """Return the closed form and the measured columns; see `kernels.twist`."""
        from kernels import twist

        return twist.survey(points, integration.tolerance, integration.measured)

    def agrees(self, points: Mapping[str, np.ndarray], columns: Mapping[str, np.ndarray]) -> np.ndarray:
        """Return where the twist is the closed form's within its error; a spin about the handle has none."""
        within = np.abs(columns["twist"] - columns["twist_exact"]) <= columns["twist_error"]
        return (np.asarray(points["theta"]) == 0.0) | within  # at 0 the handle has no azimuth about L


SYSTEM = Twist()
