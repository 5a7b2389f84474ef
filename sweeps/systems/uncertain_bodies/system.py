"""Bodies as they are known, drawn and measured: their definition, variables and pictures."""

import dataclasses
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

import numpy as np

from sweeps.schema.layout import Layout
from sweeps.schema.variables import Variable
from sweeps.systems.kernel import Kernel
from sweeps.systems.rigid_body.kernels import FLIPS, SURVEY
from sweeps.systems.rigid_body.system import RigidBody
from sweeps.systems.rigid_body.variables import SHAREABLE
from sweeps.systems.system import Dynamics, Opening, Page, Reference
from sweeps.systems.twist.system import SYSTEM as TWIST
from sweeps.systems.uncertain_bodies import designs, measuring
from sweeps.systems.uncertain_bodies.definition import UncertainDefinition
from sweeps.systems.uncertain_bodies.look import LOOK
from sweeps.systems.uncertain_bodies.variables import COORDINATES, KEPT, LAYOUT, TWISTS, VARIABLES

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

WORK, FOLLOWING = 2, 10  # of a draw's rate, and of a draw that is followed to its flips, over the work of one point


class UncertainBodies(RigidBody):
    """Draws of rigid bodies, measured near each axis and reduced as they are made.

    A point is a body and how it is spun; `bound` says which bodies those are.
    """

    name = "uncertain_bodies"
    look = LOOK
    kernels = ("survey", "principal", "twist")
    compiled = (*SURVEY, dataclasses.replace(FLIPS, when=lambda definition: True), Kernel("principal"))
    model = UncertainDefinition
    references = "Saltelli et al. (2010), Computer Physics Communications 181, 259; Owen (1995) on scrambled nets"
    caption = "probability that each spin of bodies with uncertain moments is unstable, and its growth rates"
    picture_seconds = 2.5

    def __init__(self, definition: UncertainDefinition | None = None):
        self._definition = definition

    def bound(self, definition: UncertainDefinition) -> "UncertainBodies":
        """Return the system with the definition's bodies."""
        return UncertainBodies(definition)

    def further(self, definition: UncertainDefinition) -> dict[str, np.ndarray]:
        """Return the levels of the quantiles, the inputs of all bodies, and the draws if they are kept."""
        found = {"quantile": np.array(measuring.QUANTILES), "input": np.array(_inputs(definition))}
        if definition.keep:
            found["draw"] = np.arange(_most(definition), dtype=np.int32)
        return found

    def samples(self, definition: UncertainDefinition) -> int:
        """Return the samples of all draws, of the body that has most of them."""
        most = _most(definition)
        return (WORK * most + FOLLOWING * min(most, measuring.FOLLOWED)) * definition.integration.samples

    def working_bytes(self, definition: UncertainDefinition) -> int:
        """Return the memory for the draws of one body."""
        return measuring.DRAW_BYTES * _most(definition)

    def arguments(self, definition: UncertainDefinition) -> tuple[str, ...]:
        """Return the names of the arguments of a point."""
        return ("body", "axis", *SHAREABLE)

    def coordinates(self, definition: UncertainDefinition) -> dict[str, Variable]:
        """Return name → coordinate."""
        return COORDINATES

    def variables(self, definition: UncertainDefinition | None = None) -> dict[str, Variable]:
        """Return name → variable, with twists and single draws on request."""
        if definition is None:
            return VARIABLES
        kept = KEPT if definition.twist else {name: v for name, v in KEPT.items() if name != "twist_draw"}
        return VARIABLES | (TWISTS if definition.twist else {}) | (kept if definition.keep else {})

    def layout(self) -> Layout:
        """Return the layout of its maps."""
        return LAYOUT

    def columns(self, points: Mapping[str, np.ndarray], integration) -> dict[str, np.ndarray]:
        """Return probabilities, quantiles and sensitivities; the spins of a body share its draws."""
        definition = self._definition
        size, table, further = points["axis"].size, self.variables(definition), self.further(definition)
        found = {n: _missing(v, size, tuple(further[dim].size for dim in v.over)) for n, v in table.items()}
        spins = zip(points["body"], *(points[name] for name in ("axis", *SHAREABLE)), strict=True)
        per_body: dict[str, list[tuple[int, measuring.Spun]]] = {}
        for number, (name, axis, *spun) in enumerate(spins):
            spin = measuring.Spun(int(axis), *map(float, spun))
            per_body.setdefault(str(name), []).append((number, spin))
        bodies = {body.name: body for body in definition.bodies}
        for name, numbered in per_body.items():
            known, asked = definition.known[name], definition.asked(bodies[name])
            measured = measuring.measured(known, (spin for _, spin in numbered), asked, integration)
            for (number, _), (summary, draws) in zip(numbered, measured, strict=True):
                _put(found, number, summary, draws, [list(further["input"]).index(i) for i in known.inputs])
        return found

    def kernels_of(self, definition: UncertainDefinition | None = None) -> tuple[Kernel, ...]:
        """Return the rigid body's, those of flips and of principal axes, and those of twists if measured."""
        return self.compiled + (TWIST.compiled if definition is None or definition.twist else ())

    def follows_attitude(self, definition: UncertainDefinition) -> bool:
        """Return False: values are statistics of many draws."""
        return False

    def motions(self, points: Mapping[str, np.ndarray], integration) -> int:
        """Return the number of spins of bodies; each has its draws."""
        return points["axis"].size

    def method(self, definition: UncertainDefinition) -> str:
        """Return the method of computation."""
        return f"draws ({definition.method}, seed {definition.seed}), each by direct integration of Euler's equations"

    def reference(self) -> Reference | None:
        """Return the probability of the intermediate axis for normal moments."""
        definition = self._definition
        if definition is None:
            return None

        def normal(point, integration) -> float:
            return definition.known[str(point["body"])].middle_theory(int(point["axis"]))

        def allowed(point, integration) -> float:
            body = next(body for body in definition.bodies if body.name == str(point["body"]))
            p, draws = normal(point, integration), designs.made(definition.asked(body).draws)
            return 6 * np.sqrt(p * (1 - p) / draws) + 6 / draws  # of plain draws, which scatter more

        return Reference("probability_middle", {"normal distribution": normal}, allowed)

    def own_bits(self, definition: UncertainDefinition) -> str:
        """Return "": the draws of a spin do not depend on its point."""
        return ""

    def opening(self, ds: "xr.Dataset") -> Opening:
        """Return bodies and axes as the first plane."""
        return Opening()

    def page(self, ds: "xr.Dataset") -> Page:
        """Return the page: bodies and axes in a table."""
        from sweeps.systems.uncertain_bodies.page import page

        return page(ds)

    def reading(self, values: Mapping) -> str:
        """Return the name of this system."""
        return self.name

    def told(self, definition: UncertainDefinition) -> list[tuple[str, str]]:
        """Return the sampling of the bodies, besides the lines of rigid bodies."""
        made = sorted({designs.made(definition.asked(body).draws) for body in definition.bodies})
        counts = f"{made[0]:,}" if len(made) == 1 else f"{made[0]:,} to {made[-1]:,}"
        line = (
            f"{counts} draws a body ({definition.method}, seed {definition.seed}) over {', '.join(_inputs(definition))}"
        )
        return [("draws", line), *super().told(definition)]

    def pictures(self, ds: "xr.Dataset") -> "dict[str, Callable[[], Figure | None]]":
        """Return the figure of probabilities and quantiles of the bodies."""
        from sweeps.systems.uncertain_bodies import figure_outlook

        return {"outlook": lambda ax=None: figure_outlook.draw(ds, ax)}

    def animations(self, ds: "xr.Dataset") -> dict:
        """Return no animations."""
        return {}

    motion = Dynamics.motion


def _inputs(definition: UncertainDefinition) -> tuple[str, ...]:
    """Inputs of all bodies, each once, in the order of the first body that has it."""
    names = dict.fromkeys(name for known in definition.known.values() for name in known.inputs)
    return tuple(names) or ("(none)",)


def _most(definition: UncertainDefinition) -> int:
    """Draws of the body that has most of them."""
    return max(designs.made(definition.asked(body).draws) for body in definition.bodies)


def _missing(variable: Variable, size: int, own: tuple[int, ...]) -> np.ndarray:
    missing = np.nan if variable.missing_is_nan else variable.first_flag
    return np.full((size, *own), missing, dtype=variable.dtype)


def _put(found: dict[str, np.ndarray], number: int, summary: Mapping, draws: Mapping, inputs: list[int]) -> None:
    for name, values in summary.items():
        if name.startswith("sensitivity"):
            found[name][number, inputs] = values
        else:
            found[name][number] = values
    for name, values in draws.items():
        if f"{name}_draw" in found:
            found[f"{name}_draw"][number, : len(values)] = values


SYSTEM = UncertainBodies()
