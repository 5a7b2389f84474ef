"""What definitions may say, as JSON Schema: for editors that complete keys and mark mistakes."""

from collections.abc import Sequence

from pydantic import BaseModel
from pydantic.json_schema import models_json_schema

from sweeps import systems
from sweeps.schema import DEFAULT_SYSTEM
from sweeps.schema.refusals import RefusedError, hint, shortened

DIALECT = "https://json-schema.org/draft/2020-12/schema"


def schema(described: Sequence[str] = ()) -> dict:
    """Return the JSON Schema of the definitions of every system of a folder, and of some described systems.

    A definition that names a system, or none for the default one, may have the keys of its variants too.
    """
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
