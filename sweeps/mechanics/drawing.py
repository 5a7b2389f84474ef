"""Shapes of the pictures of described systems (`System.draw`): lists of points."""

import numpy as np
import sympy as sp


def circle(radius=1.0, corners=36) -> list[tuple]:
    """Return the points of a closed circle about 0 in a plane, by its `radius` and number of `corners`."""
    angles = 2 * np.pi * np.arange(corners + 1) / corners
    places = np.column_stack([np.cos(angles), np.sin(angles)]).round(6) + 0.0  # no negative zeros
    return [(radius * c, radius * s) for c, s in places.tolist()]


def spring(start, end, width) -> list[tuple]:
    """Return the points of a spring of six turns along x from `start` to `end`, of half `width`."""
    share = np.linspace(0.1, 0.9, 13)
    middle = [(start + (end - start) * s, width * (-1) ** k) for k, s in enumerate(share.round(3).tolist())]
    return [(start, 0), (start + (end - start) * 0.08, 0), *middle, (start + (end - start) * 0.92, 0), (end, 0)]


def box(half, rotation=None) -> list[list]:
    """Return the six faces of a box of these half edges, rotated by a matrix."""
    quarter = [(1, 1), (-1, 1), (-1, -1), (1, -1)]
    faces = []
    for k in range(3):
        for side in (1, -1):
            corners = [np.roll((side, u, v), k) * half for u, v in (quarter if side > 0 else quarter[::-1])]
            faces.append([_rotate_point(rotation, corner) for corner in corners])
    return faces


def cylinder(radius, low, high, rotation, tip=None) -> list[list]:
    """Return the faces of a cylinder or a cone of 16 sides about axis 3, rotated by a matrix.

    Args:
        radius: radius at the high end.
        low: low end along axis 3.
        high: high end.
        rotation: rotation matrix; None for none.
        tip: radius at the low end; by default `radius`.
    """
    rim = circle(corners=16)
    ends = [[(r * x, r * y, z) for x, y in rim] for r, z in ((radius if tip is None else tip, low), (radius, high))]
    sides = [[ends[0][k], ends[0][k + 1], ends[1][k + 1], ends[1][k]] for k in range(16)]
    return [[_rotate_point(rotation, p) for p in face] for face in (*sides, ends[1][:-1], ends[0][-1:0:-1])]


def shaft(x, y, angle, flat=1.0) -> dict[str, list]:
    """Return a disc at (`x`, `y`) on a bent shaft along axis 1, with a mark at `angle`; `flat` makes it oval."""
    c, s = sp.cos(angle), sp.sin(angle)
    rim = [(0, x + u * c - flat * v * s, y + u * s + flat * v * c) for u, v in circle(0.6, corners=24)]
    curve = [(1.3 * k, x * (1 - k * k), y * (1 - k * k)) for k in np.linspace(-1, 1, 13).round(3).tolist()]
    return {"face": rim[:-1], "line": curve, "mark": [(0, x, y), rim[0]]}


def satellite(moments, roll, pitch, yaw) -> list[tuple]:
    """Return kind, points and label of the parts of a satellite in its orbit's axes, above the Earth.

    Args:
        moments: moments of inertia about the roll, pitch and yaw axes.
        roll: first angle from the orbit's axes to the body's, rad.
        pitch: second angle, rad.
        yaw: third angle, rad.
    """
    body = sp.rot_axis1(roll) * sp.rot_axis2(pitch) * sp.rot_axis3(yaw)  # from the orbit's axes to the body's
    rotation = sp.Matrix.diag(1, -1, -1) * body.T
    total = sum(moments)
    half = [sp.sqrt(abs(total - 2 * moment)) / 2 + 0.05 for moment in moments]
    axes = [("roll", (half[0] + 0.3, 0, 0)), ("yaw", (0, 0, half[2] + 0.3))]
    return [
        *(("face", face) for face in box(half, rotation)),
        *(("mass", [_rotate_point(rotation, tip)], label) for label, tip in axes),
        *(("line", [(0, 0, 0), end], label) for label, end in (("Earth", (0, 0, -1.5)), ("orbit", (1.5, 0, 0)))),
    ]


def _rotate_point(rotation, point) -> tuple:
    """Return the coordinates of a point after a rotation; unchanged if there is none."""
    return tuple(point) if rotation is None else tuple(rotation * sp.Matrix(point))
