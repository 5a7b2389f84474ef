"""Sentences of maps as titles; and sections along one parameter and measured thresholds, from which they are made."""

from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np

from sweeps import systems
from sweeps.schema.datasets import DataArray, Dataset

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
    """A sentence with the values of a parameter at which a smooth measured quantity is zero."""

    words: str  #: format string of {first} and {last} of these values, and of the map's coordinates by name
    along: str  #: the parameter
    quantity: str | Callable[[Dataset], DataArray]  #: a measured variable, or a function of a section
    places: Mapping[str, object]  #: dimension → value of each further parameter; the nearest grid value is used

    def __call__(self, dataset: Dataset) -> str:
        """Return the sentence of a map."""
        line = section(dataset, **self.places)
        values = line[self.quantity] if isinstance(self.quantity, str) else self.quantity(line)
        limits = zeros(line[self.along], values)
        coordinates = {str(name): value.item() for name, value in line.coords.items() if not value.ndim}
        return self.words.format(first=limits[0], last=limits[-1], **coordinates)


def squared_rate(line: Dataset) -> DataArray:
    """Return the square of a section's first rate, s-2: positive for growth, negative for an oscillation."""
    names = ("exponent_real", "exponent_imag") if "exponent_real" in line else ("eigenvalue_real", "eigenvalue_imag")
    return line[names[0]] ** 2 - line[names[1]] ** 2
