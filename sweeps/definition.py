"""A sweep's definition: YAML (or a mapping) in, one strictly validated, frozen `Definition` out.

The models below are the only truth about what a definition may hold: each key's meaning, unit and
allowed values stand in its `Field(description=...)`, and a refusal quotes them. Whatever is wrong with a
definition, `load` raises `DefinitionError`, whose text is the whole message for a person.

Files are read by the YAML 1.2 core schema (https://yaml.org/spec/1.2.2/#103-core-schema). Only the parser
is ruamel.yaml's: its own constructors also read dates and `1_000`, which the core schema does not.
"""

import difflib
import json
import math
import os
import re
import stat
import sys
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from io import StringIO
from itertools import islice
from pathlib import Path
from typing import Annotated, Any, get_args

import numpy as np
from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Discriminator,
    Field,
    PrivateAttr,
    Tag,
    ValidationError,
    model_validator,
)
from pydantic_core import PydanticCustomError
from ruamel.yaml import YAML, events

SYSTEMS = ("rigid_body",)
PROPAGATORS = ("direct",)
SPACINGS = ("linear", "log")
MOMENTS = ("I1", "I2", "I3")
SHAREABLE = ("omega0", "epsilon", "phase")  # what a body may give, and the grid gives where it does not

NAME_PATTERN = r"[A-Za-z0-9][A-Za-z0-9_.-]{0,63}"
DEFAULT_NAME = "sweep"
MAX_FILE_BYTES = 2**20
MAX_DEPTH = 20
MAX_NODES = 200_000
MAX_SHARDS = 10_000
MAX_SAMPLES = 10**9
MIN_MOMENT = sys.float_info.min
MAX_SPIN_RATE, MIN_SPIN_RATE = 1e150, 1e-150
# Up to here a range is spelled out to see that its values differ; beyond, a bound on the step must do.
SPELLED_OUT = 2**16

_TOP = "(top level)"
_TAGS = ("\0number", "\0list", "\0range")  # no key is one of these: keys are printable
_MAX_PROBLEMS_SHOWN = 10
_SHOWN_CHARACTERS = 60


class DefinitionError(ValueError):
    """What is wrong with a definition; `str()` is the whole message, one line a problem."""


# ---------------------------------------------------------------------------------------------------------
# Refusals: every one names a key's path, the value there, what is wrong with it and what is allowed.


@dataclass(frozen=True)
class _Problem:
    where: tuple
    shown: str
    wrong: str
    allowed: str

    def __str__(self):
        return f"{_path(self.where)}: {self.shown} {self.wrong}; allowed: {self.allowed}"


class _UnreadableError(Exception):
    """Carries the one problem that keeps a source from being read at all."""

    def __init__(self, where: tuple, shown: str, wrong: str, allowed: str):
        super().__init__(wrong)
        self.problem = _Problem(where, shown, wrong, allowed)


def _refusal(wrong: str, allowed: str) -> PydanticCustomError:
    return PydanticCustomError("refused", "{wrong}; allowed: {allowed}", {"wrong": wrong, "allowed": allowed})


def _refusals(problems: list[_Problem]) -> PydanticCustomError:
    text = "\n".join(map(str, problems))
    return PydanticCustomError("refused_keys", "{text}", {"text": text, "problems": tuple(problems)})


def _path(where: tuple) -> str:
    text = ""
    for part in where:
        if isinstance(part, int):
            text += f"[{part}]"
        else:
            text += ("." if text else "") + _plain_or_quoted(part)
    return text or _TOP


def _plain_or_quoted(text: str) -> str:
    return text if re.fullmatch(r"[\w ().,/~+-]{1,120}", text) else _shortened(repr(text))


def _shortened(text: str) -> str:
    return text if len(text) <= _SHOWN_CHARACTERS else text[: _SHOWN_CHARACTERS - 1] + "…"


def _shown(value: Any) -> str:
    """The value as YAML flow text, shortened; never fails and never prints a control character."""
    return _shortened(_flow(value))


def _flow(value: Any) -> str:
    if isinstance(value, BaseModel):
        value = {key: item for key, item in value if key in value.model_fields_set}
    if isinstance(value, dict):
        pairs = (f"{_plain_or_quoted(str(key))}: {_flow(item)}" for key, item in _first(value.items()))
        return "{" + ", ".join(pairs) + "}"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(_flow, _first(value))) + "]"
    if value is None or isinstance(value, bool):
        return json.dumps(value)
    if isinstance(value, int) and value.bit_length() > 1024:  # str() refuses beyond 4,300 digits
        return f"a whole number of {value.bit_length()} bits"
    if isinstance(value, int | float):
        return repr(value)
    if isinstance(value, str):
        return repr(value[: 2 * _SHOWN_CHARACTERS])
    return f"<{type(value).__name__}>"


def _first(items: Any) -> Iterator:
    return islice(items, _SHOWN_CHARACTERS)


def _message(label: str, problems: list[_Problem]) -> str:
    label = _plain_or_quoted(label) if len(label) <= 120 else _plain_or_quoted("…" + label[-100:])
    lines = [f"{label}: {problem}" for problem in problems[:_MAX_PROBLEMS_SHOWN]]
    if len(problems) > _MAX_PROBLEMS_SHOWN:
        lines.append(f"{label}: and {len(problems) - _MAX_PROBLEMS_SHOWN:,} more")
    return "\n".join(lines)


# ---------------------------------------------------------------------------------------------------------
# Checked values. A validator that refuses says what is wrong and what is allowed.


def _finite(value: Any, allowed: str) -> float:
    if isinstance(value, str):
        raise _refusal("is text, not a number", allowed)
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise _refusal("is not a number", allowed)
    try:
        number = float(value)
    except OverflowError:
        number = math.inf
    if not math.isfinite(number):
        raise _refusal("is not finite as a double", allowed)
    return number


def _number(holds: Callable[[float], bool], allowed: str) -> BeforeValidator:
    def check(value: Any) -> float:
        number = _finite(value, allowed)
        if not holds(number):
            raise _refusal("is out of range", allowed)
        return number

    return BeforeValidator(check)


def _whole(least: int, most: int, allowed: str) -> BeforeValidator:
    def check(value: Any) -> int:
        if isinstance(value, bool) or not isinstance(value, int):
            raise _refusal("is not a whole number", allowed)
        if not least <= value <= most:
            raise _refusal("is out of range", allowed)
        return value

    return BeforeValidator(check)


def _choice(options: tuple[str, ...]) -> BeforeValidator:
    def check(value: Any) -> str:
        if value in options:
            return value
        raise _refusal("is not available" + _near(value, options), ", ".join(options))

    return BeforeValidator(check)


def _near(key: Any, options: Any) -> str:
    if not isinstance(key, str) or len(key) > 100:
        return ""
    matches = difflib.get_close_matches(key, list(options), n=1)
    return f" (did you mean {matches[0]}?)" if matches else ""


def _line_of_text(most: int) -> AfterValidator:
    allowed = f"one line of printable text, 1 to {most} characters"

    def check(text: str) -> str:
        if not text.strip() or len(text) > most or not text.isprintable():
            raise _refusal("is empty, too long or not printable", allowed)
        return text

    return AfterValidator(check)


def _prose(text: str) -> str:
    text = text.strip()
    if not text or len(text) > 4000 or not all(c.isprintable() or c in "\n\t" for c in text):
        raise _refusal("is empty, too long or not printable", "printable text, 1 to 4000 characters")
    return text


def _shards(value: Any) -> int | str:
    allowed = f"auto, or a whole number from 1 to {MAX_SHARDS:,} (each is a file and a job)"
    if value == "auto":
        return "auto"
    if isinstance(value, bool) or not isinstance(value, int):
        raise _refusal("is neither auto nor a whole number", allowed)
    if not 1 <= value <= MAX_SHARDS:
        raise _refusal("is out of range", allowed)
    return value


def _not_empty(values: tuple) -> tuple:
    if not values:
        raise _refusal("is empty", "a list of at least one value")
    return values


def _different(values: tuple) -> tuple:
    seen = set()
    for value in values:
        if value in seen:
            raise _refusal(f"holds {_shown(value)} twice", "values that all differ")
        seen.add(value)
    return values


def _ascending(axes: tuple[int, ...]) -> tuple[int, ...]:
    return tuple(sorted(axes))


def _monotonic(values: tuple[float, ...]) -> tuple[float, ...]:
    """CF coordinate variables are monotonic: a list that goes up and down is sorted."""
    ascending = tuple(sorted(values))
    return values if values in (ascending, ascending[::-1]) else ascending


def _named_once(bodies: tuple["Body", ...]) -> tuple["Body", ...]:
    names = [body.name for body in bodies]
    problems = [
        _Problem((number, "name"), _shown(name), "is an earlier body's name", "names that all differ")
        for number, name in enumerate(names)
        if name in names[:number]
    ]
    if problems:
        raise _refusals(problems)
    return bodies


Moment = Annotated[
    float,
    _number(
        lambda x: x >= MIN_MOMENT,
        f"a finite number > 0 (and no denormal: at least {MIN_MOMENT!r}), a moment in kg m2 or a ratio",
    ),
]
SpinRate = Annotated[
    float,
    _number(
        lambda x: MIN_SPIN_RATE <= abs(x) <= MAX_SPIN_RATE,
        "a number with 1e-150 ≤ |omega0| ≤ 1e150 in rad s-1; negative spins the other way",
    ),
]
Epsilon = Annotated[float, _number(lambda x: 0 < x < 1, "a number with 0 < epsilon < 1")]
Phase = Annotated[float, _number(lambda x: True, "any finite number, in rad")]
Positive = Annotated[float, _number(lambda x: x > 0, "a finite number > 0")]
Tolerance = Annotated[float, _number(lambda x: 1e-13 <= x <= 1e-3, "a number from 1e-13 to 1e-3")]
Prose = Annotated[str, AfterValidator(_prose)]
Axis = Annotated[int, _whole(1, 3, "1, 2 or 3")]
Count = Annotated[int, _whole(1, 2**53, "a whole number ≥ 1 (and ≤ 2^53)")]
SamplesPerRotation = Annotated[int, _whole(4, MAX_SAMPLES, f"a whole number from 4 to {MAX_SAMPLES:,}")]


# ---------------------------------------------------------------------------------------------------------
# The models


class _Strict(BaseModel):
    model_config = ConfigDict(strict=True, extra="forbid", frozen=True)


def _power_of_ten(exponent: float) -> float:
    if exponent.is_integer():
        return float(f"1e{exponent:.0f}")  # the decade as people write it: 10.0**23 is not 1e23
    try:
        return 10.0**exponent
    except OverflowError:  # the largest double's own logarithm, rounded up
        return math.inf


def _keys(model: type[BaseModel]) -> str:
    return ", ".join(model.model_fields)


class Range(_Strict):
    """Evenly or logarithmically spaced values; both ends are exact.

    Linear values equal `numpy.linspace(start, stop, num)` bit for bit, logarithmic ones
    `numpy.geomspace(start, stop, num)` to its rounding. Each value comes from its own number alone, so a
    part of a range of any length costs no more than itself.
    """

    start: float = Field(description="first value")
    stop: float = Field(description="last value, itself included")
    num: Count = Field(description="number of values: whole, ≥ 1; 1 only where start equals stop")
    spacing: Annotated[str, _choice(SPACINGS)] = Field("linear", description="linear, or log (geometric)")

    def values(self, index: np.ndarray) -> np.ndarray:
        """Values at the numbers `index` (0 ≤ index < num; any shape), float64 of the same shape."""
        index = np.asarray(index)
        if self.num == 1:
            return np.full(index.shape, self.start)
        spaced = self._logarithmic if self.spacing == "log" else self._linear
        return np.where(index == 0, self.start, np.where(index == self.num - 1, self.stop, spaced(index)))

    def _linear(self, index: np.ndarray) -> np.ndarray:
        return index * ((self.stop - self.start) / (self.num - 1)) + self.start

    def _logarithmic(self, index: np.ndarray) -> np.ndarray:
        first, last = np.log10(np.abs([self.start, self.stop]))
        exponents = index * ((last - first) / (self.num - 1)) + first
        # NumPy's pow rounds 1e-17 to 9.999…e-18, and one number otherwise than the same in an array.
        powers = np.array([_power_of_ten(y) for y in exponents.ravel().tolist()]).reshape(index.shape)
        return np.copysign(powers, self.start)

    @model_validator(mode="after")
    def _check(self) -> "Range":
        if self.num == 1:
            if self.start != self.stop:
                raise _refusal("has one value but two ends", "num ≥ 2, or start equal to stop")
            return self
        if self.spacing == "log" and not (self.start * math.copysign(1.0, self.stop) > 0 and self.stop != 0):
            raise _refusal("has log spacing through zero", "log with ends both above or both below 0")
        if math.isinf(self.stop - self.start):
            raise _refusal("is wider than a double can hold", "stop - start within ±1.8e308")
        if not self._values_differ():
            raise _refusal("has values that coincide once rounded", "a smaller num, or ends farther apart")
        return self

    def _values_differ(self) -> bool:
        """Whether the values run strictly from end to end: then what the ends may be, all may."""
        if self.num <= SPELLED_OUT:
            with np.errstate(invalid="ignore"):  # infinite neighbours, which this refuses
                steps = np.diff(self.values(np.arange(self.num)))
            return bool(np.all(steps > 0) or np.all(steps < 0))
        if self.spacing == "log":  # 10**y at |y| ≤ 308 carries up to 1e-13 of relative rounding
            e_folds = math.log(abs(self.stop)) - math.log(abs(self.start))
            return abs(e_folds) / (self.num - 1) > 1e-12
        width = abs(self.stop - self.start)
        # start + i·step carries 1.5 units in the last place of its largest term at most.
        return width / (self.num - 1) > 2 * math.ulp(max(abs(self.start), abs(self.stop), width))


class MomentRange(Range):
    """A range of moments of inertia, kg m2."""

    start: Moment = Field(description="first moment, kg m2: finite, > 0")
    stop: Moment = Field(description="last moment, kg m2, itself included: finite, > 0")


class SpinRateRange(Range):
    """A range of spin rates, rad s-1, none of them zero."""

    start: SpinRate = Field(description="first spin rate, rad s-1: 1e-150 ≤ |omega0| ≤ 1e150")
    stop: SpinRate = Field(description="last spin rate, rad s-1, itself included: 1e-150 ≤ |omega0| ≤ 1e150")

    @model_validator(mode="after")
    def _check_zero(self) -> "SpinRateRange":
        if self.num > 1 and self.start * math.copysign(1.0, self.stop) < 0:
            step = (self.stop - self.start) / (self.num - 1)
            nearest = np.clip(round(-self.start / step) + np.arange(-1, 2), 0, self.num - 1)
            # What should be zero can come out as a few 1e-17 of a step: no spin rate anybody meant.
            if np.min(np.abs(self.values(nearest))) < max(MIN_SPIN_RATE, 1e-9 * abs(step)):
                raise _refusal("holds the spin rate 0", "values with 1e-150 ≤ |omega0|: say, an even num")
        return self


class EpsilonRange(Range):
    """A range of relative sizes of the nudge."""

    start: Epsilon = Field(description="first size, relative: 0 < epsilon < 1")
    stop: Epsilon = Field(description="last size, relative, itself included: 0 < epsilon < 1")


class PhaseRange(Range):
    """A range of directions of the nudge, rad."""

    start: Phase = Field(description="first direction, rad: finite")
    stop: Phase = Field(description="last direction, rad, itself included: finite")


def _kind(value: Any) -> str:
    if isinstance(value, Mapping | Range):
        return _TAGS[2]
    return _TAGS[1] if isinstance(value, tuple | list) else _TAGS[0]


_FORMS = "a number, a list, or {start, stop, num, spacing: linear|log}"


def _listed(item: Any) -> Any:
    return Annotated[
        tuple[item, ...],
        AfterValidator(_not_empty),
        AfterValidator(_different),
        AfterValidator(_monotonic),
        Tag(_TAGS[1]),
    ]


def _entry(item: Any, spaced: type[Range]) -> Any:
    """A grid's entry: a number, a list of numbers, or a range."""
    number = Annotated[item, Tag(_TAGS[0])]
    return Annotated[number | _listed(item) | Annotated[spaced, Tag(_TAGS[2])], Discriminator(_kind)]


class GridEntries(_Strict):
    """What a sweep varies. A list that is not monotonic is sorted ascending, as CF coordinates must be."""

    I1: _entry(Moment, MomentRange) = Field(
        default=None, description=f"moment of inertia about axis 1, kg m2, > 0: {_FORMS}"
    )
    I2: _entry(Moment, MomentRange) = Field(
        default=None, description=f"moment of inertia about axis 2, kg m2, > 0: {_FORMS}"
    )
    I3: _entry(Moment, MomentRange) = Field(
        default=None, description=f"moment of inertia about axis 3, kg m2, > 0: {_FORMS}"
    )
    omega0: _entry(SpinRate, SpinRateRange) = Field(
        default=None,
        description=f"spin rate, rad s-1, 1e-150 ≤ |omega0| ≤ 1e150, negative spins the other way: {_FORMS}",
    )
    epsilon: _entry(Epsilon, EpsilonRange) = Field(
        default=1e-6, description=f"size of the nudge relative to omega0, 0 < epsilon < 1: {_FORMS}"
    )
    phase: _entry(Phase, PhaseRange) = Field(
        default=0.6,
        description=f"direction of the nudge in the (b, c) plane, rad, from b towards c: {_FORMS}",
    )


class Ratios(_Strict):
    """Moments of a body of which only the ratios are known."""

    I1: Moment = Field(description="I1 in any one unit (I3, M R2, …): finite, > 0")
    I2: Moment = Field(description="I2 in the same unit: finite, > 0")
    I3: Moment = Field(description="I3 in the same unit: finite, > 0")


class Observed(_Strict):
    """What people measured of a body's motion: for comparison only, nothing is computed from it."""

    period_days: Positive = Field(description="observed period, days of 86,400 s: > 0")
    what: Annotated[str, _line_of_text(100)] = Field(description="what has that period: one line of text")


class Body(_Strict):
    """One real body: its moments (or their ratios) and whatever else is its own."""

    name: Annotated[str, _line_of_text(100)] = Field(
        description="the body's name, unique in the sweep: one line of text, at most 100 characters"
    )
    I1: Moment = Field(default=None, description="moment of inertia about axis 1, kg m2: finite, > 0")
    I2: Moment = Field(default=None, description="moment of inertia about axis 2, kg m2: finite, > 0")
    I3: Moment = Field(default=None, description="moment of inertia about axis 3, kg m2: finite, > 0")
    ratios: Ratios = Field(default=None, description="{I1, I2, I3} in place of moments, in any one unit")
    omega0: SpinRate = Field(default=None, description="the body's own spin rate, rad s-1: 1e-150 ≤ |omega0| ≤ 1e150")
    epsilon: Epsilon = Field(default=None, description="the body's own size of the nudge, relative: 0 < epsilon < 1")
    phase: Phase = Field(default=None, description="the body's own direction of the nudge, rad: finite")
    axis: Axis = Field(default=None, description="the axis it spins about in nature: 1, 2 or 3")
    source: Prose = Field(default=None, description="where the numbers come from: text")
    note: Prose = Field(default=None, description="what a reader should know: text")
    observed: Observed = Field(default=None, description="what people measured: {period_days, what}")

    @property
    def moments(self) -> tuple[float, float, float]:
        """(I1, I2, I3): kg m2, or in the unit of `ratios` where only those are known."""
        given = self if self.ratios is None else self.ratios
        return given.I1, given.I2, given.I3

    @model_validator(mode="after")
    def _check_moments(self) -> "Body":
        either = "I1, I2 and I3 in kg m2, or ratios: {I1, I2, I3}, not both"
        given = [name for name in MOMENTS if getattr(self, name) is not None]
        if self.ratios is not None:
            wrong = [(name, _shown(getattr(self, name)), "is given beside ratios") for name in given]
        else:
            wrong = [(name, "(nothing)", "is missing") for name in MOMENTS if name not in given]
        if wrong:
            raise _refusals([_Problem((name,), shown, what, either) for name, shown, what in wrong])
        return self


class Integration(_Strict):
    """How each run is made: its length, its samples, its accuracy."""

    propagator: Annotated[str, _choice(PROPAGATORS)] = Field(
        "direct", description="how the motion is computed: " + " or ".join(PROPAGATORS)
    )
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
            raise _refusals([_Problem(("rotations",), _shown(self.rotations), wrong, allowed)])
        return self


class Definition(_Strict):
    """A sweep: what is varied, over which bodies, how each run is made, into how many files it is cut.

    `name` and `text` are no keys of the file: the file's stem, and the YAML as run.
    """

    title: Annotated[str, _line_of_text(200)] = Field(
        description="what people read above maps and figures: one line of text; left out, the sweep's name"
    )
    system: Annotated[str, _choice(SYSTEMS)] = Field(
        "rigid_body", description="the equations of motion: " + " or ".join(SYSTEMS)
    )
    axes: Annotated[
        tuple[Axis, ...], AfterValidator(_not_empty), AfterValidator(_different), AfterValidator(_ascending)
    ] = Field((1, 2, 3), description="spin axes to survey: a list of 1, 2, 3, each once")
    grid: GridEntries = Field(GridEntries(), description="what is varied: a mapping with " + _keys(GridEntries))
    bodies: Annotated[tuple[Body, ...], AfterValidator(_not_empty), AfterValidator(_named_once)] = Field(
        default=(), description="a list of bodies, names unique, in place of I1, I2 and I3 in grid"
    )
    integration: Integration = Field(
        Integration(),
        description="how each run is made: a mapping with " + _keys(Integration),
    )
    shards: Annotated[int | str, BeforeValidator(_shards)] = Field(
        "auto",
        description=f"files the work is cut into: auto, or 1 to {MAX_SHARDS:,}; changes no result",
    )
    _name: str = PrivateAttr(DEFAULT_NAME)
    _text: str = PrivateAttr("")

    @property
    def name(self) -> str:
        """The sweep's name: its file's stem."""
        return self._name

    @property
    def text(self) -> str:
        """The YAML as run: the file's own text, or the mapping written as YAML."""
        return self._text

    def is_per_body(self, parameter: str) -> bool:
        """Whether `parameter` (I1 … phase) is a coordinate on `body` rather than a dimension."""
        if parameter in MOMENTS:
            return bool(self.bodies)
        return any(getattr(body, parameter) is not None for body in self.bodies)

    @model_validator(mode="after")
    def _check_grid(self) -> "Definition":
        problems = [p for name in MOMENTS for p in self._moment_problems(name)]
        problems += [p for name in SHAREABLE for p in self._shared_problems(name)]
        if problems:
            raise _refusals(problems)
        return self

    def _moment_problems(self, name: str) -> Iterator[_Problem]:
        entry = getattr(self.grid, name)
        if self.bodies and entry is not None:
            allowed = "moments in bodies or in grid, not both"
            yield _grid_problem(name, _shown(entry), "is given beside bodies", allowed)
        if not self.bodies and entry is None:
            yield _grid_problem(name, "(nothing)", "is missing", _description(GridEntries, name))

    def _shared_problems(self, name: str) -> Iterator[_Problem]:
        entry = getattr(self.grid, name)
        giving = [body for body in self.bodies if getattr(body, name) is not None]
        if giving and len(giving) == len(self.bodies):
            if name in self.grid.model_fields_set:
                wrong = "is given although every body gives its own"
                yield _grid_problem(name, _shown(entry), wrong, f"{name} in grid or in every body, not both")
        elif entry is None:
            yield _grid_problem(name, "(nothing)", "is missing", _description(GridEntries, name))
        elif giving and not isinstance(entry, float):
            wrong = f"makes a dimension, but {len(giving)} of {len(self.bodies)} bodies give their own {name}"
            allowed = f"a single number here, or {name} in no body, or in every body and not here"
            yield _grid_problem(name, _shown(entry), wrong, allowed)


def _grid_problem(name: str, shown: str, wrong: str, allowed: str) -> _Problem:
    return _Problem(("grid", name), shown, wrong, allowed)


# ---------------------------------------------------------------------------------------------------------
# pydantic's own findings, in words


_WORDS = {
    "string_type": "is not text (quote it)",
    "tuple_type": "is not a list",
    "model_type": "is not a mapping",
}


def _validation_problems(error: ValidationError) -> list[_Problem]:
    problems = []
    for item in error.errors(include_url=False):
        where = tuple(part for part in item["loc"] if part not in _TAGS)
        context = item.get("ctx", {})
        if "problems" in context:
            problems += [_Problem(where + p.where, p.shown, p.wrong, p.allowed) for p in context["problems"]]
        elif "wrong" in context:
            problems.append(_Problem(where, _shown(item["input"]), context["wrong"], context["allowed"]))
        else:
            problems.append(_built_in_problem(item, where))
    return problems


def _built_in_problem(item: dict, where: tuple) -> _Problem:
    model, key = _model_and_key(where)
    if item["type"] == "extra_forbidden":
        wrong = "is under an unknown key" + _near(where[-1], model.model_fields)
        return _Problem(where, _shown(item["input"]), wrong, "the keys " + _keys(model))
    allowed = _description(model, key)
    if item["type"] == "missing":
        return _Problem(where, "(nothing)", "is missing", allowed)
    wrong = _WORDS.get(item["type"], f"is refused ({item['msg']})")
    return _Problem(where, _shown(item["input"]), wrong, allowed)


def _model_and_key(where: tuple) -> tuple[type[BaseModel], str]:
    """The innermost model on the path, and the key in it."""
    model, key = Definition, ""
    for part in where:
        if isinstance(part, int):
            continue
        if key:
            model = next(_models(model.model_fields[key].annotation), model)
        key = part
    return model, key


def _models(annotation: Any) -> Iterator[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    for part in get_args(annotation):
        yield from _models(part)


def _description(model: type[BaseModel], key: str) -> str:
    field = model.model_fields.get(key)
    return field.description if field else "a mapping with the keys " + _keys(model)


# ---------------------------------------------------------------------------------------------------------
# Plain values: dict, tuple, str, int, float, bool and None, of bounded depth and number


def _plain(value: Any, where: tuple = (), left: list[int] | None = None) -> Any:
    """The value with NumPy's numbers and arrays, ranges and lists made plain; bounded, so cycles end."""
    left = [MAX_NODES] if left is None else left
    left[0] -= 1
    if left[0] < 0 or (isinstance(value, np.ndarray) and value.size > left[0]):
        allowed = f"{MAX_NODES:,} values in all, aliases expanded"
        raise _UnreadableError(where, "(too much)", "is too large", allowed)
    if len(where) > MAX_DEPTH:
        raise _UnreadableError(where[:1], "(deep)", "is nested too deeply", f"at most {MAX_DEPTH} levels")
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, Mapping):
        value = _Pairs(value.items())
    if isinstance(value, _Pairs):
        return _plain_mapping(value, where, left)
    if isinstance(value, list | tuple | range):
        return tuple(_plain(item, (*where, number), left) for number, item in enumerate(value))
    return _text(value, where) if isinstance(value, str) else value


class _Pairs(tuple):
    """A mapping as it was written: (key, value) pairs, any key, perhaps twice."""


def _plain_mapping(pairs: _Pairs, where: tuple, left: list[int]) -> dict:
    mapping = {}
    for key, item in pairs:
        if not isinstance(key, str) or not key.isprintable():
            raise _UnreadableError(where, _shown(key), "is a key that is no word", "keys that are words")
        if key in mapping:
            raise _UnreadableError((*where, key), _shown(item), "is under a key given twice", "each key once")
        mapping[key] = _plain(item, (*where, key), left)
    return mapping


def _text(text: str, where: tuple) -> str:
    """The text with surrogate pairs joined: JSON escapes write characters beyond U+FFFF as two."""
    try:
        return text.encode("utf-16", "surrogatepass").decode("utf-16")
    except UnicodeDecodeError:
        raise _UnreadableError(where, _shown(text), "holds half a surrogate pair", "Unicode text") from None


def _as_yaml(plain: dict) -> str:
    yaml = YAML(typ="safe", pure=True)
    yaml.default_flow_style = None
    yaml.allow_unicode = True
    yaml.representer.sort_base_mapping_type_on_output = False
    stream = StringIO()
    yaml.dump(plain, stream)
    return stream.getvalue()


# ---------------------------------------------------------------------------------------------------------
# Reading a file


def _file_text(path: Path) -> str:
    allowed = f"a readable YAML file of at most {MAX_FILE_BYTES:,} bytes, in UTF-8"
    where = ("(file)",)
    try:
        if path.exists() and not stat.S_ISREG(path.stat().st_mode):
            raise _UnreadableError(where, _shown(str(path)), "is not a regular file", allowed)
        with path.open("rb") as file:
            content = file.read(MAX_FILE_BYTES + 1)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise _UnreadableError(where, _shown(str(path)), f"cannot be opened ({reason})", allowed) from None
    if len(content) > MAX_FILE_BYTES:
        raise _UnreadableError(where, _shown(str(path)), "is too large", allowed)
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise _UnreadableError(where, f"byte {error.start}", "is not UTF-8 text", allowed) from None


def _read(text: str) -> Any:
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
        raise _UnreadableError((), "(deep)", "is nested too deeply", f"at most {MAX_DEPTH} levels") from None


def _read_yaml(text: str) -> Any:
    parsed = YAML(typ="safe", pure=True, plug_ins=[]).parse(text)
    try:
        return _document(parsed)
    except _UnreadableError:
        raise
    except Exception as error:  # beside its own errors the scanner lets OverflowError and others through
        raise _syntax(text, error) from None


def _syntax(text: str, error: Exception) -> _UnreadableError:
    mark = getattr(error, "problem_mark", None) or getattr(error, "context_mark", None)
    where = (f"line {mark.line + 1}",) if mark else ("(file)",)
    lines = text.splitlines()
    shown = _shown(lines[mark.line].strip()) if mark and mark.line < len(lines) else "(text)"
    reason = getattr(error, "problem", None) or str(error).split("\n")[0] or type(error).__name__
    reason = "".join(c if c.isprintable() else " " for c in reason[:200])
    return _UnreadableError(where, shown, f"is not YAML: {reason}", "YAML 1.2, one mapping")


def _document(parsed: Iterator) -> Any:
    next(parsed)  # the stream's start
    start = next(parsed)
    if isinstance(start, events.StreamEndEvent):
        raise _UnreadableError((), "(nothing)", "is an empty file", "a mapping with the keys of a definition")
    if start.version not in (None, (1, 2)):
        shown = "%YAML " + ".".join(map(str, start.version))
        raise _UnreadableError((f"line {_line(start)}",), shown, "is another YAML", "YAML 1.2")
    value = _node(next(parsed), parsed, {}, ())
    next(parsed)  # the document's end
    after = next(parsed)
    if not isinstance(after, events.StreamEndEvent):
        raise _UnreadableError((f"line {_line(after)}",), "---", "is a second document", "one document")
    return value


def _line(event: events.Event) -> int:
    return event.start_mark.line + 1


def _node(event: events.Event, parsed: Iterator, anchors: dict, where: tuple) -> Any:
    here = (f"line {_line(event)}",)
    if isinstance(event, events.AliasEvent):
        if event.anchor not in anchors:
            alias = _shown("*" + event.anchor)
            raise _UnreadableError(here, alias, "has no whole value before it", "aliases of earlier values")
        return anchors[event.anchor]
    if event.tag is not None:
        raise _UnreadableError(here, _shown(str(event.tag)), "is a tag", "values without tags (!…)")
    if len(where) > MAX_DEPTH:
        raise _UnreadableError(here, _path(where[:1]), "is nested too deeply", f"at most {MAX_DEPTH} levels")
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
        raise _UnreadableError(where, _shortened(text), wrong, "numbers up to 1.8e308")
    return int(text)


# ---------------------------------------------------------------------------------------------------------


def load(source: str | Path | Mapping, name: str | None = None) -> Definition:
    """The validated definition of a sweep.

    Args:
        source: path of a YAML (or JSON) file, or a mapping with the same keys; in a mapping NumPy's
            numbers and one-dimensional arrays do as well.
        name: the sweep's name; left out, the file's stem, and "sweep" for a mapping.

    Returns:
        The frozen `Definition`: moments in kg m2, spin rates in rad s-1, phases in rad.

    Raises:
        DefinitionError: for whatever is wrong, one line a problem: file, key's path, value, what is allowed.
    """
    label = os.fspath(source) if isinstance(source, str | Path) else "definition"
    try:
        name = _sweep_name(source) if name is None else _checked_name(name)
        text, plain = _source_text_and_value(source)
        return _validated(plain, name, text)
    except _UnreadableError as unreadable:
        problems = [unreadable.problem]
    except ValidationError as error:
        problems = _validation_problems(error)
    raise DefinitionError(_message(label, problems))


def _sweep_name(source: Any) -> str:
    if isinstance(source, Mapping):
        return DEFAULT_NAME
    if not isinstance(source, str | Path):
        raise _UnreadableError((), _shown(source), "is no source", "a path or a mapping")
    return _checked_name(Path(source).stem)


def _checked_name(name: str) -> str:
    if not (isinstance(name, str) and re.fullmatch(NAME_PATTERN, name)):
        allowed = "1 to 64 letters A-Z a-z, digits, _ . -, the first a letter or a digit"
        raise _UnreadableError(("(name)",), _shown(name), "is no name for a sweep (a file's stem)", allowed)
    return name


def _source_text_and_value(source: Any) -> tuple[str | None, dict]:
    text = None if isinstance(source, Mapping) else _file_text(Path(source))
    plain = _plain(source if text is None else _read(text))
    if not isinstance(plain, dict):
        raise _UnreadableError((), _shown(plain), "is not a mapping", _description(Definition, ""))
    return text, plain


def _validated(plain: dict, name: str, text: str | None) -> Definition:
    # Another system has other keys in its grid: to list them as unknown would mislead.
    system = plain.get("system", SYSTEMS[0])
    if system not in SYSTEMS:
        wrong = "is not available" + _near(system, SYSTEMS)
        raise _UnreadableError(("system",), _shown(system), wrong, ", ".join(SYSTEMS))
    definition = Definition.model_validate({"title": name, **plain})
    definition._name = name
    definition._text = _as_yaml(plain) if text is None else text
    return definition
