r"""Verdict on a spin about one principal axis: its word, and the smallest change of a moment that changes it.

With the moments I_a about the axis and I_b, I_c about the others, the signs of two differences decide:

.. math:: I_a > I_b, I_c: \text{stable}, \qquad (I_a - I_b)(I_a - I_c) < 0: \text{unstable}, \qquad
    I_a < I_b, I_c: \text{stable without loss}

as a loss of energy at constant angular momentum ends in a spin about the axis of greatest inertia (major-axis rule). If
I_a equals another moment, the spin is marginal. A single moment changes the verdict as soon as I_a crosses another
moment; of these changes, those count that keep a physically possible body.

Source: Landau and Lifshitz, Mechanics, section 37; Hughes, Spacecraft Attitude Dynamics (1986), chapter 5.
"""

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from kernels.free import linear
from sweeps.schema.refusals import DefinitionError
from sweeps.systems.bodies import shapes
from sweeps.systems.bodies.inertia import describe_axis
from sweeps.systems.rigid_body.motion import frame_of
from sweeps.systems.rigid_body.system import SpunBody
from sweeps.systems.uncertain_bodies import designs

WORDS = {
    "stable": "stable, also with dissipation",
    "stable_without_loss": "stable without dissipation only (any loss of energy ends in a flat spin)",
    "unstable": "unstable",
    "marginal": "marginal (its moment equals another one)",
    "uncertain": "uncertain",
}
#: words of the regimes STABLE_MINOR, STABLE_MAJOR, UNSTABLE and MARGINAL of `kernels.free.linear`, in this order
WORDS_BY_REGIME = ("stable_without_loss", "stable", "unstable", "marginal")
MAX_CONTRIBUTIONS = 5  # number of contributions that are printed; JSON has all of them
DECIDING_ERRORS = 4.0  # standard errors; of 16 replicates a larger deviation has a probability of 0.1 %
CHOICES = {  # reason for an axis → its words behind the axis
    "axis": "",
    "omega": ", nearest to the angular velocity",
    "usual_spin": ", its usual spin",
    "greatest_inertia": ", the axis of greatest inertia",
}


@dataclass(frozen=True)
class Odds:
    """Probabilities of the words of a spin, from draws of the body."""

    probability: dict[str, float]  #: word → probability, by the signs of the differences of moments of each draw
    error: dict[str, float]  #: word → standard error of the probability
    draws: int  #: number of draws
    #: uncertain input → its total Sobol index of Ω²: the fraction of the variance that is left if all others are known
    sensitivity: dict[str, float]
    moment_quantile: list[list[float]]  #: quantiles of each moment, ascending in each draw, kg m2
    quantile: tuple[float, ...]  #: levels of the quantiles

    @property
    def largest_contribution(self) -> str | None:
        """The input with the largest index; None if all are 0."""
        shares = {name: share for name, share in self.sensitivity.items() if share > 0}
        return max(shares, key=shares.__getitem__, default=None)


@dataclass(frozen=True)
class SpinVerdict:
    """The verdict on the spin about one axis."""

    axis: int  #: 1, 2 or 3
    chosen_by: str  #: one of `CHOICES`
    frame: str  #: owner of the axes of `direction`
    direction: tuple[float, float, float] | None  #: the axis in the axes of the body's input; None for moments
    nominal: str  #: one of `WORDS`, for the body without uncertainty
    margin: dict[str, Any] | None  #: moment and its relative change: the smallest one that changes the verdict
    #: of a body of parts: mass (part, relative change) and place (part, along, change in m), the smallest changes of
    #: one part that change the verdict; None if none was found
    part_margin: dict[str, dict[str, Any] | None] = field(default_factory=dict)
    odds: Odds | None = None  #: of an uncertain body

    @property
    def word(self) -> str:
        """One of `WORDS`: uncertain if no word is certain."""
        if self.odds is None:
            return self.nominal
        likely, probability = max(self.odds.probability.items(), key=lambda each: each[1])
        return likely if probability > 1 - designs.MAX_DOUBT else "uncertain"

    @property
    def facts(self) -> dict[str, Any]:
        """All values by name."""
        largest = {"largest_contribution": self.odds.largest_contribution} if self.odds else {}
        return asdict(self) | {"word": self.word, "sentence": self.sentence} | largest

    @property
    def sentence(self) -> str:
        """The verdict in words."""
        place = "" if self.direction is None else f" ({describe_axis(self.direction, self.frame)})"
        nominal = f" (nominally {WORDS[self.nominal]})" if self.word != self.nominal else ""
        clauses = [f"Spin about axis {self.axis}{place}{CHOICES[self.chosen_by]}: {WORDS[self.word]}{nominal}"]
        margins = [f"{_percent(self.margin['change'])} in {self.margin['moment']}"] if self.margin else []
        if mass := self.part_margin.get("mass"):
            margins.append(f"{_percent(mass['change'])} in the mass of {mass['part']}")
        if step := self.part_margin.get("place"):
            margins.append(f"{_length(step['change'])} along {step['along']} in the place of {step['part']}")
        clauses += ["margin " + ", ".join(margins)] if margins else []
        if self.odds is not None:
            value, error = self.odds.probability["unstable"], self.odds.error["unstable"]
            clauses.append(f"P(unstable) {designs.format_probability(value, error, self.odds.draws, is_percent=True)}")
            largest = self.odds.largest_contribution
            clauses += [f"largest contribution: {largest}"] if largest else []
        return "; ".join(clauses)

    def meets(self, required: str, probability: float | None) -> bool:
        """Return whether the spin is as required, with a probability of at least `probability` if that is given.

        `stable_without_loss` includes `stable`. A probability is decided if it is `DECIDING_ERRORS` standard errors
        from that of the draws.

        Raises:
            DefinitionError: if the draws cannot decide.
        """
        words = {required, "stable"} if required == "stable_without_loss" else {required}
        if probability is None:
            return self.word in words
        if self.odds is None:
            allowed = "for a body with tolerances of its parts, or with --uncertainty"
            raise DefinitionError(f"body: probability: is given for a body that is known exactly; allowed: {allowed}")
        value = sum(self.odds.probability[word] for word in words)
        error = math.hypot(*(self.odds.error[word] for word in words))
        if not 0 < probability < 1:
            raise DefinitionError(f"body: probability: {probability} is out of range; allowed: above 0 and below 1")
        if abs(value - probability) <= DECIDING_ERRORS * error:
            reason = f"{probability:.10g} cannot be decided: P({required}) = {value:.6g} ± {error:.2g}"
            raise DefinitionError(f"body: probability: {reason}; allowed: more draws, or another probability")
        return value > probability


def choose_axis(body: SpunBody, axis: int | None, omega: Sequence[float] | None) -> tuple[int, str]:
    """Return the axis that is judged, and why: as requested, nearest to omega, the usual one, of greatest inertia.

    Args:
        body: the body.
        axis: requested axis, or None.
        omega: angular velocity in the axes of the body's input, rad s-1, or None.
    """
    if axis is not None:
        return axis, "axis"
    if omega is not None:
        return int(np.abs(frame_of(body).principal_axes @ np.array(omega)).argmax()) + 1, "omega"
    if body.axis is not None:
        return body.axis, "usual_spin"
    return 3 - int(np.argmax(body.moments[::-1])), "greatest_inertia"


def judge_moments(moments: Sequence[float], axis: int) -> str:
    """Return the word for a spin about an axis from the signs of differences of moments."""
    return WORDS_BY_REGIME[judge_draws(np.array([moments]), axis, 0.0)[0]]


def find_margin(moments: Sequence[float], axis: int) -> dict[str, Any] | None:
    """Return moment and signed relative change of the smallest change of one moment that changes the verdict.

    Return None if no change of one moment that keeps a possible body does.
    """
    changes = []
    for transverse in {1, 2, 3} - {axis}:
        for changed, target in ((axis, transverse), (transverse, axis)):
            crossing = list(moments)
            crossing[changed - 1] = moments[target - 1]
            if not shapes.violation(crossing):
                changes.append({"moment": f"I{changed}", "change": moments[target - 1] / moments[changed - 1] - 1})
    return min(changes, key=lambda each: abs(each["change"]), default=None)


def judge_spin(body: SpunBody, axis: int | None, omega: Sequence[float] | None) -> SpinVerdict:
    """Return the verdict on the spin of a body about the axis of `choose_axis`."""
    (axis, chosen_by), direction = choose_axis(body, axis, omega), None
    if body.principal is not None:
        row = np.array(body.principal.axes[axis - 1])
        sign = 1.0 if omega is None or row @ np.array(omega) >= 0 else -1.0
        direction = tuple((sign * row + 0.0).tolist())
    word, margin = judge_moments(body.moments, axis), find_margin(body.moments, axis)
    return SpinVerdict(axis, chosen_by, body.frame, direction, word, margin)


def judge_draws(moments: np.ndarray, axis: int, rounding: float) -> np.ndarray:
    """Return the number among `WORDS_BY_REGIME` of each draw of moments, shape (draws, 3), for a spin about an axis.

    Moments that differ by less than `rounding`, relative to the largest, count as equal.
    """
    regimes = linear.regime(*equal_within(rounding, moments, axis).T, axis)
    return np.minimum(regimes, linear.MARGINAL)  # a sphere is marginal, too


def equal_within(rounding: float, moments: np.ndarray, axis: int) -> np.ndarray:
    """Return draws of moments, shape (draws, 3), with those that count as equal to the moment about an axis made so."""
    along = moments[:, axis - 1, None]
    is_equal = np.abs(moments - along) <= rounding * moments.max(axis=1, keepdims=True)
    return np.where(is_equal, along, moments)


def _length(metres: float) -> str:
    return f"{metres:.3g} m" if metres >= 1 else f"{1000 * metres:.3g} mm"


def _percent(fraction: float) -> str:
    return f"{100 * abs(fraction):.3g} %"


def make_odds(moments: np.ndarray, axis: int, rounding: float, sensitivity: dict[str, float]) -> Odds:
    """Return the odds of a spin from draws of moments.

    Args:
        moments: of each draw, kg m2, shape (replicates, draws, 3).
        axis: number of the moment about the spin axis, 1, 2 or 3.
        rounding: moments that differ by less, relative to the largest, count as equal.
        sensitivity: uncertain input → its total Sobol index.
    """
    draws, levels = moments.shape[0] * moments.shape[1], designs.QUANTILES
    words = np.array([judge_draws(replicate, axis, rounding) for replicate in moments])
    fractions = np.stack([(words == number).mean(axis=1) for number in range(len(WORDS_BY_REGIME))], axis=1)
    value, error = (
        dict(zip(WORDS_BY_REGIME, each.tolist(), strict=True)) for each in designs.probability(fractions, draws)
    )
    columns = np.moveaxis(np.sort(moments, axis=-1), -1, 0)
    quantiles = [designs.quantiles(column, levels)[0].tolist() for column in columns]
    return Odds(value, error, draws, sensitivity, quantiles, levels)


def odds_lines(odds: Odds | None, unit: str) -> list[str]:
    """Return lines on the draws: probabilities, quantiles of the moments in a unit, and the largest sensitivities."""
    if odds is None:
        return []
    chances = [
        f"P({word}) {designs.format_probability(value, odds.error[word], odds.draws, is_percent=True)}"
        for word, value in odds.probability.items()
        if value > 0
    ]
    lines = [f"{odds.draws:,} bodies drawn: {'; '.join(chances)}"]
    for name, (_, low, median, high, _) in zip(("least", "middle", "greatest"), odds.moment_quantile, strict=True):
        lines.append(f"{name} moment: median {median:.6g} {unit}, 90 % of the draws {low:.6g} to {high:.6g}")
    shares = sorted(odds.sensitivity.items(), key=lambda each: -each[1])[:MAX_CONTRIBUTIONS]
    contributions = ", ".join(f"{name} {share:.2f}" for name, share in shares)
    return [*lines, f"contributions (total Sobol index of Ω²): {contributions or 'none'}"]
