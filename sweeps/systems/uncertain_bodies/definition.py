"""The definition of uncertain bodies: the uncertainty of each body, and how it is sampled."""

from functools import cached_property
from typing import Annotated, Any

import numpy as np
from pydantic import BeforeValidator, model_validator

from sweeps.schema.definition import Integration
from sweeps.schema.parameters import Strict, key, mapping, switch
from sweeps.schema.refusals import Problem, display, keys_of, refusal, refusals
from sweeps.schema.values import Positive, choice, finite, whole
from sweeps.systems.bodies import shapes
from sweeps.systems.bodies.body import list_of
from sweeps.systems.bodies.inertia import InertiaError
from sweeps.systems.rigid_body.definition import NearAxisDefinition, SpunBody
from sweeps.systems.uncertain_bodies import designs, distribution
from sweeps.systems.uncertain_bodies.measuring import BodySampling
from sweeps.systems.uncertain_bodies.possible import ENTRIES

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
Draws = Annotated[int, whole(designs.LEAST, designs.MOST, f"a whole number from {designs.LEAST} to {designs.MOST:,}")]


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
    seed: Annotated[int, whole(0, 2**63 - 1, "a whole number, 0 or more")] = key("seed of the draws: whole, ≥ 0", 1)
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
