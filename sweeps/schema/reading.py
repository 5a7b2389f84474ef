"""A definition's text or mapping → plain values: dict, tuple, str, int, float, bool, None; bounded in depth and number.

Files are read by the YAML 1.2 core schema (https://yaml.org/spec/1.2.2/#103-core-schema). Only the parser
is ruamel.yaml's: its own constructors also read dates and `1_000`, which the core schema does not.
"""

import json
import re
import stat
from collections.abc import Iterator, Mapping
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
from ruamel.yaml import YAML, events

from sweeps.schema.refusals import UnreadableError, display, key_path, shortened

MAX_FILE_BYTES = 2**20
MAX_DEPTH = 20
MAX_NODES = 200_000
MAX_EVENTS = 100_000  # of YAML, values and ends of lists and mappings: five seconds of its parser; JSON's is quick


def plain(value: Any, where: tuple = (), left: list[int] | None = None) -> Any:
    """The value with NumPy's numbers and arrays, ranges and lists made plain; bounded, so cycles end."""
    left = [MAX_NODES] if left is None else left
    left[0] -= 1
    if left[0] < 0 or (isinstance(value, np.ndarray) and value.size > left[0]):
        allowed = f"{MAX_NODES:,} values in all, aliases expanded"
        raise UnreadableError(where, "(too much)", "is too large", allowed)
    if len(where) > MAX_DEPTH:
        raise UnreadableError(where[:1], "(deep)", "is nested too deeply", f"at most {MAX_DEPTH} levels")
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, Mapping):
        value = _Pairs(value.items())
    if isinstance(value, _Pairs):
        return _plain_mapping(value, where, left)
    if isinstance(value, list | tuple | range):
        return tuple(plain(item, (*where, number), left) for number, item in enumerate(value))
    return _text(value, where) if isinstance(value, str) else value


class _Pairs(tuple):
    """A mapping as it was written: (key, value) pairs, any key, perhaps twice."""


def _plain_mapping(pairs: _Pairs, where: tuple, left: list[int]) -> dict:
    mapping = {}
    for key, item in pairs:
        if not isinstance(key, str) or not key.isprintable():
            raise UnreadableError(where, display(key), "is a key that is no word", "keys that are words")
        if key in mapping:
            raise UnreadableError((*where, key), display(item), "is under a key given twice", "each key once")
        mapping[key] = plain(item, (*where, key), left)
    return mapping


def _text(text: str, where: tuple) -> str:
    """The text with surrogate pairs joined: JSON escapes write characters beyond U+FFFF as two."""
    try:
        return text.encode("utf-16", "surrogatepass").decode("utf-16")
    except UnicodeDecodeError:
        raise UnreadableError(where, display(text), "holds half a surrogate pair", "Unicode text") from None


def as_yaml(value: dict) -> str:
    """Plain values as YAML text, which reads back as them."""
    yaml = YAML(typ="safe", pure=True)
    yaml.default_flow_style = None
    yaml.allow_unicode = True
    yaml.representer.sort_base_mapping_type_on_output = False
    stream = StringIO()
    yaml.dump(value, stream)
    return stream.getvalue()


# ---------------------------------------------------------------------------------------------------------
# Reading a file


def file_text(path: Path) -> str:
    """The text of a definition's file, UTF-8 and of bounded size."""
    allowed = f"a readable YAML file of at most {MAX_FILE_BYTES:,} bytes, in UTF-8"
    where = ("(file)",)
    try:
        if path.exists() and not stat.S_ISREG(path.stat().st_mode):
            raise UnreadableError(where, display(str(path)), "is not a regular file", allowed)
        with path.open("rb") as file:
            content = file.read(MAX_FILE_BYTES + 1)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise UnreadableError(where, display(str(path)), f"cannot be opened ({reason})", allowed) from None
    if len(content) > MAX_FILE_BYTES:
        raise UnreadableError(where, display(str(path)), "is too large", allowed)
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise UnreadableError(where, f"byte {error.start}", "is not UTF-8 text", allowed) from None


def read_text(text: str) -> Any:
    """The value that JSON or YAML text holds, mappings as pairs: :func:`plain` sees doubles among their keys."""
    if text.lstrip().startswith("{"):
        try:
            return _read_json(text)
        except json.JSONDecodeError:
            pass  # a YAML flow mapping
    return _read_yaml(text)


def _read_json(text: str) -> Any:
    """JSON by JSON's own rules: YAML's would stumble over tabs that indent."""
    try:
        return json.loads(text, object_pairs_hook=_Pairs, parse_int=_whole_number)
    except RecursionError:
        raise UnreadableError((), "(deep)", "is nested too deeply", f"at most {MAX_DEPTH} levels") from None


def _read_yaml(text: str) -> Any:
    parsed = YAML(typ="safe", pure=True, plug_ins=[]).parse(text)
    try:
        return _document(_bounded(parsed))
    except UnreadableError:
        raise
    except Exception as error:  # beside its own errors the scanner lets OverflowError and others through
        raise _syntax(text, error) from None


def _bounded(parsed: Iterator) -> Iterator:
    for number, event in enumerate(parsed):
        if number > MAX_EVENTS:
            allowed = f"{MAX_EVENTS:,} values in YAML, more in JSON"
            raise UnreadableError((f"line {_line(event)}",), "(too much)", "is too large", allowed)
        yield event


def _syntax(text: str, error: Exception) -> UnreadableError:
    mark = getattr(error, "problem_mark", None) or getattr(error, "context_mark", None)
    where = (f"line {mark.line + 1}",) if mark else ("(file)",)
    lines = text.splitlines()
    shown = display(lines[mark.line].strip()) if mark and mark.line < len(lines) else "(text)"
    reason = getattr(error, "problem", None) or str(error).split("\n")[0] or type(error).__name__
    reason = "".join(c if c.isprintable() else " " for c in reason[:200])
    return UnreadableError(where, shown, f"is not YAML: {reason}", "YAML 1.2, one mapping")


def _document(parsed: Iterator) -> Any:
    next(parsed)  # the stream's start
    start = next(parsed)
    if isinstance(start, events.StreamEndEvent):
        raise UnreadableError((), "(nothing)", "is an empty file", "a mapping with the keys of a definition")
    if start.version not in (None, (1, 2)):
        shown = "%YAML " + ".".join(map(str, start.version))
        raise UnreadableError((f"line {_line(start)}",), shown, "is another YAML", "YAML 1.2")
    value = _node(next(parsed), parsed, {}, ())
    next(parsed)  # the document's end
    after = next(parsed)
    if not isinstance(after, events.StreamEndEvent):
        raise UnreadableError((f"line {_line(after)}",), "---", "is a second document", "one document")
    return value


def _line(event: events.Event) -> int:
    return event.start_mark.line + 1


def _node(event: events.Event, parsed: Iterator, anchors: dict, where: tuple) -> Any:
    here = (f"line {_line(event)}",)
    if isinstance(event, events.AliasEvent):
        if event.anchor not in anchors:
            alias = display("*" + event.anchor)
            raise UnreadableError(here, alias, "has no whole value before it", "aliases of earlier values")
        return anchors[event.anchor]
    if event.tag is not None:
        raise UnreadableError(here, display(str(event.tag)), "is a tag", "values without tags (!…)")
    if len(where) > MAX_DEPTH:
        raise UnreadableError(here, key_path(where[:1]), "is nested too deeply", f"at most {MAX_DEPTH} levels")
    if isinstance(event, events.ScalarEvent):
        value = _core_scalar(event.value, here) if event.implicit[0] else event.value
    elif isinstance(event, events.SequenceStartEvent):
        value = _sequence(parsed, anchors, where)
    else:
        value = _mapping(parsed, anchors, where)
    if event.anchor is not None:
        anchors[event.anchor] = value
    return value


def _sequence(parsed: Iterator, anchors: dict, where: tuple) -> list:
    items = []
    while not isinstance(event := next(parsed), events.SequenceEndEvent):
        items.append(_node(event, parsed, anchors, (*where, len(items))))
    return items


def _mapping(parsed: Iterator, anchors: dict, where: tuple) -> _Pairs:
    pairs = []
    while not isinstance(event := next(parsed), events.MappingEndEvent):
        key = _node(event, parsed, anchors, (*where, "(key)"))
        name = key if isinstance(key, str) else "(key)"
        pairs.append((key, _node(next(parsed), parsed, anchors, (*where, name))))
    return _Pairs(pairs)


_NULL = re.compile(r"null|Null|NULL|~|")
_TRUE = re.compile(r"true|True|TRUE")
_FALSE = re.compile(r"false|False|FALSE")
_INT = re.compile(r"[-+]?[0-9]+")
_OCT_HEX = re.compile(r"0o[0-7]+|0x[0-9a-fA-F]+")
_FLOAT = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?")
_INF = re.compile(r"[-+]?\.(inf|Inf|INF)")
_NAN = re.compile(r"\.(nan|NaN|NAN)")


def _core_scalar(text: str, where: tuple) -> Any:
    """A plain scalar by the YAML 1.2 core schema: null, bool, int, float, else the text itself."""
    if _NULL.fullmatch(text):
        return None
    if _TRUE.fullmatch(text) or _FALSE.fullmatch(text):
        return text.lower() == "true"
    if _INT.fullmatch(text):
        return _whole_number(text, where)
    if _OCT_HEX.fullmatch(text):
        return int(text, 0)
    if _FLOAT.fullmatch(text):
        return float(text)
    if _INF.fullmatch(text) or _NAN.fullmatch(text):
        return float(text.replace(".", ""))
    return text


def _whole_number(text: str, where: tuple = ()) -> int:
    if len(text) > 1000:  # int() refuses beyond 4,300 digits, and no double reaches 1,000
        wrong = f"is a number of {len(text):,} digits"
        raise UnreadableError(where, shortened(text), wrong, "numbers up to 1.8e308")
    return int(text)
