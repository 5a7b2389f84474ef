"""Models of a definition's mappings: the base of all, ranges of values, and grids of parameters."""

import math
from collections.abc import Iterable, Mapping
from typing import Annotated, Any, ClassVar

import numpy as np
from pydantic import BaseModel, ConfigDict, Discriminator, Field, Tag, create_model, model_validator

from sweeps.schema.refusals import TAGS, keys_of, refusal
from sweeps.schema.values import Count, choice, in_unit, list_of_different
from sweeps.schema.variables import Parameter, Quantity


class Strict(BaseModel):
    """A frozen model that converts nothing and refuses unknown keys; it is built when it is first used.

    A default that is a model is made by `model_construct`, which builds none: see `mapping`.
    """

    model_config = ConfigDict(strict=True, extra="forbid", frozen=True, defer_build=True)


def key(description: str, default: Any = None) -> Any:
    """Return the field of a key, with its description for refusals; `...` in place of a default makes it required."""
    return Field(default, description=description)


def switch(words: str) -> Any:
    """Return the field of a key that is true or false; left out, it is false."""
    return key(f"true or false: whether {words}", False)


def mapping(words: str, model: type[Strict], required: bool = False) -> Any:
    """Return the field of a mapping, a `model`, described by `words` and its keys; optional if not `required`."""
    default = ... if required else model.model_construct()
    return key(f"{words}: a mapping with {keys_of(model)}", default)


# -- ranges

# Number of values up to which all values of a range are compared; for longer ranges a bound on the step is checked.
SPELLED_OUT = 2**16


def _power_of_ten(exponent: float) -> float:
    """Return 10 to an exponent: the nearest double for a whole exponent, infinity beyond the largest."""
    if exponent.is_integer():
        return float(f"1e{exponent:.0f}")  # the decade as people write it: 10.0**23 is not 1e23
    try:
        return 10.0**exponent
    except OverflowError:  # the largest double's own logarithm, rounded up
        return math.inf


class Range(Strict):
    """Evenly or logarithmically spaced values; both ends are exact.

    Linear values equal `numpy.linspace(start, stop, num)` bit for bit, logarithmic ranges
    `numpy.geomspace(start, stop, num)` to its rounding. Each value comes from its own number alone, so a
    part of a range of any length costs no more than itself.
    """

    start: float = key("first value", ...)
    stop: float = key("last value, itself included", ...)
    num: Count = key("number of values: whole, ≥ 1; 1 only where start equals stop", ...)
    spacing: Annotated[str, choice(("linear", "log"))] = key("linear, or log (geometric)", "linear")

    def values(self, index: np.ndarray) -> np.ndarray:
        """Return the values at the numbers `index` (0 ≤ index < num; any shape), float64 of the same shape."""
        index = np.asarray(index)
        if self.num == 1:
            return np.full(index.shape, self.start)
        spacing_values = self._logarithmic if self.spacing == "log" else self._linear
        return np.where(index == 0, self.start, np.where(index == self.num - 1, self.stop, spacing_values(index)))

    def at_shares(self, share: np.ndarray) -> np.ndarray:
        """Return the values at fractions 0 ≤ share < 1 between the ends, of the logarithm where spacing is log."""
        if self.spacing == "log":
            e_folds = math.log(abs(self.stop)) - math.log(abs(self.start))
            # math.exp, not NumPy's exp, which may round a number alone differently from the same in an array
            values = self.start * np.array([math.exp(x) for x in (share * e_folds).tolist()])
        else:
            values = self.start + share * (self.stop - self.start)
        return np.clip(values, min(self.start, self.stop), max(self.start, self.stop))

    def _linear(self, index: np.ndarray) -> np.ndarray:
        return index * ((self.stop - self.start) / (self.num - 1)) + self.start

    def _logarithmic(self, index: np.ndarray) -> np.ndarray:
        """Return the logarithmically spaced values at indices, each rounded by itself."""
        first, last = np.log10(np.abs([self.start, self.stop]))
        exponents = index * ((last - first) / (self.num - 1)) + first
        # NumPy's pow rounds 1e-17 to 9.999…e-18, and one number otherwise than the same in an array.
        powers = np.array([_power_of_ten(y) for y in exponents.ravel().tolist()]).reshape(index.shape)
        return np.copysign(powers, self.start)

    @model_validator(mode="after")
    def _check(self) -> "Range":
        """Refuse a range with coinciding values, logarithms through zero, or ends too far apart."""
        if self.num == 1:
            if self.start != self.stop:
                raise refusal("has one value but two ends", "num ≥ 2, or start equal to stop")
            return self
        if self.spacing == "log" and not (self.start * math.copysign(1.0, self.stop) > 0 and self.stop != 0):
            raise refusal("has log spacing through zero", "log with ends both above or both below 0")
        if math.isinf(self.stop - self.start):
            raise refusal("is wider than a double can hold", "stop - start within ±1.8e308")
        if not self._values_differ():
            raise refusal("has values that coincide once rounded", "a smaller num, or ends farther apart")
        return self

    def _comes_near_zero(self, min_magnitude: float) -> bool:
        """Return True if a value strictly between ends of both signs is 0 up to rounding or below `min_magnitude`."""
        if self.num <= 2 or self.start * math.copysign(1.0, self.stop) > 0:
            return False
        step = (self.stop - self.start) / (self.num - 1)
        nearest = np.clip(round(-self.start / step) + np.arange(-1, 2), 1, self.num - 2)
        # What should be zero can come out as a few 1e-17 of a step: no value anybody meant.
        return bool(np.min(np.abs(self.values(nearest))) < max(min_magnitude, 1e-9 * abs(step)))

    def _values_differ(self) -> bool:
        """Return whether the values run strictly from end to end: then all are allowed where the ends are."""
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


def _sort_mixed_list(values: tuple[float, ...]) -> tuple[float, ...]:
    """Sort a list that goes up and down: CF coordinate variables are monotonic."""
    sorted_values = tuple(sorted(values))
    return values if values in (sorted_values, sorted_values[::-1]) else sorted_values


def _entry_tag(value: Any) -> str:
    if isinstance(value, Mapping | Range):
        return TAGS[2]
    return TAGS[1] if isinstance(value, tuple | list) else TAGS[0]


FORMS = "a number, a list, or {start, stop, num, spacing: linear|log}"


def entry_type(item: Any, ranges: type[Range]) -> Any:
    """Return the type of an entry of a grid: a number, a list of numbers, or a range."""
    number, numbers = Annotated[item, Tag(TAGS[0])], Annotated[list_of_different(item, _sort_mixed_list), Tag(TAGS[1])]
    return Annotated[number | numbers | Annotated[ranges, Tag(TAGS[2])], Discriminator(_entry_tag)]


# -- a table of parameters


class GridOf(Strict):
    """A grid with the keys of a table of parameters."""

    parameters: ClassVar[tuple[Parameter, ...]] = ()
    derived: ClassVar[Any] = None  # another way to give some of them, `sweeps.systems.bodies.shapes.RATIOS`, or None


def grid_model(name: str, parameters: Iterable[Parameter], module: str, derived: Any = None) -> type[GridOf]:
    """Return the model of a definition's `grid`: each key a number, a list, or a range.

    It will be found in `module` under its name (for pickle). `derived` is another way to give some of the parameters,
    as `sweeps.systems.bodies.shapes.RATIOS`.
    """
    ranges, fields, parameters = {}, {}, tuple(parameters)
    for parameter in parameters:
        quantity = parameter.quantity
        if quantity.noun not in ranges:
            ranges[quantity.noun] = range_model(quantity)
        default = ... if parameter.required else parameter.default
        of_entry = entry_type(in_unit(quantity.units, quantity.item), ranges[quantity.noun])
        fields[parameter.name] = of_entry, key(_describe_parameter(parameter), default)
    doc = "What a sweep varies. A list that is not monotonic is sorted ascending, as CF coordinates must be."
    namespace = {"parameters": parameters, "derived": derived, "__module__": module}
    if derived:
        fields[derived.key] = derived.model, key(derived.description)
        mandatory = [name for name, (_, field) in fields.items() if field.is_required() and name not in derived.names]
        namespace["model_config"] = {"json_schema_extra": {"required": mandatory}}
    base = type(name, (GridOf,), namespace)
    return create_model(name, __base__=base, __module__=module, __doc__=doc, **fields)


def _describe_parameter(parameter: Parameter) -> str:
    quantity = parameter.quantity
    units = "" if quantity.units == "1" else f", {quantity.units}"
    return (parameter.description or f"{parameter.long_name}{units}, {quantity.bounds}") + f": {FORMS}"


def range_model(quantity: Quantity) -> type[Range]:
    """Return a model of ranges of values of a quantity."""
    units = "dimensionless" if quantity.units == "1" else quantity.units
    ends = {"start": f"first {quantity.noun}, {units}", "stop": f"last {quantity.noun}, {units}, itself included"}
    item = in_unit(quantity.units, quantity.item)
    fields = {end: (item, key(f"{text}: {quantity.bounds}", ...)) for end, text in ends.items()}
    base = Range if quantity.least is None else _nonzero_model(quantity)
    return create_model("".join(map(str.capitalize, quantity.noun.split())) + "Range", __base__=base, **fields)


def _nonzero_model(quantity: Quantity) -> type[Range]:
    """Return the model of ranges of a quantity that may not be 0."""

    class Nonzero(Range):
        def at_shares(self, share: np.ndarray) -> np.ndarray:
            """Return the range's values at fractions of its length, moved away from 0."""
            values = super().at_shares(share)
            # a share of 2^30 may be 0: it is moved by a quarter of the distance between shares
            return np.where(np.abs(values) < quantity.least, 2.0**-32 * (self.stop - self.start), values)

        @model_validator(mode="after")
        def _check_zero(self) -> "Nonzero":
            """Refuse a range with a value too near 0."""
            if self._comes_near_zero(quantity.least):
                raise refusal(f"holds the {quantity.noun} 0", f"values with {quantity.bounds}: say, an even num")
            return self

    return Nonzero


def spread(entry: Any) -> Range | np.ndarray:
    """Return an entry of a grid as values along a dimension: the range itself, or an array of float64."""
    return entry if isinstance(entry, Range) else np.atleast_1d(np.array(entry, np.float64))
