"""What systems share that somebody describes: their equations, their code and their parameters are a description's.

`sweeps/mechanics/library` holds the descriptions that ship; a definition may name any Python file that makes one. What
kind of system a description makes stands in the folders beside this module: small oscillations, relative equilibria.
"""

import hashlib
import importlib.util
import math
import pickle
import re
import threading
import traceback
from abc import abstractmethod
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from functools import cache, cached_property, partial
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

import numpy as np

from sweeps.reading.sandbox import ChildError, parts_from_child
from sweeps.schema.definition import Definition
from sweeps.schema.parameters import Range, grid_model, mapping, spread
from sweeps.schema.refusals import DescriptionError
from sweeps.schema.values import number
from sweeps.schema.variables import Parameter, Quantity, Variable, coordinates_of, table
from sweeps.systems.system import Dynamics, Example, Points

if TYPE_CHECKING:
    from sweeps import mechanics
    from sweeps.mechanics.model import Model
    from sweeps.mechanics.taylor import Code

MECHANICS = Path(__file__).parents[1] / "mechanics"
ENCLOSURES, SEARCH = Example("enclosures"), Example("roots")  # the search encloses functions, too
PLANNING = Example("examples", "plan_runs", is_last=True)  # before and between runs
PATHS = Example("paths")  # motions far from an equilibrium
FILE_SECONDS = 60.0  # of processor that the file of a description may take
FEW, MANY = 16, 256  # points of a grid at which a check looks for equilibria: the many where the few have none


class Described(Dynamics):
    """The full equations of motion of a described system, near each of its equilibria.

    Its `tables` hold, besides, NUDGE: the parameters of a grid beside the description's. A definition's `system` says
    its name, `load` makes the description, whose text is `source` and whose file's path starts in `folder`.
    """

    library: ClassVar[Path]  #: folder of the descriptions of this kind that ship
    base_model: ClassVar[type[Definition]]  #: the model of definitions, but for `grid`
    #: name of a variable or coordinate by which a map of this kind is known; "" for a map of no other kind.
    marker: ClassVar[str] = ""
    shared_seconds: ClassVar[float]  #: for compiling what all of this kind share, s, about
    several: Mapping[str, str] = {"equilibrium": "equilibria"}
    literature: ClassVar[str]  #: where the theory stands, if the description does not say it
    shown: ClassVar[str]  #: what its map shows

    def __init__(self, name: str, load: "Callable[[], mechanics.System]", source: bytes, folder: str = ""):
        self.name, self.folder, self.source = name, folder, source
        self._load = load
        self._lock = threading.RLock()

    @abstractmethod
    def numbers(self) -> dict[str, np.ndarray]:
        """Return the last dimension: modes or eigenvalues of an equilibrium."""

    def constants(self) -> dict[str, Any]:
        """Return the class attributes that the model of its definitions takes from the description."""
        return {}

    @staticmethod
    @abstractmethod
    def describes(description: "mechanics.System") -> bool:
        """Return True if a description makes a system of this kind."""

    @classmethod
    def holds(cls, variables: Collection[str]) -> bool:
        """Return whether a map of a description is one of this kind, from the names of its variables."""
        return not cls.marker or cls.marker in variables

    @cached_property
    def description(self) -> "mechanics.System":
        """The description, read when it is asked for."""
        description = self._load()
        given = {*description.parameters, *description.coordinates, *description.states}
        if taken := sorted(given & {*self.layout().variables, *self.layout().coordinates, "point"}):
            raise DescriptionError(f"{self.name}: {taken[0]} is the name of a map's variable; allowed: any other name")
        return description

    @cached_property
    def mechanism(self) -> "Model":
        """The derived equations and what runs points through them."""
        with self._lock:
            return named(self.name, self._model)

    def _model(self):
        from sweeps.mechanics.model import Model

        model = Model(self.description)
        if model.equations.timed and self.description.given_period is None:
            raise DescriptionError(
                "period: is missing, and the equations hold the time; allowed: system.period(T), equations without "
                "the time, or sweeps.motion"
            )
        return model

    @property
    def references(self) -> str:
        """Where the theory stands."""
        return self.description.references or self.literature

    @property
    def caption(self) -> str:
        """What its map shows."""
        return f"{self.description.title}: {self.shown}"

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        """Table of what its grid may hold."""
        described = []
        for p in self.description.parameters.values():
            item, bounds = Annotated[float, number(p.allows, p.allowed)], p.allowed.rpartition(", in ")[0]
            quantity = Quantity(p.name.replace("_", " "), p.unit, bounds, item)
            described.append(Parameter(p.name, quantity, p.meaning, p.default))
        return (*described, *self.tables.NUDGE)

    @cached_property
    def model(self) -> type[Definition]:
        """The model of its definitions."""
        grid = grid_model("DescribedGrid", self.parameters, __name__)
        return type(
            "SystemDefinition",
            (self.base_model,),
            {
                "__module__": __name__,
                "__doc__": self.base_model.__doc__,
                "__annotations__": {"grid": grid} | dict.fromkeys(self.constants(), ClassVar),
                "grid": mapping("what is varied", grid),
                **self.constants(),
            },
        )

    def dimensions(self, definition: Definition) -> dict[str, Range | np.ndarray]:
        """Return the dimensions: parameters, perturbation, equilibrium, and modes or eigenvalues."""
        varied = {p.name: spread(getattr(definition.grid, p.name)) for p in self.parameters}
        return varied | {"equilibrium": np.array(self.description.names)} | self.numbers()

    def arguments(self, definition: Definition) -> tuple[str, ...]:
        """Return the names of the arguments of a point."""
        return (*(p.name for p in self.parameters), "equilibrium", *self.numbers())

    def coordinates(self, definition: Definition) -> dict[str, Variable]:
        """Return name → coordinate."""
        return coordinates_of(self.parameters) | self.tables.COORDINATES

    def places(self) -> dict[str, Variable]:
        """Return name → variable of the position of an equilibrium along each coordinate or state."""
        moving = self.description.kept or self.description.states.values()
        return table(*(Variable(f"{p.name}_equilibrium", p.unit, f"{p.meaning}, at the equilibrium") for p in moving))

    def slots(self, points: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
        """Return the numbered equilibria of points, in the order of the description."""
        slots = np.zeros(len(points["equilibrium"]), dtype=np.int64)
        for slot, name in enumerate(self.description.names):
            slots[points["equilibrium"] == name] = slot
        return {**points, "equilibrium": slots}

    def check(self, definition: Definition, grid: Points) -> None:
        """Derive the equations, and search for equilibria, or periodic motions, at some points of the grid.

        Raises:
            DescriptionError: for what is wrong with the description, and where no point has one, or every point more
                than there is room for.
        """
        named(self.name, self._code)  # what cannot be integrated is refused here

        def refused_at(count: int) -> str:
            return self.refusal(self._looked_at(grid, count))

        if wrong := named(self.name, lambda: refused_at(FEW) and refused_at(MANY)):
            raise DescriptionError(f"{self.name}: {wrong}")

    def proofs(self, grid: Points) -> tuple[str, ...]:
        """Return the symmetries that are used at some points of the grid."""
        return self.mechanism.proofs(self._looked_at(grid, MANY))

    def refusal(self, values: list[np.ndarray]) -> str:
        """Return why no equilibrium of these points is usable; nothing if one is."""
        from sweeps.mechanics.equilibria import refusal

        wrong = refusal(self.mechanism.landscape, self.mechanism.equilibria(values), values)
        return wrong and f"equilibria: {wrong}"

    def _looked_at(self, grid: Points, count: int) -> list[np.ndarray]:
        """Return each parameter's values at some points of a grid, from end to end."""
        slots = math.prod(map(len, (self.description.names, *self.numbers().values())))
        chosen = np.unique(np.linspace(0, grid.size // slots - 1, count).astype(np.int64)).tolist()
        parts = [grid.points(k * slots, k * slots + 1) for k in chosen]
        values = [np.concatenate([part[name] for part in parts]) for name in self.description.parameters]
        return values or [np.zeros(len(chosen))]

    def fingerprint(self) -> str:
        """Return a hash of the kernels, the generated code, its generator and the description."""
        return fingerprint(self.kernels, self._code(), self.source)

    @property
    def compile_seconds(self) -> float:
        """For compiling what all of this kind share, and the generated code, s, about."""
        return self.shared_seconds + self._code().compile_seconds

    def examples(self, definition: Definition | None = None) -> tuple[Example, ...]:
        """Return the import of the generated code, and the calls that all of this kind share."""
        return Example(str(self._code().path)), *super().examples(definition)

    def _code(self) -> "Code":
        return self.mechanism.code

    def _compiled(self):
        with self._lock:
            self._code().module()

    def __reduce__(self) -> tuple[Any, ...]:
        if self.name.endswith(".py"):
            return of_file, (type(self), self.name, self.folder)
        return of_library, (type(self), self.name)


def fingerprint(kernels: Iterable[str], code: "Code", source: bytes) -> str:
    """Return a hash of kernels, generated code, its generator and a description."""
    from kernels.fingerprint import fingerprint

    digest = hashlib.sha256(fingerprint(*kernels, "straight").encode() + code.digest.encode() + source)
    for path in sorted(MECHANICS.glob("*.py")):
        digest.update(path.read_bytes())
    return digest.hexdigest()


# -- where descriptions come from


def named(name: str, work: Callable[[], Any]) -> Any:
    """Return what a piece of work on a system returns; what it refuses names the system first."""
    try:
        return work()
    except DescriptionError as error:
        text = str(error)
        raise DescriptionError(text if text.startswith(name) else f"{name}: {text}") from None


def shipped(kind: type[Described]) -> tuple[str, ...]:
    """Return the names of the shipped systems of a kind."""
    return tuple(sorted(path.stem for path in kind.library.glob("*.py") if path.stem != "__init__"))


@cache
def of_library(kind: type[Described], name: str) -> Described:
    """Return a shipped system."""
    path = kind.library / f"{name}.py"
    module = ".".join(("sweeps.mechanics", *path.relative_to(MECHANICS).with_suffix("").parts))
    return kind(name, lambda: import_module(module).system, path.read_bytes())


@cache
def of_file(kind: type[Described], name: str, folder: str = "") -> Described:
    """Return the system of this kind that a Python file describes."""
    system, source = script(name, folder)
    return kind(name, lambda: system, source, folder)


def unread(kind: type[Described], name: str) -> Described:
    """Return the system of a map whose Python file is not run, sufficient for reading the map."""

    def refuse():
        raise DescriptionError(
            f"system: {name}: a file that a map names is not run; allowed: a definition that names it"
        )

    return kind(name, refuse, b"")


@cache
def script(name: str, folder: str = "") -> tuple["mechanics.System", bytes]:
    """Return the `system` of a Python file, and its text; it is run once, in a child process of bounded time.

    Its path is as the definition says it, and starts in the definition's folder, or where the program runs.
    """
    path = Path(folder, name)
    try:
        source = path.read_bytes()
    except (OSError, ValueError) as error:  # ValueError: no path can hold such a character
        reason = getattr(error, "strerror", None) or str(error)
        value = name if len(name) <= 300 else f"…{name[-100:]}"
        allowed = f"a Python file, its path from the definition's folder ({folder or '.'})"
        raise DescriptionError(f"system: {value}: cannot be read ({reason}); allowed: {allowed}") from None
    try:
        (answer,) = parts_from_child(partial(_answered, path), FILE_SECONDS, math.inf)
    except ChildError:
        wrong = f"ended without an answer, or took more than {FILE_SECONDS:g} s"
        raise DescriptionError(f"system: {path}: {wrong}; allowed: Python that describes a system") from None
    system = pickle.loads(answer)
    if isinstance(system, str):
        raise DescriptionError(f"system: {system}")
    return system, source


def _answered(path: Path) -> Iterator[bytes]:
    """Yield the `system` of a Python file, or what is wrong with it, pickled."""
    from sweeps.mechanics import System

    spec = importlib.util.spec_from_file_location("described", path)
    module = importlib.util.module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
        found = getattr(module, "system", None)
        if not isinstance(found, System):
            found = f"{path}: defines no `system`; allowed: a file with system = System(…)"
    except (Exception, SystemExit) as error:  # a file that ends the program would end it with its own exit status
        lines = [frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == str(path)]
        found = f"{path}, line {lines[-1]}: " if lines else f"{path}: "
        if isinstance(error, DescriptionError):
            found += str(error)
        else:
            said = " ".join(str(error).split())[:200]
            numbers = "ufunc" in said or "to float" in said  # NumPy's or math's cos of a symbol
            allowed = "SymPy's functions (from sympy import cos)" if numbers else "Python that describes a system"
            found += f"cannot be run ({type(error).__name__}: {said}); allowed: {allowed}"
    yield pickle.dumps(found)


# -- descriptions that are built by a program

BUILT: dict[str, Described] = {}


def built(description: "mechanics.System", kinds: Iterable[type[Described]]) -> str:
    """Return the name under which a description that a program has built is known from now on, in this process."""
    text = repr(sorted(vars(description).items(), key=lambda item: item[0])).encode()
    word = re.sub(r"[^A-Za-z0-9]+", "_", description.title).strip("_")[:40] or "system"
    name = f"{word}-{hashlib.sha256(text).hexdigest()[:12]}.py"
    if name not in BUILT:
        kind = named(description.title, lambda: next(kind for kind in kinds if kind.describes(description)))
        BUILT[name] = kind(name, lambda: description, text)
    return name
