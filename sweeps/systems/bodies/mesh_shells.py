r"""How the closed surfaces of one mesh lie to each other: side by side, a hollow in a solid, or through one another.

Volume integrals over a mesh add what every surface encloses, with the sign of its sense. That is the body's mass only
where no place is enclosed twice: solids that overlap would count twice, and a solid turned inside out would be taken
off. A point p is enclosed w(p) times,

.. math:: w(p) = \frac{1}{4\pi} \sum_\mathrm{faces} \Omega(p), \qquad
    \tan\frac{\Omega}{2} = \frac{a\cdot(b\times c)}{abc + (a\cdot b)c + (b\cdot c)a + (c\cdot a)b}

with a, b, c from p to a triangle's corners.

Source: van Oosterom and Strackee (1983), IEEE Trans. Biomed. Eng. 30, 125; Jacobson et al. (2013), ACM Trans. Graph.
32(4), 33. Not seen: a surface that runs through itself.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

MOST_PAIRS = 1e8  # of an edge or a point and a triangle, over all surfaces: some ten seconds
MOST_SURFACES = 10_000
LEAST_PAIRS = 2e4  # that a comparison of two surfaces counts for, however small they are
_BLOCK = 2**21  # of them at once: some 200 MB
_TOUCH = 1e-6  # of an edge: coordinates may be of single precision
_INWARDS = 1e-6  # of the mesh: how far inside its surface a face's middle is looked at


@dataclass(frozen=True)
class Arrangement:
    """How closed surfaces lie to each other."""

    turned: tuple[bool, ...]  #: for each surface, whether it looks inwards and is no hollow: to be turned
    twice: tuple[tuple[int, int], ...]  #: pairs of surfaces, by their numbers, that enclose some place twice
    unseen: int  #: pairs that were too large to be compared


def arrangement(surfaces: list[np.ndarray]) -> Arrangement:
    """Compare closed surfaces pair by pair: of each its triangles, shape (faces, 3, 3), of one sense throughout."""
    size = float(np.ptp(np.concatenate([one.reshape(-1, 3) for one in surfaces]), axis=0).max())
    around = [[] for _ in surfaces]  # which others enclose it
    twice, unseen, left = [], 0, MOST_PAIRS
    for one, other in _whose_boxes_meet(surfaces):
        pair = surfaces[one], surfaces[other]
        work = max(8.0 * len(pair[0]) * len(pair[1]), LEAST_PAIRS)
        if work > left:
            unseen += 1
            continue
        left -= work
        if _pierces(*pair) or _pierces(*reversed(pair)):
            twice.append((one, other))
        elif (inner := _inside(*pair, size)).all():
            around[one].append(other)
        elif (outer := _inside(*reversed(pair), size)).all():
            around[other].append(one)
        elif inner.any() or outer.any():
            twice.append((one, other))
    inwards = [_volume(one) < 0 for one in surfaces]
    hollow = [len(outer) % 2 == 1 for outer in around]
    twice += [(k, around[k][0]) for k in range(len(surfaces)) if hollow[k] and not inwards[k]]
    turned = tuple(looks and not is_hollow for looks, is_hollow in zip(inwards, hollow, strict=True))
    return Arrangement(turned, tuple(twice), unseen)


def _volume(triangles: np.ndarray) -> float:
    """Return volume that a closed surface encloses, negative where its faces look inwards."""
    first, second, third = np.moveaxis(triangles - triangles.reshape(-1, 3).mean(axis=0), 1, 0)
    return float(np.einsum("ij,ij->", first, np.cross(second, third)) / 6)


def _whose_boxes_meet(surfaces: list[np.ndarray]) -> Iterator[tuple[int, int]]:
    """Yield the numbers of each two surfaces whose boxes share a volume."""
    low, high = (np.array([end(one, axis=(0, 1)) for one in surfaces]) for end in (np.min, np.max))
    for one in range(len(surfaces)):
        meet = ((low[one] < high) & (low < high[one])).all(axis=1)
        yield from ((one, other) for other in np.flatnonzero(meet).tolist() if other > one)


def _inside(one: np.ndarray, other: np.ndarray, size: float) -> np.ndarray:
    """Return for each face of the one surface whether its middle, a little inside it, is enclosed by the other."""
    normals = np.cross(one[:, 1] - one[:, 0], one[:, 2] - one[:, 0])
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    sense = 1.0 if _volume(one) >= 0 else -1.0
    inwards = -sense * np.divide(normals, lengths, out=np.zeros_like(normals), where=lengths > 0)
    points = one.mean(axis=1) + _INWARDS * size * inwards
    near = ((points > other.min(axis=(0, 1))) & (points < other.max(axis=(0, 1)))).all(axis=1)
    inside = np.zeros(len(points), bool)
    inside[near] = np.abs(_windings(points[near], other)) > 0.5
    return inside


def _windings(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Return how often each point is enclosed, w(p)."""
    windings = np.empty(len(points))
    for part in _parts(len(points), len(triangles)):
        a, b, c = np.moveaxis(triangles[None] - points[part, None, None], 2, 0)
        la, lb, lc = (np.linalg.norm(v, axis=-1) for v in (a, b, c))
        above = np.einsum("ijk,ijk->ij", a, np.cross(b, c))
        below = la * lb * lc + (a * b).sum(-1) * lc + (b * c).sum(-1) * la + (c * a).sum(-1) * lb
        windings[part] = np.arctan2(above, below).sum(axis=1) / (2 * np.pi)
    return windings


def _pierces(one: np.ndarray, other: np.ndarray) -> bool:
    """Return whether an edge of the one surface runs through the inside of a triangle of the other.

    After Moeller and Trumbore (1997), J. Graphics Tools 2, 21. What only touches does not pierce.
    """
    starts, ends = one.reshape(-1, 3), np.roll(one, -1, axis=1).reshape(-1, 3)
    low, high = other.min(axis=(0, 1)), other.max(axis=(0, 1))
    near = ((np.maximum(starts, ends) >= low) & (np.minimum(starts, ends) <= high)).all(axis=1)
    starts, ways = starts[near], (ends - starts)[near]
    for part in _parts(len(starts), len(other)):
        p, d = starts[part, None], ways[part, None]
        e1, e2 = (other[:, 1] - other[:, 0])[None], (other[:, 2] - other[:, 0])[None]
        h, s = np.cross(d, e2), p - other[None, :, 0]
        q = np.cross(s, e1)
        det = (e1 * h).sum(-1)
        with np.errstate(divide="ignore", invalid="ignore"):
            u, v, t = ((s * h).sum(-1) / det, (d * q).sum(-1) / det, (e2 * q).sum(-1) / det)
            within = (u > _TOUCH) & (v > _TOUCH) & (u + v < 1 - _TOUCH)
        if (within & (t > _TOUCH) & (t < 1 - _TOUCH)).any():
            return True
    return False


def _parts(many: int, by: int) -> Iterator[slice]:
    """Return slices of so many rows that each makes a block of bounded size with so many columns."""
    step = max(1, _BLOCK // max(1, by))
    return (slice(i, i + step) for i in range(0, many, step))
