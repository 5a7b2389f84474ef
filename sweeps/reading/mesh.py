"""Meshes in STL, OBJ, PLY and OFF: their points and triangles only.

trimesh parses in a child process (see `sweeps.reading.sandbox`); textures, materials and colours are left there.
"""

import hashlib
from functools import partial
from pathlib import Path

import numpy as np

from sweeps.reading import sandbox
from sweeps.reading.files import FileBytes
from sweeps.schema.refusals import MapError, RefusedError

SUFFIXES = (".stl", ".obj", ".ply", ".off")
MAX_MESH_BYTES = 2**28
SECONDS_PER_BYTE = 2.0**-21  # processor seconds per byte, in addition to `sandbox.MAX_SECONDS`
MEMORY_FACTOR = 12  # bytes of memory per byte of the file, in addition to `sandbox.MAX_BYTES`
MAX_COORDINATE = 1e30  # bound on coordinates, so that products of five do not overflow
ALLOWED = f"a readable {', '.join(s[1:].upper() for s in SUFFIXES)} file of triangles"


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
    digest = hashlib.file_digest(file, "sha256").hexdigest()
    seconds, memory = (
        sandbox.MAX_SECONDS + file.size * SECONDS_PER_BYTE,
        sandbox.MAX_BYTES + file.size * MEMORY_FACTOR,
    )
    try:
        reason, *arrays = sandbox.parts_from_child(partial(_parse_mesh, file), seconds, memory)
    except sandbox.ChildError:
        reason, arrays = b"it is damaged, or takes too much time or memory", []
    if not arrays:
        reason = "".join(c if c.isprintable() else " " for c in reason.decode("utf-8", "replace")[:100])
        raise MeshError(f"cannot be read as a mesh ({reason})")
    vertices = np.frombuffer(arrays[0], "f8").reshape(-1, 3).copy()
    faces = np.frombuffer(arrays[1], "i8").reshape(-1, 3).copy()
    if len(faces) < 4 or not np.abs(vertices).max() <= MAX_COORDINATE:  # NaN is not
        problem = (
            f"holds no body: fewer than four triangles, or points that are no numbers or beyond {MAX_COORDINATE:g}"
        )
        raise MeshError(problem)
    return vertices, faces, digest


def _parse_mesh(file: FileBytes):
    """Return an empty part, vertices and faces, or one part, why there are none; runs in the child.

    Vertices closer than some 1e-10 of the mesh's size become one: trimesh would merge those within 1e-8 of the file's
    unit, whatever the mesh's size, and keep apart what differs in normals or texture.
    """
    import trimesh

    try:
        file.seek(0)
        with np.errstate(all="ignore"):
            # of a stream, without a path: textures and materials that the file names are not looked for
            kind, options = Path(file.path).suffix[1:].lower(), {"skip_materials": True, "process": False}
            mesh = trimesh.load_mesh(file, file_type=kind, **options)
            vertices = np.array(mesh.vertices, "f8")
            size = np.ptp(vertices, axis=0).max() if len(vertices) else 1.0
            unit = 2.0 ** np.floor(np.log2(size) - 6)  # products with it are exact
            mesh = trimesh.Trimesh(vertices / unit, mesh.faces, process=False)
            mesh.merge_vertices()
        return [b"", (mesh.vertices * unit).tobytes(), np.array(mesh.faces, "i8").tobytes()]
    except MemoryError:
        raise
    except Exception as error:  # its readers let errors of every class through
        return [str(error).encode("utf-8", "replace") or type(error).__name__.encode()]
