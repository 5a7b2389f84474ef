"""Base class of systems that a description defines: it gives their equations, their code and their parameters.

`sweeps/mechanics/library` contains the descriptions that ship; a definition may name any Python file that makes one.
The kinds of described systems (small oscillations, relative equilibria, periodic motions) are packages of this folder.
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
from sweeps.systems.invariants import SpectralSystem
from sweeps.systems.system import Example, Points

if TYPE_CHECKING:
    from sweeps import mechanics
    from sweeps.mechanics.mode_shapes import ModeShapes
    from sweeps.mechanics.model import Model
    from sweeps.mechanics.taylor import Generated

MECHANICS = Path(__file__).parents[1] / "mechanics"
ENCLOSURES, SEARCH = Example("search.enclosures"), Example("search.roots")  # the search calls both
PLANNING = Example("flow.runs", "plan_example", is_last=True)  # before and between runs
PATHS = Example("flow.paths")  # motions far from an equilibrium
MAX_FILE_SECONDS = 60.0  # processor time after which a description's file is stopped, s; a derivation needs seconds
MIN_CHECK_POINTS, MAX_CHECK_POINTS = 16, 256  # grid points at which a check searches; the second if none has a result


class Described(SpectralSystem):
    """The full equations of motion of a described system, near each of its equilibria.

    Its `tables` also contain PERTURBATION_PARAMETERS, which a grid has in addition to the description's parameters.

    Args:
        name: value of a definition's key `system`.
        load: makes the description.
        source: text of the description.
        folder: folder from which the path of the description's file starts.
    """

    library: ClassVar[Path]  #: folder of the descriptions of this kind that ship
    base_model: ClassVar[type[Definition]]  #: the model of definitions, except `grid`
    #: name of a variable or coordinate that only maps of this kind have; "" for the kind of maps without a marker.
    marker: ClassVar[str] = ""
    shared_seconds: ClassVar[float]  #: approximate time for compiling the common kernels of this kind, s
    several: Mapping[str, str] = {"equilibrium": "equilibria"}
    literature: ClassVar[str]  #: source of the theory, if the description names none
    map_content: ClassVar[str]  #: quantity that its map shows

    def __init__(self, name: str, load: "Callable[[], mechanics.System]", source: bytes, folder: str = ""):
        self.name, self.folder, self.source = name, folder, source
        self._load = load
        self._lock = threading.RLock()

    @abstractmethod
    def numbers(self) -> dict[str, np.ndarray]:
        """Return the last dimension: modes or eigenvalues of an equilibrium."""

    def mode_shapes(
        self, arguments: Mapping[str, np.ndarray], integration: Any = None
    ) -> "tuple[ModeShapes, ModeShapes, np.ndarray]":
        """Return predicted shapes, measured shapes, and theory's states of points with equilibria.

        Args:
            arguments: parameters, `epsilon` and `equilibrium` of points, shape (points,).
            integration: length, sampling and accuracy of the runs; None to integrate no motion, and to return the
                predicted shapes twice.
        """
        from sweeps.mechanics import mode_shapes, relative

        points = self.slots(arguments)
        theory = relative.theory(self.mechanism, points)
        predicted = mode_shapes.predict_shapes(self.mechanism, theory)
        measured = predicted if integration is None else self._measured_shapes(points, theory, integration)
        return predicted, measured, mode_shapes.complete_states(self.mechanism, theory, predicted)

    def _measured_shapes(self, points, theory, integration) -> "ModeShapes":
        """Return the shapes of the propagators that are fitted to runs of points."""
        from kernels.flow.runs import Sampling
        from sweeps.mechanics import mode_shapes, relative

        self._load_code()
        sampling = Sampling.of(integration.rotations, integration.samples_per_rotation, integration.tolerance)
        runs = getattr(integration, "runs", None) or relative.usual_runs(self.mechanism)
        return mode_shapes.measure_shapes(self.mechanism, points, theory, sampling, runs)

    def components(self) -> list[str]:
        """Return the names of the components of a mode shape: coordinates or states."""
        return [place.name for place in self.mechanism.equations.places]

    def complex_rates(self, columns: Any) -> Any:
        """Return the measured eigenvalues of points, or iΩ and growth rates of modes, complex, and errors, s-1."""
        raise NotImplementedError

    def constants(self) -> dict[str, Any]:
        """Return the class attributes of its definitions' model that the description determines."""
        return {}

    @staticmethod
    @abstractmethod
    def describes(description: "mechanics.System") -> bool:
        """Return True if a description makes a system of this kind."""

    @classmethod
    def holds(cls, variables: Collection[str]) -> bool:
        """Return True if a map of a described system, with these variables, is of this kind."""
        return not cls.marker or cls.marker in variables

    @cached_property
    def description(self) -> "mechanics.System":
        """The description, read at its first use."""
        description = self._load()
        own_names = {*description.parameters, *description.coordinates, *description.states}
        if clashes := sorted(own_names & {*self.layout().variables, *self.layout().coordinates, "point"}):
            raise DescriptionError(
                f"{self.name}: {clashes[0]} is the name of a map's variable; allowed: any other name"
            )
        return description

    @cached_property
    def mechanism(self) -> "Model":
        """The derived equations and the code that integrates them."""
        with self._lock:
            return with_name(self.name, self._model)

    def _model(self):
        """Derive the equations of motion; refuse equations that contain the time without a period."""
        from sweeps.mechanics.model import Model

        model = Model(self.description)
        if model.equations.depends_on_time and self.description.given_period is None:
            raise DescriptionError(
                "period: is missing, and the equations hold the time; allowed: system.period(T), equations without "
                "the time, or sweeps.motion"
            )
        return model

    @property
    def is_unread(self) -> bool:
        """Return True if the system is that of a Python file which only a map names."""
        return not self.source

    @property
    def references(self) -> str:
        """Source of the theory."""
        return self.description.references or self.literature

    @property
    def caption(self) -> str:
        """Title of the description and the quantity that its map shows."""
        return f"{self.description.title}: {self.map_content}"

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        """Parameters of its grid: the description's and those of the perturbation."""
        parameters = []
        for p in self.description.parameters.values():
            item, bounds = Annotated[float, number(p.allows, p.allowed)], p.allowed.rpartition(", in ")[0]
            quantity = Quantity(p.name.replace("_", " "), p.unit, bounds, item)
            parameters.append(Parameter(p.name, quantity, p.meaning, p.default))
        return (*parameters, *self.tables.PERTURBATION_PARAMETERS)

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
        coords = self.description.kept or self.description.states.values()
        return table(*(Variable(f"{p.name}_equilibrium", p.unit, f"{p.meaning}, at the equilibrium") for p in coords))

    def slots(self, points: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
        """Return the numbered equilibria of points, in the order of the description."""
        slots = np.zeros(len(points["equilibrium"]), dtype=np.int64)
        for slot, name in enumerate(self.description.names):
            slots[points["equilibrium"] == name] = slot
        return {**points, "equilibrium": slots}

    def check(self, definition: Definition, grid: Points) -> None:
        """Derive the equations, and search for equilibria, or periodic motions, at some points of the grid.

        Raises:
            DescriptionError: if the description is invalid, if no point has an equilibrium or periodic motion, or if
                every point has more than the map's slots.
        """
        with_name(self.name, self._code)  # refuses equations that cannot be integrated

        def refusal_at(count: int) -> str:
            return self.refusal(self._check_values(grid, count))

        if problem := with_name(self.name, lambda: refusal_at(MIN_CHECK_POINTS) and refusal_at(MAX_CHECK_POINTS)):
            raise DescriptionError(f"{self.name}: {problem}")

    def proofs(self, grid: Points) -> tuple[str, ...]:
        """Return the symmetries that are used at some points of the grid."""
        return self.mechanism.proofs(self._check_values(grid, MAX_CHECK_POINTS))

    def refusal(self, values: list[np.ndarray]) -> str:
        """Return why no equilibrium of these points is usable; nothing if one is."""
        from sweeps.mechanics.equilibria import refusal

        problem = refusal(self.mechanism.landscape, self.mechanism.equilibria(values), values)
        return problem and f"equilibria: {problem}"

    def _check_values(self, grid: Points, count: int) -> list[np.ndarray]:
        """Return each parameter's values at some points of a grid, from end to end."""
        slots = math.prod(map(len, (self.description.names, *self.numbers().values())))
        numbers = np.unique(np.linspace(0, grid.size // slots - 1, count).astype(np.int64)).tolist()
        samples = [grid.points(k * slots, k * slots + 1) for k in numbers]
        values = [np.concatenate([sample[name] for sample in samples]) for name in self.description.parameters]
        return values or [np.zeros(len(numbers))]

    def fingerprint(self) -> str:
        """Return a hash of the kernels, the generated code, its generator and the description."""
        return hash_sources(self.kernels, self._code(), self.source)

    @property
    def compile_seconds(self) -> float:
        """Approximate time for compiling the generated code and the kernels that systems of this kind share, s."""
        return self.shared_seconds + self._code().compile_seconds

    def examples(self, definition: Definition | None = None) -> tuple[Example, ...]:
        """Return the import of the generated code, and the calls that all systems of this kind share."""
        return Example(str(self._code().path)), *super().examples(definition)

    def _code(self) -> "Generated":
        return self.mechanism.code

    def _load_code(self):
        with self._lock:
            self._code().module()

    def __reduce__(self) -> tuple[Any, ...]:
        if self.name.endswith(".py"):
            return of_file, (type(self), self.name, self.folder)
        return of_library, (type(self), self.name)


def hash_sources(kernels: Iterable[str], code: "Generated | None", source: bytes) -> str:
    """Return a hash of kernels, generated code, its generator and a description.

    Args:
        kernels: names of modules of `kernels`.
        code: generated code; None if there is none.
        source: text of the description.
    """
    from kernels.compile.fingerprint import fingerprint

    digest = hashlib.sha256(
        fingerprint(*kernels, "compile.llvm_formulas").encode() + (code.digest if code else "").encode() + source
    )
    for path in sorted(MECHANICS.glob("*.py")):
        digest.update(path.read_bytes())
    return digest.hexdigest()


# -- sources of descriptions


def with_name(name: str, work: Callable[[], Any]) -> Any:
    """Return the result of `work` on a system; begin the message of a refusal with the system's name."""
    try:
        return work()
    except DescriptionError as error:
        text = str(error)
        raise DescriptionError(text if text.startswith(name) else f"{name}: {text}") from None


def shipped_names(kind: type[Described]) -> tuple[str, ...]:
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
    """Return the system of this kind that a Python file describes.

    Args:
        kind: class of the system.
        name: path of the file, as the definition gives it.
        folder: folder from which the path starts; left out, the working directory.
    """
    system, source = run_file(name, folder)
    return kind(name, lambda: system, source, folder)


def make_unread(kind: type[Described], name: str) -> Described:
    """Return the system of a map without running its Python file, sufficient for reading the map."""

    def refuse():
        raise DescriptionError(
            f"system: {name}: a file that a map names is not run; allowed: a definition that names it"
        )

    return kind(name, refuse, b"")


@cache
def run_file(name: str, folder: str = "") -> tuple["mechanics.System", bytes]:
    """Return the `system` of a Python file, and its text; it is run once, in a child process of bounded time.

    Its path is as the definition gives it, and starts in the definition's folder, or in the working directory.
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
        (answer,) = parts_from_child(partial(_pickle_system, path), MAX_FILE_SECONDS, math.inf)
    except ChildError:
        problem = f"ended without an answer, or took more than {MAX_FILE_SECONDS:g} s"
        raise DescriptionError(f"system: {path}: {problem}; allowed: Python that describes a system") from None
    system = pickle.loads(answer)
    if isinstance(system, str):
        raise DescriptionError(f"system: {system}")
    return system, source


def _pickle_system(path: Path) -> Iterator[bytes]:
    """Yield the `system` of a Python file, or the message of its error, pickled."""
    from sweeps.mechanics import System

    spec = importlib.util.spec_from_file_location("described", path)
    module = importlib.util.module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
        result = getattr(module, "system", None)
        if not isinstance(result, System):
            result = f"{path}: defines no `system`; allowed: a file with system = System(…)"
    except (Exception, SystemExit) as error:  # a file that ends the program would end it with its own exit status
        lines = [frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == str(path)]
        result = f"{path}, line {lines[-1]}: " if lines else f"{path}: "
        if isinstance(error, DescriptionError):
            result += str(error)
        else:
            message = " ".join(str(error).split())[:200]
            numbers = "ufunc" in message or "to float" in message  # NumPy's or math's cos of a symbol
            allowed = "SymPy's functions (from sympy import cos)" if numbers else "Python that describes a system"
            result += f"cannot be run ({type(error).__name__}: {message}); allowed: {allowed}"
    yield pickle.dumps(result)


# -- descriptions that are built by a program

REGISTERED: dict[str, Described] = {}


def register_description(description: "mechanics.System", kinds: Iterable[type[Described]]) -> str:
    """Register a description that a program has built; return its name, by which this process finds it."""
    text = repr(sorted(vars(description).items(), key=lambda item: item[0])).encode()
    word = re.sub(r"[^A-Za-z0-9]+", "_", description.title).strip("_")[:40] or "system"
    name = f"{word}-{hashlib.sha256(text).hexdigest()[:12]}.py"
    if name not in REGISTERED:
        kind = with_name(description.title, lambda: next(kind for kind in kinds if kind.describes(description)))
        REGISTERED[name] = kind(name, lambda: description, text)
    return name
