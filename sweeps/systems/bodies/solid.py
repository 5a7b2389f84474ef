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
    """A flat piece of a surface: its corners (n, 3), colour, and how much it hides what is behind."""

    corners: np.ndarray
    color: tuple[float, float, float]
    veil: float = 1.0

    @property
    def normal(self) -> np.ndarray:
        """The direction in which it looks: its corners are seen counterclockwise from there."""
        normal = np.cross(self.corners[1] - self.corners[0], self.corners[2] - self.corners[0])
        return normal / (np.linalg.norm(normal) or 1.0)


def solid(moments: np.ndarray) -> list[Face]:
    """Return the faces of the body in its axes, its farthest corner at distance one."""
    squares = np.maximum(moments.sum() - 2.0 * moments, 1e-3 * moments.max())
    squares = squares / squares.max()
    order = np.argsort(-squares, kind="stable")
    is_even = (order[1] - order[0]) % 3 == 1  # an odd order of the axes mirrors the shape
    placed = []
    thin, wide, long = np.sort(squares)
    for face in SHAPES["racket" if thin < 0.12 * wide and wide < 0.3 * long else "box"]:
        corners = np.empty_like(face.corners)
        corners[:, order] = face.corners * np.sqrt(squares[order])
        placed.append(face._replace(corners=corners if is_even else corners[::-1]))
    reach = max(np.linalg.norm(face.corners, axis=1).max() for face in placed)
    return [face._replace(corners=face.corners / reach) for face in placed]


def of_mesh(vertices: Sequence[int], triangles: Sequence[int]) -> list[Face]:
    """Return the faces of a surface from three coordinates of each vertex and three numbers of each triangle."""
    corners = np.reshape(np.asarray(vertices, float), (-1, 3))[np.reshape(triangles, (-1, 3))]
    return [Face(one, EDGE) for one in corners / np.linalg.norm(corners, axis=2).max()]


def _box() -> list[Face]:
    """Return six faces of a uniform box; the two broad ones differ, so that a flip is seen."""
    faces, square = [], np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    for k in range(3):
        for sign in (1.0, -1.0):
            corners = np.roll(np.insert(square, 0, sign, axis=1), k, axis=1)
            color = (FRONT if sign > 0 else BACK) if k == 2 else EDGE
            faces.append(Face(np.sqrt(3.0) * (corners if sign > 0 else corners[::-1]), color))
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


def _racket() -> list[Face]:
    """Return the racket: its handle along the longest direction, its face across the shortest; strings without mass."""
    ring, handle = _outline()
    middle, xx, yy = _plane_moments(np.concatenate([ring, handle[None]]))

    def placed(points, side):
        flat = np.column_stack([points[:, 0] - middle, points[:, 1], np.full(len(points), side)])
        return flat / np.sqrt([xx, yy, 1.0 / 3.0])

    faces = []
    for part, above, below, sides in (
        *((part, FRONT, BACK, ((1, 2), (3, 0))) for part in ring),
        (handle, GRIP, tuple(0.75 * x for x in GRIP), ((0, 1), (1, 2), (2, 3), (3, 0))),
    ):
        top, bottom = placed(part, 1.0), placed(part, -1.0)
        faces += [Face(top, above), Face(bottom[::-1], below)]
        faces += [Face(np.stack([top[k], bottom[k], bottom[j], top[j]]), EDGE) for k, j in sides]
    above, below = placed(ring[:, 0], 0.02), placed(ring[:, 0], -0.02)[::-1]
    return [*faces, Face(above, FRONT, STRINGS), Face(below, BACK, STRINGS)]


#: shapes with a mean square of one along each direction: the longest, the middle and the shortest.
SHAPES = {"box": _box(), "racket": _racket()}


def for_scripts() -> dict[str, list]:
    """Return the shapes as a page's scripts take them: of each face its colour (to 255), veil and corners."""
    return {
        name: [([round(255 * x) for x in color], veil, corners.round(3).tolist()) for corners, color, veil in faces]
        for name, faces in SHAPES.items()
    }
