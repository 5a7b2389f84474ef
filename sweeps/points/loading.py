"""YAML (or a mapping) in, a strictly validated sweep out, its `Definition` of the model of the system that it names.

For any error in a definition `read_sweep` raises `DefinitionError`; its text is the whole message for a person.
"""

import os
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from pydantic import BaseModel

from sweeps import systems
from sweeps.points import scattered
from sweeps.points.sweep import Sweep, build_sweep
from sweeps.reading.definitions import as_yaml, file_text, plain, read_text
from sweeps.schema import DEFAULT_SYSTEM
from sweeps.schema.definition import DEFAULT_NAME, NAME_PATTERN, Definition
from sweeps.schema.refusals import (
    DefinitionError,
    RefusedError,
    UnreadableError,
    cut_text,
    description_of,
    display,
    hint,
    message,
    validate,
)

DIALECT = "https://json-schema.org/draft/2020-12/schema"


def read_sweep(source: str | Path | Mapping, name: str | None = None, *, check: bool = True, folder: str = "") -> Sweep:
    """Return the sweep of a definition, which is validated.

    Args:
        source: path of a YAML (or JSON) file, or a mapping with the same keys; in a mapping NumPy's
            numbers and one-dimensional arrays do as well.
        name: the sweep's name; left out, the file's stem, and "sweep" for a mapping.
        check: whether its system also checks the points, which takes longer.
        folder: paths in a mapping are relative to it; by default the current folder.

    Returns:
        The sweep; its `definition` is of its system's model, with numbers in the units of the system's parameters.

    Raises:
        DefinitionError: if the definition is invalid, with one line a problem: file, key's path, value, allowed values.
    """
    label = os.fspath(source) if isinstance(source, str | Path) else "definition"
    try:
        name = _sweep_name(source) if name is None else _checked_name(name)
        folder = os.path.dirname(label) if isinstance(source, str | Path) else folder
        sweep = _validate_sweep(*_text_and_values(source), name, os.path.abspath(folder), label)
    except UnreadableError as unreadable:
        raise DefinitionError(message(label, [unreadable.problem])) from None
    if check:
        sweep.system.check(sweep.definition, sweep.grid)
    return sweep


def read_definition(source: str | Path | Mapping, name: str | None = None, *, check: bool = True) -> Definition:
    """Return the validated definition of `source` alone; for `name` and `check` see `read_sweep`."""
    return read_sweep(source, name, check=check).definition


def _sweep_name(source: Any) -> str:
    """Return the name of a sweep from its file's stem; the default name for a mapping."""
    if isinstance(source, Mapping):
        return DEFAULT_NAME
    if not isinstance(source, str | Path):
        raise UnreadableError((), display(source), "is no source", "a path or a mapping")
    return _checked_name(Path(source).stem)


def _checked_name(name: str) -> str:
    """Return a sweep's name; refuse a name that is unsafe as a folder."""
    if not (isinstance(name, str) and re.fullmatch(NAME_PATTERN, name)):
        allowed = "1 to 64 letters A-Z a-z, digits, _ . -, the first a letter or a digit"
        raise UnreadableError(("(name)",), display(name), "is no name for a sweep (a file's stem)", allowed)
    return name


def _text_and_values(source: Any) -> tuple[str | None, dict]:
    """Return the text (None for a mapping) and the plain values of a definition."""
    text = None if isinstance(source, Mapping) else file_text(Path(source))
    values = plain(source if text is None else read_text(text))
    if not isinstance(values, dict):
        model = systems.resolve(DEFAULT_SYSTEM).model
        raise UnreadableError((), display(values), "is not a mapping", description_of(model, ""))
    return text, values


def _validate_sweep(text: str | None, values: dict, name: str, folder: str, label: str = "definition") -> Sweep:
    """Return the sweep of a definition's values, validated by the model of its system; a label begins refusals."""
    # Another system has different keys in its grid: to list them as unknown would mislead.
    system = _resolve_system(values.get("system", DEFAULT_SYSTEM), folder)
    if (reads := _variant_system(system, values)) is not None:
        system, values = _resolve_system(reads, folder), {**values, "system": reads}
    full_values, table = scattered.complete_values(values, system.model, folder)
    definition = validate(system.model, {"title": name, **full_values}, label, folder=folder)
    definition.keep_source(as_yaml(values) if text is None else text, name, folder, table, _from_text)
    return build_sweep(definition, system)


def _variant_system(system: systems.Dynamics, values: Mapping) -> str | None:
    """Return the name of the system that reads a definition in place of `system`, by the keys of it and its bodies."""
    bodies = values.get("bodies")
    body_list = bodies if isinstance(bodies, tuple | list) else ()
    keys = {key for each in (values, *body_list) if isinstance(each, Mapping) for key in each}
    return next((name for key, name in system.variants.items() if key in keys), None)


def _from_text(text: str, name: str, folder: str) -> Definition:
    return _validate_sweep(text, plain(read_text(text)), name, folder).definition


def _resolve_system(name: Any, folder: str) -> systems.Dynamics:
    """Return the system of a definition's key `system`; refuse a name that does not exist."""
    if systems.is_file(name):
        return systems.resolve(name, folder)
    # a search for installed systems takes longer than reading a file
    ours = isinstance(name, str) and name in systems.MODULES
    if not ours and (not isinstance(name, str) or name not in systems.system_names()):
        problem = "is not available" + hint(name, systems.system_names())
        raise UnreadableError(
            ("system",), display(name), problem, ", ".join(systems.system_names()) + ", or path/to/file.py"
        )
    return systems.resolve(name)


# -- a schema of definitions, for editors that complete keys and mark mistakes


def json_schema(system_files: Sequence[str] = ()) -> dict:
    """Return the JSON Schema of the definitions of every system of a folder, and of some described systems.

    A definition that names a system, or none for the default one, may have the keys of its variants too.
    """
    from pydantic.json_schema import models_json_schema

    models = {name: _model_of_system(name) for name in (*systems.MODULES, *system_files)}
    refs, schema = models_json_schema([(model, "validation") for model in models.values()], title="Polhode definition")
    any_of = {}
    for name, model in models.items():  # without a title a sweep has its file's name, without a system the default one
        entry = schema["$defs"][refs[model, "validation"]["$ref"].rpartition("/")[2]]
        entry["required"] = [key for key in entry.get("required", []) if key not in ("title", "system")]
        readers = (name, *systems.resolve(name).variants.values())
        any_of[name] = {"anyOf": [refs[models[each], "validation"] for each in readers]}
    has_system = {"required": ["system"]}
    conditions = {name: {**has_system, "properties": {"system": {"const": name}}} for name in any_of}
    rules = [{"if": conditions[name], "then": allowed} for name, allowed in any_of.items()]
    default_rule = {"if": {"not": has_system}, "then": any_of[DEFAULT_SYSTEM]}
    return {"$schema": DIALECT, **schema, "type": "object", "allOf": [*rules, default_rule]}


def _model_of_system(name: str) -> type[BaseModel]:
    """Return the model of definitions of a system by its name; refuse an unknown name."""
    try:
        return systems.resolve(name).model
    except KeyError:
        names = systems.system_names()
        problem = f"{cut_text(repr(name))} is not a system{hint(name, names)}"
        raise RefusedError(f"SYSTEM: {problem}; allowed: {', '.join(names)}, or path/to/file.py") from None
