"""Bodies by name in place of moments in a grid, for systems whose points are a body and what it is set to do."""

from collections.abc import Iterable
from typing import Annotated, Any

import numpy as np
from pydantic import AfterValidator, Field, model_validator

from sweeps.schema.parameters import Range, spread
from sweeps.schema.refusals import Problem, display, refusals
from sweeps.schema.strict import Strict
from sweeps.schema.values import Moment, Prose, line_of_text, not_empty

MOMENTS = ("I1", "I2", "I3")


class ListedRatios(Strict):
    """Moments of a body of which only the ratios are known."""

    I1: Moment = Field(description="I1 in any one unit (I3, M R2, …): finite, > 0")
    I2: Moment = Field(description="I2 in the same unit: finite, > 0")
    I3: Moment = Field(description="I3 in the same unit: finite, > 0")


class ListedBody(Strict):
    """One real body: its moments or their ratios; a system adds what else may be a body's own."""

    name: Annotated[str, line_of_text(100)] = Field(
        description="the body's name, unique in the sweep: one line of text, at most 100 characters"
    )
    I1: Moment = Field(default=None, description="moment of inertia about axis 1, kg m2: finite, > 0")
    I2: Moment = Field(default=None, description="moment of inertia about axis 2, kg m2: finite, > 0")
    I3: Moment = Field(default=None, description="moment of inertia about axis 3, kg m2: finite, > 0")
    ratios: ListedRatios = Field(default=None, description="{I1, I2, I3} in place of moments, in any one unit")
    source: Prose = Field(default=None, description="source of the numbers: text")
    note: Prose = Field(default=None, description="remark for the reader: text")

    @property
    def moments(self) -> tuple[float, float, float]:
        """(I1, I2, I3): kg m2, or in the unit of `ratios` where only those are known."""
        given = self if self.ratios is None else self.ratios
        return given.I1, given.I2, given.I3

    @model_validator(mode="after")
    def _check_moments(self) -> "ListedBody":
        allowed = "I1, I2 and I3 in kg m2, or ratios: {I1, I2, I3}, one of these"
        given = [name for name in MOMENTS if getattr(self, name) is not None]
        if self.ratios is not None:
            wrong = [(name, display(getattr(self, name)), "is given beside ratios") for name in given]
        else:
            wrong = [(name, "", "is missing") for name in MOMENTS if name not in given]
        if wrong:
            raise refusals([Problem((name,), shown, what, allowed) for name, shown, what in wrong])
        return self


def _named_once(bodies: tuple[ListedBody, ...]) -> tuple[ListedBody, ...]:
    names = [body.name for body in bodies]
    wrong = [
        Problem((number, "name"), display(name), "is an earlier body's name", "names that all differ")
        for number, name in enumerate(names)
        if name in names[:number]
    ]
    if wrong:
        raise refusals(wrong)
    return bodies


def bodies_of(model: type[ListedBody]) -> Any:
    """Return the type of a definition's `bodies`: a list with unique names."""
    return Annotated[tuple[model, ...], AfterValidator(not_empty), AfterValidator(_named_once)]


def problems(definition: Any, shareable: Iterable[str]) -> list[Problem]:
    """Return the conflicts between `bodies` and `grid`: moments in one of them, other values in one of them."""
    found = []
    for name in MOMENTS:
        entry = getattr(definition.grid, name)
        if definition.bodies and entry is not None:
            allowed = "moments in bodies or in grid, not both"
            found.append(Problem(("grid", name), display(entry), "is given beside bodies", allowed))
        elif not definition.bodies and entry is None:
            found.append(Problem(("grid", name), "", "is missing", f"{name} in kg m2, or bodies"))
    for name in shareable:
        entry, giving = getattr(definition.grid, name), [b for b in definition.bodies if getattr(b, name) is not None]
        if giving and len(giving) < len(definition.bodies):
            wrong = f"is given by {len(giving)} of {len(definition.bodies)} bodies"
            found.append(Problem(("bodies", name), "(some)", wrong, f"{name} in every body, or in none"))
        elif giving and name in definition.grid.model_fields_set:
            wrong = "is given although every body gives its own"
            found.append(Problem(("grid", name), display(entry), wrong, f"{name} in grid or in every body, not both"))
        elif not giving and entry is None:
            allowed = f"{name} in grid, or in every body" if definition.bodies else f"{name} in grid"
            found.append(Problem(("grid", name), "", "is missing", allowed))
    return found


def own(definition: Any, shareable: Iterable[str]) -> tuple[str, ...]:
    """Return the names of the values that every body has, moments included; () without bodies."""
    if not definition.bodies:
        return ()
    return (*MOMENTS, *(name for name in shareable if getattr(definition.bodies[0], name) is not None))


def dimensions_of(definition: Any, arguments: Iterable[str], shareable: Iterable[str]) -> dict[str, Range | np.ndarray]:
    """Return each dimension in storage order: (body, …) where bodies are listed, else the arguments."""
    along = own(definition, shareable)
    bodies = {"body": np.array([body.name for body in definition.bodies])} if definition.bodies else {}
    return bodies | {name: spread(getattr(definition.grid, name)) for name in arguments if name not in along}


def auxiliary(definition: Any, shareable: Iterable[str]) -> dict[str, tuple[str, np.ndarray]]:
    """Return the coordinates along `body`: moments, and other values of the bodies."""
    if not definition.bodies:
        return {}
    moments = np.array([body.moments for body in definition.bodies]).T
    columns = dict(zip(MOMENTS, map(np.ascontiguousarray, moments), strict=True))
    for name in own(definition, shareable)[3:]:
        columns[name] = np.array([getattr(body, name) for body in definition.bodies])
    columns["moments_are_ratios"] = np.array([body.ratios is not None for body in definition.bodies])
    return {name: ("body", values) for name, values in columns.items()}
