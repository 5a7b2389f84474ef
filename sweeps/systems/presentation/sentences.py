"""Sentences of maps as titles; and sections along one parameter and measured thresholds, from which they are made."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from sweeps import systems
from sweeps.schema.datasets import Dataset

MIN_VALUES = 8  # values of a section; with fewer a zero of their spline may be wrong in the printed digits
SINGLE = ("eigenvalue", "multiplier", "epsilon", "phase")  # dimensions of which a section has the first value


def head_texts(dataset: Dataset, title: str = "", words: str = "") -> tuple[str, str]:
    """Return title and subtitle of a figure: the sentence of its map, and the map's title.

    Args:
        dataset: the map.
        title: of the figure, if the map has no sentence; "" for the map's title.
        words: further lines of the subtitle.
    """
    map_title = str(dataset.attrs.get("title", ""))
    title = systems.presentation_of(dataset).sentence(dataset) or title or map_title
    return title, "\n".join(filter(None, [map_title if title != map_title else "", words]))


def section(dataset: Dataset, **places: object) -> Dataset:
    """Return a map at the grid values nearest to `places`, and at one value of each dimension of length one."""
    words = {name: value for name, value in places.items() if isinstance(value, str)}
    numbers = {name: value for name, value in places.items() if name not in words}
    section = dataset.sel(words).sel(numbers, method="nearest")
    return section.isel({name: 0 for name in SINGLE if name in section.dims}).squeeze()


def zeros(places, values) -> np.ndarray:
    """Return the places of the zeros of measured values, ascending, by a cubic spline; missing values are left out.

    With fewer than `MIN_VALUES` values it has no zeros.

    Args:
        places: values of a parameter, in any order, shape (n,).
        values: of a smooth function of it, shape (n,).
    """
    from scipy.interpolate import CubicSpline

    order = np.argsort(places)
    places, values = np.asarray(places, float)[order], np.asarray(values, float)[order]
    is_known = np.isfinite(values)
    if np.count_nonzero(is_known) < MIN_VALUES:
        return np.empty(0)
    return CubicSpline(places[is_known], values[is_known]).roots(extrapolate=False)


class Threshold(NamedTuple):
    """A sentence with the value of a parameter at which a smooth measured variable passes a level."""

    words: str  #: format string of {limit} and of coordinates by name
    along: str  #: the parameter
    variable: str  #: the measured variable
    places: Mapping[str, object]  #: dimension → value of each further parameter; the nearest grid value is used
    level: float = 0.0  #: of the variable
    order: int = -1  #: 0 for the first passage, -1 for the last one

    def __call__(self, dataset: Dataset) -> str:
        """Return the sentence of a map."""
        line = section(dataset, **self.places)
        limit = zeros(line[self.along], line[self.variable] - self.level)[self.order]
        values = {str(name): value.item() for name, value in line.coords.items() if not value.ndim}
        return self.words.format(limit=limit, **values)
