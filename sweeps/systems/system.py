"""Interface of a system of equations of motion, and values that it returns on the way from a definition to a map."""

import hashlib
import sys
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import PurePath
from types import ModuleType
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from sweeps.schema.datasets import Dataset
from sweeps.schema.variables import Layout, Variable

if TYPE_CHECKING:
    from sweeps.schema.definition import Definition
    from sweeps.schema.parameters import Range

Point = Mapping[str, float]  # argument → value


@dataclass(frozen=True)
class Example:
    """A call that compiles kernels: of a function on example arguments, or the import of a compiling module."""

    module: str  #: name of a module in `kernels` (`free.exact`), or the path of a generated file
    function: str = ""  #: name of a Python function of the module; "" if its import compiles all of it
    arguments: tuple = ()  #: of the function
    is_last: bool = False  #: whether it is called after all further examples, as it links kernels that they compile

    @property
    def name(self) -> str:
        """A name of the call for files, which no further call has."""
        values = hashlib.sha256(repr(self.arguments).encode()).hexdigest()[:8]
        return f"{PurePath(self.module.removesuffix('.py')).name}.{self.function}-{values}"


@dataclass(frozen=True)
class Reference:
    """Independent measurements of a variable, point by point, which `verify` compares with a map."""

    variable: str  #: the variable of the map
    #: name of a method → a function of (point, integration) that returns the variable's value, or NaN if the run is too
    #: long for it. No method shares code with the system's integrators and its estimator.
    ways: Mapping[str, Callable[[Mapping[str, float], Any], float]]
    #: a function of (point, integration): largest allowed difference between the map and a method's value.
    allowed: Callable[[Mapping[str, float], Any], float]
    more: tuple["Reference", ...] = ()  #: references of further variables
    within_error: bool = False  #: whether a deviation of twice the reported error is allowed too


@dataclass(frozen=True)
class Cost:
    """The work of one point and the memory of one process, for estimates."""

    samples: int  #: samples of runs per point
    working_bytes: int = 0  #: memory of one process while it measures, bytes, without its points and columns


class Points(Protocol):
    """The points of a definition, by number (`sweeps.points.sweep.Grid`)."""

    @property
    def size(self) -> int:
        """Number of points."""

    def points(self, start: int, stop: int) -> dict[str, np.ndarray]:
        """Return argument → values at the points start … stop − 1, shape (stop − start,)."""


class Dynamics(ABC):
    """A system of equations of motion, with its parameters and its columns.

    A system is one module: that of its class also has ARGUMENTS, VARIABLES and LAYOUT (:attr:`tables`). The module
    `presentation` next to it, if there is one, has PRESENTATION, which shows its maps. Importing a system imports no
    kernel, no SciPy, no xarray and no Matplotlib. The smallest is `tests/toy/damped_top/system.py`.
    """

    name: str  #: value of a definition's key `system`
    model: "type[Definition]"  #: the model of its definitions
    references: str  #: sources of the theory
    caption: str  #: content of its map, one line
    samples_per_second: int = 64_000_000  #: approximate number of samples of runs that one core makes in a second
    point_seconds: float = 0.0  #: approximate time per point without its run (equilibria, theory), s
    start_seconds: float = 1.5  #: approximate time until a command has read and checked such a definition, s
    picture_seconds: float = 1.5  #: approximate time for all pictures of a map, s
    method_text: str = ""  #: method of computation of every map, see :meth:`method`
    #: modules of `kernels` that :meth:`columns` imports; a map's fingerprint covers them and their imports. With none,
    #: it covers every kernel.
    kernels: tuple[str, ...] = ()
    #: names of the arguments that decide whether a point is physically possible; () if all points are.
    existence: tuple[str, ...] = ()
    spectrum: tuple[str, ...] = ()  #: dimensions along which one point has all its modes or eigenvalues
    #: dimensions along which one point has all its equilibria, modes or eigenvalues → these in words
    several: Mapping[str, str] = {}
    compiled: tuple[Example, ...] = ()  #: the examples of every definition, see :meth:`examples`
    compile_seconds: float = 1.0  #: for compiling all examples in two processes, measured on an EPYC of 2024, s
    #: key of a definition, or of a body in it → name of the system that reads such definitions.
    variants: Mapping[str, str] = {}

    @property
    def tables(self) -> ModuleType:
        """Return the module with ARGUMENTS (names of the arguments of a point), VARIABLES and LAYOUT: the class's."""
        return sys.modules[type(self).__module__]

    def dimensions(self, definition: Any) -> "dict[str, Range | np.ndarray]":
        """Return each dimension, in storage order → its values: a range, or a one-dimensional array."""
        from sweeps.schema.parameters import spread

        return {name: spread(getattr(definition.grid, name)) for name in self.arguments(definition)}

    def auxiliary(self, definition: Any) -> dict[str, tuple[str, np.ndarray]]:
        """Return each coordinate that is not a dimension → (its dimension, its values)."""
        return {}

    def extra_dimensions(self, definition: Any) -> dict[str, np.ndarray]:
        """Return each further dimension of variables at a point (`Variable.over`) → the values along it."""
        return {}

    def cost(self, definition: Any) -> "Cost":
        """Return the work of a point and the memory of one process."""
        return Cost(definition.integration.samples)

    def proofs(self, grid: "Points") -> tuple[str, ...]:
        """Return one line for each property of the equations that is proved and used; `check` prints them."""
        return ()

    def bound(self, definition: Any) -> "Dynamics":
        """Return the system that measures a definition: itself, unless its points alone are not sufficient."""
        return self

    def arguments(self, definition: Any) -> tuple[str, ...]:
        """Return the names of the dimensions and auxiliary coordinates that a point of :meth:`columns` consists of."""
        return self.tables.ARGUMENTS

    def coordinates(self, definition: Any) -> dict[str, Variable]:
        """Return name → each coordinate that a map of this definition may have, including auxiliary coordinates."""
        return dict(self.layout().coordinates)

    def variables(self, definition: Any = None) -> dict[str, Variable]:
        """Return name → each variable of a map of this definition; without one, those that every map has."""
        return self.tables.VARIABLES

    def layout(self) -> Layout:
        """Return the layout of all maps of this system; open if only a definition determines their names."""
        return self.tables.LAYOUT

    @abstractmethod
    def columns(self, points: Mapping[str, np.ndarray], integration: Any) -> dict[str, np.ndarray]:
        """Measure points and return their columns.

        Args:
            points: each of :meth:`arguments` → values, shape (n,), in the units of :meth:`coordinates`.
            integration: length, sampling and accuracy of each run.

        Returns:
            Each of :meth:`variables` → values, shape (n,) and those of its further dimensions; a value depends on
            its own point alone.
        """

    def impossible(self, points: Mapping[str, np.ndarray]) -> np.ndarray:
        """Return which points are physically impossible, from the arguments in :attr:`existence`."""
        raise NotImplementedError

    def motions(self, points: Mapping[str, np.ndarray], integration: Any) -> int:
        """Return how many motions :meth:`columns` integrates for these points."""
        return next(iter(points.values())).size

    def check(self, definition: Any, grid: "Points") -> None:
        """Check a definition beyond its values; refuse it by a DefinitionError."""
        return None

    def fingerprint(self) -> str:
        """Return a hash of the code that makes the columns, 64 hexadecimal digits."""
        from kernels.compile.fingerprint import fingerprint

        return fingerprint(*self.kernels)

    def method(self, definition: Any) -> str:
        """Return the method of computation, for a map's `source`: "direct integration of Euler's equations"."""
        return self.method_text

    def examples(self, definition: Any = None) -> tuple[Example, ...]:
        """Return the calls that compile all kernels of a definition's :meth:`columns`.

        Without a definition, those of any, except generated code.
        """
        return self.compiled

    def motion(self, point: Point, duration: float | None, samples: int | None, tolerance: float) -> Dataset | None:
        """Return the motion at one point of a map; None if the system has none to show.

        Args:
            point: the point's coordinates, in the units of :meth:`coordinates`.
            duration: s, finite and > 0; left out, the duration that shows the motion best.
            samples: number of instants, both ends included; left out, enough for a curve.
            tolerance: relative truncation error of the integration.

        Returns:
            Variables over `time` (s), each with its units.
        """
        return None

    def reference(self) -> Reference | None:
        """Return the independent measurements for `verify`; None if the system has none."""
        return None
