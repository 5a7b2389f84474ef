"""Presentation of a system's maps: figures, animations, page, and how flags and parameters look."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any

from sweeps.schema.datasets import Dataset
from sweeps.systems.presentation.appearance import Appearance, Compared
from sweeps.systems.system import Dynamics

Drawing = Callable[..., Any]  # of an optional place (Axes): a Figure, or None where there is nothing to draw
Drawings = dict[str, Drawing]  # name → drawing
DRAWING = Path(__file__).parent / "drawing.js"  # script of the pages that show a motion
Animations = dict[str, Callable[[], Iterator[Any]]]  # name → function that draws the frames, arrays of pixels


@dataclass(frozen=True)
class Opening:
    """Where the page of a map begins."""

    plane: tuple[str, ...] = ()  #: names of the two dimensions that it shows first; () for the longest
    #: dimension → value at which to stand; others stand in their middle.
    at: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Page:
    """A system's part of the page."""

    #: its own sections (.html), styles (.css) and scripts (.js), each kind in order. The last script defines `part`,
    #: whose members `sweeps/views/page/part.js` lists; () for a page with no part of its own.
    files: tuple[Path, ...] = ()
    #: what the page asks, below its title.
    question: str = "What is stable, with which rates, and how accurate are they?"
    keys: str = ""  #: what to know of the picture, after how it is steered
    table: bool = False  #: whether the map is shown as a table, which `part` builds, and not as a plane
    facts: Mapping = field(default_factory=dict)  #: what the scripts are told beside the map, as JSON knows it
    needs: frozenset[str] = frozenset()  #: names of variables without which a map has the plain page


class Presentation:
    """Presentation of the maps of one system; the base class draws maps of points alone.

    That of the system in `tests/toy` is `tests/toy/damped_top/presentation.py`.
    """

    appearance: Appearance = Appearance()  #: how flags and parameters look in figures, terminal and page
    part: Page = Page()  #: the system's part of the page
    least: tuple[str, ...] = ()  #: names of the dimensions at whose least value the page begins
    #: (name, "module.function" of this package that draws it from a map) of each figure.
    drawn: tuple[tuple[str, str], ...] = ()
    compared: tuple[Compared, ...] = ()  #: the measured quantities that a figure shows against theory

    def __init__(self, system: Dynamics):
        self.system = system

    def figures(self, ds: Dataset) -> Drawings:
        """Return name → drawing function, of an optional place, of each figure of a map."""
        return {name: self.drawing(where, ds) for name, where in self.drawn} | self.against_theory(ds)

    def against_theory(self, ds: Dataset) -> Drawings:
        """Return the figure of measured quantities against theory, of a map that has some of :attr:`compared`."""
        from sweeps.systems.presentation import agreement

        held = [one for one in self.compared if {*one.names} <= {*ds.variables}]
        held = [one for one in held if not one.is_spare] or held
        draw = partial(agreement.draw, ds, self.system.layout().variables, held, self.appearance)
        return {"theory_against_measured": draw} if held else {}

    def drawing(self, where: str, ds: Dataset, *more) -> Drawing:
        """Return a function of this package, "module.function", that draws a map."""
        module, function = where.split(".")
        return partial(getattr(import_module(f"{type(self).__module__}.{module}"), function), ds, *more)

    def figures_of_points(self, ds: Dataset) -> Drawings:
        """Return name → drawing function of the figures of a map of sampled or listed points."""
        from sweeps.systems.presentation import cloud

        return {"points": partial(cloud.draw, ds, self.system.layout().variables, self.appearance)}

    def animations(self, ds: Dataset) -> Animations:
        """Return name → function that draws the frames of each animation of a map."""
        return {}

    def needs_compiler(self, ds: Dataset) -> bool:
        """Return False if the figures of a map call few kernels: plain Python is then faster than loading Numba."""
        return True

    def opening(self, ds: Dataset) -> Opening:
        """Return the initial view of the page of a map."""
        return Opening(at={name: float(ds[name].values.min()) for name in self.least if name in ds.dims})

    def page(self, ds: Dataset) -> Page:
        """Return the system's part of the page of a map."""
        return self.part if self.part.needs <= set(ds.variables) else Page(question=self.part.question)


PRESENTATION = Presentation
