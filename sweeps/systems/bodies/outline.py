"""A mesh's surface with few faces, for pictures: made where the mesh is read, and carried by the map.

A map that names a file never makes it read, so what its page turns must be in the map itself: the attribute `outlines`,
some 25 kB of text for 2,000 faces.

Source of the simplification: Rossignac and Borrel, Multi-resolution 3D approximations for rendering complex scenes
(1993): vertices of one cell of a lattice become one, and faces that are left without area go.
"""

import base64
import binascii
import json
from collections.abc import Mapping

import numpy as np

from sweeps.schema.refusals import MapError

MOST_FACES = 2000  # of all bodies of a map together
LEAST_FACES = 200  # of one body: those beyond ten are drawn as boxes
LATTICES = (128, 108, 90, 76, 64, 54, 45, 38, 32, 27, 23, 19, 16, 13, 11, 9, 7, 5)  # cells along the longest edge
WHOLE = 32767  # a coordinate of one, as a number of 16 bits


def simplified(vertices: np.ndarray, faces: np.ndarray, most: int = MOST_FACES) -> tuple[np.ndarray, np.ndarray]:
    """Return a surface simplified to at most so many faces; as it is given where they are few enough.

    Vertices have shape (n, 3); faces (m, 3), indices of vertices counterclockwise seen from outside, also of what is
    returned.
    """
    if len(faces) <= most and len(vertices) < 2**16:
        return vertices, faces
    low, edge = vertices.min(axis=0), float(np.ptp(vertices, axis=0).max())
    for cells in LATTICES:
        place = np.minimum((vertices - low) * (cells / edge), cells - 1).astype(np.int64)
        _, cell = np.unique(place @ (1, cells, cells * cells), return_inverse=True)
        moved = cell[faces]
        left = moved[(moved != np.roll(moved, 1, axis=1)).all(axis=1)]
        turn = (np.arange(3) + left.argmin(axis=1)[:, None]) % 3  # the least index first, the sense as it was
        left = np.unique(np.take_along_axis(left, turn, axis=1), axis=0)
        if len(left) <= most:
            break
    counts = np.bincount(cell)
    means = np.stack([np.bincount(cell, vertices[:, k]) / counts for k in range(3)], axis=1)
    used, numbers = np.unique(left, return_inverse=True)
    return means[used], numbers.reshape(left.shape)


def packed(vertices: np.ndarray, faces: np.ndarray) -> str:
    """Return a surface as base64 of the number of vertices, the vertices and the faces, 16 bits each."""
    scaled = np.rint(vertices * (WHOLE / np.linalg.norm(vertices, axis=1).max())).astype("<i2")
    parts = np.array([len(scaled)], "<u2"), scaled, faces.astype("<u2")
    return base64.b64encode(b"".join(part.tobytes() for part in parts)).decode("ascii")


def unpacked(text: str) -> dict[str, list[int]] | None:
    """Return the surface in a text, {"vertices": x, y, z of each, "faces": three indices of each}; None without one."""
    try:
        raw = np.frombuffer(base64.b64decode(text, validate=True), "<u2")
    except (ValueError, binascii.Error):
        return None
    many = int(raw[0]) if raw.size else 0
    corners, faces = raw[1 : 1 + 3 * many].view("<i2"), raw[1 + 3 * many :]
    sound = corners.size == 3 * many > 0 and 0 < faces.size <= 3 * MOST_FACES and faces.size % 3 == 0
    if not sound or faces.max() >= many:
        return None
    return {"vertices": corners.tolist(), "faces": faces.tolist()}


def written(surfaces: Mapping[str, tuple[np.ndarray, np.ndarray]]) -> str:
    """Return the surfaces of a map's bodies as its attribute `outlines`, with at most so many faces; "" without one."""
    drawn = dict(list(surfaces.items())[: MOST_FACES // LEAST_FACES])
    left, texts = MOST_FACES, {}
    few_first = sorted(drawn, key=lambda name: len(drawn[name][1]))  # they leave more to others
    for number, name in enumerate(few_first):
        vertices, faces = simplified(*drawn[name], left // (len(drawn) - number))
        texts[name], left = packed(vertices, faces), left - len(faces)
    return json.dumps(texts) if texts else ""


def read(attributes: Mapping) -> dict[str, dict[str, list[int]]]:
    """Return body → surface for the complete surfaces of a map; invalid ones are left out.

    Raises:
        MapError: if the attribute is nested too deeply to be read.
    """
    try:
        texts = json.loads(str(attributes.get("outlines", "") or "{}"))
    except ValueError:
        return {}
    except RecursionError:
        raise MapError("outlines: is nested too deeply; allowed: a text for each body, as Polhode writes it") from None
    texts = texts if isinstance(texts, dict) else {}
    return {name: surface for name, text in texts.items() if isinstance(text, str) and (surface := unpacked(text))}
