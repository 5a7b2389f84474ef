"""Small oscillations of a described mechanical system: what its definition, its columns and its pictures are.

One `Oscillator` a description: those of `sweeps/mechanics/library`, and any Python file that a definition names.
"""

import hashlib
import importlib.util
import threading
import traceback
from collections.abc import Callable, Mapping
from functools import cache, cached_property
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

import numpy as np
from pydantic import Field

from sweeps.schema import parameters
from sweeps.schema.definition import Definition, Integration
from sweeps.schema.layout import Layout
from sweeps.schema.parameters import Parameter, Quantity, Range, grid_model, spread
from sweeps.schema.refusals import keys_of
from sweeps.schema.values import number
from sweeps.schema.variables import Variable, table
from sweeps.systems.oscillator.definition import OscillatorDefinition
from sweeps.systems.oscillator.look import LOOK
from sweeps.systems.oscillator.variables import COORDINATES, DEGENERATE, FOLLOWED, LAYOUT, NUDGE, VARIABLES
from sweeps.systems.system import Dynamics, Opening, Page, Points

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure
    from PIL.Image import Image

    from sweeps import mechanics
    from sweeps.mechanics.model import Model
    from sweeps.mechanics.taylor import Code

LIBRARY = Path(__file__).parents[2] / "mechanics" / "library"
SHARED = ("kernels.oscillations", "kernels.enclosures")  # what every oscillator's generated code calls
SELDOM = ("kernels.taylor_tapes",)  # what that of large ones calls besides
ANIMATED = ("bead_on_hoop", "double_pendulum", "pendulum")
LOOKED_AT = 256  # points of a grid at which a check looks for equilibria


class Oscillator(Dynamics):
    """The full equations of motion of a described system, near each of its equilibria, mode by mode.

    Args:
        name: what a definition's `system` says.
        load: makes the description.
        source: the description's text, for the fingerprint.
        folder: where the path of a description's file starts.
    """

    point_seconds = 4e-5  # 1e-5 to 1e-4, by how hard its equilibria are to enclose
    start_seconds = 5.5  # its equations are derived
    look = LOOK
    kernels = ("oscillations", "enclosures")

    def __init__(self, name: str, load: "Callable[[], mechanics.System]", source: bytes, folder: str = ""):
        self.name, self.folder = name, folder
        self.picture_seconds = 4.5 if name in ANIMATED else 2.5
        self._load = load
        self.source = source
        self._lock = threading.RLock()

    @cached_property
    def description(self) -> "mechanics.System":
        """The description, read when it is asked for."""
        from sweeps.mechanics import DescriptionError

        description = self._load()
        ours = {*VARIABLES, *DEGENERATE, *FOLLOWED, "equilibrium", "mode", "point"}
        taken = sorted({*description.parameters, *description.coordinates} & ours)
        if taken:
            raise DescriptionError(f"{self.name}: {taken[0]} is the name of a map's variable; allowed: any other name")
        return description

    @cached_property
    def mechanism(self) -> "Model":
        """The derived equations and what runs points through them."""
        from sweeps.mechanics import DescriptionError
        from sweeps.mechanics.model import Model

        with self._lock:
            try:
                return Model(self.description)
            except DescriptionError as error:
                raise DescriptionError(f"{self.name}: {error}") from None

    @property
    def samples_per_second(self) -> int:
        """By how long its generated code is."""
        return self._code().samples_per_second

    @property
    def compile_seconds(self) -> float:
        """Of its generated code, by how long that is."""
        return self._code().compile_seconds

    @property
    def references(self) -> str:
        """Where the theory stands."""
        return self.description.references or "Landau and Lifshitz, Mechanics, section 23"

    @property
    def caption(self) -> str:
        """What its map shows."""
        return f"{self.description.title}: measured rates of small oscillations about each equilibrium, beside theory"

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        """Table of what its grid may hold."""
        own = (parameter_of(p) for p in self.description.parameters.values())
        return (*own, *NUDGE)

    @cached_property
    def model(self) -> type[Definition]:
        """The model of its definitions."""
        grid = grid_model("OscillatorGrid", self.parameters, __name__)
        return type(
            "SystemDefinition",
            (OscillatorDefinition,),
            {
                "__module__": __name__,
                "__doc__": OscillatorDefinition.__doc__,
                "__annotations__": {"grid": grid, "moved": ClassVar[tuple[str, ...]]},
                "moved": tuple(c.name for c in self.description.kept),
                "grid": Field(grid(), description="what is varied: a mapping with " + keys_of(grid)),
            },
        )

    def dimensions(self, definition: Definition) -> dict[str, Range | np.ndarray]:
        """(the parameters, epsilon, phase, equilibrium, mode)."""
        varied = {p.name: spread(getattr(definition.grid, p.name)) for p in self.parameters}
        modes = np.arange(1, len(self.description.kept) + 1, dtype=np.int8)
        return varied | {"equilibrium": np.array(self.description.names), "mode": modes}

    def arguments(self, definition: Definition) -> tuple[str, ...]:
        """Names of what a point consists of."""
        return (*(p.name for p in self.parameters), "equilibrium", "mode")

    def coordinates(self, definition: Definition) -> dict[str, Variable]:
        """Name → coordinate."""
        return parameters.coordinates(self.parameters) | COORDINATES

    def variables(self, definition: Definition | None = None) -> dict[str, Variable]:
        """Name → variable; each coordinate's place at the equilibrium beside what every map has."""
        if definition is None:
            return VARIABLES
        places = (
            Variable(f"{c.name}_equilibrium", c.unit, f"{c.meaning}, at the equilibrium") for c in self.description.kept
        )
        degenerate = DEGENERATE if definition.integration.degenerate else {}
        followed = FOLLOWED if self.description.follow else {}
        return VARIABLES | table(*places) | degenerate | followed

    def layout(self) -> Layout:
        """What any of its maps may hold: parameters and places by names that its description knows."""
        return LAYOUT

    def columns(self, points: Mapping[str, np.ndarray], integration: Integration) -> dict[str, np.ndarray]:
        """Linear theory beside what is measured; see `sweeps.mechanics.model`."""
        self._compiled()
        numbers = np.zeros(len(points["equilibrium"]), dtype=np.int64)
        for slot, name in enumerate(self.description.names):
            numbers[points["equilibrium"] == name] = slot
        settings = (integration.rotations, integration.samples_per_rotation, integration.tolerance)
        points = {**points, "equilibrium": numbers}
        return self.mechanism.survey(points, *settings, integration.direction, integration.degenerate)

    def check(self, definition: Definition, grid: Points) -> None:
        """Derives the equations, and looks for equilibria at some points of the grid.

        Raises:
            DescriptionError: for what is wrong with the description, and where no point has an equilibrium, or every
                one more than there is room for.
        """
        from sweeps.mechanics import DescriptionError
        from sweeps.mechanics.equilibria import refuse_crowded

        slots = len(self.description.names) * len(self.description.kept)
        chosen = np.unique(np.linspace(0, grid.size // slots - 1, LOOKED_AT).astype(np.int64)).tolist()
        parts = [grid.points(k * slots, k * slots + 1) for k in chosen]
        columns = {name: np.concatenate([part[name] for part in parts]) for name in self.description.parameters}
        try:
            self._code()  # what cannot be integrated is refused here
            values = [columns[name] for name in self.description.parameters] or [np.zeros(len(chosen))]
            found = self.mechanism.equilibria(values)
            if found.crowded.all():  # some of many are their status
                refuse_crowded(self.mechanism.landscape, found, values)
        except DescriptionError as error:
            text = str(error)
            raise DescriptionError(text if text.startswith(self.name) else f"{self.name}: {text}") from None
        if found.flat.all():
            raise DescriptionError(
                f"{self.name}: equilibria: V is flat along a line of them; allowed: a coordinate to hold (hold=…)"
            )
        if not found.counts.any():
            raise DescriptionError(
                f"{self.name}: equilibria: there is none within the bounds, at {len(chosen)} points of the grid; "
                "allowed: bounds that hold one"
            )

    def fingerprint(self) -> str:
        """Hash of the kernels, of the generated code, of what derived it and of the description."""
        from kernels.fingerprint import fingerprint

        code = self._code()
        kernels = fingerprint(*self.kernels, *code.kernels)
        digest = hashlib.sha256(kernels.encode() + code.digest.encode() + self.source)
        for path in sorted(LIBRARY.parent.glob("*.py")):
            digest.update(path.read_bytes())
        return digest.hexdigest()

    def method(self, definition: Definition) -> str:
        """How the motion was computed."""
        return "direct integration of the full Euler-Lagrange equations"

    def compile(self) -> None:
        """Compiles what all oscillators share, and the code that was generated for this one."""
        compile_shared()
        self._compiled()

    def compiled(self) -> Path:
        """The file that says that this system's generated code is in the cache."""
        return self._code().compiled

    def _code(self) -> "Code":
        """The generated kernel.

        Raises:
            DescriptionError: for what cannot be integrated.
        """
        return self.mechanism.code

    def _compiled(self):
        with self._lock:
            self._code().module()

    def opening(self, ds: "xr.Dataset") -> Opening:
        """The least nudge."""
        return Opening(at={"epsilon": float(ds["epsilon"].min())} if "epsilon" in ds.dims else {})

    def page(self, ds: "xr.Dataset") -> Page:
        """The motion of one mode, and where equilibria are."""
        from sweeps.systems.oscillator.page import page

        return page(ds, None if self.name.endswith(".py") else self.description)

    def pictures(self, ds: "xr.Dataset") -> "dict[str, Callable[[], Figure | None]]":
        """The map, and theory against measurement; a map is all they need."""
        from sweeps.systems.oscillator import figure_oscillations

        return {
            "oscillations": lambda ax=None: figure_oscillations.draw(ds, ax),
            "theory_against_measured": lambda ax=None: figure_oscillations.draw_agreement(ds, ax),
        }

    def animations(self, ds: "xr.Dataset") -> "dict[str, Callable[[], list[Image]]]":
        """Of the bead on a hoop and of pendulums, how they move beside a stable and an unstable place."""
        if self.name not in ANIMATED:
            return {}
        from sweeps.systems.oscillator import figure_motion

        return {"motion": lambda: figure_motion.frames(ds, self.name, self.mechanism)}

    def __reduce__(self) -> tuple[Any, ...]:
        return (of_file, (self.name, self.folder)) if self.name.endswith(".py") else (of_library, (self.name,))


def compile_shared() -> None:
    """Compiles what every oscillator's generated code calls: importing it does."""
    for kernel in SHARED:
        import_module(kernel)


def parameter_of(p: "mechanics.description.DescribedParameter") -> Parameter:
    """A described parameter as a key of a definition's `grid`."""
    item = Annotated[float, number(p.allows, p.allowed)]
    bounds = p.allowed.rpartition(", in ")[0]
    return Parameter(p.name, Quantity(p.name.replace("_", " "), p.unit, bounds, item), p.meaning, p.default)


# ---------------------------------------------------------------------------------------------------------
# Where descriptions come from


@cache
def of_library(name: str) -> Oscillator:
    """A system that ships."""
    return Oscillator(
        name,
        lambda: import_module(f"sweeps.mechanics.library.{name}").system,
        (LIBRARY / f"{name}.py").read_bytes(),
    )


@cache
def of_file(name: str, folder: str = "") -> Oscillator:
    """The system that a Python file describes; the file is run, as the person who names it means it to be.

    Args:
        name: the file's path, as the definition says it.
        folder: where that starts, the definition's own; left out, where the program runs.

    Raises:
        DescriptionError: if the file cannot be read or run, or makes no `system`.
    """
    from sweeps.mechanics import DescriptionError

    path = Path(folder, name)
    try:
        source = path.read_bytes()
    except (OSError, ValueError) as error:  # ValueError: no path can hold such a character
        reason = getattr(error, "strerror", None) or str(error)
        shown = name if len(name) <= 300 else f"…{name[-100:]}"
        allowed = f"a Python file, its path from the definition's folder ({folder or '.'})"
        raise DescriptionError(f"system: {shown}: cannot be read ({reason}); allowed: {allowed}") from None
    return Oscillator(name, lambda: _run(path), source, folder)


def unread(name: str) -> Oscillator:
    """The system of a map that a Python file describes, which is not run: good for what a map alone is enough for."""

    def refuse():
        from sweeps.mechanics import DescriptionError

        raise DescriptionError(
            f"system: {name}: a file that a map names is not run; allowed: a definition that names it"
        )

    return Oscillator(name, refuse, b"")


def _run(path: Path) -> "mechanics.System":
    """The `system` of a Python file."""
    from sweeps.mechanics import DescriptionError, System

    digest = hashlib.sha256(str(path.resolve()).encode()).hexdigest()[:16]
    spec = importlib.util.spec_from_file_location(f"described_{digest}", path)
    module = importlib.util.module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
    except DescriptionError as error:
        raise DescriptionError(f"system: {path}: {error}") from None
    except Exception as error:
        said = " ".join(str(error).split())[:200]
        lines = [frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == str(path)]
        where = f"{path}, line {lines[-1]}" if lines else str(path)
        numbers = "ufunc" in said or "to float" in said  # NumPy's or math's cos of a symbol
        allowed = "SymPy's functions (from sympy import cos)" if numbers else "Python that describes a system"
        raise DescriptionError(
            f"system: {where}: cannot be run ({type(error).__name__}: {said}); allowed: {allowed}"
        ) from None
    system = getattr(module, "system", None)
    if not isinstance(system, System):
        raise DescriptionError(f"system: {path}: makes no `system`; allowed: a file with system = System(…)")
    return system
