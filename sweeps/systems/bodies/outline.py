"""A mesh's surface with few faces, for pictures: simplified when the mesh is read, and stored in the map.

Files that a map names are never read, so the surface that its page draws is in the map itself: the attribute
`outlines`, some 25 kB of text for 2,000 faces.

Source of the simplification: Rossignac and Borrel, Multi-resolution 3D approximations for rendering complex scenes
(1993): vertices of one cell of a lattice become one, and faces without area are removed.
"""

import base64
import binascii
import json
from collections.abc import Mapping

import numpy as np

from sweeps.schema.refusals import MapError

MAX_FACES = 2000  # faces of all bodies of a map together, some 25 kB of text
MIN_BODY_FACES = 200  # faces of one body; so ten bodies have outlines, and further ones are drawn as boxes
LATTICE_CELLS = (128, 108, 90, 76, 64, 54, 45, 38, 32, 27, 23, 19, 16, 13, 11, 9, 7, 5)  # cells along the longest edge
COORDINATE_SCALE = 32767  # number of 16 bits that represents the largest distance of a vertex


def simplify(vertices: np.ndarray, faces: np.ndarray, max_faces: int = MAX_FACES) -> tuple[np.ndarray, np.ndarray]:
    """Return a surface of at most `max_faces` faces: vertices within a cell of a lattice become their mean.

    A surface with no more faces, and fewer than 2^16 vertices, is returned as it is.

    Args:
        vertices: coordinates, shape (n, 3).
        faces: indices of vertices, counterclockwise seen from outside, shape (m, 3); so are the returned ones.
        max_faces: largest number of returned faces.
    """
    if len(faces) <= max_faces and len(vertices) < 2**16:
        return vertices, faces
    low, edge = vertices.min(axis=0), float(np.ptp(vertices, axis=0).max())
    for cells in LATTICE_CELLS:
        place = np.minimum((vertices - low) * (cells / edge), cells - 1).astype(np.int64)
        _, cell = np.unique(place @ (1, cells, cells * cells), return_inverse=True)
        cell_faces = cell[faces]
        remaining = cell_faces[(cell_faces != np.roll(cell_faces, 1, axis=1)).all(axis=1)]
        rotation = (np.arange(3) + remaining.argmin(axis=1)[:, None]) % 3  # the smallest index first, same orientation
        remaining = np.unique(np.take_along_axis(remaining, rotation, axis=1), axis=0)
        if len(remaining) <= max_faces:
            break
    counts = np.bincount(cell)
    means = np.stack([np.bincount(cell, vertices[:, k]) / counts for k in range(3)], axis=1)
    used_cells, numbers = np.unique(remaining, return_inverse=True)
    return means[used_cells], numbers.reshape(remaining.shape)


def encode_surface(vertices: np.ndarray, faces: np.ndarray) -> str:
    """Return a surface as base64 of the number of vertices, the vertices and the faces, 16 bits each."""
    scaled = np.rint(vertices * (COORDINATE_SCALE / np.linalg.norm(vertices, axis=1).max())).astype("<i2")
    arrays = np.array([len(scaled)], "<u2"), scaled, faces.astype("<u2")
    return base64.b64encode(b"".join(array.tobytes() for array in arrays)).decode("ascii")


def decode_surface(text: str) -> dict[str, list[int]] | None:
    """Return the surface in a text, {"vertices": x, y, z of each, "faces": three indices of each}; None without one."""
    try:
        raw = np.frombuffer(base64.b64decode(text, validate=True), "<u2")
    except (ValueError, binascii.Error):
        return None
    num_vertices = int(raw[0]) if raw.size else 0
    corners, faces = raw[1 : 1 + 3 * num_vertices].view("<i2"), raw[1 + 3 * num_vertices :]
    is_valid = corners.size == 3 * num_vertices > 0 and 0 < faces.size <= 3 * MAX_FACES and faces.size % 3 == 0
    if not is_valid or faces.max() >= num_vertices:
        return None
    return {"vertices": corners.tolist(), "faces": faces.tolist()}


def format_outlines(surfaces: Mapping[str, tuple[np.ndarray, np.ndarray]]) -> str:
    """Return the surfaces of bodies as the attribute `outlines` of a map, of at most `MAX_FACES` faces; "" if none."""
    selected = dict(list(surfaces.items())[: MAX_FACES // MIN_BODY_FACES])
    free_faces, texts = MAX_FACES, {}
    # bodies with few faces leave more to later ones
    few_first = sorted(selected, key=lambda name: len(selected[name][1]))
    for number, name in enumerate(few_first):
        vertices, faces = simplify(*selected[name], free_faces // (len(selected) - number))
        texts[name], free_faces = encode_surface(vertices, faces), free_faces - len(faces)
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
    return {
        name: surface for name, text in texts.items() if isinstance(text, str) and (surface := decode_surface(text))
    }
