r"""Nesting and overlaps of closed surfaces, by parallel lines through them.

Volume integrals over a mesh add the volume inside every surface, with the sign of its orientation. They give the body's
mass only if each point is enclosed w = 0 or 1 times. Along a line, w rises by one where the line enters an outward
surface and falls by one where it leaves it; so the volume that counts falsely is

.. math:: V_f = \int \big(\max(w - 1, 0) + \max(-w, 0)\big)\,dV

exact along each line, and a sum over lines of a square lattice across. Lines run in three perpendicular directions that
are oblique to the coordinate axes, so that no region is thin along all of them; a region that all lines miss has the
volume of some cells of the lattice, h³. The spacing h is chosen such that this is small beside the volume that matters.
The cost grows with the number of triangles and of crossings, not with pairs of triangles.

A lattice line crosses exactly one of two triangles beside an edge: the crossing of an edge with a row of lines is
computed from its lower to its upper end for both, and intervals are half open.

Source: Requicha (1980), ACM Computing Surveys 12, 437, for ray representations; Jacobson et al. (2013), ACM Trans.
Graph. 32(4), 33, for winding numbers.
"""

from typing import NamedTuple

import numpy as np

from sweeps.reading.mesh import MeshError

MIN_LINES, MAX_LINES = 256, 1024  # lines along the longer edge of the lattice
MISSED_VOLUME = 3e-5  # volume of a lattice cell, at most, relative to the body's volume, as far as MAX_LINES allows
MAX_CROSSINGS = 1e7  # crossings in one direction, some 300 MB; their sorting takes some two seconds
MAX_SPANS = 1e8  # pairs of a triangle and a row of lines in one direction
BLOCK = 2**20  # pairs of a triangle and a row at a time, some 200 MB
MAX_WALKED_CROSSINGS = 20_000  # crossings of the lines on which the overlapping surfaces are identified
TOO_INTRICATE = (
    "has too many surfaces one above the other to be compared",
    "a simpler mesh (reduce it in your modeller)",
)
#: rows of a rotation near that by 60° about (1, 1, 1), oblique to all coordinate axes, with no simple ratio
DIRECTIONS = np.linalg.qr([[2.0, -1.0, 2.17], [2.13, 2.0, -1.05], [-1.09, 2.11, 2.0]])[0]


class Crossings(NamedTuple):
    """Crossings of lines with a mesh, in the order of lines and of heights along them."""

    line: np.ndarray  #: number of the line
    height: np.ndarray  #: place along the line
    rise: np.ndarray  #: +1 where the line enters a surface with outward normals, −1 where it leaves it
    surface: np.ndarray  #: number of the surface
    area: float  #: cross-section for which a line counts


class Overlap(NamedTuple):
    """Volume that counts falsely."""

    volume: float
    surfaces: tuple[int, ...]  #: numbers of the two surfaces that overlap most; one that intersects itself


def orient(
    vertices: np.ndarray, faces: np.ndarray, labels: np.ndarray, volumes: np.ndarray
) -> tuple[np.ndarray, Overlap]:
    """Return the surfaces to be inverted, and the volume that counts falsely thereafter.

    The sense of the whole file is settled first, by the volume of the surfaces that no other encloses. Then surfaces
    inside an even number of others are turned outwards; inside an odd number, inward normals bound a cavity.

    Args:
        vertices: shape (n, 3).
        faces: indices of vertices, shape (m, 3).
        labels: number of the surface of each face, shape (m,).
        volumes: volume inside each surface, negative for inward normals, shape (k,).
    """
    signs = np.where(volumes < 0, -1, 1)
    rotations = [np.roll(DIRECTIONS, k, axis=0) for k in range(3)]  # their third rows are directions of lines
    casts = [_cast(vertices @ rows.T, faces, labels, abs(volumes).sum()) for rows in rotations]
    depths, counts = np.zeros(len(volumes)), np.zeros(len(volumes))
    is_hit = np.zeros(len(volumes), bool)
    is_hit[np.concatenate([crossings.surface for crossings in casts])] = True
    missed = [] if is_hit.all() else [_cross_missed((vertices @ DIRECTIONS.T)[faces], labels, is_hit)]
    for crossings in casts + missed:
        rises = crossings.rise * signs[crossings.surface]
        depth = np.minimum(np.cumsum(rises), np.cumsum(rises) - rises)  # on the outer side of the surface
        depths += np.bincount(crossings.surface, depth, len(depths))
        counts += np.bincount(crossings.surface, minlength=len(depths))
    depth = np.rint(depths / np.maximum(counts, 1)).astype(int)
    is_inside_out = volumes[depth == 0].sum() < -1e-9 * np.abs(volumes).sum()
    final_signs = -signs if is_inside_out else signs
    to_invert = (final_signs < 0) & (depth % 2 == 0)
    factors = np.where(to_invert, -1, 1) * (-1 if is_inside_out else 1)
    excess = [_false_lengths(crossings, factors) for crossings in casts]
    totals = [lengths.sum() for lengths in excess]
    volume, worst = float(np.mean([cast.area for cast in casts] * np.array(totals))), int(np.argmax(totals))
    return factors < 0, Overlap(volume, _overlapping(casts[worst], excess[worst], factors) if volume else ())


def _cast(points: np.ndarray, faces: np.ndarray, labels: np.ndarray, volume: float) -> Crossings:
    """Return the crossings of a lattice of lines along the third coordinate with a mesh."""
    low, extents = points.min(axis=0), np.ptp(points, axis=0)
    cells = (MISSED_VOLUME * volume / np.prod(extents)) ** (-1 / 3) if volume > 0 else MAX_LINES
    spacing = extents[:2].max() / np.clip(cells, MIN_LINES, MAX_LINES)
    # a line passes through the middle of each cell: row and column numbers are whole there
    triangles = np.column_stack([(points[:, :2] - low[:2]) / spacing - 0.5, points[:, 2]])[faces]
    first, end = (np.ceil(bound).astype(np.int64) for bound in _bounds(triangles[:, :, 1]))
    return _collect(triangles, labels, np.maximum(first, 0), end, None, spacing**2)


def _cross_missed(triangles: np.ndarray, labels: np.ndarray, is_hit: np.ndarray) -> Crossings:
    """Return the crossings of triangles with a line through each surface that no line of the lattices crosses."""
    across = np.abs(np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])[:, 2])
    order = np.lexsort((across, labels))
    largest = order[np.append(np.flatnonzero(np.diff(labels[order])), len(order) - 1)]  # triangle of each surface
    lines = triangles[largest[~is_hit]].mean(axis=1)[:, :2]
    lines = lines[np.argsort(lines[:, 1])]
    ends = (np.searchsorted(lines[:, 1], bound) for bound in _bounds(triangles[:, :, 1]))
    return _collect(triangles, labels, *ends, lines, 0.0)


def _collect(triangles, labels, first, end, lines, area: float) -> Crossings:
    """Return the crossings of triangles with lines, sorted.

    Args:
        triangles: corners, shape (n, 3, 3).
        labels: number of the surface of each triangle, shape (n,).
        first: number of the first row of lines, or of the first of `lines`, that may cross each triangle, shape (n,).
        end: number behind the last one, shape (n,).
        lines: first two coordinates of lines in the order of the second, shape (k, 2); None for a lattice, whose lines
            are at whole numbers.
        area: cross-section for which a line counts.
    """
    ends = np.cumsum(np.maximum(end - first, 0))
    if ends[-1] > MAX_SPANS:
        raise MeshError(*TOO_INTRICATE)
    parts, num_crossings = [], 0
    for block in np.split(np.arange(len(ends)), np.searchsorted(ends, np.arange(BLOCK, ends[-1], BLOCK))):
        owner, row = _expand(first[block], end[block])
        triangle = triangles[block][owner]
        left, right = _span(triangle, row.astype(float) if lines is None else lines[row, 1])
        if lines is None:
            start, column_end = np.ceil(left).astype(np.int64), np.ceil(right).astype(np.int64)
            num_crossings += int(np.maximum(column_end - start, 0).sum())
            if num_crossings > MAX_CROSSINGS:
                raise MeshError(*TOO_INTRICATE)
            which, column = _expand(start, column_end)
            places, keys = np.column_stack([column, row[which]]).astype(float), (row[which] << 20) + column
        else:
            which = np.flatnonzero((left <= lines[row, 0]) & (lines[row, 0] < right))
            places, keys = lines[row[which]], row[which]
        parts.append((keys, *_heights(triangle[which], places), labels[block][owner[which]]))
    line, height, rise, surface = (np.concatenate(columns) for columns in zip(*parts, strict=True))
    order = np.lexsort((height, line))
    return Crossings(line[order], height[order], rise[order], surface[order], area)


def _expand(first: np.ndarray, end: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the number of the interval, and each whole number from `first` to before `end`."""
    counts = np.maximum(end - first, 0)
    owner = np.repeat(np.arange(len(first)), counts)
    return owner, np.arange(len(owner)) - np.repeat(np.cumsum(counts) - counts, counts) + first[owner]


def _bounds(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the least and the greatest of three values, shape (n, 3) (`min` along rows takes ten times longer)."""
    a, b, c = values.T
    return np.minimum(np.minimum(a, b), c), np.maximum(np.maximum(a, b), c)


def _span(triangles: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the least and the greatest first coordinate of triangles (n, 3, 3) at second coordinates y (n,)."""
    left, right = np.full(len(y), np.inf), np.full(len(y), -np.inf)
    for k in range(3):
        start, stop = triangles[:, k], triangles[:, k - 2]
        is_up = (start[:, 1] < stop[:, 1])[:, None]
        low, high = np.where(is_up, start, stop), np.where(is_up, stop, start)
        with np.errstate(divide="ignore", invalid="ignore"):
            x = low[:, 0] + (y - low[:, 1]) / (high[:, 1] - low[:, 1]) * (high[:, 0] - low[:, 0])
        meets = (low[:, 1] <= y) & (y < high[:, 1])
        np.minimum(left, x, out=left, where=meets)
        np.maximum(right, x, out=right, where=meets)
    is_met = left <= right
    return np.where(is_met, left, 0.0), np.where(is_met, right, 0.0)


def _heights(triangles: np.ndarray, places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the third coordinate of triangles at places (n, 2), and the rise of w there."""
    origin = triangles[:, 0]
    normal = np.cross(triangles[:, 1] - origin, triangles[:, 2] - origin)
    with np.errstate(divide="ignore", invalid="ignore"):
        slope = -((places - origin[:, :2]) * normal[:, :2]).sum(axis=1) / normal[:, 2]
    return np.clip(np.nan_to_num(origin[:, 2] + slope), *_bounds(triangles[:, :, 2])), -np.sign(normal[:, 2]).astype(
        np.int64
    )


def _false_lengths(crossings: Crossings, factors: np.ndarray) -> np.ndarray:
    """Return the length behind each crossing, up to the next, times the number of times that it counts falsely."""
    windings = np.cumsum(crossings.rise * factors[crossings.surface])
    lengths = np.diff(crossings.height, append=crossings.height[-1:])
    return np.where(windings > 1, windings - 1, np.maximum(-windings, 0)) * np.maximum(lengths, 0.0)


def _overlapping(crossings: Crossings, lengths: np.ndarray, factors: np.ndarray) -> tuple[int, ...]:
    """Return the two surfaces that enclose the greatest length falsely, or the one that does so alone."""
    amounts: dict[tuple[int, ...], float] = {}
    lines = np.unique(crossings.line[lengths > 0])
    num_walked = np.isin(crossings.line, lines).sum()
    for line in lines[:: int(num_walked // MAX_WALKED_CROSSINGS) + 1]:
        first, end = np.searchsorted(crossings.line, [line, line + 1])
        windings: dict[int, int] = {}
        total = 0
        for k in range(first, end):
            surface = int(crossings.surface[k])
            rise = int(crossings.rise[k] * factors[surface])
            windings[surface], total = windings.get(surface, 0) + rise, total + rise
            if lengths[k] > 0:
                present = [each for each, winding in windings.items() if winding and (winding > 0) == (total > 0)]
                if total < 0 and len(present) == 1:  # a hollow reaches out of the surface that is crossed next to it
                    near = [*crossings.surface[first:k][::-1], *crossings.surface[k:end]]
                    present += [int(each) for each in near if each != present[0]][:1]
                pair = tuple(sorted(present[-2:]))
                amounts[pair] = amounts.get(pair, 0.0) + float(lengths[k])
    return max(amounts, key=amounts.get)
