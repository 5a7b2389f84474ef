"""Meshes in STL, OBJ, PLY, OFF, GLB and DAE, and shape models in tables: their points and triangles only.

trimesh parses in a child process (see `sweeps.reading.sandbox`); textures, materials and colours are left there. Shape
models of small bodies come as .tab or .txt: as OBJ text (Planetary Data System), or as the numbers of points and of
triangles, three coordinates of each point and three numbers of points of each triangle, in which rows may begin with
their own number (DAMIT, and the plate models of the Planetary Data System).
"""

import hashlib
from functools import partial
from pathlib import Path

import numpy as np

from sweeps.reading import sandbox
from sweeps.reading.files import FileBytes
from sweeps.schema.refusals import MapError, RefusedError

TABLES = (".tab", ".txt")
SUFFIXES = (".stl", ".obj", ".ply", ".off", ".glb", ".dae", *TABLES)
MAX_MESH_BYTES = 2**28
SECONDS_PER_BYTE = 2.0**-21  # processor seconds per byte, in addition to `sandbox.MAX_SECONDS`
MEMORY_FACTOR = 12  # bytes of memory per byte of the file, in addition to `sandbox.MAX_BYTES`
MAX_COORDINATE = 1e30  # bound on coordinates, so that products of five do not overflow
ALLOWED = f"a readable {', '.join(suffix[1:].upper() for suffix in SUFFIXES)} file of triangles"


class MeshError(RefusedError):
    """Report invalid content of a mesh file."""

    def __init__(self, reason: str, allowed: str = ALLOWED):
        super().__init__(f"{reason}; allowed: {allowed}")
        self.wrong, self.allowed = reason, allowed


def read(path: str | Path) -> tuple[np.ndarray, np.ndarray, str]:
    """Return vertices, shape (points, 3), faces as numbers of vertices, shape (faces, 3), and the file's SHA-256.

    Raises:
        MeshError: for a file that is none, and a mesh of fewer than four triangles.
    """
    try:
        with FileBytes(path) as file:
            return _read_open_file(file)
    except (OSError, ValueError, MapError) as error:
        if isinstance(error, MeshError):
            raise
        raise MeshError("is not there, or is no file, or cannot be read") from None


def _read_open_file(file: FileBytes) -> tuple[np.ndarray, np.ndarray, str]:
    """Return corners, faces and SHA-256 of a mesh file, parsed by trimesh in a child process."""
    if file.size > MAX_MESH_BYTES:
        raise MeshError("is too large", f"at most {MAX_MESH_BYTES:,} bytes")
    try:
        import PIL.ImageFile  # noqa: F401
        import trimesh  # noqa: F401 -- here, since the child can open no file
    except ImportError:
        raise MeshError("needs trimesh, which is not here", "pip install -e '.[mesh]'") from None
    if Path(file.path).suffix.lower() == ".dae":
        try:
            import collada  # noqa: F401
        except ImportError:
            raise MeshError("needs pycollada, which is not here", "pip install pycollada, or an STL file") from None
    digest = hashlib.file_digest(file, "sha256").hexdigest()
    seconds = sandbox.MAX_SECONDS + file.size * SECONDS_PER_BYTE
    memory = sandbox.MAX_BYTES + file.size * MEMORY_FACTOR
    try:
        arrays = [*sandbox.parts_from_child(partial(_parse_mesh, file), seconds, memory)]
    except sandbox.ChildError as error:
        reason = str(error) or "it is damaged, or takes too much time or memory"
        raise MeshError(f"cannot be read as a mesh ({reason})") from None
    vertices = np.frombuffer(arrays[0], "f8").reshape(-1, 3).copy()
    faces = np.frombuffer(arrays[1], "i8").reshape(-1, 3).copy()
    if len(faces) < 4 or not np.abs(vertices).max() <= MAX_COORDINATE:  # NaN is not
        problem = f"fewer than four triangles, or points that are no numbers or beyond {MAX_COORDINATE:g}"
        raise MeshError(f"holds no body: {problem}")
    return vertices, faces, digest


def _parse_mesh(file: FileBytes):
    """Return vertices and faces; runs in the child."""
    import trimesh

    file.seek(0)
    with np.errstate(all="ignore"):
        kind = Path(file.path).suffix.lower()
        if kind in TABLES:
            kind = ".obj" if file.read(2**16).lstrip()[:2] in (b"v ", b"v\t", b"# ", b"o ", b"g ") else kind
            file.seek(0)
        if kind in TABLES:
            vertices, faces = _parse_table(file.read())
        else:  # a stream has no path, so trimesh opens no texture or material that the file names
            mesh = trimesh.load_mesh(file, file_type=kind[1:], skip_materials=True, process=False)
            vertices, faces = np.array(mesh.vertices, "f8"), np.array(mesh.faces, "i8")
            if kind == ".dae":  # which states its unit of length
                vertices *= trimesh.units.unit_conversion(mesh.units or "", "meters")
        vertices, faces = _join_equal(vertices, faces)
    return [vertices.tobytes(), faces.tobytes()]


def _parse_table(content: bytes) -> tuple[np.ndarray, np.ndarray]:
    """Return the vertices and faces of a table of points and triangles, the points counted from 0 or from 1."""
    rows = [row for line in content.splitlines() if (row := line.split(b"#")[0].replace(b",", b" ").split())]
    if len(rows[0]) == 2:
        num_points, num_faces = map(int, rows[0])
        points, triangles = rows[1 : num_points + 1], rows[num_points + 1 :]
    else:
        num_points = int(rows[0][0])
        num_faces = int(rows[num_points + 1][0])
        points, triangles = rows[1 : num_points + 1], rows[num_points + 2 :]
    vertices = np.array([row[-3:] for row in points], dtype=bytes).astype("f8")
    faces = np.array([row[-3:] for row in triangles], dtype=bytes).astype("i8")
    if {len(row) for row in rows[1:]} - {1, 3, 4} or len(faces) != num_faces or len(vertices) != num_points:
        raise ValueError("it is no table of the numbers of points and triangles, points, and triangles")
    return vertices, faces - (faces.min() if faces.min() in (0, 1) else 0)


def _join_equal(vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return vertices in ascending order with equal ones made one, and faces."""
    if len(faces) and not 0 <= faces.min() <= faces.max() < len(vertices):
        raise ValueError("it names points that it does not have")
    order = np.lexsort(vertices.T)  # takes a fifth of the time of `np.unique`
    vertices = vertices[order]
    is_first = (np.diff(vertices, axis=0, prepend=np.nan) != 0).any(axis=1)
    numbers = np.empty_like(order)
    numbers[order] = np.cumsum(is_first) - 1
    return vertices[is_first], numbers[faces]
