"""YAML (or a mapping) in, a strictly validated sweep out, its `Definition` of the model of the system that it names.

Whatever is wrong with a definition, `read` raises `DefinitionError`, whose text is the whole message for a person.
"""

import os
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ValidationError

from sweeps import systems
from sweeps.points import scattered
from sweeps.points.sweep import Sweep, of
from sweeps.reading.definitions import as_yaml, file_text, plain, read_text
from sweeps.schema import DEFAULT_SYSTEM
from sweeps.schema.definition import DEFAULT_NAME, NAME_PATTERN, Definition
from sweeps.schema.refusals import (
    DefinitionError,
    Problem,
    RefusedError,
    UnreadableError,
    description_of,
    display,
    hint,
    message,
    shortened,
    validation_problems,
)

DIALECT = "https://json-schema.org/draft/2020-12/schema"


class _InvalidError(Exception):
    """Carries what is wrong with the values of a definition."""

    def __init__(self, problems: list[Problem]):
        super().__init__(len(problems))
        self.problems = problems


def read(source: str | Path | Mapping, name: str | None = None, *, check: bool = True, folder: str = "") -> Sweep:
    """Return the sweep of a definition, which is validated.

    Args:
        source: path of a YAML (or JSON) file, or a mapping with the same keys; in a mapping NumPy's
            numbers and one-dimensional arrays do as well.
        name: the sweep's name; left out, the file's stem, and "sweep" for a mapping.
        check: whether its system also looks beyond the values, which takes longer.
        folder: where paths in a mapping start; left out, the current folder.

    Returns:
        The sweep; its `definition` is of its system's model, with numbers in the units of the system's parameters.

    Raises:
        DefinitionError: for whatever is wrong, one line a problem: file, key's path, value, what is allowed.
    """
    label = os.fspath(source) if isinstance(source, str | Path) else "definition"
    try:
        name = _sweep_name(source) if name is None else _checked_name(name)
        folder = os.path.dirname(label) if isinstance(source, str | Path) else folder
        sweep = _validated(*_text_and_values(source), name, os.path.abspath(folder))
    except UnreadableError as unreadable:
        raise DefinitionError(message(label, [unreadable.problem])) from None
    except _InvalidError as invalid:
        raise DefinitionError(message(label, invalid.problems)) from None
    if check:
        sweep.system.check(sweep.definition, sweep.grid)
    return sweep


def load(source: str | Path | Mapping, name: str | None = None, *, check: bool = True) -> Definition:
    """Return the validated definition alone; see `read`."""
    return read(source, name, check=check).definition


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
        model = systems.resolve(DEFAULT_SYSTEM).model
        raise UnreadableError((), display(values), "is not a mapping", description_of(model, ""))
    return text, values


def _validated(text: str | None, values: dict, name: str, folder: str) -> Sweep:
    # Another system has other keys in its grid: to list them as unknown would mislead.
    system = _system(values.get("system", DEFAULT_SYSTEM), folder)
    if (reads := _variant(system, values)) is not None:
        system, values = _system(reads, folder), {**values, "system": reads}
    model = system.model
    try:
        completed, table = scattered.completed(values, model, folder)
        definition = model.model_validate({"title": name, **completed}, context={"folder": folder})
    except ValidationError as error:
        raise _InvalidError(validation_problems(error, model)) from None
    definition.keep_source(as_yaml(values) if text is None else text, name, folder, table, _from_text)
    return of(definition, system)


def _variant(system: systems.Dynamics, values: Mapping) -> str | None:
    """Return the name of the system that reads a definition in place of `system`, by the keys of it and its bodies."""
    bodies = values.get("bodies")
    listed = bodies if isinstance(bodies, tuple | list) else ()
    keys = {key for each in (values, *listed) if isinstance(each, Mapping) for key in each}
    return next((name for key, name in system.variants.items() if key in keys), None)


def _from_text(text: str, name: str, folder: str) -> Definition:
    return _validated(text, plain(read_text(text)), name, folder).definition


def _system(name: Any, folder: str) -> systems.Dynamics:
    if systems.is_file(name):
        return systems.resolve(name, folder)
    ours = isinstance(name, str) and name in systems.MODULES  # to look for others' takes longer than to read one
    if not ours and (not isinstance(name, str) or name not in systems.names()):
        wrong = "is not available" + hint(name, systems.names())
        raise UnreadableError(("system",), display(name), wrong, ", ".join(systems.names()) + ", or path/to/file.py")
    return systems.resolve(name)


# -- what definitions may say, for editors that complete keys and mark mistakes


def json_schema(described: Sequence[str] = ()) -> dict:
    """Return the JSON Schema of the definitions of every system of a folder, and of some described systems.

    A definition that names a system, or none for the default one, may have the keys of its variants too.
    """
    from pydantic.json_schema import models_json_schema

    models = {name: _model(name) for name in (*systems.MODULES, *described)}
    places, whole = models_json_schema([(model, "validation") for model in models.values()], title="Polhode definition")
    any_of = {}
    for name, model in models.items():  # without a title a sweep has its file's name, without a system the default one
        entry = whole["$defs"][places[model, "validation"]["$ref"].rpartition("/")[2]]
        entry["required"] = [key for key in entry.get("required", []) if key not in ("title", "system")]
        readers = (name, *systems.resolve(name).variants.values())
        any_of[name] = {"anyOf": [places[models[each], "validation"] for each in readers]}
    named = {"required": ["system"]}
    conditions = {name: {**named, "properties": {"system": {"const": name}}} for name in any_of}
    rules = [{"if": conditions[name], "then": allowed} for name, allowed in any_of.items()]
    unnamed = {"if": {"not": named}, "then": any_of[DEFAULT_SYSTEM]}
    return {"$schema": DIALECT, **whole, "type": "object", "allOf": [*rules, unnamed]}


def _model(name: str) -> type[BaseModel]:
    try:
        return systems.resolve(name).model
    except KeyError:
        names = systems.names()
        what = f"{shortened(repr(name))} is not a system{hint(name, names)}"
        raise RefusedError(f"SYSTEM: {what}; allowed: {', '.join(names)}, or path/to/file.py") from None
