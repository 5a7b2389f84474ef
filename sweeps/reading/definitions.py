"""A definition's text or mapping → plain values: dict, tuple, str, int, float, bool, None; bounded in depth and number.

Files are read by the YAML 1.2 core schema; see `sweeps.reading.yaml_text`.
"""

import json
from collections.abc import Iterable, Mapping
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np

from sweeps.reading.files import content
from sweeps.reading.limits import MAX_DEPTH, MAX_FILE_BYTES, Pairs, whole_number
from sweeps.schema.refusals import DefinitionError, MapError, UnreadableError, display

MAX_NODES = 200_000
MAX_CHARACTERS = 4 * MAX_FILE_BYTES  # characters of all texts and keys, aliases expanded
MAX_EVENTS = 100_000  # values and ends of collections in YAML: five seconds of its parser; JSON's is quick


def plain(value: Any, where: tuple = (), remaining_counts: list[int] | None = None) -> Any:
    """Return a value with NumPy numbers, arrays, ranges and lists as plain values.

    Args:
        value: the value, of bounded depth, so that cycles are refused.
        where: keys that lead to the value.
        remaining_counts: numbers of values and of characters that are still allowed.
    """
    remaining_counts = [MAX_NODES, MAX_CHARACTERS] if remaining_counts is None else remaining_counts
    remaining_counts[0] -= 1
    remaining_counts[1] -= len(value) if isinstance(value, str) else 0
    if min(remaining_counts) < 0 or (isinstance(value, np.ndarray) and value.size > remaining_counts[0]):
        allowed = f"{MAX_NODES:,} values and {MAX_CHARACTERS:,} characters in all, aliases expanded"
        raise UnreadableError(where, "(too much)", "is too large", allowed)
    if len(where) > MAX_DEPTH:
        raise UnreadableError(where[:1], "(deep)", "is nested too deeply", f"at most {MAX_DEPTH} levels")
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, Mapping | Pairs):
        return _plain_mapping(value.items() if isinstance(value, Mapping) else value, where, remaining_counts)
    if isinstance(value, list | tuple | range):
        return tuple(plain(item, (*where, number), remaining_counts) for number, item in enumerate(value))
    return _text(value, where) if isinstance(value, str) else value


def _plain_mapping(pairs: Iterable[tuple], where: tuple, remaining_counts: list[int]) -> dict:
    """Return pairs as a dictionary of plain values; refuse keys that are no words, and repeated keys."""
    mapping = {}
    for key, item in pairs:
        remaining_counts[1] -= len(key) if isinstance(key, str) else 0
        if not isinstance(key, str) or not key.isprintable():
            raise UnreadableError(where, display(key), "is a key that is no word", "keys that are words")
        if key in mapping:
            raise UnreadableError((*where, key), display(item), "is under a key given twice", "each key once")
        mapping[key] = plain(item, (*where, key), remaining_counts)
    return mapping


def _text(text: str, where: tuple) -> str:
    """Join surrogate pairs of a text: JSON escapes write characters beyond U+FFFF as two."""
    try:
        return text.encode("utf-16", "surrogatepass").decode("utf-16")
    except UnicodeDecodeError:
        raise UnreadableError(where, display(text), "holds half a surrogate pair", "Unicode text") from None


def as_yaml(value: dict) -> str:
    """Return plain values as YAML text that reads back as the same values."""
    from ruamel.yaml import YAML

    yaml = YAML(typ="safe", pure=True)
    yaml.default_flow_style = None
    yaml.allow_unicode = True
    yaml.representer.sort_base_mapping_type_on_output = False
    stream = StringIO()
    yaml.dump(value, stream)
    return stream.getvalue()


def definition_of(attributes: Mapping) -> dict:
    """Return the plain values of the definition among a map's attributes; none where it carries none to be read.

    Nothing that it names is followed, and nothing is run.
    """
    try:
        return mapping_of(attributes.get("definition", ""))
    except (DefinitionError, UnreadableError):
        return {}


def mapping_of(text: object) -> dict:
    """Return the plain values of a definition's text, which may be anything."""
    if not isinstance(text, str) or len(text) > MAX_FILE_BYTES:
        raise DefinitionError("is no text of a definition")
    values = plain(read_text(text))
    if not isinstance(values, dict):
        raise DefinitionError("is no mapping")
    return values


# -- reading a file


def file_text(path: Path) -> str:
    """Return the text of a definition's file, UTF-8 and of bounded size."""
    allowed = f"a readable YAML file of at most {MAX_FILE_BYTES:,} bytes, in UTF-8"
    where = ("(file)",)
    try:
        raw = content(path, MAX_FILE_BYTES)
    except (OSError, ValueError, MapError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        wrong = reason if reason.startswith("is ") else f"cannot be opened ({reason})"
        raise UnreadableError(where, display(str(path)), wrong, allowed) from None
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise UnreadableError(where, f"byte {error.start}", "is not UTF-8 text", allowed) from None


def read_text(text: str) -> Any:
    """Return the value of JSON or YAML text, mappings as pairs: :func:`plain` sees duplicates among their keys."""
    if text.lstrip().startswith("{"):
        try:  # by JSON's own rules: YAML's would stumble over tabs that indent
            return json.loads(text, object_pairs_hook=Pairs, parse_int=whole_number)
        except RecursionError:
            raise UnreadableError((), "(deep)", "is nested too deeply", f"at most {MAX_DEPTH} levels") from None
        except json.JSONDecodeError:
            pass  # a YAML flow mapping
    from sweeps.reading import yaml_text  # loaded for a text that is there, not for limits and refusals

    return yaml_text.read(text, MAX_EVENTS)
