"""The body that turns in pictures: a box, or for a flat long one a racket, with exactly the body's ratios of moments.

With unit mass, the mean square of coordinate i over the body is ``S_i = (I_j + I_k - I_i)/2``: any shape, stretched
along the axes until its own mean squares are S_i, has the moments I_i.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

FRONT, BACK, EDGE = (0.835, 0.369, 0.0), (0.0, 0.447, 0.698), (0.69, 0.706, 0.729)
GRIP = (0.43, 0.33, 0.24)
STRINGS = 0.45  # how much of the bed's colour is seen
RING = 32  # pieces of a racket's frame


class Face(NamedTuple):
    """A flat piece of a surface, in body axes: corners (n, 3), normal, colour, and how much hides what is behind."""

    corners: np.ndarray
    normal: np.ndarray
    color: tuple[float, float, float]
    veil: float = 1.0


def mean_squares(moments: np.ndarray) -> np.ndarray:
    """Return S_i in units of the largest, at least a thousandth of it."""
    squares = np.maximum(moments.sum() - 2.0 * moments, 1e-3 * moments.max())
    return squares / squares.max()


def looks_like_racket(squares: np.ndarray) -> bool:
    """Return True if the body is flat and long like a racket."""
    thin, wide, long = np.sort(squares)
    return bool(thin < 0.12 * wide and wide < 0.3 * long)


def solid(moments: np.ndarray) -> list[Face]:
    """Return the faces of the body, its farthest corner at distance one."""
    squares = mean_squares(moments)
    faces = _racket(squares) if looks_like_racket(squares) else _box(squares)
    reach = max(np.linalg.norm(face.corners, axis=1).max() for face in faces)
    return [face._replace(corners=face.corners / reach) for face in faces]


def of_mesh(vertices: Sequence[int], triangles: Sequence[int]) -> list[Face]:
    """Return the faces of a surface from three coordinates of each vertex and three numbers of each triangle."""
    corners = np.reshape(np.asarray(vertices, float), (-1, 3))[np.reshape(triangles, (-1, 3))]
    reach = np.linalg.norm(corners, axis=2).max()
    return [_face(one / reach, EDGE) for one in corners]


def _face(corners, color, veil: float = 1.0) -> Face:
    corners = np.asarray(corners, dtype=float)
    normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
    return Face(corners, normal / (np.linalg.norm(normal) or 1.0), color, veil)


def _box(squares: np.ndarray) -> list[Face]:
    """Return six faces of a uniform box; the two broad ones differ, so that a flip is seen."""
    half, thin, faces = np.sqrt(3.0 * squares), int(np.argmin(squares)), []
    for k in range(3):
        for sign in (1.0, -1.0):
            corners = np.zeros((4, 3))
            corners[:, k] = sign
            corners[:, (k + 1) % 3] = [-1.0, 1.0, 1.0, -1.0]
            corners[:, (k + 2) % 3] = [-1.0, -1.0, 1.0, 1.0]
            color = (FRONT if sign > 0 else BACK) if k == thin else EDGE
            faces.append(_face((corners if sign > 0 else corners[::-1]) * half, color))
    return faces


def _outline() -> tuple[np.ndarray, np.ndarray]:
    """Return a racket's frame (n, 4, 2) and handle (4, 2): handle along x, seen from above counterclockwise."""
    angle = 2.0 * np.pi * np.arange(RING + 1) / RING
    edge = np.stack([1.05 * np.cos(angle), 0.8 * np.sin(angle)], axis=1)
    middle = np.array([0.55, 0.0])
    inner, outer = middle + 0.84 * edge, middle + edge
    handle = np.array([[-2.3, -0.13], [-0.46, -0.1], [-0.46, 0.1], [-2.3, 0.13]])
    return np.stack([inner[:-1], outer[:-1], outer[1:], inner[1:]], axis=1), handle


def _plane_moments(parts: np.ndarray) -> tuple[float, float, float]:
    """Return mean x, mean square of x about it and of y, over quadrilaterals (n, 4, 2)."""
    triangles = np.concatenate([parts[:, [0, 1, 2]], parts[:, [0, 2, 3]]])
    u, v, w = triangles.transpose(1, 0, 2)
    area = 0.5 * ((v - u)[:, 0] * (w - u)[:, 1] - (w - u)[:, 0] * (v - u)[:, 1])
    share = area / area.sum()
    mean = share @ (u + v + w) / 3.0
    squares = share @ (u * u + v * v + w * w + u * v + v * w + w * u) / 6.0
    return mean[0], squares[0] - mean[0] ** 2, squares[1]


def _racket(squares: np.ndarray) -> list[Face]:
    """Return the racket: its handle along the longest direction, its face across the shortest; strings without mass."""
    ring, handle = _outline()
    middle, xx, yy = _plane_moments(np.concatenate([ring, handle[None]]))
    order = np.argsort(-squares)
    stretch = np.sqrt([squares[order[0]] / xx, squares[order[1]] / yy, 3.0 * squares[order[2]]])
    even = (order[1] - order[0]) % 3 == 1  # an odd order of the axes mirrors the outline

    def placed(points, side):
        flat = np.column_stack([points[:, 0] - middle, points[:, 1], np.full(len(points), side)]) * stretch
        mesh = np.empty_like(flat)
        mesh[:, order] = flat
        return mesh

    def face(corners, color, veil=1.0):
        return _face(corners if even else corners[::-1], color, veil)

    faces = []
    for part, above, below, sides in (
        *((part, FRONT, BACK, ((1, 2), (3, 0))) for part in ring),
        (handle, GRIP, tuple(0.75 * x for x in GRIP), ((0, 1), (1, 2), (2, 3), (3, 0))),
    ):
        top, bottom = placed(part, 1.0), placed(part, -1.0)
        faces += [face(top, above), face(bottom[::-1], below)]
        faces += [face(np.stack([top[k], bottom[k], bottom[j], top[j]]), EDGE) for k, j in sides]
    bed = ring[:, 0]
    return [*faces, face(placed(bed, 0.02), FRONT, STRINGS), face(placed(bed, -0.02)[::-1], BACK, STRINGS)]
