"""Relative equilibria of a described system: what its definition, its columns and its pictures are.

One `RelativeEquilibrium` a description: those of `sweeps/mechanics/library/relative`, and any Python file that a
definition names and whose equations are of first order (see `sweeps.mechanics.flow.is_flow`).
"""

from collections.abc import Callable, Mapping
from functools import cache, cached_property
from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np
from pydantic import Field

from sweeps.schema import parameters
from sweeps.schema.definition import Definition, Integration
from sweeps.schema.layout import Layout
from sweeps.schema.parameters import Parameter, Range, grid_model, spread
from sweeps.schema.refusals import keys_of
from sweeps.schema.variables import Role, Variable, table
from sweeps.systems.oscillator import system as oscillator
from sweeps.systems.relative_equilibrium.definition import FlowDefinition
from sweeps.systems.relative_equilibrium.look import LOOK
from sweeps.systems.relative_equilibrium.variables import COORDINATES, INVARIANTS, LAYOUT, NUDGE, VARIABLES
from sweeps.systems.system import Page, Points, Reference

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure
    from PIL.Image import Image

    from sweeps import mechanics
    from sweeps.mechanics.relative import FlowModel

LIBRARY = oscillator.LIBRARY / "relative"
SHARED = ("kernels.flows",)  # what every flow's generated code calls
SELDOM = ()


class RelativeEquilibrium(oscillator.Oscillator):
    """The full equations of a described system near each of its relative equilibria, by their eigenvalues."""

    samples_per_second = 2_000_000  # all that is worked out of a point included
    point_seconds = 0.0
    start_seconds = 4.5
    look = LOOK
    kernels = ("flows",)
    compile_seconds = 30.0

    @cached_property
    def description(self) -> "mechanics.System":
        """The description, read when it is asked for."""
        from sweeps.mechanics import DescriptionError

        description = self._load()
        own = {*description.parameters, *description.coordinates, *description.states}
        taken = sorted(own & {*VARIABLES, *INVARIANTS, *COORDINATES, "point"})
        if taken:
            raise DescriptionError(f"{self.name}: {taken[0]} is the name of a map's variable; allowed: any other name")
        return description

    @cached_property
    def mechanism(self) -> "FlowModel":
        """The derived equations and what runs points through them."""
        from sweeps.mechanics import DescriptionError
        from sweeps.mechanics.relative import FlowModel

        with self._lock:
            try:
                return FlowModel(self.description)
            except DescriptionError as error:
                raise DescriptionError(f"{self.name}: {error}") from None

    @property
    def references(self) -> str:
        """Where the theory stands."""
        return self.description.references or "Merkin, Introduction to the Theory of Stability, chapter 6"

    @property
    def caption(self) -> str:
        """What its map shows."""
        return f"{self.description.title}: measured eigenvalues of motions about each equilibrium, beside theory"

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        """Table of what its grid may hold."""
        own = (oscillator.parameter_of(p) for p in self.description.parameters.values())
        return (*own, *NUDGE)

    @cached_property
    def model(self) -> type[Definition]:
        """The model of its definitions."""
        grid = grid_model("FlowGrid", self.parameters, __name__)
        return type(
            "SystemDefinition",
            (FlowDefinition,),
            {
                "__module__": __name__,
                "__doc__": FlowDefinition.__doc__,
                "__annotations__": {"grid": grid},
                "grid": Field(grid(), description="what is varied: a mapping with " + keys_of(grid)),
            },
        )

    def dimensions(self, definition: Definition) -> dict[str, Range | np.ndarray]:
        """(the parameters, epsilon, equilibrium, eigenvalue)."""
        varied = {p.name: spread(getattr(definition.grid, p.name)) for p in self.parameters}
        numbers = np.arange(1, self.mechanism.n + 1, dtype=np.int8)
        return varied | {"equilibrium": np.array(self.description.names), "eigenvalue": numbers}

    def arguments(self, definition: Definition) -> tuple[str, ...]:
        """Names of what a point consists of."""
        return (*(p.name for p in self.parameters), "equilibrium", "eigenvalue")

    def coordinates(self, definition: Definition) -> dict[str, Variable]:
        """Name → coordinate."""
        return parameters.coordinates(self.parameters) | COORDINATES

    def variables(self, definition: Definition | None = None) -> dict[str, Variable]:
        """Name → variable; for four eigenvalues their invariants, and what this system conserves and where it rests."""
        if definition is None:
            return VARIABLES
        model = self.mechanism
        drifts = (
            Variable(
                f"{name}_drift",
                "1",
                f"largest change of the conserved {name.replace('_', ' ')}, relative",
                role=Role.CHECK,
            )
            for name in model.quantities
        )
        places = (
            Variable(f"{p.name}_equilibrium", p.unit, f"{p.meaning}, at the equilibrium") for p in model.flow.places
        )
        return VARIABLES | (INVARIANTS if model.n == 4 else {}) | table(*drifts, *places)

    def layout(self) -> Layout:
        """What any of its maps may hold: parameters, places and drifts by names that its description knows."""
        return LAYOUT

    def columns(self, points: Mapping[str, np.ndarray], integration: Integration) -> dict[str, np.ndarray]:
        """Linear theory beside what is measured; see `sweeps.mechanics.relative`."""
        self._compiled()
        numbers = np.zeros(len(points["equilibrium"]), dtype=np.int64)
        for slot, name in enumerate(self.description.names):
            numbers[points["equilibrium"] == name] = slot
        settings = (integration.rotations, integration.samples_per_rotation, integration.tolerance)
        return self.mechanism.survey({**points, "equilibrium": numbers}, *settings, integration.runs)

    def motions(self, points: Mapping[str, np.ndarray], integration: Integration) -> int:
        """Runs of each equilibrium, which all its eigenvalues share."""
        runs = integration.runs or self.mechanism.runs
        return next(iter(points.values())).size * runs // self.mechanism.n

    def check(self, definition: Definition, grid: Points) -> None:
        """Derives the equations, and looks for equilibria at some points of the grid.

        Raises:
            DescriptionError: for what is wrong with the description, and where no point has an equilibrium.
        """
        from sweeps.mechanics import DescriptionError

        try:
            slots = len(self.description.names) * self.mechanism.n
            places = np.linspace(0, grid.size // slots - 1, oscillator.LOOKED_AT)
            chosen = np.unique(places.astype(np.int64)).tolist()
            parts = [grid.points(k * slots, k * slots + 1) for k in chosen]
            columns = {name: np.concatenate([part[name] for part in parts]) for name in self.description.parameters}
            self._code()  # what cannot be integrated is refused here
            found = self.mechanism.equilibria([columns[name] for name in self.description.parameters])
        except DescriptionError as error:
            text = str(error)
            raise DescriptionError(text if text.startswith(self.name) else f"{self.name}: {text}") from None
        if np.isnan(found).any(axis=-1).all():
            raise DescriptionError(
                f"{self.name}: equilibria: there is none within the bounds, at {len(chosen)} points of the grid; "
                "allowed: bounds that hold one"
            )

    def reference(self) -> Reference:
        """What `verify` finds again, by LAPACK and by SciPy."""
        from sweeps.systems.relative_equilibrium import references

        return references.reference(self.mechanism)

    def method(self, definition: Definition) -> str:
        """How the motion was computed."""
        return "direct integration of the full equations of motion"

    def compile(self) -> None:
        """Compiles what all of these share, and the code that was generated for this one."""
        compile_shared()
        self._compiled()

    def page(self, ds: "xr.Dataset") -> Page:
        """The eigenvalues of the point chosen."""
        from sweeps.systems.relative_equilibrium.page import PAGE

        return PAGE

    def pictures(self, ds: "xr.Dataset") -> "dict[str, Callable[[], Figure | None]]":
        """The map, and theory against measurement; a map is all they need."""
        from sweeps.systems.relative_equilibrium import figure_spectra

        return {
            "stability": lambda ax=None: figure_spectra.draw(ds, ax),
            "theory_against_measured": lambda ax=None: figure_spectra.draw_agreement(ds, ax),
        }

    def animations(self, ds: "xr.Dataset") -> "dict[str, Callable[[], list[Image]]]":
        """Of the slug that damps, what growth comes to."""
        from sweeps.systems.relative_equilibrium import figure_flat_spin

        return {"flat_spin": lambda: figure_flat_spin.frames(ds)} if self.name == "viscous_slug" else {}

    def __reduce__(self) -> tuple[Any, ...]:
        return (of_file, (self.name, self.folder)) if self.name.endswith(".py") else (of_library, (self.name,))


def compile_shared() -> None:
    """Compiles what every flow's generated code calls: importing it does."""
    for kernel in SHARED:
        import_module(kernel)


def shipped() -> tuple[str, ...]:
    """Names of the relative equilibria that ship."""
    return tuple(sorted(path.stem for path in LIBRARY.glob("*.py") if path.stem != "__init__"))


@cache
def of_library(name: str) -> RelativeEquilibrium:
    """A system that ships."""
    module = f"sweeps.mechanics.library.relative.{name}"
    source = (LIBRARY / f"{name}.py").read_bytes()
    return RelativeEquilibrium(name, lambda: import_module(module).system, source)


@cache
def of_file(name: str, folder: str = "") -> RelativeEquilibrium:
    """The system that a Python file describes, its path from a folder; the file is run.

    Raises:
        DescriptionError: if the file cannot be read or run, or makes no `system`.
    """
    found = oscillator.of_file(name, folder)
    return RelativeEquilibrium(name, lambda: found.description, found.source, folder)


def holds(ds: "xr.Dataset") -> bool:
    """Whether a map is one of relative equilibria, by its dimensions."""
    return "eigenvalue" in ds.dims


def unread(name: str) -> RelativeEquilibrium:
    """The system of a map that a Python file describes, which is not run: good for what a map alone is enough for."""
    found = oscillator.unread(name)
    return RelativeEquilibrium(name, lambda: found.description, b"")
