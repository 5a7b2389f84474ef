"""Uncertain bodies, sampled and measured: their columns."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from sweeps.schema.variables import Variable
from sweeps.systems.bodies.family import FreeBody
from sweeps.systems.rigid_body.system import FLIPS, SURVEY
from sweeps.systems.system import Cost, Kernel, Reference
from sweeps.systems.twist.system import SYSTEM as TWIST
from sweeps.systems.uncertain_bodies import designs, measuring, variables
from sweeps.systems.uncertain_bodies.definition import UncertainDefinition
from sweeps.systems.uncertain_bodies.variables import ARGUMENTS, KEPT, TWISTS, VARIABLES

WORK, FOLLOWING = 2, 10  # of a draw's rate, and of a draw that is followed to its flips, over the work of one point
TWISTED = tuple(replace(kernel, when=lambda definition: definition.twist) for kernel in TWIST.compiled)


class UncertainBodies(FreeBody):
    """Draws of rigid bodies, measured near each axis and reduced as they are made.

    A point is a body and how it is spun; `bound` says which bodies those are.
    """

    name = "uncertain_bodies"
    kernels = ("survey", "principal", "twist")
    existence = ()
    compiled = (*SURVEY, replace(FLIPS, when=lambda definition: True), Kernel("principal"), *TWISTED)
    tables = variables
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
        dimensions = {"quantile": np.array(measuring.QUANTILES), "input": np.array(definition.inputs_of_draws)}
        if definition.keep:
            dimensions["draw"] = np.arange(_most(definition), dtype=np.int32)
        return dimensions

    def cost(self, definition: UncertainDefinition) -> Cost:
        """Return the samples of all draws of the body that has most of them, and the memory for its draws."""
        most = _most(definition)
        draws = WORK * most + FOLLOWING * min(most, measuring.FOLLOWED)
        return Cost(draws * definition.integration.samples, measuring.DRAW_BYTES * most)

    def variables(self, definition: UncertainDefinition | None = None) -> dict[str, Variable]:
        """Return name → variable, with twists and single draws on request."""
        if definition is None:
            return VARIABLES
        of_draws = KEPT if definition.twist else {name: v for name, v in KEPT.items() if name != "twist_draw"}
        return VARIABLES | (TWISTS if definition.twist else {}) | (of_draws if definition.keep else {})

    def columns(self, points: Mapping[str, np.ndarray], integration) -> dict[str, np.ndarray]:
        """Return probabilities, quantiles and sensitivities; the spins of a body share its draws."""
        definition, names, columns = self._definition, np.asarray(points["body"]), {}
        further = self.further(definition)
        for name, one in self.variables(definition).items():
            missing = np.nan if one.missing_is_nan else one.first_flag
            columns[name] = np.full((names.size, *(further[dim].size for dim in one.over)), missing, dtype=one.dtype)
        for body in definition.bodies:
            numbers, distribution = np.flatnonzero(names == body.name), definition.distributions[body.name]
            inputs = [list(further["input"]).index(name) for name in distribution.inputs]
            spins = (measuring.Spun(*(points[name][number].item() for name in ARGUMENTS[1:])) for number in numbers)
            measured = measuring.measured(distribution, spins, definition.sampling(body), integration)
            for number, (summary, draws) in zip(numbers, measured, strict=False):  # without numbers none are drawn
                _put(columns, number, summary, draws, inputs)
        return columns

    def method(self, definition: UncertainDefinition) -> str:
        """Return the method of computation."""
        return f"draws ({definition.method}, seed {definition.seed}), each by direct integration of Euler's equations"

    def reference(self) -> Reference | None:
        """Return the probability of the intermediate axis for normal moments."""
        definition = self._definition
        if definition is None:
            return None

        def normal(point, integration) -> float:
            return definition.distributions[str(point["body"])].middle_theory(int(point["axis"]))

        def allowed(point, integration) -> float:
            body = next(body for body in definition.bodies if body.name == str(point["body"]))
            p, draws = normal(point, integration), designs.made(definition.sampling(body).draws)
            return 6 * np.sqrt(p * (1 - p) / draws) + 6 / draws  # of plain draws, which scatter more

        return Reference("probability_middle", {"normal distribution": normal}, allowed)


def _most(definition: UncertainDefinition) -> int:
    return max(designs.made(definition.sampling(body).draws) for body in definition.bodies)


def _put(columns: dict[str, np.ndarray], number: int, summary: Mapping, draws: Mapping, inputs: list[int]) -> None:
    for name, values in summary.items():
        if name.startswith("sensitivity"):
            columns[name][number, inputs] = values
        else:
            columns[name][number] = values
    for name, values in draws.items():
        if f"{name}_draw" in columns:
            columns[f"{name}_draw"][number, : len(values)] = values


SYSTEM = UncertainBodies()
