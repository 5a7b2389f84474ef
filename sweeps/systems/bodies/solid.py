"""The body in moving pictures: a box, or a racket for a flat long body, with exactly the body's ratios of moments.

With unit mass, the mean square of coordinate i over the body is ``S_i = (I_j + I_k - I_i)/2``: any shape that is
stretched along the axes to mean squares S_i has the moments I_i.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

FRONT, BACK, EDGE = (0.835, 0.369, 0.0), (0.0, 0.447, 0.698), (0.69, 0.706, 0.729)
GRIP = (0.43, 0.33, 0.24)
STRING_OPACITY = 0.45  # opacity of the strings
RING = 32  # segments of a racket's frame


class Face(NamedTuple):
    """A flat face of a surface: corners, shape (n, 3), colour, and opacity."""

    corners: np.ndarray
    color: tuple[float, float, float]
    opacity: float = 1.0

    @property
    def normal(self) -> np.ndarray:
        """The outward unit normal, from which the corners are counterclockwise."""
        normal = np.cross(self.corners[1] - self.corners[0], self.corners[2] - self.corners[0])
        return normal / (np.linalg.norm(normal) or 1.0)


def solid(moments: np.ndarray) -> list[Face]:
    """Return the faces of the body in its axes, scaled to a largest distance of 1."""
    squares = np.maximum(moments.sum() - 2.0 * moments, 1e-3 * moments.max())
    squares = squares / squares.max()
    order = np.argsort(-squares, kind="stable")
    is_even = (order[1] - order[0]) % 3 == 1  # an odd permutation of the axes mirrors the shape
    faces = []
    thinnest, middle, longest = np.sort(squares)
    for face in SHAPES["racket" if thinnest < 0.12 * middle and middle < 0.3 * longest else "box"]:
        corners = np.empty_like(face.corners)
        corners[:, order] = face.corners * np.sqrt(squares[order])
        faces.append(face._replace(corners=corners if is_even else corners[::-1]))
    reach = max(np.linalg.norm(face.corners, axis=1).max() for face in faces)
    return [face._replace(corners=face.corners / reach) for face in faces]


def of_mesh(vertices: Sequence[int], triangles: Sequence[int]) -> list[Face]:
    """Return the faces of a surface from three coordinates of each vertex and three numbers of each triangle."""
    corners = np.reshape(np.asarray(vertices, float), (-1, 3))[np.reshape(triangles, (-1, 3))]
    return [Face(triangle, EDGE) for triangle in corners / np.linalg.norm(corners, axis=2).max()]


def _box() -> list[Face]:
    """Return six faces of a uniform box; the two broad ones differ in colour, which shows a flip."""
    faces, square = [], np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    for k in range(3):
        for sign in (1.0, -1.0):
            corners = np.roll(np.insert(square, 0, sign, axis=1), k, axis=1)
            color = (FRONT if sign > 0 else BACK) if k == 2 else EDGE
            faces.append(Face(np.sqrt(3.0) * (corners if sign > 0 else corners[::-1]), color))
    return faces


def _racket_outline() -> tuple[np.ndarray, np.ndarray]:
    """Return a racket's frame (n, 4, 2) and handle (4, 2): handle along x, counterclockwise from above."""
    angle = 2.0 * np.pi * np.arange(RING + 1) / RING
    edge = np.stack([1.05 * np.cos(angle), 0.8 * np.sin(angle)], axis=1)
    middle = np.array([0.55, 0.0])
    inner, outer = middle + 0.84 * edge, middle + edge
    handle = np.array([[-2.3, -0.13], [-0.46, -0.1], [-0.46, 0.1], [-2.3, 0.13]])
    return np.stack([inner[:-1], outer[:-1], outer[1:], inner[1:]], axis=1), handle


def _plane_moments(quadrilaterals: np.ndarray) -> tuple[float, float, float]:
    """Return mean x, mean square of x about it and of y, over quadrilaterals (n, 4, 2)."""
    triangles = np.concatenate([quadrilaterals[:, [0, 1, 2]], quadrilaterals[:, [0, 2, 3]]])
    u, v, w = triangles.transpose(1, 0, 2)
    area = 0.5 * ((v - u)[:, 0] * (w - u)[:, 1] - (w - u)[:, 0] * (v - u)[:, 1])
    weights = area / area.sum()
    mean = weights @ (u + v + w) / 3.0
    squares = weights @ (u * u + v * v + w * w + u * v + v * w + w * u) / 6.0
    return mean[0], squares[0] - mean[0] ** 2, squares[1]


def _racket() -> list[Face]:
    """Return the racket: handle along the longest direction, thickness along the shortest; strings without mass."""
    ring, handle = _racket_outline()
    middle, xx, yy = _plane_moments(np.concatenate([ring, handle[None]]))

    def in_space(points, side):
        flat = np.column_stack([points[:, 0] - middle, points[:, 1], np.full(len(points), side)])
        return flat / np.sqrt([xx, yy, 1.0 / 3.0])

    faces = []
    for polygon, top_color, bottom_color, sides in (
        *((polygon, FRONT, BACK, ((1, 2), (3, 0))) for polygon in ring),
        (handle, GRIP, tuple(0.75 * x for x in GRIP), ((0, 1), (1, 2), (2, 3), (3, 0))),
    ):
        top, bottom = in_space(polygon, 1.0), in_space(polygon, -1.0)
        faces += [Face(top, top_color), Face(bottom[::-1], bottom_color)]
        faces += [Face(np.stack([top[k], bottom[k], bottom[j], top[j]]), EDGE) for k, j in sides]
    top_color, bottom_color = in_space(ring[:, 0], 0.02), in_space(ring[:, 0], -0.02)[::-1]
    return [*faces, Face(top_color, FRONT, STRING_OPACITY), Face(bottom_color, BACK, STRING_OPACITY)]


#: shapes with unit mean square along each direction: the longest, the middle and the shortest.
SHAPES = {"box": _box(), "racket": _racket()}


def for_scripts() -> dict[str, list]:
    """Return the shapes for a page's scripts: colour (up to 255), opacity and corners of each face."""
    return {
        name: [
            ([round(255 * x) for x in color], opacity, corners.round(3).tolist()) for corners, color, opacity in faces
        ]
        for name, faces in SHAPES.items()
    }
