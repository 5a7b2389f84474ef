r"""Closed surfaces of a mesh, and volume integrals over them.

A surface is closed if every edge is used as often in one direction as in the other. Triangles with two equal corners
are left out, and corners closer than the resolution of the file's numbers are one. With the corners a, b, c of a
triangle, the volume, its first and its second moments are

.. math:: V = \sum \frac{D}{6}, \quad \int x\,dV = \sum \frac{D}{24}\,s, \quad
    \int x x^\mathsf{T} dV = \sum \frac{D}{120}\,(a a^\mathsf{T} + b b^\mathsf{T} + c c^\mathsf{T} + s s^\mathsf{T}),
    \qquad D = a\cdot(b\times c), \; s = a + b + c

Source: Tonon (2004), J. Math. Stat. 1, 8, for the tetrahedron; Eberly (2002), "Polyhedral mass properties".
"""

from typing import NamedTuple

import numpy as np

from sweeps.reading.mesh import MeshError

#: distances, relative to the largest coordinate, below which corners are one if the mesh is not closed otherwise: of
#: texts with ten digits, and two units of the last place in single precision, in which binary STL files are written
CORNER_DISTANCES = (1e-10, 2.0**-22)


class Shells(NamedTuple):
    """Closed surfaces."""

    vertices: np.ndarray  #: shape (n, 3)
    faces: np.ndarray  #: indices of vertices, shape (m, 3)
    labels: np.ndarray  #: number of the surface of each face, in the order of their first faces, shape (m,)
    notes: tuple[str, ...]  #: remarks on what was changed, one sentence each


class Edges(NamedTuple):
    """Edges of faces in an order in which the uses of one edge are neighbours."""

    number: np.ndarray  #: number of the edge of each use
    face: np.ndarray  #: face of each use
    sense: np.ndarray  #: +1 if the face follows the edge from its smaller to its larger vertex, otherwise −1
    uses: np.ndarray  #: number of uses of each edge
    balance: np.ndarray  #: sum of the senses of each edge, 0 if it is closed


def find_shells(vertices: np.ndarray, faces: np.ndarray) -> Shells:
    """Return the closed surfaces of a mesh; refuse one that is open."""
    notes: tuple[str, ...] = ()
    faces = _without_equal_corners(faces)
    edges = _edges_of(faces, len(vertices))
    for distance in CORNER_DISTANCES if (edges.uses % 2).any() else ():
        joined_vertices, joined = _join_corners(vertices, faces, distance)
        joined_edges = _edges_of(joined, len(joined_vertices))
        if len(joined) and not (joined_edges.uses % 2).any():
            notes = (f"corners closer than {distance:.2g} of the largest coordinate were joined",)
            vertices, faces, edges = joined_vertices, joined, joined_edges
            break
    if edges.balance.any() and (edges.uses % 2 == 0).all():
        faces = _wind_alike(faces, edges)
        edges = _edges_of(faces, len(vertices))
        notes += ("its faces looked both ways and were turned",)
    if num_open := np.count_nonzero(edges.balance):
        problem = (
            f"is not watertight: {num_open:,} of its {len(edges.uses):,} edges have more faces one way than the other"
        )
        raise MeshError(problem, "a closed surface (repair it in your modeller, or with trimesh)")
    return Shells(vertices, faces, _label_surfaces(edges, len(faces)), notes)


def _without_equal_corners(faces: np.ndarray) -> np.ndarray:
    return faces[(faces != np.roll(faces, 1, axis=1)).all(axis=1)]


def _edges_of(faces: np.ndarray, num_vertices: int) -> Edges:
    """Return the edges of triangles, each with its triangles and the sense in which they run along it."""
    starts, ends = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    keys = np.minimum(starts, ends) * num_vertices + np.maximum(starts, ends)
    order = np.argsort(keys, kind="stable")
    number = np.cumsum(np.diff(keys[order], prepend=keys[order[:1]]) != 0)
    sense = np.where(starts < ends, 1, -1)[order]
    return Edges(number, order // 3, sense, np.bincount(number), np.rint(np.bincount(number, sense)).astype(int))


def _join_corners(vertices: np.ndarray, faces: np.ndarray, distance: float) -> tuple[np.ndarray, np.ndarray]:
    """Return vertices and faces with corners closer than `distance` of the largest coordinate, in each, made one."""
    from scipy.spatial import cKDTree

    used, faces = np.unique(faces, return_inverse=True)
    vertices = vertices[used]
    radius = distance * np.abs(vertices).max() * np.sqrt(3.0)
    labels = _components(len(vertices), *cKDTree(vertices).query_pairs(radius, output_type="ndarray").T)
    _, first = np.unique(labels, return_index=True)
    return vertices[first], _without_equal_corners(labels[faces.reshape(-1, 3)])


def _components(count: int, first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Return the number of the component of each of `count` nodes, in the order of their first nodes, by links."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    links = coo_array((np.ones(len(first), np.int8), (first, second)), shape=(count, count))
    return connected_components(links, directed=False)[1]


def _neighbours(edges: Edges, is_linked: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return pairs of successive faces of the edges for which `is_linked`, and whether they have the same sense."""
    same = (edges.number[1:] == edges.number[:-1]) & is_linked[edges.number[1:]]
    return edges.face[:-1][same], edges.face[1:][same], (edges.sense[1:] == edges.sense[:-1])[same]


def _wind_alike(faces: np.ndarray, edges: Edges) -> np.ndarray:
    """Return faces turned such that both faces of every edge of two follow it in opposite senses, where possible.

    Each face has two nodes, one for each of its senses; an edge links the two pairs of senses that fit together. The
    nodes of a surface make two components, of opposite senses.
    """
    first, second, is_alike = _neighbours(edges, edges.uses == 2)
    count = len(faces)
    links = (
        np.concatenate([first, first + count]),
        np.concatenate([second + count * is_alike, second + count * ~is_alike]),
    )
    labels = _components(2 * count, *links)
    return np.where((labels[:count] > labels[count:])[:, None], faces[:, ::-1], faces)


def _label_surfaces(edges: Edges, num_faces: int) -> np.ndarray:
    """Return the number of the surface of each face.

    A surface is what hangs together across edges of two faces if that is closed; pieces that are closed only together,
    across edges of more faces, are one surface.
    """
    labels = _components(num_faces, *_neighbours(edges, edges.uses == 2)[:2])
    count = labels.max() + 1
    keys = edges.number * count + labels[edges.face]
    distinct, inverse = np.unique(keys, return_inverse=True)
    is_open = np.rint(np.bincount(inverse, edges.sense)).astype(int) != 0
    if is_open.any():
        has_open_piece = np.zeros(len(edges.uses), bool)
        has_open_piece[distinct[is_open] // count] = True
        labels = _components(num_faces, *_neighbours(edges, (edges.uses == 2) | has_open_piece)[:2])
    return labels


def volumes_of(shells: Shells) -> np.ndarray:
    """Return the volume inside each surface, negative for inward normals."""
    count = shells.labels.max() + 1
    points = shells.vertices[shells.faces]
    middles = np.zeros((count, 3))  # a corner of each surface: about a distant point, digits are lost
    middles[shells.labels[::-1]] = points[::-1, 0]
    a, b, c = np.moveaxis(points - middles[shells.labels][:, None], 1, 0)
    return np.bincount(shells.labels, np.einsum("ij,ij->i", a, np.cross(b, c)) / 6, count)


def mass_properties(vertices: np.ndarray, faces: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
    """Return volume, centre of volume (3,), and the second moments of the volume about that centre (3, 3)."""
    a, b, c = np.moveaxis(vertices[faces], 1, 0)
    D, s = np.einsum("ij,ij->i", a, np.cross(b, c)), a + b + c
    volume = float(D.sum() / 6)
    centre = D @ s / 24 / volume
    second = sum((D[:, None] * x).T @ x for x in (a, b, c, s)) / 120
    return volume, centre, second - volume * np.outer(centre, centre)
