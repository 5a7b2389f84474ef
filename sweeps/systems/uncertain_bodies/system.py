"""Uncertain bodies: bodies sampled from their uncertainty, measured, and reported as probabilities."""

from collections.abc import Mapping
from dataclasses import replace
from functools import cached_property
from typing import Annotated, Any

import numpy as np
from pydantic import BeforeValidator, model_validator

from sweeps.schema.definition import Integration
from sweeps.schema.parameters import Strict, key, mapping, switch
from sweeps.schema.refusals import Problem, display, keys_of, refusal, refusals
from sweeps.schema.values import Positive, choice, finite, integer
from sweeps.schema.variables import Variable, table
from sweeps.systems.bodies import shapes
from sweeps.systems.bodies.body import list_of
from sweeps.systems.bodies.free_body import FreeBody
from sweeps.systems.bodies.inertia import InertiaError
from sweeps.systems.bodies.variables import VERDICTS
from sweeps.systems.rigid_body.system import FLIPPED, REGIMES, SHAREABLE, SURVEY, NearAxisDefinition, SpunBody
from sweeps.systems.rigid_body.system import LAYOUT as OF_RIGID_BODIES
from sweeps.systems.shared_variables import parse_rows
from sweeps.systems.system import Cost, Example, Reference
from sweeps.systems.twist.system import SYSTEM as TWIST
from sweeps.systems.uncertain_bodies import designs, distribution, measuring
from sweeps.systems.uncertain_bodies.measuring import BodySampling
from sweeps.systems.uncertain_bodies.possible import ENTRIES

LEAST_INERTIA = f"about the axis of least inertia: {VERDICTS['stable_minor'].more}"
_OF_PROBABILITY = "; at least one draw; where all draws agree, the far end of the 95 % Wilson interval over 1.96"


def _sampled(text: str) -> dict[str, Variable]:
    """Return name → variable of a table of `parse_rows`; after each name that ends in ±, its sampling error."""
    variables = {}
    for row, one in parse_rows(text).items():
        name = row.removesuffix("±")
        over = ("quantile",) if name.endswith("_quantile") else ("input",) if name.startswith("sensitivity") else ()
        variables[name] = replace(one, name=name, over=over)
        if name != row:
            how = "from independent replicates" + (_OF_PROBABILITY if name.startswith("probability") else "")
            words = f"sampling standard error of {name}"
            variables[f"{name}_error"] = Variable(f"{name}_error", one.units, words, comment=how, over=over)
    return variables


VARIABLES = _sampled(
    """
    probability_unstable±      1  probability that the spin is unstable, from the measured draws [measurement]
    probability_middle±        1  probability that the axis is the intermediate axis
    probability_middle_theory  1  probability that the axis is the intermediate axis, for normally distributed moments;
        missing where the principal axes tilt
    probability_flip±          1  probability that the body flips within `turns` turns of the spin, from the measured
        draws
        comment: `turns` is a key of the definition; over the draws that were followed to their flips
    stability                -  stable or unstable with a probability above 0.99, otherwise uncertain [headline]
        flags: 0 stable uncertain unstable
    status                   -  whether fewer than 1 % of the draws are undecided [status]
        flags: 0 ok undecided
    undecided                1  fraction of the draws whose regime is marginal or undetermined, or whose status is not
        ok
    impossible_naive         1  fraction of Gaussian samples that violate the triangle inequality of moments
    moment_mean_requested    kg m2  mean of the moment about the axis, requested
    moment_mean±             kg m2  mean of the moment about the axis, sampled
    moment_spread_requested  kg m2  standard deviation of the moment about the axis, requested
    moment_spread            kg m2  standard deviation of the moment about the axis, sampled
    draws                    1  i4  number of draws
    draws_followed           1  i4  number of draws that were followed to their flips
    growth_rate_quantile±    s-1  quantile of the measured growth rate
        comment: over all draws: 0 where not unstable
    frequency_quantile±      rad s-1  quantile of the measured angular frequency
        comment: over all draws: 0 where not stable
    flip_period_quantile±    s  quantile of the time between two flips, measured; missing where the spin keeps its sign
        comment: over all draws: a spin that keeps its sign counts as infinitely long
    max_tilt_quantile±       rad  quantile of the largest angle of the angular velocity from the direction of the axis
        near which it starts, measured
        comment: over all draws: from the axis of the drawn body
    sensitivity_first±       1  first-order Sobol index of Ω²
        comment: fraction of the variance of Ω² that this input alone explains
    sensitivity_total±       1  total Sobol index of Ω²
        comment: fraction of the variance of Ω² that is left if all other inputs are known
    """
)

TWISTS = _sampled(
    """
    twist_quantile±  rad  quantile of the absolute twist per revolution of the axis of least inertia about L, measured
        comment: over all draws: near pi, a half turn, for a thrown racket; missing for a spin about that axis
    """
)

KEPT = {
    name: replace(variable, over=("draw",))
    for name, variable in parse_rows(
        """
        I1_draw           kg m2  moment about axis 1 of a draw
        I2_draw           kg m2  moment about axis 2 of a draw
        I3_draw           kg m2  moment about axis 3 of a draw
        growth_rate_draw  s-1  growth rate of a draw, measured
        frequency_draw    rad s-1  angular frequency of a draw, measured
        """,
        Variable("regime_draw", None, "regime of a draw, measured", "i1", REGIMES, first_flag=-1),
        """
        flip_period_draw  s  time between two flips of a draw; missing where the spin keeps its sign
        max_tilt_draw     rad  largest tilt of a draw
        twist_draw        rad  absolute twist of a draw, where `twist` is true
        """,
    ).items()
}

ARGUMENTS = ("body", "axis", *SHAREABLE)
FURTHER = table(
    Variable("quantile", "1", "fraction of the draws that do not exceed the value"),
    Variable("input", None, "uncertain input", "str"),
    Variable("draw", "1", "number of the draw", "i4"),
)
OF_BODIES = {name: one for name, one in OF_RIGID_BODIES.coordinates.items() if name not in OF_RIGID_BODIES.spare}
COORDINATES = OF_BODIES | FURTHER

_HELD: dict[str, Any] = {
    "coordinates": {"body": OF_BODIES["body"], **COORDINATES},
    "variables": VARIABLES | TWISTS | KEPT,
}
LAYOUT = replace(OF_RIGID_BODIES, needed=tuple(VARIABLES), over={}, **_HELD)


SHARE = "a fraction from 0 to below 1, as a number (0.05) or in per cent (5 %)"
COVARIANCE = "3 rows of 3 numbers (of I1, I2, I3), or 6 of 6 (of the tensor's xx, yy, zz, xy, xz, yz), kg2 m4"


def share(value: Any) -> float:
    """Return a relative standard deviation from 0.05 or "5 %"."""
    amount = finite(value, SHARE, "1")
    if not 0 <= amount < 1:
        raise refusal(f"is {100 * amount:.6g} %" if amount > 0 else "is negative", SHARE)
    return amount


Share = Annotated[float, BeforeValidator(share, json_schema_input_type=float | str)]


def _shares(count: int):
    def check(value: Any) -> tuple[float, ...]:
        values = value if isinstance(value, tuple | list) else (value,) * count
        if len(values) != count:
            raise refusal(f"has {len(values)} fractions", f"{count} of them, or one for all")
        return tuple(map(share, values))

    return BeforeValidator(check, json_schema_input_type=float | str | list[float | str])


def _covariance(value: Any) -> tuple[tuple[float, ...], ...]:
    rows = value if isinstance(value, tuple | list) else ()
    sizes = {len(row) if isinstance(row, tuple | list) else 0 for row in rows}
    if len(rows) not in (3, 6) or sizes != {len(rows)}:
        raise refusal("is not a covariance", COVARIANCE)
    return tuple(tuple(finite(entry, COVARIANCE) for entry in row) for row in rows)


def _phase(value: Any) -> float | str:
    if value == distribution.ANY:
        return value
    allowed = f"a standard deviation ≥ 0 in rad, or {distribution.ANY}"
    amount = finite(value, allowed, "rad")
    if amount < 0:
        raise refusal("is negative", allowed)
    return amount


class Uncertainty(Strict):
    """Standard deviations of a body and its spin."""

    moments: Annotated[tuple[float, ...], _shares(3)] = key(
        f"of I1, I2 and I3 independently, relative: {SHARE}, or a list of three"
    )
    tensor: Annotated[tuple[float, ...], _shares(6)] = key(
        f"of the tensor's entries xx, yy, zz, xy, xz, yz independently, relative: {SHARE}, or a list of six"
    )
    covariance: Annotated[tuple[tuple[float, ...], ...], BeforeValidator(_covariance)] = key(
        f"the whole covariance: {COVARIANCE}"
    )
    omega0: Share = key(f"of the spin rate, relative: {SHARE}")
    epsilon: Share = key(f"of the size of the perturbation, relative: {SHARE}")
    phase: Annotated[float | str, BeforeValidator(_phase)] = key(
        f"of the direction of the perturbation, rad: ≥ 0, or {distribution.ANY}"
    )
    inertia: Share = key(f"of the moments, or of the tensor where that is given: {SHARE}")

    @model_validator(mode="after")
    def _check_one(self) -> "Uncertainty":
        given = [name for name in ("moments", "tensor", "covariance", "inertia") if getattr(self, name) is not None]
        if len(given) > 1:
            value = display(getattr(self, given[1]))
            raise refusals([Problem((given[1],), value, f"is given beside {given[0]}", "one of them")])
        if not self.model_fields_set:
            raise refusal("is empty", "a mapping with " + keys_of(Uncertainty))
        return self

    @property
    def spin(self) -> dict[str, float | str]:
        """Of omega0, epsilon and phase what is uncertain."""
        return {name: value for name in distribution.SPIN if (value := getattr(self, name)) not in (None, 0)}


UNCERTAIN = "a fraction (5 %), or a mapping with  " + ", ".join(name for name in Uncertainty.model_fields)
GivenUncertainty = Annotated[
    Uncertainty,
    BeforeValidator(  # a bare share stands for the moments, or the tensor where that is given
        lambda value: value if isinstance(value, dict | Uncertainty) else {"inertia": share(value)},
        json_schema_input_type=Uncertainty | float | str,
    ),
]
Draws = Annotated[int, integer(designs.LEAST, designs.MOST, f"a whole number from {designs.LEAST} to {designs.MOST:,}")]


class UncertainBody(SpunBody):
    """One body and the uncertainty of its moments."""

    uncertainty: GivenUncertainty = key(f"uncertainty of this body: {UNCERTAIN}")
    draws: Draws = key("number of draws of this body")


class UncertainIntegration(Integration):
    """How each draw is measured: half as long as a single body, to a rate that is still far better than the draws."""

    rotations: Positive = key("length of a run in rotations, 2π/|omega0|: > 0", 2.0)


class UncertainDefinition(NearAxisDefinition):
    """A sweep of uncertain bodies."""

    bodies: list_of(UncertainBody) = key(
        "a list of bodies, names unique, each as for rigid bodies, with uncertainty and draws", ()
    )
    integration: UncertainIntegration = mapping("how each draw is measured", UncertainIntegration)
    uncertainty: GivenUncertainty = key(f"of all bodies without their own: {UNCERTAIN}")
    draws: Draws = key("least number of draws of each body", 10_000)
    seed: Annotated[int, integer(0, 2**63 - 1, "a whole number, 0 or more")] = key("seed of the draws: whole, ≥ 0", 1)
    method: Annotated[str, choice(designs.METHODS)] = key(
        "sampling of the draws: " + ", ".join(designs.METHODS), "sobol"
    )
    turns: Positive = key("turns of the spin within which a flip is counted: > 0", 100.0)
    twist: bool = switch("to measure the twist of the draws too, and write its quantiles")
    keep: bool = switch("to write every draw into the map")

    @property
    def remarks(self) -> list[tuple[str, str]]:
        """The sampling of the bodies, besides their principal axes."""
        made = {designs.made(self.sampling(body).draws) for body in self.bodies}
        counts = " to ".join(f"{count:,}" for count in sorted({min(made), max(made)}))
        line = f"{counts} draws a body ({self.method}, seed {self.seed}) over {', '.join(self.inputs_of_draws)}"
        return [("draws", line), *super().remarks]

    @cached_property
    def inputs_of_draws(self) -> tuple[str, ...]:
        """Inputs of all bodies, each once, in the order of the first body that has it."""
        names = dict.fromkeys(name for one in self.distributions.values() for name in one.inputs)
        return tuple(names) or ("(none)",)

    def sampling(self, body: UncertainBody) -> BodySampling:
        """Return the sampling of a body."""
        return BodySampling(body.draws or self.draws, self.seed, self.method, self.turns, self.twist)

    @cached_property
    def distributions(self) -> dict[str, distribution.Distribution]:
        """Name → body with its uncertainty."""
        return {body.name: _distribution(body, body.uncertainty or self.uncertainty) for body in self.bodies}

    @model_validator(mode="after")
    def _check_uncertainty(self) -> "UncertainDefinition":
        if not self.bodies:
            raise refusals([Problem(("bodies",), "", "is missing", "a list of bodies, each with its moments")])
        wrong = []
        for i, body in enumerate(self.bodies):
            given = body.uncertainty or self.uncertainty
            where = ("bodies", i, "uncertainty") if body.uncertainty or not self.uncertainty else ("uncertainty",)
            try:
                if given is None:
                    raise InertiaError("", "is missing", f"{UNCERTAIN}, here or for all bodies")
                _distribution(body, given)
            except InertiaError as error:
                wrong.append(Problem(where, error.shown, error.wrong, error.allowed))
        if wrong:
            raise refusals(wrong)
        return self


def _distribution(body: UncertainBody, given: Uncertainty) -> distribution.Distribution:
    moments = np.array(body.moments)
    if broken := shapes.violation(body.moments):
        value = ", ".join(f"{moment:.6g}" for moment in moments)
        raise InertiaError(value, f"are not the moments of any rigid body: {broken}", shapes.POSSIBLE)
    wants_tensor = given.tensor is not None or (given.covariance is not None and len(given.covariance) == 6)
    if wants_tensor and body.tensor is None:
        allowed = f"uncertainty of its moments, or a tensor of {body.name}"
        raise InertiaError("(six entries)", "are given for a body without a tensor", allowed)
    entries, frame = moments, np.eye(3)
    if wants_tensor or (given.inertia is not None and body.tensor is not None):
        frame, tensor = np.array(body.principal.axes), np.array(body.tensor)
        entries = np.array([(tensor[i, j] + tensor[j, i]) / 2 for i, j in ENTRIES.values()])
    if given.tensor is not None and len(set(given.tensor)) > 1:
        for name, entry, share in zip(ENTRIES, entries, given.tensor, strict=True):
            if entry == 0 and share > 0:
                wrong = f"is a fraction of an entry that is 0 ({name}): it has no effect"
                raise InertiaError(f"{100 * share:.4g} %", wrong, "0, or covariance: 6 rows of 6, kg2 m4")
    if given.covariance is not None:
        covariance = distribution.checked_covariance(np.array(given.covariance), entries)
    else:
        shares = next((s for s in (given.tensor, given.moments, given.inertia) if s is not None), 0.0)
        covariance = distribution.relative(entries, np.array(shares))
    return distribution.Distribution(moments, frame, entries, covariance, given.spin)


WORK, FOLLOWING = 2, 10  # of a draw's rate, and of a draw that is followed to its flips, over the work of one point


class UncertainBodies(FreeBody):
    """Draws of rigid bodies, measured near each axis and reduced as they are made.

    A point is a body and how it is spun; `bound` says which bodies those are.
    """

    name = "uncertain_bodies"
    kernels = ("near_axis.survey", "free.jacobi_eigen", "events.twist")
    existence = ()
    compiled = (*SURVEY, FLIPPED, Example("free.jacobi_eigen"))
    compile_seconds = 14.0
    model = UncertainDefinition
    references = "Saltelli et al. (2010), Computer Physics Communications 181, 259; Owen (1995) on scrambled nets"
    caption = "probability that each spin of bodies with uncertain moments is unstable, and its growth rates"
    picture_seconds = 2.5

    def __init__(self, definition: UncertainDefinition | None = None):
        self._definition = definition

    def bound(self, definition: UncertainDefinition) -> "UncertainBodies":
        """Return the system with the definition's bodies."""
        return UncertainBodies(definition)

    def extra_dimensions(self, definition: UncertainDefinition) -> dict[str, np.ndarray]:
        """Return the levels of the quantiles, the inputs of all bodies, and the draws if they are kept."""
        dimensions = {"quantile": np.array(measuring.QUANTILES), "input": np.array(definition.inputs_of_draws)}
        if definition.keep:
            dimensions["draw"] = np.arange(_most(definition), dtype=np.int32)
        return dimensions

    def cost(self, definition: UncertainDefinition) -> Cost:
        """Return the samples of all draws of the body that has most of them, and the memory for its draws."""
        most = _most(definition)
        draws = WORK * most + FOLLOWING * min(most, measuring.MAX_FLIP_DRAWS)
        return Cost(draws * definition.integration.samples, measuring.DRAW_BYTES * most)

    def variables(self, definition: UncertainDefinition | None = None) -> dict[str, Variable]:
        """Return name → variable, with twists and single draws on request."""
        if definition is None:
            return VARIABLES
        of_draws = KEPT if definition.twist else {name: v for name, v in KEPT.items() if name != "twist_draw"}
        return VARIABLES | (TWISTS if definition.twist else {}) | (of_draws if definition.keep else {})

    def examples(self, definition: UncertainDefinition | None = None) -> tuple[Example, ...]:
        """Return the calls that compile surveys and flips, and those for twists on request."""
        return *self.compiled, *(TWIST.compiled if definition is None or definition.twist else ())

    def columns(self, points: Mapping[str, np.ndarray], integration) -> dict[str, np.ndarray]:
        """Return probabilities, quantiles and sensitivities; the spins of a body share its draws."""
        definition, names, columns = self._definition, np.asarray(points["body"]), {}
        further = self.extra_dimensions(definition)
        for name, one in self.variables(definition).items():
            missing = np.nan if one.missing_is_nan else one.first_flag
            columns[name] = np.full((names.size, *(further[dim].size for dim in one.over)), missing, dtype=one.dtype)
        for body in definition.bodies:
            numbers, distribution = np.flatnonzero(names == body.name), definition.distributions[body.name]
            inputs = [list(further["input"]).index(name) for name in distribution.inputs]
            spins = (
                measuring.SpinSettings(*(points[name][number].item() for name in ARGUMENTS[1:])) for number in numbers
            )
            measured = measuring.measure_spins(distribution, spins, definition.sampling(body), integration)
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
