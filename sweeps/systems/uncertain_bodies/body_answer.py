"""Answer of `sweeps.body`: the stability of each spin of one body, as numbers and as text."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from html import escape
from io import StringIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sweeps.process import machine
from sweeps.schema.refusals import DefinitionError, cut_text
from sweeps.systems.bodies import body_files
from sweeps.systems.bodies.body import FileBody, body_entry
from sweeps.systems.rigid_body import orbit, rotation_mode, spin_outcomes
from sweeps.systems.uncertain_bodies import verdict

if TYPE_CHECKING:
    from rich.console import Console

    from sweeps.systems.uncertain_bodies.sampled_body import Answer

SPIN = tuple(spin_outcomes.DEFAULTS)
SAMPLING = ("draws", "seed", "method", "turns")
OPTIONS = (*SPIN, *SAMPLING, "uncertainty", "omega", "orbit", "mu")


@dataclass(frozen=True, repr=False)
class BodyAnswer:
    """The answer of `sweeps.body`; `print` shows it."""

    name: str  #: the body's name
    facts: dict[str, Any]  #: all numbers, in SI units, angles in rad; `facts["axes"]` has a mapping for each spin axis
    sentence: str = field(default="")  #: the verdict on the judged spin in words; "" of several bodies
    judged: verdict.SpinVerdict | None = field(default=None)  #: the verdict; None without one
    #: tables of (subject, outcome) in words by the heading of the subjects, that of the judged spin first
    tables: list[tuple[str, list[tuple[str, str]]]] = field(default_factory=list)
    paragraphs: list[list[str]] = field(default_factory=list)  #: lines on the body, its spin, observations
    answers: "list[BodyAnswer]" = field(default_factory=list)  #: of a file of several bodies, one for each
    entry: dict[str, Any] = field(default_factory=dict)  #: the body as an entry of a definition
    _sampled: "Answer | None" = field(default=None)

    def __str__(self) -> str:
        from sweeps.figure import printing

        text = StringIO()
        self.show(printing.console(text))
        return text.getvalue().rstrip()

    __repr__ = __str__

    def _repr_html_(self) -> str:
        """Return the answer as HTML, which a notebook shows: the verdict, its table, and further tables folded."""
        if self.answers:
            return "".join(each._repr_html_() for each in self.answers)
        tables = []
        for heading, rows in self.tables:
            cells = [f"<tr><td>{escape(subject)}</td><td>{escape(outcome)}</td></tr>" for subject, outcome in rows]
            head = f"<summary>{escape(heading)}</summary>"
            tables.append(f"<details{' open' if not tables else ''}>{head}<table>{''.join(cells)}</table></details>")
        lines = "<br>".join(escape(line) for lines in self.paragraphs for line in lines)
        return f"<h4>{escape(self.name)}</h4><p>{escape(self.sentence)}</p>{''.join(tables)}<p>{lines}</p>"

    def show(self, console: "Console") -> None:
        """Print the answer: the verdict, the outcome of the judged spin, further outcomes, then the body and its spin.

        Of several bodies, print all verdicts, then each answer.
        """
        from sweeps.figure.printing import table

        if self.answers:
            console.print(*(f"{each.name}: {each.sentence}" for each in self.answers), sep="\n")
        for each in self.answers:
            console.print()
            each.show(console)
        if self.answers:
            return
        console.print(self.name, style="bold")
        console.print(self.sentence)
        for heading, rows in self.tables:
            outcome_table = table(heading, "outcome")
            for row in rows:
                outcome_table.add_row(*row)
            console.print("", outcome_table, sep="\n")
        for lines in filter(None, self.paragraphs):
            console.print("", *lines, sep="\n")

    def write_definition(self, path: str | Path) -> None:
        """Write a definition of the bodies (YAML), with the covariance of uncertain tensors, for a sweep."""
        from sweeps.process.files import replace_output
        from sweeps.reading.definitions import as_yaml

        entries = [each.entry for each in self.answers or [self]]
        bodies = [{name: value for name, value in entry.items() if value is not None} for entry in entries if entry]
        if not bodies or Path(path).suffix != ".yaml":
            allowed = "a file .yaml, and a physically possible body"
            raise DefinitionError(f"{path}: holds no definition of {self.name}; allowed: {allowed}")
        with replace_output(path) as temporary:
            temporary.write_text(as_yaml({"title": cut_text(self.name, 200), "bodies": bodies}), encoding="utf-8")

    def meets(self, required: str, probability: float | None = None) -> bool:
        """Return whether every spin is as required: stable, stable_without_loss (or stable) or unstable.

        Args:
            required: the word.
            probability: least probability of it; left out, the word must be the verdict.

        Raises:
            DefinitionError: if the draws cannot decide the probability.
        """
        verdicts = [each.judged for each in self.answers or [self]]
        return all([judged is not None and judged.meets(required, probability) for judged in verdicts])

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
    """Return the answer for one body, or for each body of a file; see `sweeps.body`.

    Args:
        body: the body, as for `sweeps.body`.
        axis: spin axis, or None for all.
        twist: True to add the twist of a throw.
        source: the definition with the body's name, see `spin_outcomes.body_of`.
        setting: spin, uncertainty and sampling by name.
        load: makes a definition of a mapping, a path or a name.
    """
    if unknown := sorted(set(setting) - {*OPTIONS}):
        allowed = ", ".join(("axis", "twist", "definition", *OPTIONS))
        raise DefinitionError(f"body: {unknown[0]} is unknown; allowed: {allowed}")
    options = dict.fromkeys(OPTIONS) | dict(setting)
    options |= {"axis": axis, "twist": twist or None}
    entry: Any = body if isinstance(body, str) else body_entry(body)
    file_bodies = body_files.find_bodies(entry)
    answers = [_answer_or_refuse(each, source, options, load) for each in file_bodies]
    if len(answers) == 1:
        if "refused" in answers[0].facts:
            lines = (f"body: {line}" for line in file_bodies[0].lines)
            raise body_files.ImpossibleBodyError("\n".join([answers[0].facts["refused"], *lines]), answers[0].facts)
        return answers[0]
    return BodyAnswer(
        "; ".join(each.name for each in answers),
        {"bodies": {each.name: each.facts for each in answers}},
        answers=answers,
    )


def _answer_or_refuse(file_body: FileBody, source: object, options: Mapping[str, Any], load) -> BodyAnswer:
    """Return the answer for one body, or the diagnosis of a tensor that no rigid body has."""
    diagnosis: dict = file_body.facts.get("diagnosis", {"possible": True, "problems": (), "causes": ()})
    causes = ", ".join(cause["cause"] for cause in diagnosis["causes"]) or "unknown"
    try:
        result = _answer_one(file_body, source, options, load)
        doubt = f". The tensor is unlikely for this mass and size. Possible cause: {causes}."
        return replace(result, sentence=result.sentence + doubt) if diagnosis["problems"] else result
    except DefinitionError as error:
        if diagnosis["possible"]:
            raise
        facts = {"name": file_body.name or "your body", "refused": str(error)} | file_body.facts
        sentence = f"No rigid body has this tensor of inertia. Possible cause: {causes}."
        return BodyAnswer(file_body.name, facts, sentence=sentence, paragraphs=[list(file_body.lines)])


def _answer_one(file_body: FileBody, source: object, options: Mapping[str, Any], load) -> BodyAnswer:
    """Return the answer for one body with `options`: spin, axis, omega, twist, uncertainty and sampling, or None each.

    With omega, an angular velocity in any direction, spins of this size about each axis are predicted, and the answer
    has the rotation's mode, tilts and periods under `facts["rotation"]`.
    """
    omega, spin_options = _chosen_spin(file_body, options)
    nominal, spin = spin_outcomes.body_of(file_body, source, spin_options, load)
    axes = spin_outcomes.axes_of(options["axis"])
    judged = verdict.judge_spin(nominal, options["axis"], omega)
    facts, lines, rows, observations = spin_outcomes.predict_body(nominal, spin, axes, bool(options["twist"]))
    about = dict(zip(axes, rows, strict=True))
    tables = [("judged spin", [about.pop(judged.axis)])]
    if options["omega"] is not None:
        rotation = rotation_mode.predict_rotation(nominal, omega)
        facts["rotation"] = rotation.facts
        tables[0][1].append(rotation_mode.describe_rotation(rotation))
    if options["orbit"] is not None:
        facts["orbit"], orientation_rows = orbit.predict_orientations(nominal, options["orbit"], options["mu"])
        tables.append(("orientation on the orbit", orientation_rows))
    elif options["mu"] is not None:
        raise DefinitionError("body: mu: is given without orbit; allowed: both, or orbit alone for the Earth")
    entry = spin_outcomes.entry_of(nominal) | {"omega0": spin["omega0"], "axis": judged.axis}
    sample = _sample(nominal, file_body, spin, {**options, "axes": axes}, load)
    if file_body.pieces is not None:
        from sweeps.systems.uncertain_bodies import uncertain_parts

        judged, entry["uncertainty"] = uncertain_parts.judge_parts(judged, file_body.pieces, options)
    if sample is not None:
        from sweeps.systems.uncertain_bodies import sampled_body

        entry["uncertainty"] = sample.body.uncertainty.model_dump(exclude_none=True)
        judged = replace(judged, odds=sampled_body.odds_of(sample, judged.axis))
        sample_facts = sampled_body.collect_facts(sample)
        axis_facts = [spin | sample_facts["axes"].get(spin["axis"], {}) for spin in facts["axes"]]
        facts |= sample_facts | {"axes": axis_facts}
        tables.append(("sampled spins", sampled_body.outcome_rows(sample)))
        lines += sampled_body.sampling_lines(sample)
    facts |= file_body.facts | {"verdict": judged.facts}
    tables += [("other spins", list(about.values()))] if about else []
    paragraphs = [
        [*lines, *verdict.odds_lines(judged.odds, "kg m²" if nominal.ratios is None else "(ratios)"), *file_body.lines],
        observations,
    ]
    return BodyAnswer(nominal.name, facts, judged.sentence, judged, tables, paragraphs, entry=entry, _sampled=sample)


def _chosen_spin(file_body: FileBody, options: Mapping[str, Any]) -> tuple:
    """Return the angular velocity that was given, or that of the file, or None, and the options with its rate."""
    omega = options["omega"]
    if omega is not None:
        allowed_options = ("epsilon", "phase", "omega", "orbit", "mu")
        if extra_options := [n for n in options if n not in allowed_options and options[n] is not None]:
            reason = f"is given beside {extra_options[0]}"
            raise DefinitionError(f"body: omega: {reason}; allowed: one of them")
        omega = rotation_mode.parse_omega(omega)
    elif options["axis"] is None:
        omega = file_body.omega
    rate = options["omega0"] if omega is None or options["omega0"] is not None else math.hypot(*omega)
    return omega, dict(options) | {"omega0": rate}


def _sample(nominal, file_body, spin: Mapping[str, float], options: Mapping[str, Any], load) -> "Answer | None":
    """Return the sampled and measured body if an uncertainty is given; refuse options of the sampling without one."""
    has_tolerances = file_body.pieces is not None and bool(file_body.pieces.sources)
    if options["uncertainty"] is None:
        unused = SAMPLING[-1:] if has_tolerances else SAMPLING
        if extra_options := [name for name in unused if options[name] is not None]:
            allowed = "both, or neither"
            raise DefinitionError(f"body: {', '.join(extra_options)}: given without uncertainty; allowed: {allowed}")
        return None
    if has_tolerances:
        raise DefinitionError("body: uncertainty: is given beside tolerances of parts; allowed: one of them")
    from sweeps.systems.uncertain_bodies import sampled_body

    body = file_body.entry
    entry = spin_outcomes.entry_of(nominal) if isinstance(body, str) else {"name": nominal.name} | body_entry(body)
    definition = sampled_body.make_definition(entry, options, spin, load)
    machine.keep_freed_memory()
    return sampled_body.measure_body(definition, machine.num_processors())
