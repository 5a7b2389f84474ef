r"""Links of robots in URDF, SDF and MJCF files: mass, centre of mass, tensor of inertia, and points around the shapes.

The tensor is as written, in the axes of the link's inertial frame, which the matrix R rotates into those of the link:

.. math:: T_{\text{link}} = R\,T\,R^\mathsf{T}, \qquad R = R_z(\text{yaw})\,R_y(\text{pitch})\,R_x(\text{roll})

for URDF and SDF. A box stands for a cylinder, a sphere and a capsule. A mesh is read if it is an STL, OBJ, PLY or OFF
file below the robot file's folder, or below the folder above it that has the name of the package.

Expat parses the XML in a child process (see `sweeps.reading.sandbox`). Document types, and with them entities, and
elements that include other files are refused.

Source: URDF, wiki.ros.org/urdf/XML/link; SDFormat 1.11, sdformat.org/spec; MuJoCo 3, XML reference, body/inertial.
"""

from collections.abc import Iterator, Sequence
from functools import partial
from itertools import product
from pathlib import Path, PurePosixPath
from typing import NamedTuple
from xml.etree import ElementTree
from xml.etree.ElementTree import Element
from xml.parsers import expat

import numpy as np
from scipy.spatial.transform import Rotation

from sweeps.reading import mesh, sandbox
from sweeps.reading.files import FileBytes
from sweeps.schema.refusals import DefinitionError, MapError, UnreadableError, display, message

MESH_SUFFIXES = (".stl", ".obj", ".ply", ".off")  # formats without a unit of length of their own
MAX_ROBOT_BYTES = 2**24  # bytes of a robot file; large public ones have 1 MiB
MAX_SHAPE_BYTES = 2**25  # bytes of a mesh that is read for its size
ENTRIES = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
FORMATS = "a URDF, SDF or MJCF file of at most 16 MiB without document type and entities"
XACRO = "its expansion: xacro robot.urdf.xacro > robot.urdf (pip install xacro)"
CORNERS = np.array(list(product((-1, 1), repeat=3)))  # corners of a cube of edge 2
GEOM_SIZES = {"box": 3, "ellipsoid": 3, "sphere": 1, "cylinder": 2, "capsule": 2}  # type of MJCF → numbers of its size
Pose = tuple[list[float], np.ndarray]  # position, m, and rotation matrix


class Link(NamedTuple):
    """A link of a robot with an inertial element."""

    name: str
    mass: float  #: kg
    centre: np.ndarray  #: centre of mass in the link's frame, m, shape (3,)
    rotation: np.ndarray  #: rotation matrix from the axes of the tensor to those of the link, shape (3, 3)
    tensor: np.ndarray  #: tensor of inertia as written, kg m2, shape (3, 3)
    points: np.ndarray  #: points that enclose the link's shapes, in the link's frame, m, shape (n, 3)


def read_links(path: str | Path) -> list[Link]:
    """Return the links of a robot file that have an inertial element; refuse a file without any."""
    try:
        root = _read_xml(path)
        if str(path).endswith(".xacro") or any(element.tag.startswith("xacro:") for element in root.iter()):
            raise UnreadableError(("(file)",), "", "has macros of xacro", XACRO)
        if root.find(".//include") is not None:
            raise UnreadableError(("include",), "", "names another file", "one file with all links")
        links = list((_mjcf_links if root.tag == "mujoco" else _links)(root, Path(path)))
        if root.tag not in ("robot", "sdf", "mujoco") or not links:
            raise UnreadableError((root.tag,), "", "has no link with an inertial element", FORMATS)
        return links
    except UnreadableError as error:
        raise DefinitionError(message(str(path), [error.problem])) from None
    except ValueError as error:  # SciPy raises it for a quaternion 0 and an unknown sequence of Euler angles
        raise DefinitionError(f"{path}: {error}; allowed: {FORMATS}") from None


def _read_xml(path: str | Path) -> Element:
    """Return the root of an XML file, parsed in a child process."""
    reason = b"is too large, or takes too much time"
    try:
        with FileBytes(path) as file:
            if file.size <= MAX_ROBOT_BYTES:
                reason, *content = sandbox.parts_from_child(partial(_parse_xml, file), sandbox.MAX_SECONDS)
                if content:
                    return _element_of(content[0])
    except (OSError, MapError, sandbox.ChildError) as error:
        reason = str(getattr(error, "strerror", None) or error or "is damaged").encode()
    raise UnreadableError(("(file)",), "", reason.decode(errors="replace"), FORMATS)


def _parse_xml(file: FileBytes) -> list[bytes]:
    """Return an empty part and the document without comments, or one part, why it is refused; runs in the child."""
    try:
        return [b"", ElementTree.tostring(_element_of(file.read_at(0, file.size)), encoding="utf-8")]
    except ValueError as error:
        return [str(error).encode()]
    except expat.ExpatError as error:
        return [f"is no XML document ({error})".encode()]


def _element_of(content: bytes) -> Element:
    """Return the root of a document, prefixes as a part of its names; refuse one with a document type."""

    def refuse(*arguments):
        raise ValueError("has a document type or an entity")

    builder, parser = ElementTree.TreeBuilder(), expat.ParserCreate()
    parser.StartElementHandler, parser.EndElementHandler = builder.start, builder.end
    parser.CharacterDataHandler = builder.data
    parser.StartDoctypeDeclHandler = parser.EntityDeclHandler = refuse
    parser.Parse(content, True)
    return builder.close()


def _numbers(text: str | None, default: str, where: str) -> list[float]:
    """Return as many finite numbers as a default text has, of an element or attribute `where`."""
    try:
        values = [float(word) for word in (default if text is None else text).split()]
    except ValueError:
        values = []
    if len(values) != len(default.split()) or not all(abs(value) <= mesh.MAX_COORDINATE for value in values):
        allowed = f"{len(default.split())} numbers of at most {mesh.MAX_COORDINATE:g}"
        raise UnreadableError((where,), display(text), "is refused", allowed)
    return values


def _link(name: str, mass: float, pose: Pose, entries: Sequence[float], points: Sequence[np.ndarray]) -> Link:
    tensor = np.array(entries)[[[0, 1, 2], [1, 3, 4], [2, 4, 5]]]
    return Link(name, mass, np.array(pose[0]), pose[1], tensor, np.concatenate([np.empty((0, 3)), *points]))


def _box(kind: str, sizes: Sequence[float], pose: Pose) -> np.ndarray:
    """Return the corners of a box around a shape, of which the sizes are half its edges, or radius and half length."""
    radius, length = sizes[0], sizes[-1] + (sizes[0] if kind == "capsule" else 0.0)
    return CORNERS * (sizes if len(sizes) == 3 else [radius, radius, length]) @ pose[1].T + pose[0]


def _value(element: Element | None, key: str) -> str | None:
    """Return the text of the attribute (URDF) or the element (SDF) `key`; None without it."""
    return None if element is None else element.get(key, element.findtext(key))


def _links(root: Element, path: Path) -> Iterator[Link]:
    """Yield the links of a URDF or SDF file; in SDF a mass left out is 1 kg, and a moment 1 kg m2."""
    models = list(root.iter("model")) if root.tag == "sdf" else [root]
    default_value = "1" if root.tag == "sdf" else "0"
    for model, link in [(parent, child) for parent in models for child in parent.findall("link")]:
        name = link.get("name", "") if len(models) == 1 else f"{model.get('name')}::{link.get('name')}"
        if (inertial := link.find("inertial")) is None:
            continue
        defaults = [default_value if entry[1] == entry[2] else "0" for entry in ENTRIES]
        values = [_value(inertial.find("inertia"), entry) for entry in ENTRIES]
        entries = [_numbers(*pair, f"{name}: inertia")[0] for pair in zip(values, defaults, strict=True)]
        mass = inertial.findtext("mass") if root.tag == "sdf" else _value(inertial.find("mass"), "value")
        shapes = [
            _shape_points(shape, _pose(element, name), name, path)
            for element in (*link.findall("visual"), *link.findall("collision"))
            for shape in element.findall("geometry/*")
        ]
        yield _link(name, _numbers(mass, default_value, f"{name}: mass")[0], _pose(inertial, name), entries, shapes)


def _shape_points(shape: Element, pose: Pose, name: str, path: Path) -> np.ndarray:
    """Return points that enclose a shape of URDF or SDF; none of a shape or a mesh that cannot be read."""
    if shape.tag == "mesh":
        scale = _numbers(_value(shape, "scale"), "1 1 1", f"{name}: scale")
        return _mesh_points(path, shape.get("filename") or shape.findtext("uri") or "") * scale @ pose[1].T + pose[0]
    if shape.tag not in GEOM_SIZES:
        return np.empty((0, 3))
    keys = {"size": "0 0 0"} if shape.tag == "box" else {"radius": "0", "length": "0"}
    values = [value for key in keys for value in _numbers(_value(shape, key), keys[key], f"{name}: {key}")]
    if shape.tag != "box":
        values[0] *= 2
    return _box(shape.tag, [value / 2 for value in values[: GEOM_SIZES[shape.tag]]], pose)


def _mesh_points(path: Path, uri: str) -> np.ndarray:
    """Return the vertices of a mesh below the folder of a robot file or of its package; none of another file."""
    scheme, name = uri.rpartition("://")[::2]
    folders, steps = [path.resolve().parent], PurePosixPath(name).parts
    if scheme in ("package", "model"):
        folders, steps = [folder for folder in folders[0].parents if steps and folder.name == steps[0]], steps[1:]
    file = folders[0].joinpath(*steps).resolve() if folders else path
    is_mesh = scheme in ("", "package", "model") and file.suffix.lower() in MESH_SUFFIXES
    if is_mesh and file.is_relative_to(folders[0]) and file.is_file() and file.stat().st_size <= MAX_SHAPE_BYTES:
        try:
            return mesh.read(file)[0]
        except mesh.MeshError:
            pass
    return np.empty((0, 3))


def _pose(element: Element, name: str) -> Pose:
    """Return the position and the rotation matrix of an element's origin (URDF) or pose (SDF)."""
    origin, pose, where = element.find("origin"), element.find("pose"), f"{name}: pose"
    if pose is None:
        values = [value for key in ("xyz", "rpy") for value in _numbers(_value(origin, key), "0 0 0", where)]
        return values[:3], Rotation.from_euler("xyz", values[3:]).as_matrix()
    if pose.get("relative_to"):
        raise UnreadableError((where,), "", "is relative to another frame", "poses in the frame of the link")
    if pose.get("rotation_format") == "quat_xyzw":
        values = _numbers(pose.text, "0 0 0 0 0 0 1", where)
        return values[:3], Rotation.from_quat(values[3:]).as_matrix()
    values = _numbers(pose.text, "0 0 0 0 0 0", where)
    return values[:3], Rotation.from_euler("xyz", values[3:], pose.get("degrees") == "true").as_matrix()


def _mjcf_links(root: Element, path: Path) -> Iterator[Link]:
    """Yield the bodies of an MJCF file that have inertial elements; MuJoCo computes the remaining ones from geoms."""
    compiler = root.find("compiler")
    compiler = Element("compiler") if compiler is None else compiler
    for number, body in enumerate(root.iter("body"), 1):
        name = body.get("name", f"body {number}")
        if (inertial := body.find("inertial")) is None:
            continue
        moments = _numbers(inertial.get("diaginertia"), "0 0 0", f"{name}: diaginertia")
        values = _numbers(inertial.get("fullinertia"), " ".join(map(repr, [*moments, 0, 0, 0])), f"{name}: fullinertia")
        geoms = body.findall("geom")  # without those that take type and size from defaults or a mesh, none is used
        is_explicit = all(
            geom.get("type") in GEOM_SIZES and geom.get("size") and not geom.get("fromto") for geom in geoms
        )
        boxes = []
        for geom in geoms if is_explicit else ():
            kind, words = geom.attrib["type"], geom.attrib["size"].split()
            sizes = _numbers(" ".join(words[: GEOM_SIZES[kind]]), "0 " * GEOM_SIZES[kind], f"{name}: size")
            boxes.append(_box(kind, sizes, _mjcf_pose(geom, compiler, name)))
        mass = _numbers(inertial.get("mass"), "0", f"{name}: mass")[0]
        yield _link(
            name, mass, _mjcf_pose(inertial, compiler, name), [values[place] for place in (0, 3, 4, 1, 5, 2)], boxes
        )


def _mjcf_pose(element: Element, compiler: Element, name: str) -> Pose:
    """Return the position and the rotation matrix of an inertial element or a geom."""
    position, is_degrees = _numbers(element.get("pos"), "0 0 0", f"{name}: pos"), compiler.get("angle") != "radian"
    if element.get("axisangle"):
        *axis, angle = _numbers(element.get("axisangle"), "0 0 1 0", f"{name}: axisangle")
        rotation = Rotation.from_rotvec(np.array(axis) / (np.linalg.norm(axis) or 1.0) * angle, is_degrees)
    elif element.get("euler"):  # small letters are rotating axes in MuJoCo, and fixed ones in SciPy
        angles = _numbers(element.get("euler"), "0 0 0", f"{name}: euler")
        rotation = Rotation.from_euler(compiler.get("eulerseq", "xyz").swapcase(), angles, is_degrees)
    elif element.get("xyaxes") or element.get("zaxis"):
        raise UnreadableError((name,), "", "has an orientation by axes", "quat, euler or axisangle")
    else:
        rotation = Rotation.from_quat(_numbers(element.get("quat"), "1 0 0 0", f"{name}: quat"), scalar_first=True)
    return position, rotation.as_matrix()
