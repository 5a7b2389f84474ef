r"""Principal moments and axes of a body, from its tensor of inertia or from a mesh of its surface.

The tensor of inertia about the centre of mass is, in the coordinates in which the body is given,

.. math:: T_{ij} = \int (r^2\delta_{ij} - x_i x_j)\,dm, \qquad T = R^\mathsf{T}\,\mathrm{diag}(I_1, I_2, I_3)\,R

so its off-diagonal entries are *minus* the products of inertia. The moments come out ascending, I1 ≤ I2 ≤ I3, and the
rows of R are the principal axes, right-handed.

Source: Landau and Lifshitz, Mechanics, section 32. Volume integrals over a mesh: trimesh, after Eberly (2002),
"Polyhedral mass properties".
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from sweeps.reading.mesh import SUFFIXES, MeshError, read
from sweeps.schema.refusals import display
from sweeps.systems.bodies import mesh_shells, outline, shapes

UNITS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "in": 0.0254, "ft": 0.3048}  # metres
CAD = " (export the part as STL from your CAD program, in its own unit, and give that by --unit)"
ROBOT = " (give the mesh file of one link, which the file names)"
EXPORTS = dict.fromkeys((".step", ".stp", ".iges", ".igs", ".sldprt", ".fcstd", ".3mf", ".glb", ".gltf"), CAD)
EXPORTS |= dict.fromkeys((".urdf", ".xacro", ".sdf", ".xml", ".mjcf"), ROBOT)

DENSITIES = (1.0, 25_000.0)  # kg m-3: below aerogel, above osmium; beyond them another unit is likelier
FITTING = (20.0, 25_000.0)  # of what is built
LARGE = 100.0  # m
LIKELY = ("mm", "cm", "m", "in", "ft")
SYMMETRY = 1e-9  # of the largest entry: tables print some ten digits
TENSOR_ROUNDING = 1e-14  # of the largest moment: some tens of roundings of a 3 by 3 eigenproblem
MESH_ROUNDING = 1e-7  # of the largest moment: coordinates in STL files are single precision


class InertiaError(ValueError):
    """A tensor or a covariance is refused; `str()` says why."""

    def __init__(self, shown: str, wrong: str, allowed: str):
        super().__init__(f"{shown} {wrong}; allowed: {allowed}")
        self.shown, self.wrong, self.allowed = shown, wrong, allowed


@dataclass(frozen=True)
class Principal:
    """Principal moments and axes."""

    moments: tuple[float, float, float]  #: (I1, I2, I3), ascending, kg m2 (or the tensor's own unit)
    #: rotation matrix, 3 rows: principal axis i in the coordinates of the tensor or mesh. Where moments are equal, any
    #: axes of their plane (or space) would do as well.
    axes: tuple[tuple[float, float, float], ...]
    notes: tuple[str, ...] = ()  #: what a person should know of how they came out, one sentence each


def principal(tensor: Sequence[Sequence[float]], rounding: float = TENSOR_ROUNDING) -> Principal:
    """Return principal moments, each right to some 1e-15 of the largest, and axes of a tensor of inertia.

    It has 3 rows of 3 finite numbers, symmetric, kg m2 (or any one unit). Moments that differ by less than `rounding`,
    relative to the largest, count as equal.
    """
    matrix = np.array(tensor, dtype=np.float64)
    _check_symmetry(matrix)
    size = np.abs(matrix).max()
    # a power of two is exact, and products neither over- nor underflow
    unit = 2.0 ** np.floor(np.log2(size)) if size > 0 else 1.0
    values, vectors = np.linalg.eigh((matrix / unit + (matrix / unit).T) / 2)
    given = display(matrix.tolist())
    if not values[0] > 4 * np.finfo(float).eps * values[2]:
        value = ", ".join(f"{value:.6g}" for value in values * unit)
        raise InertiaError(given, f"has the principal moments {value}", "three principal moments > 0")
    if broken := shapes.violation((values * unit).tolist()):
        wrong = f"has principal moments of no rigid body: {broken}"
        allowed = f"{shapes.POSSIBLE} (off-diagonal entries are minus the products of inertia)"
        raise InertiaError(given, wrong, allowed)
    moments, notes = _equal_within_rounding(values, rounding)
    return Principal(tuple((moments * unit).tolist()), _right_handed(vectors.T), notes)


def _check_symmetry(matrix: np.ndarray) -> None:
    if matrix.shape != (3, 3) or not np.isfinite(matrix).all():
        raise InertiaError(display(matrix.tolist()), "is not a tensor of inertia", "3 rows of 3 finite numbers")
    gaps = np.abs(matrix - matrix.T)
    if gaps.max() > SYMMETRY * np.abs(matrix).max():
        row, column = np.unravel_index(int(gaps.argmax()), gaps.shape)
        one, other = float(matrix[row, column]), float(matrix[column, row])
        wrong = f"is not symmetric: {one} against {other} across its diagonal"
        raise InertiaError(display(matrix.tolist()), wrong, "a symmetric tensor")


def _equal_within_rounding(values: np.ndarray, rounding: float) -> tuple[np.ndarray, tuple[str, ...]]:
    """Make moments equal that differ by rounding only: else a cube would flip, given 10^15 s."""
    near = np.diff(values) <= rounding * values[2]
    words = {(True, True): "I1, I2 and I3", (True, False): "I1 and I2"}.get(tuple(near.tolist()), "I2 and I3")
    groups = np.split(values, np.flatnonzero(~near) + 1)
    made = (near & (np.diff(values) > 0)).any()
    equal = np.concatenate([np.full(group.size, group.mean()) for group in groups])
    return equal, (f"{words} differ by rounding only and count as equal",) if made else ()


def _right_handed(rows: np.ndarray) -> tuple[tuple[float, float, float], ...]:
    """Return unit rows with the largest entry of the first two positive, and the third their cross product."""
    first, second = (row * np.sign(row[np.abs(row).argmax()]) for row in rows[:2])
    rounded = np.array([first, second, np.cross(first, second)]) + 0.0  # no negative zeros
    return tuple(tuple(row) for row in rounded.tolist())


def axis_in_words(row: tuple[float, float, float]) -> str:
    """Return a direction: "x", "−z" along a coordinate axis, else its three components."""
    for value, name in zip(row, "xyz", strict=True):
        if abs(value) > 1 - 1e-12:
            return name if value > 0 else f"−{name}"
    return "(" + ", ".join(f"{value:.6f}".replace("-", "−") for value in row) + ")"


def principal_axes(principal: Principal) -> Iterator[str]:
    """Yield a line for each principal moment and its axis, and for each note."""
    for number, (moment, row) in enumerate(zip(principal.moments, principal.axes, strict=True), 1):
        yield f"I{number} = {moment:.6g} kg m²  about {axis_in_words(row)}"
    for note in principal.notes:
        yield f"note: {note}"


# -- meshes


@dataclass(frozen=True)
class Solid:
    """A body from a mesh, its density uniform."""

    principal: Principal  #: its principal moments and axes
    mass: float  #: kg
    volume: float  #: m3
    centre: tuple[float, float, float]  #: centre of mass in the mesh's coordinates, m
    extents: tuple[float, float, float]  #: edges of the box around it, m
    faces: int  #: number of triangles
    #: its vertices about the centre along the principal axes, m, and its faces: few enough to be drawn.
    surface: tuple[np.ndarray, np.ndarray] = field(compare=False, repr=False)
    digest: str  #: SHA-256 of the file


def unsupported(path: str | Path) -> tuple[str, str] | None:
    """Return what is wrong with a file's format and what is allowed; None for a format that is read."""
    suffix = Path(path).suffix.lower()
    if suffix in SUFFIXES:
        return None
    return f"is of the unsupported format {suffix or '(none)'}", ", ".join(SUFFIXES) + EXPORTS.get(suffix, "")


def solid(path: str | Path, density: float | None = None, mass: float | None = None, unit: str = "m") -> Solid:
    """Return the solid of constant density that a closed mesh bounds.

    Args:
        path: an STL, OBJ, PLY or OFF file.
        density: kg m-3; or
        mass: kg, of the whole body.
        unit: what the file's lengths are in, one of `UNITS`.

    Returns:
        Its mass properties about its centre of mass; relative errors some 1e-14, beside the file's own digits.
        Moments that differ by less than 1e-7 of the largest count as equal.
    """
    mesh, notes, digest = _closed(path)
    notes += _made_separate(mesh)
    scale = UNITS[unit]
    middle = mesh.bounds.mean(axis=0)
    mesh.vertices = (mesh.vertices - middle) * scale  # integrals about a point outside lose digits
    if mesh.volume < 0:
        mesh.invert()
        notes += ("its faces looked inwards and were turned",)
    volume = float(mesh.volume)
    if not volume > 1e-12 * float(np.prod(mesh.extents)):
        raise MeshError("encloses no volume", "a mesh of a body with volume")
    mesh.density = mass / volume if density is None else density
    inertia = principal(mesh.moment_inertia, MESH_ROUNDING)
    notes += _doubts(mesh.extents, None if mass is None else mesh.density, scale)
    along = (np.asarray(mesh.vertices) - mesh.center_mass) @ np.array(inertia.axes).T
    return Solid(
        principal=replace(inertia, notes=notes + inertia.notes),
        mass=mesh.density * volume,
        volume=volume,
        centre=tuple((mesh.center_mass + middle * scale).tolist()),
        extents=tuple(mesh.extents.tolist()),
        faces=len(mesh.faces),
        surface=outline.simplify(along, np.asarray(mesh.faces)),
        digest=digest,
    )


def _doubts(extents: np.ndarray, implied: float | None, scale: float) -> tuple[str, ...]:
    """Return a note where lengths may be in another unit: by the density `implied` from a mass (kg m-3), or by size."""
    longest = float(np.max(extents))
    if implied is not None and not DENSITIES[0] <= implied <= DENSITIES[1]:
        fitting = [n for n in LIKELY if FITTING[0] <= implied * (scale / UNITS[n]) ** 3 <= FITTING[1]]
        return (f"its density is {implied:.3g} kg/m³" + "".join(f": is it in {n} (--unit {n})?" for n in fitting[:1]),)
    if longest > LARGE and scale == 1.0:
        return (f"it is {longest:.4g} m long: is it in mm (--unit mm)?",)
    return ()


def _closed(path: str | Path):
    """Return the mesh of a file, with faces that close it, notes, and the file's SHA-256."""
    if wrong := unsupported(path):
        raise MeshError(*wrong)
    vertices, faces, digest = read(path)
    import trimesh.repair

    mesh = trimesh.Trimesh(vertices, faces, process=False)
    if mesh.is_watertight and mesh.is_winding_consistent:
        return mesh, (), digest
    if mesh.is_watertight:
        trimesh.repair.fix_winding(mesh)
        return mesh, ("its faces looked both ways and were turned",), digest
    edges, uses = np.unique(mesh.edges_sorted, axis=0, return_counts=True)
    wrong = f"is not watertight: {(uses != 2).sum():,} of its {len(edges):,} edges join one face, or more than two"
    if np.all(uses % 2 == 0):
        raise MeshError(wrong, "solids that share no edge (unite them, or move one aside by a hundredth of its size)")
    raise MeshError(wrong, "a closed surface (repair it in your modeller, or with trimesh)")


def _made_separate(mesh) -> tuple[str, ...]:
    """Turn those surfaces of a mesh outwards that look inwards; return notes. None may enclose a place twice."""
    import trimesh.graph

    part = trimesh.graph.connected_component_labels(mesh.face_adjacency, len(mesh.faces))
    count = part.max() + 1
    if count == 1:
        return ()
    if count > mesh_shells.MOST_SURFACES:
        raise MeshError(f"holds {count:,} closed surfaces", f"at most {mesh_shells.MOST_SURFACES:,}")
    parts = mesh_shells.arrangement([mesh.triangles[part == k] for k in range(count)])
    if parts.twice:
        involved = len({k for pair in parts.twice for k in pair})
        wrong = f"holds solids that overlap ({involved:,} of its {count:,} surfaces): they would count twice"
        allowed = "solids apart or united (in your modeller), hollows with their faces turned inwards"
        raise MeshError(wrong, allowed)
    notes = ()
    if any(parts.turned):
        mesh.faces = np.where(np.array(parts.turned)[part][:, None], mesh.faces[:, ::-1], mesh.faces)
        notes = (f"{sum(parts.turned):,} of its {count:,} surfaces looked inwards and were turned",)
    if parts.unseen:
        notes += (f"{parts.unseen:,} pairs of its surfaces are too fine to be compared: what overlaps counts twice",)
    return notes
