"""Presentation of a system's maps: figures, animations, page, and how flags and parameters look."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from sweeps.systems.presentation.look import Look
from sweeps.systems.system import Dynamics

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure
    from PIL.Image import Image


@dataclass(frozen=True)
class Opening:
    """Where the page of a map begins.

    Attributes:
        plane: names of the two dimensions that it shows first; () for the longest.
        at: dimension → value at which to stand; others stand in their middle.
    """

    plane: tuple[str, ...] = ()
    at: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Page:
    """A system's part of the page.

    Attributes:
        files: its own sections (.html), styles (.css) and scripts (.js), each kind in order. The last script defines
            `part`, whose members `sweeps/views/page/part.js` lists; () for a page with no part of its own.
        question: what the page asks, below its title.
        keys: what to know of the picture, after how it is steered.
        table: whether the map is shown as a table, which `part` builds, and not as a plane.
        facts: what the scripts are told beside the map, as JSON knows it.
        needs: names of variables without which a map has the plain page.
    """

    files: tuple[Path, ...] = ()
    question: str = "What is stable, with which rates, and how accurate are they?"
    keys: str = ""
    table: bool = False
    facts: Mapping = field(default_factory=dict)
    needs: frozenset[str] = frozenset()


class Presentation:
    """Presentation of the maps of one system; the base class draws maps of points alone.

    That of the system in `tests/toy` is `tests/toy/damped_top/presentation.py`.

    Attributes:
        look: how flags and parameters look in figures, terminal and page.
        part: the system's part of the page.
        least: names of the dimensions at whose least value the page begins.
    """

    look: Look = Look()
    part: Page = Page()
    least: tuple[str, ...] = ()

    def __init__(self, system: Dynamics):
        self.system = system

    def figures(self, ds: "xr.Dataset") -> "dict[str, Callable[..., Figure | None]]":
        """Return name → drawing function, of an optional place, of each figure of a map."""
        return {}

    def figures_of_points(self, ds: "xr.Dataset") -> "dict[str, Callable[..., Figure | None]]":
        """Return name → drawing function of the figures of a map of sampled or listed points."""
        from sweeps.systems.presentation import cloud

        return {"points": partial(cloud.draw, ds, self.system.layout().variables, self.look)}

    def animations(self, ds: "xr.Dataset") -> "dict[str, Callable[[], list[Image]]]":
        """Return name → function that draws the frames of each animation of a map."""
        return {}

    def draws_plainly(self, ds: "xr.Dataset") -> bool:
        """Return True if all figures of a map can be drawn from a plain map, without loading xarray or Numba.

        Then a process that draws loads neither xarray nor Numba (see `sweeps.maps.plain` and `kernels.jit`).
        """
        return False

    def opening(self, ds: "xr.Dataset") -> Opening:
        """Return the initial view of the page of a map."""
        return Opening(at={name: float(ds[name].values.min()) for name in self.least if name in ds.dims})

    def page(self, ds: "xr.Dataset") -> Page:
        """Return the system's part of the page of a map."""
        return self.part if self.part.needs <= set(ds.variables) else Page(question=self.part.question)


PRESENTATION = Presentation
