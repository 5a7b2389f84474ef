r"""Draws of a body of uncertain parts, the odds of a spin, and the change of one part that changes its verdict.

A draw multiplies the mass of each part by a log-normal factor of mean 1 with the relative standard deviation of its
tolerance, and moves the part along each coordinate by a normal displacement; each tolerance is independent. As no mass
becomes negative, every draw is a physically possible body. The tensor of each draw is about its own centre of mass.
The spin axis of a draw is its principal axis nearest to the judged axis of the nominal body.

Source: see `sweeps.systems.bodies.parts` and `sweeps.systems.uncertain_bodies.designs`.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from itertools import accumulate
from typing import Any

import numpy as np

from kernels.free import linear
from sweeps.schema.parameters import Strict, key
from sweeps.schema.refusals import validate
from sweeps.systems.bodies import inertia
from sweeps.systems.bodies.parts import Pieces, sum_pieces
from sweeps.systems.uncertain_bodies import designs
from sweeps.systems.uncertain_bodies.possible import ENTRIES
from sweeps.systems.uncertain_bodies.verdict import SpinVerdict, equal_within, judge_draws, make_odds

DRAWS = 2**17  # number of draws without --draws; a probability of 1e-3 is known to some 10 % of itself
SENSITIVITY_DRAWS = 2**10  # draws in each half of the design for sensitivities, which know an index to a few per cent
#: relative changes of a mass, up to ten times and down to none, at which the verdict is computed before it is bisected
MASS_CHANGES = (np.geomspace(1e-4, 9.0, 300), -np.geomspace(1e-4, 1.0 - 1e-9, 250))
PLACE_CHANGES = np.geomspace(1e-5, 10.0, 300)  # displacements over the size of the body, for the same purpose
#: names and unit vectors of the displacements
DIRECTIONS = [
    (sign + name, float(f"{sign}1") * row) for name, row in zip("xyz", np.eye(3), strict=True) for sign in "+-"
]
BISECTIONS = 40  # halvings of a bracket of a few per cent, to beyond the rounding of moments


class DrawSettings(Strict):
    """Number, seed and method of the draws."""

    draws: designs.Draws = key("number of draws", DRAWS)
    seed: designs.Seed = key("seed of the draws", 1)
    method: designs.Method = key(f"sampling: {', '.join(designs.METHODS)}", "sobol")


@dataclass(frozen=True, eq=False)
class UncertainParts:
    """A body of parts with tolerances, and its judged axis."""

    pieces: Pieces
    direction: np.ndarray  #: unit vector of the judged axis, shape (3,)

    @property
    def inputs(self) -> dict[str, tuple[int, ...]]:
        """Name of each uncertain mass or place → its columns of standard normals."""
        names = [
            (f"{name} of {source.part}", width)
            for source in self.pieces.sources
            for name, deviation, width in (("mass", source.mass, 1), ("place", source.place, 3))
            if deviation
        ]
        ends = accumulate(name[1] for name in names)
        return {name: tuple(range(end - width, end)) for (name, width), end in zip(names, ends, strict=True)}

    def draw_tensors(self, normals: np.ndarray) -> np.ndarray:
        """Return the tensors of inertia, kg m2, shape (n, 3, 3), from standard normals, shape (n, columns)."""
        masses = np.repeat(self.pieces.masses[None, :], len(normals), axis=0)
        places = np.repeat(self.pieces.places[None, :], len(normals), axis=0)
        column = 0
        for source, moved in self.pieces.sources.items():
            if source.mass:
                masses[:, moved] *= designs.log_normal_factors(source.mass, normals[:, column, None])
                column += 1
            if source.place:
                places[:, moved] += source.place * normals[:, None, column : column + 3]
                column += 3
        return sum_pieces(masses, places, self.pieces.mean_squares)[2]

    def find_moments(self, tensors: np.ndarray) -> np.ndarray:
        """Return principal moments, kg m2, shape (n, 3), in cyclic order from that about the judged axis."""
        values, vectors = np.linalg.eigh(tensors)
        nearest = np.abs(np.swapaxes(vectors, -1, -2) @ self.direction).argmax(axis=-1)
        return np.take_along_axis(values, (nearest[:, None] + np.arange(3)) % 3, axis=1)

    def relative_rate(self, normals: np.ndarray) -> np.ndarray:
        """Return Ω² over ω₀² about the judged axis of each draw: negative where unstable."""
        moments = equal_within(self.pieces.rounding, self.find_moments(self.draw_tensors(normals)), 1)
        return linear.omega_squared(*moments.T, 1.0, 1)

    def judge(self, tensors: np.ndarray) -> np.ndarray:
        """Return the number among `WORDS_BY_REGIME` of each tensor."""
        return judge_draws(self.find_moments(tensors), 1, self.pieces.rounding)


@np.errstate(all="ignore")  # draws of tolerances beyond all bodies overflow, and are judged as they are
def judge_parts(judged: SpinVerdict, pieces: Pieces, options: Mapping[str, Any]) -> tuple[SpinVerdict, dict | None]:
    """Return the verdict on a body of parts with its margins and odds, and the uncertainty of its tensor for sweeps.

    Without tolerances, there are no odds, and the uncertainty is None.

    Args:
        judged: the verdict on the nominal body.
        pieces: its rigid pieces.
        options: draws, seed and method, None each for the default.
    """
    requested = {name: options[name] for name in DrawSettings.model_fields if options[name] is not None}
    settings = validate(DrawSettings, requested, "body")
    body = UncertainParts(pieces, np.array(judged.direction))
    judged = replace(judged, part_margin=find_part_margins(body))
    if not body.inputs:
        return judged, None
    groups, moments, entries = tuple(body.inputs.values()), [], []
    rows, columns = np.transpose([*ENTRIES.values()])
    draws, seed, method = settings.draws, settings.seed, settings.method
    for normals in designs.iterate_normals(method, sum(map(len, groups)), draws, seed):
        tensors = body.draw_tensors(normals)
        moments.append(body.find_moments(tensors))
        entries.append(tensors[:, rows, columns])
    indices = designs.sobol_indices(body.relative_rate, groups, min(draws, SENSITIVITY_DRAWS), seed, method)
    sensitivity = dict(zip(body.inputs, np.nan_to_num(indices["total"]).tolist(), strict=True))
    odds = make_odds(np.array(moments), 1, pieces.rounding, sensitivity)
    return replace(judged, odds=odds), {"covariance": np.cov(np.concatenate(entries), rowvar=False).tolist()}


# -- margins


def find_part_margins(body: UncertainParts) -> dict[str, dict[str, Any] | None]:
    """Return the smallest change of one part's mass, and of its place along x, y or z, that changes the verdict.

    Masses from none to ten times, and displacements up to ten times the body's size, √(tr T/M), are searched in steps
    of a few per cent; None if no change is found.
    """
    pieces = body.pieces
    margins: dict[str, list[dict[str, Any]]] = {"mass": [], "place": []}
    tensor = sum_pieces(*pieces[:3])[2]
    size, word = math.sqrt(np.trace(tensor) / pieces.masses.sum()), body.judge(tensor[None])[0]
    for part, numbers in pieces.parts.items() if len(pieces.parts) > 1 else ():
        groups = np.array(numbers), np.delete(np.arange(len(pieces.masses)), numbers)
        joined = [np.array(each) for each in zip(*(_join_pieces(pieces, group) for group in groups), strict=True)]
        searches = [("mass", {"part": part}, changes, np.zeros(3)) for changes in MASS_CHANGES]
        searches += [("place", {"part": part, "along": name}, size * PLACE_CHANGES, step) for name, step in DIRECTIONS]
        for name, entry, changes, step in searches:

            def has_changed(values: np.ndarray, joined: list = joined, step: np.ndarray = step) -> np.ndarray:
                """Return for which relative or absolute changes of the part the word differs."""
                masses, places = (np.repeat(each[None], len(values), axis=0) for each in joined[:2])
                masses[:, 0] *= 1.0 if step.any() else 1.0 + values
                places[:, 0] += values[:, None] * step
                return body.judge(sum_pieces(masses, places, joined[2])[2]) != word

            if (change := _first_change(changes, has_changed)) is not None:
                margins[name].append(entry | {"change": change})
    return {name: min(entries, key=lambda each: abs(each["change"]), default=None) for name, entries in margins.items()}


def _join_pieces(pieces: Pieces, numbers: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return mass, centre and mean squares of the coordinates about it, of some pieces as one."""
    mass, centre, tensor = sum_pieces(*(values[numbers] for values in pieces[:3]))
    return mass, centre, inertia.second_moments(tensor) / mass


def _first_change(changes: np.ndarray, has_changed: Callable[[np.ndarray], np.ndarray]) -> float | None:
    """Return the first of ascending sizes of a change for which a predicate is true, bisected; None if it is none."""
    numbers = np.flatnonzero(has_changed(changes))
    if not numbers.size:
        return None
    low, high = (float(each) for each in np.concatenate([[0.0], changes])[numbers[0] : numbers[0] + 2])
    for _halving in range(BISECTIONS):
        middle = (low + high) / 2
        low, high = (low, middle) if has_changed(np.array([middle]))[0] else (middle, high)
    return high
