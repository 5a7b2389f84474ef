"""The answer for one uncertain body, sampled and measured: `polhode body … --uncertainty 5%`."""

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from sweeps.reading.definitions import plain, read_text
from sweeps.schema.refusals import DefinitionError, UnreadableError
from sweeps.systems.bodies.body import body_entry
from sweeps.systems.bodies.inertia import TENSOR_ROUNDING
from sweeps.systems.bodies.variables import MOMENTS
from sweeps.systems.motion import format_span
from sweeps.systems.rigid_body.spin_outcomes import load_body
from sweeps.systems.uncertain_bodies import designs, measuring
from sweeps.systems.uncertain_bodies.distribution import Distribution
from sweeps.systems.uncertain_bodies.possible import ENTRIES
from sweeps.systems.uncertain_bodies.system import VARIABLES, UncertainBody, UncertainDefinition
from sweeps.systems.uncertain_bodies.verdict import Odds, make_odds

# options of the command line that are keys of a definition
OPTIONS = ("draws", "seed", "turns", "method", "twist", "axes")


@dataclass(frozen=True)
class Answer:
    """A sampled and measured body."""

    body: UncertainBody  #: the nominal body and its spin
    distribution: Distribution  #: distribution of its moments and its spin
    sampling: measuring.BodySampling  #: number and method of the draws
    #: axis → its summary and its draws, see `sweeps.systems.uncertain_bodies.measuring.measured`.
    axes: dict[int, tuple[dict, dict]]


def definition_of(bodies: object, uncertainty: object, omega0: float | str, other_keys: Mapping) -> dict:
    """Return the mapping of a definition from the arguments of `sweeps.uncertainty`.

    Args:
        bodies: a body's mapping, moments or tensor, or a list of mappings.
        uncertainty: standard deviations, as in a definition.
        omega0: spin rate of bodies without their own, rad s-1.
        other_keys: all further keys of the definition.
    """
    entries = [bodies] if isinstance(bodies, Mapping) else bodies
    if not (isinstance(entries, list | tuple) and entries and all(isinstance(body, Mapping) for body in entries)):
        entries = [{"name": "body"} | body_entry(bodies)]
    grid = dict(other_keys.get("grid", {}))
    entries = [body if "omega0" in body or "omega0" in grid else {**body, "omega0": omega0} for body in entries]
    return {"bodies": entries, "uncertainty": uncertainty, **other_keys}


def make_definition(entry: Mapping, options: Mapping, spun: Mapping[str, float], load: Callable) -> UncertainDefinition:
    """Return the definition of one body; refusals name the option.

    Args:
        entry: the body's entry of a definition.
        options: uncertainty (text of YAML, or its value) and `OPTIONS`, each None if it is not given.
        spun: omega0, epsilon and phase.
        load: makes a definition of a mapping.
    """
    try:
        uncertainty = options["uncertainty"]
        uncertainty = plain(read_text(uncertainty)) if isinstance(uncertainty, str) else uncertainty
    except UnreadableError as unreadable:
        raise DefinitionError(f"body: uncertainty: {unreadable.problem}") from None
    values = {"bodies": [{**entry, "uncertainty": uncertainty, **spun}]}
    return load_body(values | {name: options[name] for name in OPTIONS if options[name] is not None}, load)


def measure_body(definition: UncertainDefinition, threads: int = 1) -> Answer:
    """Sample and measure the only body of a definition."""
    body = definition.bodies[0]
    distribution, sampling = definition.distributions[body.name], definition.sampling(body)
    spins = [measuring.SpinSettings(axis, body.omega0, body.epsilon, body.phase) for axis in definition.axes]
    measured = measuring.measure_spins(distribution, spins, sampling, definition.integration, threads)
    return Answer(body, distribution, sampling, dict(zip(definition.axes, measured, strict=True)))


def collect_facts(result: Answer) -> dict:
    """Return the answer for JSON: numbers by axis under the names of a map."""
    sampling, axes, words = result.sampling, {}, VARIABLES["stability"].flags
    for axis, (summary, _) in result.axes.items():
        plain = {name: np.asarray(value).tolist() for name, value in summary.items() if name != "status"}
        axes[axis] = plain | {"stability": words[summary["stability"]]}
    how = {"draws": designs.count_draws(sampling.draws), "seed": sampling.seed, "method": sampling.method}
    how |= {"turns": sampling.turns, "quantile": list(designs.QUANTILES), "input": list(result.distribution.inputs)}
    return how | {"impossible_naive": next(iter(axes.values()))["impossible_naive"], "axes": axes}


def odds_of(result: Answer, axis: int) -> Odds:
    """Return the odds of the spin about an axis from all draws."""
    summary, draws = result.axes[axis]
    moments = np.stack([draws[name] for name in MOMENTS], axis=-1).reshape(
        *designs.replicates(result.sampling.draws), 3
    )
    shares = np.nan_to_num(summary["sensitivity_total"]).tolist()
    sensitivity = dict(zip(result.distribution.inputs, shares, strict=True))
    return make_odds(moments, axis, TENSOR_ROUNDING, sensitivity)


def outcome_rows(result: Answer) -> list[tuple[str, str]]:
    """Return (axis, outcome) in words."""
    return [(f"axis {axis}", _describe_outcome(axis, summary, result)) for axis, (summary, _) in result.axes.items()]


def _describe_outcome(axis: int, summary: Mapping, result: Answer) -> str:
    """Return the outcome of a spin in words: probabilities, times, twist and the main source of uncertainty."""
    text = f"P(unstable) {_format_probability(summary, 'unstable', summary['draws'])}"
    text += f"; P(intermediate axis) {_format_probability(summary, 'middle', summary['draws'])}"
    theory = summary["probability_middle_theory"]
    text += f" (normal distribution: {theory:.4g})" if math.isfinite(theory) else ""
    for rate, chance in zip(summary["growth_rate_quantile"][3:], (5, 1), strict=True):
        if rate > 0:
            text += f"; with {chance} % probability perturbations grow e-fold in {format_span(1 / rate)} or less"
    probability = _format_probability(summary, "flip", summary["draws_followed"])
    text += f"; P(flips within {result.sampling.turns:g} turns) {probability}"
    sooner = summary["flip_period_quantile"]
    if np.isfinite(sooner[2]):
        text += f", median time between flips {format_span(sooner[2])}"
    is_handle = result.body.moments[axis - 1] == min(result.body.moments)  # its direction stays near L
    if "twist_quantile" in summary and not is_handle and np.isfinite(summary["twist_quantile"]).all():
        low, middle, high = np.degrees(summary["twist_quantile"][1:4])
        outcome = f"; thrown with ε = {result.body.epsilon:.3g}, it twists by {middle:.3g}°"
        text += f"{outcome} per revolution of its handle (90 % of the draws: {low:.3g}° to {high:.3g}°)"
    shares, inputs = np.nan_to_num(summary["sensitivity_total"]), result.distribution.inputs
    if not shares.size or shares.max() <= 0:
        return text
    largest = int(shares.argmax())
    return f"{text}; most of the variance of Ω² comes from {inputs[largest]} (total Sobol index {shares[largest]:.2f})"


def _format_probability(summary: Mapping, event: str, draws: int) -> str:
    """Return a probability with its standard error, "= 0.4758 ± 0.0009"; of no hit or no miss, its bound."""
    value, error = summary[f"probability_{event}"], summary[f"probability_{event}_error"]
    return designs.format_probability(value, error, draws)


def sampling_lines(result: Answer) -> Iterator[str]:
    """Yield lines on the sampling and the draws."""
    sampling, inputs = result.sampling, result.distribution.inputs
    how = f"{sampling.method}, seed {sampling.seed}"
    yield f"{designs.count_draws(sampling.draws):,} bodies drawn ({how}); uncertain: {', '.join(inputs) or 'nothing'}"
    zero = [name for name, entry in zip(ENTRIES, result.distribution.entries, strict=False) if entry == 0]
    if exact := [name for name in zero if not any(name in each.split("+") for each in inputs)]:
        yield f"taken as exactly 0: {', '.join(exact)} (a fraction of 0 is 0; covariance gives them a sigma)"
    first = next(iter(result.axes.values()))[0]
    if first["impossible_naive"] > 0:
        violation = f"{100 * first['impossible_naive']:.3g} % of Gaussian samples violate the triangle inequality"
        yield f"{violation} and are projected to nearly flat bodies"
    for axis, (summary, _) in result.axes.items():
        shift = summary["moment_mean"] / summary["moment_mean_requested"] - 1
        spread = summary["moment_spread"] / requested - 1 if (requested := summary["moment_spread_requested"]) else 0
        if abs(shift) > 1e-3 or abs(spread) > 1e-2:
            mean = f"sampled mean {100 * shift:+.2f} % from the requested one"
            yield f"moment about axis {axis}: {mean}, sigma {1 + spread:.3g} x the requested one"
