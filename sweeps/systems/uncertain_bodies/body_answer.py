"""Answer of `sweeps.body`: the stability of each spin of one body, as numbers and as text."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from io import StringIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sweeps.process import machine
from sweeps.schema.refusals import DefinitionError
from sweeps.systems.bodies.body import body_entry
from sweeps.systems.rigid_body import rotation_mode, spin_outcomes

if TYPE_CHECKING:
    from rich.console import Console

    from sweeps.systems.uncertain_bodies.sampled_body import Answer

SPIN = tuple(spin_outcomes.DEFAULTS)
SAMPLING = ("draws", "seed", "method", "turns")


@dataclass(frozen=True)
class BodyAnswer:
    """The answer of `sweeps.body`; `print` shows it."""

    name: str  #: the body's name
    facts: dict[str, Any]  #: all numbers, in SI units, angles in rad; `facts["axes"]` has a mapping for each spin axis
    _lines: list[str] = field(repr=False)  #: text on the body and its spin
    _outcomes: list[tuple[str, str]] = field(repr=False)  #: (spin axis, outcome) in words
    _observations: list[str] = field(repr=False)  #: observed period and note of a listed body
    _sampled: "Answer | None" = field(default=None, repr=False)

    def __str__(self) -> str:
        from sweeps.figure import printing

        text = StringIO()
        self.show(printing.console(text))
        return text.getvalue().rstrip()

    def show(self, console: "Console") -> None:
        """Print the answer: the outcome of each spin, then the body and its spin."""
        from sweeps.figure.printing import table

        console.print(self.name, style="bold")
        outcome_table = table("spin about", "outcome")
        for row in self._outcomes:
            outcome_table.add_row(*row)
        console.print(outcome_table)
        for lines in (self._lines, self._observations):
            console.print(*["", *lines] if lines else [], sep="\n", end="\n" if lines else "")

    def savefig(self, path: str | Path) -> None:
        """Draw the sampled bodies on the triangle of inertia (PNG)."""
        from sweeps.figure import sheets
        from sweeps.process.files import replace_output
        from sweeps.systems.uncertain_bodies import sampled_body
        from sweeps.systems.uncertain_bodies.presentation import figure_outlook

        if self._sampled is None:
            raise DefinitionError("body: figure: shows sampled bodies; allowed: with uncertainty")
        with sheets.use_sheet(sheets.OWN_SIZE), replace_output(path) as temporary:
            figure = figure_outlook.draw_cloud(
                self.name, next(sampled_body.sampling_lines(self._sampled)), self._sampled.axes
            )
            figure.savefig(temporary, format="png")


def answer(
    body: object, axis: object, twist: bool, source: object, setting: Mapping[str, object], load: Callable
) -> BodyAnswer:
    """Return the answer for one body; see `sweeps.body`.

    Args:
        body: the body, as for `sweeps.body`.
        axis: spin axis, or None for all.
        twist: True to add the twist of a throw.
        source: the definition with the body's name, see `spin_outcomes.body_of`.
        setting: spin, uncertainty and sampling by name.
        load: makes a definition of a mapping, a path or a name.
    """
    if unknown := sorted(set(setting) - {*SPIN, *SAMPLING, "uncertainty", "omega"}):
        allowed = ", ".join(("axis", "twist", "definition", *SPIN, "omega", "uncertainty", *SAMPLING))
        raise DefinitionError(f"body: {unknown[0]} is unknown; allowed: {allowed}")
    options = dict.fromkeys((*SPIN, *SAMPLING, "uncertainty")) | dict(setting)
    if (omega := options.pop("omega", None)) is not None:
        return _answer_for_omega(body, omega, source, options | {"axis": axis, "twist": twist or None}, load)
    is_sampled = options["uncertainty"] is not None
    if not is_sampled and (extra_options := [name for name in SAMPLING if options[name] is not None]):
        raise DefinitionError(f"body: {', '.join(extra_options)}: given without uncertainty; allowed: both, or neither")
    nominal, spin = spin_outcomes.body_of(body, source, options, load)
    axes = spin_outcomes.axes_of(axis)
    facts, lines, rows, observations = spin_outcomes.predict_body(nominal, spin, axes, twist)
    if not is_sampled:
        return BodyAnswer(nominal.name, facts, lines, rows, observations)
    from sweeps.systems.uncertain_bodies import sampled_body

    entry = sampled_body.entry_of(nominal) if isinstance(body, str) else {"name": nominal.name} | body_entry(body)
    definition = sampled_body.make_definition(entry, options | {"axes": axes, "twist": twist or None}, spin, load)
    machine.keep_freed_memory()
    sample = sampled_body.measure_body(definition, machine.num_processors())
    sample_facts = sampled_body.collect_facts(sample)
    axis_facts = [spin | sample_facts["axes"].get(spin["axis"], {}) for spin in facts["axes"]]
    rows = [*sampled_body.outcome_rows(sample), *((f"{name}, nominal", text) for name, text in rows)]
    lines = [*lines, *sampled_body.sampling_lines(sample)]
    return BodyAnswer(nominal.name, facts | sample_facts | {"axes": axis_facts}, lines, rows, observations, sample)


def _answer_for_omega(body: object, omega: object, source: object, options: Mapping[str, object], load) -> BodyAnswer:
    """Return the answer for an angular velocity in any direction, and for spins of this size about each axis.

    The answer has the rotation's mode, tilts and periods under `facts["rotation"]`, and as its first outcome. An
    option other than epsilon and phase is refused.
    """
    if extra_options := [name for name in options if name not in ("epsilon", "phase") and options[name] is not None]:
        reason = f"is given beside {extra_options[0]}"
        raise DefinitionError(f"body: omega: {reason}; allowed: one of them")
    omega = rotation_mode.parse_omega(omega)
    options = dict(options) | {"omega0": math.hypot(*omega)}
    nominal, spin = spin_outcomes.body_of(body, source, options, load)
    rotation = rotation_mode.predict_rotation(nominal, omega)
    facts, lines, rows, observations = spin_outcomes.predict_body(nominal, spin)
    rows = [rotation_mode.describe_rotation(rotation), *rows]
    return BodyAnswer(nominal.name, facts | {"rotation": rotation.facts}, lines, rows, observations)
