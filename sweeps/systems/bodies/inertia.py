r"""Principal moments and axes of a body, from its tensor of inertia or from a mesh of its surface.

The tensor of inertia about the centre of mass is, in the coordinates in which the body is given,

.. math:: T_{ij} = \int (r^2\delta_{ij} - x_i x_j)\,dm, \qquad T = R^\mathsf{T}\,\mathrm{diag}(I_1, I_2, I_3)\,R

so its off-diagonal entries are *minus* the products of inertia. The moments come out ascending, I1 ≤ I2 ≤ I3, and the
rows of R are the principal axes, right-handed.

Source: Landau and Lifshitz, Mechanics, section 32. Volume integrals over a mesh: trimesh, after Eberly (2002),
"Polyhedral mass properties".
"""

import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from sweeps.reading.mesh import SUFFIXES, MeshError, read
from sweeps.schema.refusals import display
from sweeps.systems.bodies import mesh_overlaps, mesh_shells, outline, shapes

UNITS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "km": 1e3, "in": 0.0254, "ft": 0.3048}  # metres
CAD = " (export the part as STL from your CAD program, in its own unit, and give that by --unit)"
ROBOT = " (a robot file is given without --mesh: polhode body robot.urdf)"
EXPORTS = dict.fromkeys((".step", ".stp", ".iges", ".igs", ".sldprt", ".fcstd", ".3mf", ".gltf"), CAD)
EXPORTS |= dict.fromkeys((".urdf", ".xacro", ".sdf", ".xml", ".mjcf"), ROBOT)

DENSITIES = (1.0, 25_000.0)  # kg m-3, lighter than aerogel and heavier than osmium; beyond, another unit is likelier
BUILT_DENSITIES = (20.0, 25_000.0)  # kg m-3, of bodies that are built
MAX_LENGTH = 50.0  # m; longer bodies are likelier in mm
LIKELY_UNITS = ("mm", "cm", "m", "in", "ft", "um")
MIN_OVERLAP, MAX_OVERLAP = 1e-6, 1e-3  # fraction of the volume above which an overlap is noted, and is refused
MAX_ASYMMETRY = 1e-9  # relative to the largest entry; tables print some ten digits
TENSOR_ROUNDING = 1e-14  # relative to the largest moment, some tens of roundings of a 3 by 3 eigenproblem
MESH_ROUNDING = 1e-7  # relative to the largest moment; coordinates in STL files are of single precision


class InertiaError(ValueError):
    """A tensor or covariance that is refused; the message has the reason."""

    def __init__(self, shown: str, wrong: str, allowed: str):
        super().__init__(f"{shown} {wrong}; allowed: {allowed}")
        self.shown, self.wrong, self.allowed = shown, wrong, allowed


@dataclass(frozen=True)
class Principal:
    """Principal moments and axes."""

    moments: tuple[float, float, float]  #: (I1, I2, I3), ascending, kg m2 (or the tensor's own unit)
    #: rotation matrix, 3 rows: principal axis i in the coordinates of the tensor or mesh. For equal moments any
    #: axes of their plane (or space) are principal axes.
    axes: tuple[tuple[float, float, float], ...]
    notes: tuple[str, ...] = ()  #: remarks on the result, one sentence each

    @property
    def tensor(self) -> np.ndarray:
        """The tensor of inertia in the axes of the input, shape (3, 3)."""
        axes = np.array(self.axes)
        return (axes.T * np.array(self.moments)) @ axes

    @property
    def rotation(self) -> dict[str, list[float]]:
        """Rotation from the principal axes to those of the input: unit quaternion, scalar first, and roll-pitch-yaw.

        Roll, pitch and yaw (rad) are angles about the fixed axes x, y and z, as in URDF. If the pitch is ±90°, the yaw
        is 0.
        """
        from scipy.spatial.transform import Rotation

        rotation = Rotation.from_matrix(np.transpose(self.axes))
        with warnings.catch_warnings(action="ignore"):  # at a pitch of ±90° roll and yaw are not unique
            rpy = rotation.as_euler("xyz")
        quaternion = rotation.as_quat(canonical=True, scalar_first=True) + 0.0  # no negative zeros
        return {"principal_quaternion": quaternion.tolist(), "principal_rpy": rpy.tolist()}


def second_moments(tensor: np.ndarray) -> np.ndarray:
    """Return the second moments of mass, the integral of x xᵀ dm, kg m2, of a tensor of inertia, shape (…, 3, 3)."""
    return np.trace(tensor, axis1=-2, axis2=-1)[..., None, None] / 2 * np.eye(3) - tensor


def tensor_of(second: np.ndarray) -> np.ndarray:
    """Return the tensor of inertia of second moments of mass, kg m2, shape (…, 3, 3)."""
    return np.trace(second, axis1=-2, axis2=-1)[..., None, None] * np.eye(3) - second


def principal(tensor: Sequence[Sequence[float]], rounding: float = TENSOR_ROUNDING) -> Principal:
    """Return principal moments, with errors of some 1e-15 of the largest, and axes of a tensor of inertia.

    The tensor has 3 rows of 3 finite numbers, symmetric, kg m2 (or another unit). Moments that differ by less than
    `rounding`, relative to the largest, count as equal.
    """
    matrix = np.array(tensor, dtype=np.float64)
    _check_symmetry(matrix)
    size = np.abs(matrix).max()
    # a power of two is exact, and products neither over- nor underflow
    unit = 2.0 ** np.floor(np.log2(size)) if size > 0 else 1.0
    values, vectors = np.linalg.eigh((matrix / unit + (matrix / unit).T) / 2)
    tensor_text = display(matrix.tolist())
    if not values[0] > 4 * np.finfo(float).eps * values[2]:
        value = ", ".join(f"{value:.6g}" for value in values * unit)
        raise InertiaError(tensor_text, f"has the principal moments {value}", "three principal moments > 0")
    if violation := shapes.violation((values * unit).tolist()):
        problem = f"has principal moments of no rigid body: {violation}"
        allowed = f"{shapes.POSSIBLE} (off-diagonal entries are minus the products of inertia)"
        raise InertiaError(tensor_text, problem, allowed)
    moments, notes = _equal_within_rounding(values, rounding)
    return Principal(tuple((moments * unit).tolist()), _right_handed(vectors.T), notes)


def _check_symmetry(matrix: np.ndarray) -> None:
    """Raise an InertiaError for a matrix that is not 3 by 3, finite and symmetric to rounding."""
    if matrix.shape != (3, 3) or not np.isfinite(matrix).all():
        raise InertiaError(display(matrix.tolist()), "is not a tensor of inertia", "3 rows of 3 finite numbers")
    gaps = np.abs(matrix - matrix.T)
    if gaps.max() > MAX_ASYMMETRY * np.abs(matrix).max():
        row, column = np.unravel_index(int(gaps.argmax()), gaps.shape)
        upper, lower = float(matrix[row, column]), float(matrix[column, row])
        problem = f"is not symmetric: {upper} against {lower} across its diagonal"
        raise InertiaError(display(matrix.tolist()), problem, "a symmetric tensor")


def _equal_within_rounding(values: np.ndarray, rounding: float) -> tuple[np.ndarray, tuple[str, ...]]:
    """Make moments equal that differ by rounding only (otherwise a cube would flip, in 10^15 s)."""
    is_equal = np.diff(values) <= rounding * values[2]
    names = {(True, True): "I1, I2 and I3", (True, False): "I1 and I2"}.get(tuple(is_equal.tolist()), "I2 and I3")
    groups = np.split(values, np.flatnonzero(~is_equal) + 1)
    has_change = (is_equal & (np.diff(values) > 0)).any()
    equal = np.concatenate([np.full(group.size, group.mean()) for group in groups])
    return equal, (f"{names} differ by rounding only and count as equal",) if has_change else ()


def _right_handed(rows: np.ndarray) -> tuple[tuple[float, float, float], ...]:
    """Return unit rows with the largest entry of the first two positive, and the third their cross product."""
    first, second = (row * np.sign(row[np.abs(row).argmax()]) for row in rows[:2])
    axes = np.array([first, second, np.cross(first, second)]) + 0.0  # no negative zeros
    return tuple(tuple(row) for row in axes.tolist())


def describe_axis(row: tuple[float, float, float], frame: str = "") -> str:
    """Return a direction, "x", "−z" or its components; with the owner of the axes, `Body.frame`, "body +x"."""
    owner, plus = (("body " if frame == "file" else f"{frame} "), "+") if frame else ("", "")
    for value, name in zip(row, "xyz", strict=True):
        if abs(value) > 1 - 1e-12:
            return f"{owner}{plus if value > 0 else '−'}{name}"
    return f"{owner}(" + ", ".join(f"{round(value, 6) + 0.0:.6f}".replace("-", "−") for value in row) + ")"


def axis_lines(principal: Principal) -> Iterator[str]:
    """Yield a line for each principal moment and its axis, and for each note."""
    for number, (moment, row) in enumerate(zip(principal.moments, principal.axes, strict=True), 1):
        yield f"I{number} = {moment:.6g} kg m²  about {describe_axis(row)}"
    for note in principal.notes:
        yield f"note: {note}"


# -- meshes


@dataclass(frozen=True)
class Solid:
    """A body of uniform density inside a mesh."""

    principal: Principal  #: its principal moments and axes
    mass: float  #: kg
    volume: float  #: m3
    centre: tuple[float, float, float]  #: centre of mass in the mesh's coordinates, m
    extents: tuple[float, float, float]  #: edges of the box around it, m
    faces: int  #: number of triangles
    #: vertices about the centre along the principal axes, m, and faces, few enough to be drawn.
    surface: tuple[np.ndarray, np.ndarray] = field(compare=False, repr=False)
    digest: str  #: SHA-256 of the file


def unsupported_format(path: str | Path) -> tuple[str, str] | None:
    """Return why a file's format is not supported, and the allowed formats; None for a supported format."""
    suffix = Path(path).suffix.lower()
    if suffix in SUFFIXES:
        return None
    return f"is of the unsupported format {suffix or '(none)'}", ", ".join(SUFFIXES) + EXPORTS.get(suffix, "")


def solid(path: str | Path, density: float | None = None, mass: float | None = None, unit: str = "m") -> Solid:
    """Return the solid of constant density that a closed mesh bounds.

    Args:
        path: a file of one of the formats `SUFFIXES`.
        density: kg m-3; or
        mass: mass of the whole body, kg.
        unit: unit of length of the file, one of `UNITS`.

    Returns:
        Mass properties about the centre of mass, with relative errors of some 1e-14 in addition to those of the file's
        digits. Moments that differ by less than 1e-7 of the largest count as equal.
    """
    if problem := unsupported_format(path):
        raise MeshError(*problem)
    if Path(path).suffix.lower() == ".dae" and unit != "m":
        raise MeshError("states its unit of length itself", "unit m, the default")
    vertices, faces, digest = read(path)
    shells = mesh_shells.find_shells(vertices, faces)
    vertices, notes = shells.vertices, shells.notes
    scale, middle = UNITS[unit], (vertices.min(axis=0) + vertices.max(axis=0)) / 2
    vertices, extents = (vertices - middle) * scale, np.ptp(vertices, axis=0) * scale
    faces, orientation_notes = _orient_surfaces(shells._replace(vertices=vertices))
    volume, centre, second = mesh_shells.mass_properties(vertices, faces)
    density = mass / volume if density is None else density
    inertia = principal(density * tensor_of(second), MESH_ROUNDING)
    notes += orientation_notes + _unit_doubts(extents, None if mass is None else density, scale)
    return Solid(
        principal=replace(inertia, notes=notes + inertia.notes),
        mass=density * volume,
        volume=volume,
        centre=tuple((centre + middle * scale).tolist()),
        extents=tuple(extents.tolist()),
        faces=len(faces),
        surface=outline.simplify((vertices - centre) @ np.array(inertia.axes).T, faces),
        digest=digest,
    )


def _orient_surfaces(shells: mesh_shells.Shells) -> tuple[np.ndarray, tuple[str, ...]]:
    """Return faces with normals out of the body, and notes; refuse a mesh if more than `MAX_OVERLAP` of it overlaps."""
    volumes = mesh_shells.volumes_of(shells)
    box = float(np.prod(np.ptp(shells.vertices, axis=0)))
    if not np.abs(volumes).sum() > 1e-12 * box:
        raise MeshError("encloses no volume", "a mesh of a body with volume")
    is_inverted, overlap = mesh_overlaps.orient(*shells[:3], volumes)
    volume = float(np.where(is_inverted, -volumes, volumes).sum())
    if not volume > 1e-12 * box:
        raise MeshError("encloses no volume", "a mesh of a body with volume")
    count, num_inverted, notes = len(volumes), int(is_inverted.sum()), ()
    if num_inverted == count:
        notes = ("its faces looked inwards and were turned",)
    elif num_inverted:
        notes = (f"{num_inverted:,} of its {count:,} surfaces looked inwards and were turned",)
    share = overlap.volume / volume
    if share > MIN_OVERLAP:
        numbers = " and ".join(f"{number + 1:,}" for number in overlap.surfaces)
        who = f"surfaces {numbers} overlap" if len(overlap.surfaces) > 1 else f"surface {numbers} intersects itself"
        text = f"{who}: {overlap.volume:.3g} m³, {100 * share:.2g} % of the volume, counted wrongly"
        if share > MAX_OVERLAP:
            allowed = "solids apart or united (in your modeller), hollows with their faces turned inwards"
            raise MeshError(text, f"at most {100 * MAX_OVERLAP:g} %: {allowed}")
        notes += (text,)
    return np.where(is_inverted[shells.labels][:, None], shells.faces[:, ::-1], shells.faces), notes


def _unit_doubts(extents: np.ndarray, density: float | None, scale: float) -> tuple[str, ...]:
    """Return a note if lengths may be in another unit, by the density (kg m-3) from a mass, or by size."""
    longest = float(np.max(extents))
    if density is not None and not DENSITIES[0] <= density <= DENSITIES[1]:
        low, high = BUILT_DENSITIES
        units = [unit for unit in LIKELY_UNITS if low <= density * (scale / UNITS[unit]) ** 3 <= high]
        return (
            f"its density is {density:.3g} kg/m³" + (f": is it in {units[0]} (--unit {units[0]})?" if units else ""),
        )
    if longest > MAX_LENGTH and scale == 1.0:
        return (f"it is {longest:.4g} m long: is it in mm (--unit mm)?",)
    return ()
