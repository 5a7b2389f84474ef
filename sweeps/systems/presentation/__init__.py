"""Presentation of a system's maps: figures, animations, page, and the appearance of flags and parameters."""

from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any

from sweeps.schema.datasets import Dataset
from sweeps.systems.presentation.appearance import Appearance, Compared
from sweeps.systems.system import Dynamics

Drawing = Callable[..., Any]  # a function of an optional place (Axes) that returns a Figure, or None without content
Drawings = dict[str, Drawing]  # the drawing of each figure by its name
DRAWING = Path(__file__).parent / "drawing.js"  # script of the pages that show a motion
# each animation's name → function that yields its frames, arrays of pixels
Animations = dict[str, Callable[[], Iterator[Any]]]


@dataclass(frozen=True)
class Opening:
    """Initial view of the page of a map."""

    plane: tuple[str, ...] = ()  #: names of the two dimensions of the initial plane; () for the longest
    #: dimension → its initial value; dimensions that are not listed start in their middle.
    at: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Page:
    """The content that a system adds to the page of a map."""

    #: the system's sections (.html), styles (.css) and scripts (.js), each kind in order. The last script defines
    #: `part`, with the members that `sweeps/views/page/part.js` lists; () for the plain page.
    files: tuple[Path, ...] = ()
    #: the question that the page answers, below its title.
    question: str = "What is stable, with which rates, and how accurate are they?"
    keys: str = ""  #: hints on the picture, after those on its keys
    table: bool = False  #: True if the map is shown as a table, which `part` builds, and not as a plane
    facts: Mapping = field(
        default_factory=dict
    )  #: values that the scripts receive in addition to the map, of JSON's types
    needs: frozenset[str] = frozenset()  #: variables that a map must have; without them it has the plain page


def longest_parameters(values: Any, panels: Collection[str]) -> tuple[str, str | None, str | None]:
    """Return (x, y, third): names of the two longest dimensions, and of a third that varies; None if there is none.

    Dimensions in `panels`, which have a panel (one of the figure's axes) for each value, are excluded.
    """
    names = [str(name) for name in values.dims if name not in panels]
    free_names = sorted((name for name in names if values.sizes[name] > 1), key=lambda name: -values.sizes[name])
    if len(free_names) < 2:
        return (*free_names, names[0])[0], None, None
    y, x = sorted(free_names[:2], key=names.index)
    return x, y, free_names[2] if len(free_names) > 2 else None


class Presentation:
    """Presentation of the maps of one system; the base class draws maps of points alone.

    For a small example see `tests/toy/damped_top/presentation.py`.
    """

    appearance: Appearance = Appearance()  #: flags and parameters in figures, terminal and page
    base_page: Page = Page()  #: the system's content of the page, of every map
    minimum_dims: tuple[str, ...] = ()  #: names of the dimensions that start at their least value on the page
    #: variable of the picture over a plane of parameters, and its dimensions with a panel for each value; the page
    #: opens with the same plane. (): the page's own choice, the two longest dimensions in storage order.
    plane_variable: tuple[str, tuple[str, ...]] | tuple[()] = ()
    #: (name, "module.function" of this package that draws it from a map) of each figure.
    figure_paths: tuple[tuple[str, str], ...] = ()
    compared: tuple[Compared, ...] = ()  #: the measured quantities that a figure compares with theory
    #: system → function of a map that returns its sentence with its measured number, the title of its figures.
    sentences: Mapping[str, Callable[[Dataset], str]] = {}

    def __init__(self, system: Dynamics):
        self.system: Any = system  # a subclass uses the methods of its own system

    def figures(self, ds: Dataset) -> Drawings:
        """Return name → drawing function of each figure of a map."""
        return {name: self.drawing(path, ds) for name, path in self.figure_paths} | self.agreement_figure(ds)

    def sentence(self, ds: Dataset) -> str:
        """Return the measured sentence of a map; "" if the map does not show it."""
        with suppress(KeyError, IndexError, ValueError):  # a slice, or a grid that misses the sentence's points
            return self.sentences[self.system.name](ds)
        return ""

    def agreement_figure(self, ds: Dataset) -> Drawings:
        """Return the figure of measured quantities against theory; {} if the map has none of :attr:`compared`."""
        from sweeps.systems.presentation import agreement

        compared = [quantity for quantity in self.compared if {*quantity.names} <= {*ds.variables}]
        compared = [quantity for quantity in compared if not quantity.is_spare] or compared
        draw = partial(agreement.draw, ds, self.system.layout().variables, compared, self.appearance)
        return {"theory_against_measured": draw} if compared else {}

    def drawing(self, function_path: str, ds: Dataset, *arguments) -> Drawing:
        """Return a function of this package, "module.function", that draws a map."""
        module, function = function_path.split(".")
        return partial(getattr(import_module(f"{type(self).__module__}.{module}"), function), ds, *arguments)

    def figures_of_points(self, ds: Dataset) -> Drawings:
        """Return name → drawing function of the figures of a map of sampled or listed points."""
        from sweeps.systems.presentation import cloud

        return {"points": partial(cloud.draw, ds, self.system.layout().variables, self.appearance)}

    def animations(self, ds: Dataset) -> Animations:
        """Return name → function that draws the frames of each animation of a map."""
        return {}

    def needs_compiler(self, ds: Dataset) -> bool:
        """Return False if the figures of a map call so few kernels that plain Python is faster than loading Numba."""
        return True

    def opening(self, ds: Dataset) -> Opening:
        """Return the initial view of the page of a map."""
        plane = ()
        if self.plane_variable:
            name, panels = self.plane_variable
            plane = tuple(filter(None, longest_parameters(ds[name], panels)[:2]))
        return Opening(plane, {name: float(ds[name].values.min()) for name in self.minimum_dims if name in ds.dims})

    def page(self, ds: Dataset) -> Page:
        """Return the system's content of the page of a map."""
        page = self.base_page
        return page if page.needs <= set(ds.variables) else Page(question=page.question)


PRESENTATION = Presentation
