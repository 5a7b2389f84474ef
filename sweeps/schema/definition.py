"""A sweep's definition: YAML (or a mapping) in, one strictly validated, frozen `Definition` out.

The models here and in `sweeps.systems` are the only truth about what a definition may hold: each key's meaning, unit
and allowed values stand in its `Field(description=...)`, and a refusal quotes them. Whatever is wrong with a
definition, `load` raises `DefinitionError`, whose text is the whole message for a person.
"""

import math
import os
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

from pydantic import BeforeValidator, Field, PrivateAttr, ValidationError, model_validator

from sweeps import systems
from sweeps.schema.reading import as_yaml, file_text, plain, read_text
from sweeps.schema.refusals import (
    DefinitionError,
    Problem,
    UnreadableError,
    description_of,
    display,
    hint,
    keys_of,
    message,
    refusals,
    validation_problems,
)
from sweeps.schema.values import (
    MAX_SAMPLES,
    MAX_SHARDS,
    Positive,
    SamplesPerRotation,
    Strict,
    Tolerance,
    file_count,
    line_of_text,
)

NAME_PATTERN = r"[A-Za-z0-9][A-Za-z0-9_.-]{0,63}"
DEFAULT_NAME = "sweep"


class _InvalidError(Exception):
    """Carries what is wrong with the values of a definition."""

    def __init__(self, problems: list[Problem]):
        super().__init__(len(problems))
        self.problems = problems


class Integration(Strict):
    """How each run is made: its length, its samples, its accuracy."""

    rotations: Positive = Field(4.0, description="length of a run in rotations, 2π/|omega0|: > 0")
    samples_per_rotation: SamplesPerRotation = Field(
        16, description="samples in a rotation: whole, ≥ 4; rotations × samples_per_rotation from 8 to 1e9"
    )
    tolerance: Tolerance = Field(
        1e-10,
        description="relative error allowed on the perturbation, 1e-13 to 1e-3: below 1e-13 the rounding of "
        "doubles over a run is larger than the request, above 1e-3 the error hides what is measured",
    )

    @property
    def samples(self) -> int:
        """Number of samples in a run: rotations × samples_per_rotation, rounded."""
        return round(self.rotations * self.samples_per_rotation)

    @model_validator(mode="after")
    def _check_samples(self) -> "Integration":
        samples = self.rotations * self.samples_per_rotation
        if not (math.isfinite(samples) and 8 <= round(samples) <= MAX_SAMPLES):
            wrong = f"makes {samples:.4g} samples with samples_per_rotation {self.samples_per_rotation}"
            allowed = f"rotations × samples_per_rotation from 8 to {MAX_SAMPLES:,}"
            raise refusals([Problem(("rotations",), display(self.rotations), wrong, allowed)])
        return self


class Definition(Strict):
    """A sweep of any system: what is varied, how each run is made, into how many files it is cut.

    Each system's own model adds its `grid`, and what else it asks for. `name` and `text` are no keys of the file: the
    file's stem, and the YAML as run.
    """

    title: Annotated[str, line_of_text(200)] = Field(
        description="what people read above maps and figures: one line of text; left out, the sweep's name"
    )
    system: str = Field(
        systems.DEFAULT, description="the equations of motion: " + " or ".join((*systems.names(), "a .py file"))
    )
    grid: Strict = Field(description="what is varied")
    integration: Integration = Field(
        Integration(),
        description="how each run is made: a mapping with " + keys_of(Integration),
    )
    shards: Annotated[int | str, BeforeValidator(file_count)] = Field(
        "auto",
        description=f"files the work is cut into: auto, or 1 to {MAX_SHARDS:,}; changes no result",
    )
    _name: str = PrivateAttr(DEFAULT_NAME)
    _text: str = PrivateAttr("")
    _folder: str = PrivateAttr("")

    @property
    def name(self) -> str:
        """The sweep's name: its file's stem."""
        return self._name

    @property
    def text(self) -> str:
        """The YAML as run: the file's own text, or the mapping written as YAML."""
        return self._text

    @property
    def inputs(self) -> str:
        """The files that the definition names, one a line with the SHA-256 of its content; empty without any."""
        return ""

    def __reduce__(self):
        """Travels between processes as its text: the models of a system need not be importable by name."""
        return _from_text, (self._text, self._name, self._folder)


def load(source: str | Path | Mapping, name: str | None = None, *, check: bool = True) -> Definition:
    """The validated definition of a sweep.

    Args:
        source: path of a YAML (or JSON) file, or a mapping with the same keys; in a mapping NumPy's
            numbers and one-dimensional arrays do as well.
        name: the sweep's name; left out, the file's stem, and "sweep" for a mapping.
        check: whether its system also looks beyond the values, which takes longer.

    Returns:
        The frozen `Definition` of its system's model; numbers in the units of its parameters.

    Raises:
        DefinitionError: for whatever is wrong, one line a problem: file, key's path, value, what is allowed.
    """
    label = os.fspath(source) if isinstance(source, str | Path) else "definition"
    try:
        name = _sweep_name(source) if name is None else _checked_name(name)
        folder = os.path.dirname(label) if isinstance(source, str | Path) else ""
        definition = _validated(*_text_and_values(source), name, os.path.abspath(folder))
    except UnreadableError as unreadable:
        raise DefinitionError(message(label, [unreadable.problem])) from None
    except _InvalidError as invalid:
        raise DefinitionError(message(label, invalid.problems)) from None
    if check:
        systems.resolve(definition.system).check(definition)
    return definition


def _sweep_name(source: Any) -> str:
    if isinstance(source, Mapping):
        return DEFAULT_NAME
    if not isinstance(source, str | Path):
        raise UnreadableError((), display(source), "is no source", "a path or a mapping")
    return _checked_name(Path(source).stem)


def _checked_name(name: str) -> str:
    if not (isinstance(name, str) and re.fullmatch(NAME_PATTERN, name)):
        allowed = "1 to 64 letters A-Z a-z, digits, _ . -, the first a letter or a digit"
        raise UnreadableError(("(name)",), display(name), "is no name for a sweep (a file's stem)", allowed)
    return name


def _text_and_values(source: Any) -> tuple[str | None, dict]:
    text = None if isinstance(source, Mapping) else file_text(Path(source))
    values = plain(source if text is None else read_text(text))
    if not isinstance(values, dict):
        model = systems.resolve(systems.DEFAULT).model
        raise UnreadableError((), display(values), "is not a mapping", description_of(model, ""))
    return text, values


def _validated(text: str | None, values: dict, name: str, folder: str) -> Definition:
    # Another system has other keys in its grid: to list them as unknown would mislead.
    model = _system(values.get("system", systems.DEFAULT)).model
    try:
        definition = model.model_validate({"title": name, **values}, context={"folder": folder})
    except ValidationError as error:
        raise _InvalidError(validation_problems(error, model)) from None
    definition._name, definition._folder = name, folder
    definition._text = as_yaml(values) if text is None else text
    return definition


def _from_text(text: str, name: str, folder: str) -> Definition:
    return _validated(text, plain(read_text(text)), name, folder)


def _system(name: Any) -> systems.System:
    if not systems.is_file(name) and (not isinstance(name, str) or name not in systems.names()):
        wrong = "is not available" + hint(name, systems.names())
        raise UnreadableError(("system",), display(name), wrong, ", ".join(systems.names()) + ", or path/to/file.py")
    return systems.resolve(name)
