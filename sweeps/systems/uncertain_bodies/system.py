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
from sweeps.schema.values import Positive, finite
from sweeps.schema.variables import Variable, table
from sweeps.systems.bodies import shapes
from sweeps.systems.bodies.body import list_of
from sweeps.systems.bodies.free_body import FreeBody
from sweeps.systems.bodies.inertia import InertiaError
from sweeps.systems.bodies.variables import VERDICTS
from sweeps.systems.rigid_body.system import FLIPPED, REGIMES, SHAREABLE, SURVEY, NearAxisDefinition, SpunBody
from sweeps.systems.rigid_body.system import LAYOUT as RIGID_BODY_LAYOUT
from sweeps.systems.shared_variables import parse_rows
from sweeps.systems.system import Cost, Example, Reference
from sweeps.systems.twist.system import SYSTEM as TWIST
from sweeps.systems.uncertain_bodies import designs, distribution, measuring
from sweeps.systems.uncertain_bodies.measuring import BodySampling
from sweeps.systems.uncertain_bodies.possible import ENTRIES

MINOR_AXIS_REMARK = f"about the axis of least inertia: {VERDICTS['stable_minor'].more}"
_PROBABILITY_ERROR = "; at least one draw; where all draws agree, the far end of the 95 % Wilson interval over 1.96"


def _with_sampling_errors(text: str) -> dict[str, Variable]:
    """Return name → variable of a table of `parse_rows`, and for each name that ends in ± its sampling error."""
    variables = {}
    for row, variable in parse_rows(text).items():
        name = row.removesuffix("±")
        over = ("quantile",) if name.endswith("_quantile") else ("input",) if name.startswith("sensitivity") else ()
        variables[name] = replace(variable, name=name, over=over)
        if name != row:
            how = "from independent replicates" + (_PROBABILITY_ERROR if name.startswith("probability") else "")
            long_name = f"sampling standard error of {name}"
            variables[f"{name}_error"] = Variable(f"{name}_error", variable.units, long_name, comment=how, over=over)
    return variables


VARIABLES = _with_sampling_errors(
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

TWISTS = _with_sampling_errors(
    """
    twist_quantile±  rad  quantile of the absolute twist per revolution of the axis of least inertia about L, measured
        comment: over all draws: near pi, a half turn, for a thrown racket; missing for a spin about that axis
    """
)

DRAW_VARIABLES = {
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
EXTRA_COORDINATES = table(
    Variable("quantile", "1", "fraction of the draws that do not exceed the value"),
    Variable("input", None, "uncertain input", "str"),
    Variable("draw", "1", "number of the draw", "i4"),
)
BODY_COORDINATES = {
    name: one for name, one in RIGID_BODY_LAYOUT.coordinates.items() if name not in RIGID_BODY_LAYOUT.spare
}
COORDINATES = BODY_COORDINATES | EXTRA_COORDINATES

LAYOUT = replace(
    RIGID_BODY_LAYOUT,
    needed=tuple(VARIABLES),
    over={},
    coordinates={"body": BODY_COORDINATES["body"], **COORDINATES},
    variables=VARIABLES | TWISTS | DRAW_VARIABLES,
)


FRACTION = "a fraction from 0 to below 1, as a number (0.05) or in per cent (5 %)"
COVARIANCE = "3 rows of 3 numbers (of I1, I2, I3), or 6 of 6 (of the tensor's xx, yy, zz, xy, xz, yz), kg2 m4"


def read_fraction(value: Any) -> float:
    """Return a relative standard deviation from 0.05 or "5 %"."""
    amount = finite(value, FRACTION, "1")
    if not 0 <= amount < 1:
        raise refusal(f"is {100 * amount:.6g} %" if amount > 0 else "is negative", FRACTION)
    return amount


Fraction = Annotated[float, BeforeValidator(read_fraction, json_schema_input_type=float | str)]


def _fractions_validator(count: int):
    """Return a validator of `count` uncertainties, each a fraction or a percentage; a single one counts for all."""

    def check(value: Any) -> tuple[float, ...]:
        """Return the fractions as a tuple; refuse another number of them."""
        values = value if isinstance(value, tuple | list) else (value,) * count
        if len(values) != count:
            raise refusal(f"has {len(values)} fractions", f"{count} of them, or one for all")
        return tuple(map(read_fraction, values))

    return BeforeValidator(check, json_schema_input_type=float | str | list[float | str])


def _read_covariance(value: Any) -> tuple[tuple[float, ...], ...]:
    """Return a covariance of 3 moments or 6 entries of a tensor as a tuple of rows; refuse other sizes."""
    rows = value if isinstance(value, tuple | list) else ()
    sizes = {len(row) if isinstance(row, tuple | list) else 0 for row in rows}
    if len(rows) not in (3, 6) or sizes != {len(rows)}:
        raise refusal("is not a covariance", COVARIANCE)
    return tuple(tuple(finite(entry, COVARIANCE) for entry in row) for row in rows)


def _read_phase(value: Any) -> float | str:
    """Return the standard deviation of a phase in rad, or "any"; refuse negative ones."""
    if value == distribution.ANY:
        return value
    allowed = f"a standard deviation ≥ 0 in rad, or {distribution.ANY}"
    amount = finite(value, allowed, "rad")
    if amount < 0:
        raise refusal("is negative", allowed)
    return amount


class Uncertainty(Strict):
    """Standard deviations of a body and its spin."""

    moments: Annotated[tuple[float, ...], _fractions_validator(3)] = key(
        f"of I1, I2 and I3 independently, relative: {FRACTION}, or a list of three"
    )
    tensor: Annotated[tuple[float, ...], _fractions_validator(6)] = key(
        f"of the tensor's entries xx, yy, zz, xy, xz, yz independently, relative: {FRACTION}, or a list of six"
    )
    covariance: Annotated[tuple[tuple[float, ...], ...], BeforeValidator(_read_covariance)] = key(
        f"the whole covariance: {COVARIANCE}"
    )
    omega0: Fraction = key(f"of the spin rate, relative: {FRACTION}")
    epsilon: Fraction = key(f"of the size of the perturbation, relative: {FRACTION}")
    phase: Annotated[float | str, BeforeValidator(_read_phase)] = key(
        f"of the direction of the perturbation, rad: ≥ 0, or {distribution.ANY}"
    )
    inertia: Fraction = key(f"of the moments, or of the tensor where that is given: {FRACTION}")

    @model_validator(mode="after")
    def _check_one(self) -> "Uncertainty":
        """Check that exactly one of the ways to give an uncertainty is used, or only that of the spin."""
        entries = [name for name in ("moments", "tensor", "covariance", "inertia") if getattr(self, name) is not None]
        if len(entries) > 1:
            value = display(getattr(self, entries[1]))
            raise refusals([Problem((entries[1],), value, f"is given beside {entries[0]}", "one of them")])
        if not self.model_fields_set:
            raise refusal("is empty", "a mapping with " + keys_of(Uncertainty))
        return self

    @property
    def spin(self) -> dict[str, float | str]:
        """Name → uncertainty of omega0, epsilon and phase, for those that are uncertain."""
        return {name: value for name in distribution.SPIN if (value := getattr(self, name)) not in (None, 0)}


UNCERTAIN = "a fraction (5 %), or a mapping with  " + ", ".join(name for name in Uncertainty.model_fields)
UncertaintyEntry = Annotated[
    Uncertainty,
    BeforeValidator(  # a single fraction is that of the tensor, or if there is none of the moments
        lambda value: value if isinstance(value, dict | Uncertainty) else {"inertia": read_fraction(value)},
        json_schema_input_type=Uncertainty | float | str,
    ),
]


class UncertainBody(SpunBody):
    """One body and the uncertainty of its moments."""

    uncertainty: UncertaintyEntry = key(f"uncertainty of this body: {UNCERTAIN}")
    draws: designs.Draws = key("number of draws of this body")


class UncertainIntegration(Integration):
    """Measurement of each draw: half as long as for a single body, with errors far below those of the sampling."""

    rotations: Positive = key("length of a run in rotations, 2π/|omega0|: > 0", 2.0)


class UncertainDefinition(NearAxisDefinition):
    """A sweep of uncertain bodies."""

    bodies: list_of(UncertainBody) = key(
        "a list of bodies, names unique, each as for rigid bodies, with uncertainty and draws", ()
    )
    integration: UncertainIntegration = mapping("how each draw is measured", UncertainIntegration)
    uncertainty: UncertaintyEntry = key(f"of all bodies without their own: {UNCERTAIN}")
    draws: designs.Draws = key("least number of draws of each body", 10_000)
    seed: designs.Seed = key("seed of the draws: whole, ≥ 0", 1)
    method: designs.Method = key("sampling of the draws: " + ", ".join(designs.METHODS), "sobol")
    turns: Positive = key("turns of the spin within which a flip is counted: > 0", 100.0)
    twist: bool = switch("to measure the twist of the draws too, and write its quantiles")
    keep: bool = switch("to write every draw into the map")

    @property
    def remarks(self) -> list[tuple[str, str]]:
        """The sampling of the bodies, and their principal axes."""
        counts = {designs.count_draws(self.sampling(body).draws) for body in self.bodies}
        range_text = " to ".join(f"{count:,}" for count in sorted({min(counts), max(counts)}))
        line = f"{range_text} draws a body ({self.method}, seed {self.seed}) over {', '.join(self.inputs_of_draws)}"
        return [("draws", line), *super().remarks]

    @cached_property
    def inputs_of_draws(self) -> tuple[str, ...]:
        """Uncertain inputs of all bodies, each once, in the order of their first occurrence."""
        names = dict.fromkeys(name for distribution in self.distributions.values() for name in distribution.inputs)
        return tuple(names) or ("(none)",)

    def sampling(self, body: UncertainBody) -> BodySampling:
        """Return the sampling of a body."""
        return BodySampling(body.draws or self.draws, self.seed, self.method, self.turns, self.twist)

    @cached_property
    def distributions(self) -> dict[str, distribution.Distribution]:
        """Name → body with its uncertainty."""
        return {body.name: _make_distribution(body, body.uncertainty or self.uncertainty) for body in self.bodies}

    @model_validator(mode="after")
    def _check_uncertainty(self) -> "UncertainDefinition":
        """Check that there are bodies, and that the uncertainty of each can be applied to it."""
        if not self.bodies:
            raise refusals([Problem(("bodies",), "", "is missing", "a list of bodies, each with its moments")])
        problems = []
        for i, body in enumerate(self.bodies):
            uncertainty = body.uncertainty or self.uncertainty
            key_path = ("bodies", i, "uncertainty") if body.uncertainty or not self.uncertainty else ("uncertainty",)
            try:
                if uncertainty is None:
                    raise InertiaError("", "is missing", f"{UNCERTAIN}, here or for all bodies")
                _make_distribution(body, uncertainty)
            except InertiaError as error:
                problems.append(Problem(key_path, error.shown, error.wrong, error.allowed))
        if problems:
            raise refusals(problems)
        return self


def _make_distribution(body: UncertainBody, uncertainty: Uncertainty) -> distribution.Distribution:
    """Return the distribution of moments or tensor of a body.

    Raises:
        InertiaError: if no rigid body has the moments, or the uncertainty cannot be applied to the body.
    """
    moments = np.array(body.moments)
    if reason := shapes.violation(body.moments):
        value = ", ".join(f"{moment:.6g}" for moment in moments)
        raise InertiaError(value, f"are not the moments of any rigid body: {reason}", shapes.POSSIBLE)
    is_of_tensor = uncertainty.tensor is not None or (
        uncertainty.covariance is not None and len(uncertainty.covariance) == 6
    )
    if is_of_tensor and body.tensor is None:
        allowed = f"uncertainty of its moments, or a tensor of {body.name}"
        raise InertiaError("(six entries)", "are given for a body without a tensor", allowed)
    entries, frame = moments, np.eye(3)
    if is_of_tensor or (uncertainty.inertia is not None and body.tensor is not None):
        frame, tensor = np.array(body.principal.axes), np.array(body.tensor)
        entries = np.array([(tensor[i, j] + tensor[j, i]) / 2 for i, j in ENTRIES.values()])
    if uncertainty.tensor is not None and len(set(uncertainty.tensor)) > 1:
        for name, entry, read_fraction in zip(ENTRIES, entries, uncertainty.tensor, strict=True):
            if entry == 0 and read_fraction > 0:
                problem = f"is a fraction of an entry that is 0 ({name}): it has no effect"
                raise InertiaError(f"{100 * read_fraction:.4g} %", problem, "0, or covariance: 6 rows of 6, kg2 m4")
    if uncertainty.covariance is not None:
        covariance = distribution.check_covariance(np.array(uncertainty.covariance), entries)
    else:
        fractions = next(
            (s for s in (uncertainty.tensor, uncertainty.moments, uncertainty.inertia) if s is not None), 0.0
        )
        covariance = distribution.relative_covariance(entries, np.array(fractions))
    return distribution.Distribution(moments, frame, entries, covariance, uncertainty.spin)


RATE_WORK, FLIP_WORK = 2, 10  # work of a draw's rate, and of its flips, relative to that of one point


class UncertainBodies(FreeBody):
    """Draws of rigid bodies, measured near each axis and reduced body by body.

    A point is a body and its spin; `bound` returns the system with the bodies of a definition.
    """

    name = "uncertain_bodies"
    kernels = ("near_axis.survey", "events.twist")
    existence: tuple[str, ...] = ()
    compiled = (*SURVEY, FLIPPED)
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
        """Return the levels of the quantiles, the inputs of all bodies, and the draws if the map contains them."""
        dimensions = {"quantile": np.array(designs.QUANTILES), "input": np.array(definition.inputs_of_draws)}
        if definition.keep:
            dimensions["draw"] = np.arange(_max_draws(definition), dtype=np.int32)
        return dimensions

    def cost(self, definition: UncertainDefinition) -> Cost:
        """Return the samples of all draws of the body with the largest number of draws, and the memory for them."""
        max_draws = _max_draws(definition)
        draws = RATE_WORK * max_draws + FLIP_WORK * min(max_draws, measuring.MAX_FLIP_DRAWS)
        return Cost(draws * definition.integration.samples, measuring.DRAW_BYTES * max_draws)

    def variables(self, definition: UncertainDefinition | None = None) -> dict[str, Variable]:
        """Return name → variable, with twists and single draws on request."""
        if definition is None:
            return VARIABLES
        draw_variables = (
            DRAW_VARIABLES
            if definition.twist
            else {name: v for name, v in DRAW_VARIABLES.items() if name != "twist_draw"}
        )
        return VARIABLES | (TWISTS if definition.twist else {}) | (draw_variables if definition.keep else {})

    def examples(self, definition: UncertainDefinition | None = None) -> tuple[Example, ...]:
        """Return the calls that compile surveys and flips, and those for twists on request."""
        return *self.compiled, *(TWIST.compiled if definition is None or definition.twist else ())

    def columns(self, points: Mapping[str, np.ndarray], integration) -> dict[str, np.ndarray]:
        """Return probabilities, quantiles and sensitivities; the spins of a body share its draws."""
        definition, names, columns = self._definition, np.asarray(points["body"]), {}
        extra = self.extra_dimensions(definition)
        for name, variable in self.variables(definition).items():
            missing = np.nan if variable.missing_is_nan else variable.first_flag
            columns[name] = np.full(
                (names.size, *(extra[dim].size for dim in variable.over)), missing, dtype=variable.dtype
            )
        for body in definition.bodies:
            numbers, distribution = np.flatnonzero(names == body.name), definition.distributions[body.name]
            inputs = [list(extra["input"]).index(name) for name in distribution.inputs]
            spins = (
                measuring.SpinSettings(*(points[name][number].item() for name in ARGUMENTS[1:])) for number in numbers
            )
            measured = measuring.measure_spins(distribution, spins, definition.sampling(body), integration)
            for number, (summary, draws) in zip(numbers, measured, strict=False):
                _store_columns(columns, number, summary, draws, inputs)
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
            p, draws = normal(point, integration), designs.count_draws(definition.sampling(body).draws)
            return 6 * np.sqrt(p * (1 - p) / draws) + 6 / draws  # error of plain draws, which scatter more

        return Reference("probability_middle", {"normal distribution": normal}, allowed)


def _max_draws(definition: UncertainDefinition) -> int:
    return max(designs.count_draws(definition.sampling(body).draws) for body in definition.bodies)


def _store_columns(
    columns: dict[str, np.ndarray], number: int, summary: Mapping, draws: Mapping, inputs: list[int]
) -> None:
    """Store summary and draws of spin number `number` in the columns; sensitivities at the body's own inputs."""
    for name, values in summary.items():
        if name.startswith("sensitivity"):
            columns[name][number, inputs] = values
        else:
            columns[name][number] = values
    for name, values in draws.items():
        if f"{name}_draw" in columns:
            columns[f"{name}_draw"][number, : len(values)] = values


SYSTEM = UncertainBodies()
