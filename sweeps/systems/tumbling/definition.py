"""What a definition of tumbling bodies may say."""

import numpy as np
from pydantic import Field, model_validator

from sweeps.schema.definition import Definition
from sweeps.schema.parameters import grid_model, spread
from sweeps.schema.refusals import Problem, display, keys_of, refusals
from sweeps.systems import listed
from sweeps.systems.once import Once
from sweeps.systems.shapes import RATIOS
from sweeps.systems.tumbling.variables import MOMENTS, PARAMETERS, Energy, Spin

TumblingGrid = grid_model("TumblingGrid", PARAMETERS, __name__, RATIOS)
SHAREABLE = ("energy", "omega0")


class Tumbler(listed.ListedBody):
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


class TumblingDefinition(Definition):
    """A sweep of tumbling bodies."""

    grid: TumblingGrid = Field(TumblingGrid(), description="what is varied: a mapping with " + keys_of(TumblingGrid))
    bodies: listed.bodies_of(Tumbler) = Field(
        default=(), description="a list of bodies, names unique, in place of I1, I2 and I3 in grid"
    )
    integration: Once = Field(Once(), description="how each motion is integrated: a mapping with " + keys_of(Once))

    @model_validator(mode="after")
    def _check_grid(self) -> "TumblingDefinition":
        wrong = listed.problems(self, SHAREABLE)
        if not wrong and self.grid.energy is not None:
            wrong = self._energy_problems()
        if wrong:
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
    """Least and greatest value of a grid's entry."""
    values = spread(entry)
    ends = (values.start, values.stop) if hasattr(values, "start") else values
    return float(np.min(ends)), float(np.max(ends))
