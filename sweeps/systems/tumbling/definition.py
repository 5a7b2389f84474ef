"""What a definition of tumbling bodies may say."""

from typing import ClassVar

import numpy as np
from pydantic import Field, model_validator

from sweeps.schema.parameters import grid_model, spread
from sweeps.schema.refusals import Problem, display, keys_of, refusals
from sweeps.systems.bodies.body import BODIES, Body, FollowedDefinition, list_of
from sweeps.systems.bodies.shapes import RATIOS
from sweeps.systems.bodies.variables import MOMENTS, Spin
from sweeps.systems.tumbling.variables import PARAMETERS, Energy

TumblingGrid = grid_model("TumblingGrid", PARAMETERS, __name__, RATIOS)


class Tumbler(Body):
    """One body that tumbles."""

    energy: Energy = Field(default=None, description="energy of this body, 2T I3/L2: from 1 to I_max/I_min")
    omega0: Spin = Field(default=None, description="L/I3 of this body, rad s-1: 1e-150 ≤ omega0 ≤ 1e150")

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
    grid: TumblingGrid = Field(TumblingGrid(), description="what is varied: a mapping with " + keys_of(TumblingGrid))
    bodies: list_of(Tumbler) = Field(default=(), description=BODIES)

    @model_validator(mode="after")
    def _check_energy(self) -> "TumblingDefinition":
        if self.grid.energy is not None and (wrong := self._energy_problems()):
            raise refusals(wrong)
        return self

    def _energy_problems(self) -> list[Problem]:
        """Energies that no body of the sweep can have."""
        if self.bodies:
            most = max(max(body.moments) / min(body.moments) for body in self.bodies)
        else:
            ends = np.array([_ends(getattr(self.grid, name)) for name in MOMENTS])
            most = max(ends[i, 1] / ends[j, 0] for i in range(3) for j in range(3) if i != j)
        least, greatest = _ends(self.grid.energy)
        if greatest <= most:
            return []
        wrong = f"reaches {greatest:.6g}, above the maximum of every body of the sweep"
        shown = display(self.grid.energy) if isinstance(self.grid.energy, float) else f"{least:g} … {greatest:g}"
        return [Problem(("grid", "energy"), shown, wrong, f"1 to I_max/I_min, at most {most:.6g} here")]


def _ends(entry) -> tuple[float, float]:
    values = spread(entry)
    ends = (values.start, values.stop) if hasattr(values, "start") else values
    return float(np.min(ends)), float(np.max(ends))
