"""Tumbling bodies: their definition, columns, motion and references."""

from collections.abc import Mapping
from itertools import permutations
from typing import ClassVar

import numpy as np
from pydantic import model_validator

from sweeps.schema.parameters import grid_model, key, mapping, spread
from sweeps.schema.refusals import Problem, display, refusals
from sweeps.systems.bodies.body import BODIES, Body, FollowedDefinition, Once, list_of
from sweeps.systems.bodies.family import MeasuredOnce
from sweeps.systems.bodies.shapes import RATIOS
from sweeps.systems.bodies.variables import MOMENTS, Spin
from sweeps.systems.system import Kernel
from sweeps.systems.tumbling import variables

A_POINT = {"I1": 1.0, "I2": 2.0, "I3": 3.0, "energy": 1.2, "omega0": 1.0}

TumblingGrid = grid_model("TumblingGrid", variables.PARAMETERS, __name__, RATIOS)


class Tumbler(Body):
    """One body that tumbles."""

    energy: variables.Energy = key("energy of this body, 2T I3/L2: from 1 to I_max/I_min")
    omega0: Spin = key("L/I3 of this body, rad s-1: 1e-150 ≤ omega0 ≤ 1e150")

    @model_validator(mode="after")
    def _check_energy(self) -> "Tumbler":
        most = max(self.moments) / min(self.moments)
        if self.energy is not None and self.energy > most:
            wrong = "is above the maximum of this body"
            allowed = f"1 to I_max/I_min = {most:.6g}"
            raise refusals([Problem(("energy",), display(self.energy), wrong, allowed)])
        return self


class TumblingDefinition(FollowedDefinition):
    """A sweep of tumbling bodies."""

    shareable: ClassVar = ("energy", "omega0")
    grid: TumblingGrid = mapping("what is varied", TumblingGrid)
    bodies: list_of(Tumbler) = key(BODIES, ())

    @model_validator(mode="after")
    def _check_energy(self) -> "TumblingDefinition":
        """Refuse energies that no body of the sweep can have."""
        if self.grid.energy is None:
            return self
        ends = [] if self.bodies else [_ends(getattr(self.grid, name)) for name in MOMENTS]
        ratios = [greatest / least for (_, greatest), (least, _) in permutations(ends, 2)]
        most = max(ratios or [max(body.moments) / min(body.moments) for body in self.bodies])
        least, greatest = _ends(self.grid.energy)
        if greatest <= most:
            return self
        wrong = f"reaches {greatest:.6g}, above the maximum of every body of the sweep"
        value = display(self.grid.energy) if isinstance(self.grid.energy, float) else f"{least:g} … {greatest:g}"
        raise refusals([Problem(("grid", "energy"), value, wrong, f"1 to I_max/I_min, at most {most:.6g} here")])


def _ends(entry) -> tuple[float, float]:
    values = spread(entry)
    ends = (values.start, values.stop) if hasattr(values, "start") else values
    return float(np.min(ends)), float(np.max(ends))


class Tumbling(MeasuredOnce):
    """A free body at any energy: mode, period in the body, periods about the angular momentum."""

    name = "tumbling"
    kernels = ("tumbling", "statuses", "triangle")
    compiled = (
        Kernel("tumbling", "survey", example=(A_POINT, 1e-9), seconds=4.0),
        Kernel("tumbling", "tilts", example=(A_POINT,)),
    )
    model = TumblingDefinition
    tables = variables
    closed = "periods"
    references = "Landau and Lifshitz, Mechanics, section 37; Kaasalainen, Astronomy and Astrophysics 376 (2001) 302"
    caption = "measured mode and periods of tumbling bodies, compared with the closed form"
    samples_per_second = 160_000

    def start(self, point: Mapping[str, float]) -> tuple[np.ndarray, np.ndarray]:
        """Return moments (ascending, kg m2) and ω at time 0 (rad s-1) of a point: L = I3 omega0, w2 = 0."""
        from kernels import tumbling

        moments = np.sort([float(point[name]) for name in MOMENTS])
        omega = np.array(tumbling.start(*moments / moments[2], float(point["energy"])))
        return moments, omega * float(point["omega0"])

    def shown(self, moments: np.ndarray, omega: np.ndarray, rotation: float) -> float:
        """Return two periods of ω in the body."""
        from kernels import exact
        from sweeps.systems.motion import span

        return span(2 * exact.period(exact.set_up(*moments, *omega)), rotation)

    def survey(self, points: Mapping[str, np.ndarray], integration: Once) -> dict[str, np.ndarray]:
        """Return the closed form and the measured columns; see `kernels.tumbling`."""
        from kernels import tumbling

        columns = tumbling.survey(points, integration.tolerance, integration.measured)
        columns["period_ratio"] = columns["period_psi_exact"] / columns["period_phi_long_axis_exact"]
        return columns | tumbling.tilts(points)

    def agrees(self, points: Mapping[str, np.ndarray], columns: Mapping[str, np.ndarray]) -> np.ndarray:
        """Return where mode and periods are the closed form's, the periods within their errors."""
        apart = columns["mode"] != columns["mode_exact"]
        for name in variables.PERIODS:
            apart |= np.abs(columns[name] - columns[f"{name}_exact"]) > columns[f"{name}_error"]
        return ~apart


SYSTEM = Tumbling()
