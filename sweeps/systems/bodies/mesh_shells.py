r"""Arrangement of the closed surfaces of a mesh: side by side, a cavity in a solid, or intersecting.

Volume integrals over a mesh add the volume inside every surface, with the sign of its orientation. They give the body's
mass only if no point is enclosed twice: overlapping solids would count twice, and a solid with inward normals would be
subtracted. A point p is enclosed w(p) times,

.. math:: w(p) = \frac{1}{4\pi} \sum_\mathrm{faces} \Omega(p), \qquad
    \tan\frac{\Omega}{2} = \frac{a\cdot(b\times c)}{abc + (a\cdot b)c + (b\cdot c)a + (c\cdot a)b}

with a, b, c from p to a triangle's corners.

Source: van Oosterom and Strackee (1983), IEEE Trans. Biomed. Eng. 30, 125; Jacobson et al. (2013), ACM Trans. Graph.
32(4), 33. Surfaces that intersect themselves are not detected.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

MAX_PAIRS = 1e8  # tests of an edge or a point against a triangle, over all surfaces; they take some ten seconds
MAX_SURFACES = 10_000  # surfaces, whose pairs of boxes are compared
MIN_PAIRS = 2e4  # tests that a comparison of two surfaces counts for at least, by its overhead
_BLOCK_PAIRS = 2**21  # tests at a time, some 200 MB
_TOUCH = 1e-6  # relative to an edge; closer points touch, as coordinates may be of single precision
_DEPTH = 1e-6  # depth of a face's test point below the surface, relative to the mesh


@dataclass(frozen=True)
class Arrangement:
    """Arrangement of closed surfaces."""

    to_invert: tuple[bool, ...]  #: True for a surface with inward normals that is no cavity and must be inverted
    overlaps: tuple[tuple[int, int], ...]  #: pairs of surfaces, by their numbers, that enclose some point twice
    num_skipped: int  #: number of pairs that were too large to be compared


def arrange(surfaces: list[np.ndarray]) -> Arrangement:
    """Compare closed surfaces pair by pair; each is an array of triangles of one orientation, shape (faces, 3, 3)."""
    size = float(np.ptp(np.concatenate([surface.reshape(-1, 3) for surface in surfaces]), axis=0).max())
    enclosers = [[] for _ in surfaces]  # numbers of the surfaces that enclose each one
    overlaps, num_skipped, remaining_pairs = [], 0, MAX_PAIRS
    for first, second in _overlapping_boxes(surfaces):
        pair = surfaces[first], surfaces[second]
        num_pairs = max(8.0 * len(pair[0]) * len(pair[1]), MIN_PAIRS)
        if num_pairs > remaining_pairs:
            num_skipped += 1
            continue
        remaining_pairs -= num_pairs
        if _pierces(*pair) or _pierces(*reversed(pair)):
            overlaps.append((first, second))
        elif (first_inside := _faces_inside(*pair, size)).all():
            enclosers[first].append(second)
        elif (second_inside := _faces_inside(*reversed(pair), size)).all():
            enclosers[second].append(first)
        elif first_inside.any() or second_inside.any():
            overlaps.append((first, second))
    has_inward_normals = [_volume(surface) < 0 for surface in surfaces]
    is_cavity = [len(outer) % 2 == 1 for outer in enclosers]
    overlaps += [(k, enclosers[k][0]) for k in range(len(surfaces)) if is_cavity[k] and not has_inward_normals[k]]
    to_invert = tuple(inward and not cavity for inward, cavity in zip(has_inward_normals, is_cavity, strict=True))
    return Arrangement(to_invert, tuple(overlaps), num_skipped)


def _volume(triangles: np.ndarray) -> float:
    """Return the volume that a closed surface encloses, negative for inward normals."""
    first, second, third = np.moveaxis(triangles - triangles.reshape(-1, 3).mean(axis=0), 1, 0)
    return float(np.einsum("ij,ij->", first, np.cross(second, third)) / 6)


def _overlapping_boxes(surfaces: list[np.ndarray]) -> Iterator[tuple[int, int]]:
    """Yield the numbers of each two surfaces with overlapping bounding boxes."""
    low, high = (np.array([extremum(surface, axis=(0, 1)) for surface in surfaces]) for extremum in (np.min, np.max))
    for first in range(len(surfaces)):
        meet = ((low[first] < high) & (low < high[first])).all(axis=1)
        yield from ((first, second) for second in np.flatnonzero(meet).tolist() if second > first)


def _faces_inside(surface: np.ndarray, solid: np.ndarray, size: float) -> np.ndarray:
    """Return for each face of `surface` whether its centre, moved slightly inwards, is enclosed by `solid`."""
    normals = np.cross(surface[:, 1] - surface[:, 0], surface[:, 2] - surface[:, 0])
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    orientation = 1.0 if _volume(surface) >= 0 else -1.0
    inwards = -orientation * np.divide(normals, lengths, out=np.zeros_like(normals), where=lengths > 0)
    points = surface.mean(axis=1) + _DEPTH * size * inwards
    in_box = ((points > solid.min(axis=(0, 1))) & (points < solid.max(axis=(0, 1)))).all(axis=1)
    inside = np.zeros(len(points), bool)
    inside[in_box] = np.abs(_winding_numbers(points[in_box], solid)) > 0.5
    return inside


def _winding_numbers(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Return the winding number w(p) of each point."""
    windings = np.empty(len(points))
    for block in _row_blocks(len(points), len(triangles)):
        a, b, c = np.moveaxis(triangles[None] - points[block, None, None], 2, 0)
        la, lb, lc = (np.linalg.norm(v, axis=-1) for v in (a, b, c))
        numerator = np.einsum("ijk,ijk->ij", a, np.cross(b, c))
        denominator = la * lb * lc + (a * b).sum(-1) * lc + (b * c).sum(-1) * la + (c * a).sum(-1) * lb
        windings[block] = np.arctan2(numerator, denominator).sum(axis=1) / (2 * np.pi)
    return windings


def _pierces(surface: np.ndarray, target: np.ndarray) -> bool:
    """Return True if an edge of `surface` crosses the interior of a triangle of `target`, and does not only touch it.

    After Moeller and Trumbore (1997), J. Graphics Tools 2, 21.
    """
    starts, ends = surface.reshape(-1, 3), np.roll(surface, -1, axis=1).reshape(-1, 3)
    low, high = target.min(axis=(0, 1)), target.max(axis=(0, 1))
    in_box = ((np.maximum(starts, ends) >= low) & (np.minimum(starts, ends) <= high)).all(axis=1)
    starts, directions = starts[in_box], (ends - starts)[in_box]
    for block in _row_blocks(len(starts), len(target)):
        p, d = starts[block, None], directions[block, None]
        e1, e2 = (target[:, 1] - target[:, 0])[None], (target[:, 2] - target[:, 0])[None]
        h, s = np.cross(d, e2), p - target[None, :, 0]
        q = np.cross(s, e1)
        det = (e1 * h).sum(-1)
        with np.errstate(divide="ignore", invalid="ignore"):
            u, v, t = ((s * h).sum(-1) / det, (d * q).sum(-1) / det, (e2 * q).sum(-1) / det)
            in_triangle = (u > _TOUCH) & (v > _TOUCH) & (u + v < 1 - _TOUCH)
        if (in_triangle & (t > _TOUCH) & (t < 1 - _TOUCH)).any():
            return True
    return False


def _row_blocks(num_rows: int, num_columns: int) -> Iterator[slice]:
    """Return slices of `num_rows` such that a block of each with `num_columns` has at most `_BLOCK_PAIRS` entries."""
    step = max(1, _BLOCK_PAIRS // max(1, num_columns))
    return (slice(i, i + step) for i in range(0, num_rows, step))
