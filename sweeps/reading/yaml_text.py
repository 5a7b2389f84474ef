"""YAML text → values, by the YAML 1.2 core schema (https://yaml.org/spec/1.2.2/#103-core-schema).

Only the parser is ruamel.yaml's: its own constructors also read dates and `1_000`, which the core schema does not.
"""

import re
from collections.abc import Iterator
from typing import Any

from ruamel.yaml import YAML, events

from sweeps.reading.limits import MAX_DEPTH, Pairs, whole_number
from sweeps.schema.refusals import UnreadableError, display, key_path


def read(text: str, most: int) -> Any:
    """Return the value of YAML text, mappings as pairs; refuse more than `most` values and ends of collections."""
    parsed = YAML(typ="safe", pure=True, plug_ins=[]).parse(text)
    try:
        return _document(_limit_events(parsed, most))
    except UnreadableError:
        raise
    except Exception as error:  # beside its own errors the scanner lets OverflowError and others through
        raise _syntax(text, error) from None


def _limit_events(parsed: Iterator, most: int) -> Iterator:
    """Yield YAML events, and refuse the file after too many."""
    for number, event in enumerate(parsed):
        if number > most:
            allowed = f"{most:,} values in YAML, more in JSON"
            raise UnreadableError((f"line {_line(event)}",), "(too much)", "is too large", allowed)
        yield event


def _syntax(text: str, error: Exception) -> UnreadableError:
    """Return the refusal of text that is not YAML, with line and reason."""
    mark = getattr(error, "problem_mark", None) or getattr(error, "context_mark", None)
    where = (f"line {mark.line + 1}",) if mark else ("(file)",)
    lines = text.splitlines()
    value = display(lines[mark.line].strip()) if mark and mark.line < len(lines) else "(text)"
    reason = getattr(error, "problem", None) or str(error).split("\n")[0] or type(error).__name__
    reason = "".join(c if c.isprintable() else " " for c in reason[:200])
    return UnreadableError(where, value, f"is not YAML: {reason}", "YAML 1.2, one mapping")


def _document(parsed: Iterator) -> Any:
    """Return the only document of a stream of events as plain values; refuse other versions of YAML."""
    next(parsed)  # the stream's start
    start = next(parsed)
    if isinstance(start, events.StreamEndEvent):
        raise UnreadableError((), "", "is an empty file", "a mapping with the keys of a definition")
    if start.version not in (None, (1, 2)):
        directive = "%YAML " + ".".join(map(str, start.version))
        raise UnreadableError((f"line {_line(start)}",), directive, "is another YAML", "YAML 1.2")
    value = _node(next(parsed), parsed, {}, ())
    next(parsed)  # the document's end
    after = next(parsed)
    if not isinstance(after, events.StreamEndEvent):
        raise UnreadableError((f"line {_line(after)}",), "---", "is a second document", "one document")
    return value


def _line(event: events.Event) -> int:
    return event.start_mark.line + 1


def _node(event: events.Event, parsed: Iterator, anchors: dict, where: tuple) -> Any:
    """Return the value that begins with an event; refuse tags, unknown aliases and deep nesting."""
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
    """Return the items of a sequence up to its end."""
    items: list[Any] = []
    while not isinstance(event := next(parsed), events.SequenceEndEvent):
        items.append(_node(event, parsed, anchors, (*where, len(items))))
    return items


def _mapping(parsed: Iterator, anchors: dict, where: tuple) -> Pairs:
    """Return the pairs of a mapping up to its end, repeated keys included."""
    pairs = []
    while not isinstance(event := next(parsed), events.MappingEndEvent):
        key = _node(event, parsed, anchors, (*where, "(key)"))
        name = key if isinstance(key, str) else "(key)"
        pairs.append((key, _node(next(parsed), parsed, anchors, (*where, name))))
    return Pairs(pairs)


# form of a plain scalar → its value
_CORE = {
    r"null|Null|NULL|~|": lambda text, where: None,
    r"true|True|TRUE|false|False|FALSE": lambda text, where: text.lower() == "true",
    r"[-+]?[0-9]+": whole_number,
    r"0o[0-7]+|0x[0-9a-fA-F]+": lambda text, where: int(text, 0),
    r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?": lambda text, where: float(text),
    r"[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)": lambda text, where: float(text.replace(".", "")),
}
_FORMS = [(re.compile(form), value) for form, value in _CORE.items()]


def _core_scalar(text: str, where: tuple) -> Any:
    """Return a plain scalar by the YAML 1.2 core schema: null, bool, int, float, else the text itself."""
    return next((value(text, where) for form, value in _FORMS if form.fullmatch(text)), text)
