"""Messages about invalid input: each refusal names a key's path, the value there and the allowed values.

pydantic is loaded with the models, not with this module: every command has refusals.
"""

import json
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import islice
from typing import TYPE_CHECKING, Any, TypeVar, get_args

if TYPE_CHECKING:
    from pydantic import BaseModel, ValidationError
    from pydantic_core import PydanticCustomError

ModelOf = TypeVar("ModelOf", bound="BaseModel")
TAGS = ("\0number", "\0list", "\0range")  # forms of a grid's entry; no key equals any of these: keys are printable

_MAX_PROBLEMS_SHOWN = 10
_SHOWN_CHARACTERS = 60
_MAX_LISTED_NAMES = 100  # number of names in a message, so that it stays readable
MIN_WORD = 4  # letters of the shortest word of a name that a hint compares with the input


class RefusedError(ValueError):
    """Invalid input; `str()` is the whole message."""


class DefinitionError(RefusedError):
    """Invalid input: a definition, a body, or an argument. `str()` is the whole message, one line for each problem.

    Example:
        >>> try:
        ...     sweeps.survey(I1=1.0, I2="2 furlong", I3=2.5)
        ... except sweeps.DefinitionError as error:
        ...     print(str(error).partition(";")[0])
        definition: grid.I2: '2 furlong' has the unit 'furlong'
    """


class DescriptionError(DefinitionError):
    """A system's description is refused; `str()` is the whole message."""


class MapError(RefusedError):
    """A file that is not a map, or a place that a map does not have. `str()` is the whole message.

    Example:
        >>> try:
        ...     sweeps.open_map("nowhere.nc")
        ... except sweeps.MapError as error:
        ...     print(str(error).partition(";")[0])
        nowhere.nc: there is no such file
    """


@dataclass(frozen=True)
class Problem:
    """One invalid value."""

    where: tuple  #: path of the key
    shown: str  #: the value as text; "" where none is given
    wrong: str  #: what is wrong with it
    allowed: str  #: what is allowed

    def __str__(self):
        return f"{key_path(self.where)}: {f'{self.shown} ' if self.shown else ''}{self.wrong}; allowed: {self.allowed}"


class UnreadableError(Exception):
    """Carries the problem that makes a source unreadable."""

    def __init__(self, where: tuple, value_text: str, reason: str, allowed: str):
        super().__init__(reason)
        self.problem = Problem(where, value_text, reason, allowed)


def refusal(reason: str, allowed: str) -> "PydanticCustomError":
    """Return the error that a validator raises about its value."""
    from pydantic_core import PydanticCustomError

    return PydanticCustomError("refused", "{wrong}; allowed: {allowed}", {"wrong": reason, "allowed": allowed})


def refusals(problems: list[Problem]) -> "PydanticCustomError":
    """Return the error that a validator raises about several keys below its value."""
    from pydantic_core import PydanticCustomError

    text = "\n".join(map(str, problems))
    return PydanticCustomError("refused_keys", "{text}", {"text": text, "problems": tuple(problems)})


def key_path(where: tuple) -> str:
    """Return the path of a key as in grid.I1[2] or bodies[17] (Moon).tensor."""
    return "".join(map(_step_text, where)).removeprefix(".") or "(top level)"


def _step_text(step: int | str | tuple[int, str]) -> str:
    """Return a step of a path: a number in a list, that number with the entry's name, or a key."""
    if isinstance(step, int):
        return f"[{step}]"
    return f"[{step[0]}] ({_plain_or_quoted(step[1])})" if isinstance(step, tuple) else f".{_plain_or_quoted(step)}"


def _plain_or_quoted(text: str) -> str:
    return text if re.fullmatch(r"[\w ().,/~+-]{1,120}", text) else cut_text(repr(text))


def cut_text(text: str, max_length: int = _SHOWN_CHARACTERS) -> str:
    """Return text of at most so many characters; by default as many as a message shows."""
    return text if len(text) <= max_length else text[: max_length - 1] + "…"


def display(value: Any) -> str:
    """Return the value as YAML flow text, shortened, without control characters; never raise."""
    return cut_text(_flow_text(value))


def _flow_text(value: Any) -> str:
    """Return a value as one line of YAML, cut after some entries."""
    if hasattr(value, "model_fields_set"):
        value = {key: item for key, item in value if key in value.model_fields_set}
    if isinstance(value, dict):
        first = islice(value.items(), _SHOWN_CHARACTERS)
        return "{" + ", ".join(f"{_plain_or_quoted(str(key))}: {_flow_text(item)}" for key, item in first) + "}"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(_flow_text, islice(value, _SHOWN_CHARACTERS))) + "]"
    if value is None or isinstance(value, bool):
        return json.dumps(value)
    if isinstance(value, int) and value.bit_length() > 1024:  # str() refuses beyond 4,300 digits
        return f"a whole number of {value.bit_length()} bits"
    if isinstance(value, int | float):
        return repr(value)
    if isinstance(value, str):
        return repr(value[: 2 * _SHOWN_CHARACTERS])
    return f"<{type(value).__name__}>"


def message(label: str, problems: list[Problem]) -> str:
    """Return the whole message, one line per problem, each with the file's label."""
    label = _plain_or_quoted(label) if len(label) <= 120 else _plain_or_quoted("…" + label[-100:])
    lines = [f"{label}: {problem}" for problem in problems[:_MAX_PROBLEMS_SHOWN]]
    if len(problems) > _MAX_PROBLEMS_SHOWN:
        lines.append(f"{label}: and {len(problems) - _MAX_PROBLEMS_SHOWN:,} more")
    return "\n".join(lines)


def hint(key: Any, options: Any) -> str:
    """Return " (did you mean …?)" for the nearest option, "" if none is near."""
    if not isinstance(key, str) or len(key) > 100:
        return ""
    import difflib

    options = list(islice(options, 1000))
    words = {
        word.lower(): option for option in options for word in re.split(r"[\s_-]+", option) if len(word) >= MIN_WORD
    }
    words |= {option.lower(): option for option in options}
    near = difflib.get_close_matches(key.strip().lower(), words, n=1)  # the name, or one word of it
    return f" (did you mean {words[near[0]]}?)" if near else ""


def list_names(names: list[str]) -> str:
    """Return names separated by commas; of more than 100, the first hundred and their number."""
    more = f", … ({len(names):,} names)" if len(names) > _MAX_LISTED_NAMES else ""
    return ", ".join(names[:_MAX_LISTED_NAMES]) + more


def match_name(text: str, names: list[str], where: str, error: type[RefusedError]) -> str:
    """Return the name that matches a text: the name itself, in any case, or a unique part of it; else raise.

    Args:
        text: the text.
        names: the allowed names.
        where: the option or key, for the message.
        error: the class of the error.
    """
    low = text.strip().lower()
    matches = [name for name in names if name.lower() == low] or [name for name in names if low and low in name.lower()]
    if len(matches) == 1:
        return matches[0]
    if matches:
        raise error(f"{where}: {cut_text(repr(text))} may be several; allowed: {list_names(matches)}")
    problem = f"{cut_text(repr(text))} is not among the names{hint(text, names)}"
    raise error(f"{where}: {problem}; allowed: {list_names(names)}")


def keys_of(model: "type[BaseModel]") -> str:
    """Return the keys of a model, separated by commas."""
    return ", ".join(model.model_fields)


# -- pydantic's own findings, in words


_WORDS = {"string_type": "is not text (quote it)", "tuple_type": "is not a list", "model_type": "is not a mapping"}
_WORDS["dict_type"] = _WORDS["model_type"]


def validation_problems(error: "ValidationError", root: "type[BaseModel]") -> list[Problem]:
    """Return pydantic's findings about a value for the model `root` as problems."""
    problems = []
    for item in error.errors(include_url=False):
        where = tuple(step for step in item["loc"] if step not in TAGS)
        context = item.get("ctx", {})
        if "problems" in context:
            problems += [Problem(where + p.where, p.shown, p.wrong, p.allowed) for p in context["problems"]]
        elif "wrong" in context:
            problems.append(Problem(where, display(item["input"]), context["wrong"], context["allowed"]))
        else:
            problems.append(_built_in_problem(item, where, root, len(problems) < _MAX_PROBLEMS_SHOWN))
    return problems


def validate(model: "type[ModelOf]", values: Any, label: str, **context: Any) -> "ModelOf":
    """Return a model of some values; refuse invalid ones, in messages that begin with a label.

    Paths have the names of entries in lists of several: bodies[17] (Moon).tensor.
    """
    from pydantic import ValidationError

    try:
        return model.model_validate(values, context=context)
    except ValidationError as error:
        problems = validation_problems(error, model)
        problems = [replace(problem, where=_named_path(problem.where, values)) for problem in problems]
        raise DefinitionError(message(label, problems)) from None


def _named_path(where: tuple, values: Mapping) -> tuple:
    """Return a path with the name of the entry on it, if the entry is one of several and has a name."""
    key, number, *steps = where if len(where) > 2 else ("", None)
    entries = values.get(key)
    if steps == ["name"] or not (isinstance(number, int) and isinstance(entries, list | tuple) and len(entries) > 1):
        return where
    name = entries[number].get("name") if isinstance(entries[number], Mapping) else None
    return (key, (number, name), *steps) if isinstance(name, str) else where


def _built_in_problem(item: Mapping[str, Any], where: tuple, root: "type[BaseModel]", with_hint: bool) -> Problem:
    """Return the problem of one of pydantic's own errors, with the allowed values of its key."""
    model, key = root, ""  # the innermost model on the path, and the key in it
    for step in (step for step in where if not isinstance(step, int)):
        inner = next(models_in(model.model_fields[key].annotation), None) if key else model
        if inner is None:  # a mapping of any keys
            break
        model, key = inner, step
    if item["type"] == "extra_forbidden":
        reason = "is an unknown key" + (hint(where[-1], model.model_fields) if with_hint else "")
        return Problem(where, "", reason, "the keys " + keys_of(model))
    allowed = description_of(model, key)
    if item["type"] == "missing":
        return Problem(where, "", "is missing", allowed)
    reason = _WORDS.get(item["type"], f"is refused ({item['msg']})")
    return Problem(where, display(item["input"]), reason, allowed)


def models_in(annotation: Any) -> "Iterator[type[BaseModel]]":
    """Yield the models that a field's annotation names."""
    from pydantic import BaseModel

    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    for argument in get_args(annotation):
        yield from models_in(argument)


def description_of(model: "type[BaseModel]", key: str) -> str:
    """Return the description of a key in a model."""
    field = model.model_fields.get(key)
    return field.description or "" if field else "a mapping with the keys " + keys_of(model)
