r"""Links of robots in URDF, SDF and MJCF files: mass, centre of mass, tensor of inertia, and points around the shapes.

The tensor is as written, in the axes of the link's inertial frame, which the matrix R rotates into those of the link:

.. math:: T_{\text{link}} = R\,T\,R^\mathsf{T}, \qquad R = R_z(\text{yaw})\,R_y(\text{pitch})\,R_x(\text{roll})

for URDF and SDF. A box stands for a cylinder, a sphere and a capsule. A mesh is read if it is an STL, OBJ, PLY or OFF
file below the robot file's folder, or below the folder above it that has the name of the package. Geoms of MJCF have
the defaults of their classes; meshes among them are not read.

Expat parses the XML in a child process (see `sweeps.reading.sandbox`). Document types, and with them entities, and
elements that include other files are refused.

Source: URDF, wiki.ros.org/urdf/XML/link; SDFormat 1.11, sdformat.org/spec; MuJoCo 3, XML reference, body/inertial.
"""

from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from functools import partial
from itertools import product
from pathlib import Path, PurePosixPath
from typing import Any, NamedTuple
from xml.etree.ElementTree import Element, TreeBuilder
from xml.parsers import expat

import numpy as np
from scipy.spatial.transform import Rotation

from sweeps.reading import mesh, sandbox
from sweeps.reading.files import FileBytes
from sweeps.schema.refusals import DefinitionError, MapError, UnreadableError, display, match_name, message

MESH_SUFFIXES = (".stl", ".obj", ".ply", ".off")  # formats without a unit of length of their own
MAX_ROBOT_BYTES = 2**24  # bytes of a robot file; large public ones have 1 MiB
MAX_SHAPE_BYTES = 2**25  # bytes of a mesh that is read for its size
ENTRIES = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
MATRIX = [[0, 1, 2], [1, 3, 4], [2, 4, 5]]  # indices of these entries in a tensor
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


def read_links(path: str | Path, name: str | None = None) -> list[Link]:
    """Return the links of a robot file that have an inertial element, or those of a name; refuse a file without any.

    Args:
        path: the file.
        name: the name, or a unique part of it; None for all links.
    """
    try:
        root = _read_xml(path)
        if str(path).endswith(".xacro") or any(element.tag.startswith("xacro:") for element in root.iter()):
            raise UnreadableError(("(file)",), "", "has macros of xacro", XACRO)
        if root.find(".//include") is not None:
            raise UnreadableError(("include",), "", "names another file", "one file with all links")
        links, read = _inertial_links(root), _read_body if root.tag == "mujoco" else _read_link
        _set_defaults(root)
        if root.tag not in ("robot", "sdf", "mujoco") or not links:
            raise UnreadableError((root.tag,), "", "has no link with an inertial element", FORMATS)
        if name is not None:
            name = match_name(name, [link_name for link_name, element in links], str(path), DefinitionError)
        return [read(*link, root, Path(path)) for link in links if name in (None, link[0])]
    except UnreadableError as error:
        raise DefinitionError(message(str(path), [error.problem])) from None
    except DefinitionError:
        raise
    except ValueError as error:  # SciPy raises it for a quaternion 0 and an unknown sequence of Euler angles
        raise DefinitionError(f"{path}: {error}; allowed: {FORMATS}") from None


def _read_xml(path: str | Path) -> Element:
    """Return the root of an XML file, parsed in a child process."""
    try:
        with FileBytes(path) as file:
            if file.size > MAX_ROBOT_BYTES:
                raise sandbox.ChildError
            calls = sandbox.run_in_child(partial(_parse_xml, file), file.size)["calls"]
    except (OSError, MapError, sandbox.ChildError) as error:
        reason = getattr(error, "strerror", None) or str(error) or "is too large, or takes too much time"
        raise UnreadableError(("(file)",), "", reason, FORMATS) from None
    builder = TreeBuilder()
    for method, *arguments in calls:
        getattr(builder, method)(*arguments)
    return builder.close()


def _parse_xml(file: FileBytes) -> dict:
    """Return calls of a `TreeBuilder` that make the document; runs in the child.

    Prefixes are a part of names; a document type is refused.
    """
    calls: list[tuple] = []

    def refuse(*arguments):
        raise ValueError("has a document type or an entity")

    parser = expat.ParserCreate()
    parser.StartElementHandler = lambda name, attributes: calls.append(("start", name, attributes))
    parser.EndElementHandler = lambda name: calls.append(("end", name))
    parser.CharacterDataHandler = lambda text: calls.append(("data", text))
    parser.StartDoctypeDeclHandler = parser.EntityDeclHandler = refuse
    try:
        parser.Parse(file.read_at(0, file.size), True)
    except expat.ExpatError as error:
        raise ValueError(f"is no XML document ({error})") from None
    return {"calls": calls}


def _inertial_links(root: Element) -> list[tuple[str, Element]]:
    """Return name and element of each link or body with an inertial element; MuJoCo computes others from geoms."""
    tag, models = "body" if root.tag == "mujoco" else "link", list(root.iter("model"))
    owners = {link: f"{model.get('name')}::" for model in models for link in model if len(models) > 1}
    links = [(element.get("name", f"{tag} {number}"), element) for number, element in enumerate(root.iter(tag), 1)]
    return [(owners.get(link, "") + name, link) for name, link in links if link.find("inertial") is not None]


def _numbers(element: Element | None, key: str, default: str, name: str) -> list[float]:
    """Return as many finite numbers as a default text has, of an attribute or an inner element `key` of a link."""
    text = default if element is None else element.get(key, element.findtext(key, default))
    try:
        values = [float(word) for word in text.split()]
    except ValueError:
        values = []
    if len(values) != len(default.split()) or not all(abs(value) <= mesh.MAX_COORDINATE for value in values):
        allowed = f"{len(default.split())} numbers of at most {mesh.MAX_COORDINATE:g}"
        raise UnreadableError((f"{name}: {key}",), display(text), "is refused", allowed)
    return values


def _link(name: str, mass: float, pose: Pose, entries: Sequence[float], groups: Iterable[list]) -> Link:
    """Return a link; of its groups of shapes, each points or None, those that are known wholly give its size."""
    points = [each for group in groups if all(each is not None for each in group) for each in group]
    tensor = np.array(entries)[MATRIX]
    return Link(name, mass, np.array(pose[0]), pose[1], tensor, np.concatenate([np.empty((0, 3)), *points]))


def _box(kind: str, sizes: Sequence[float], pose: Pose) -> np.ndarray:
    """Return the corners of a box around a shape from its sizes: half its edges, or radius and half length."""
    radius, length = sizes[0], sizes[-1] + (sizes[0] if kind == "capsule" else 0.0)
    return CORNERS * (sizes if len(sizes) == 3 else [radius, radius, length]) @ pose[1].T + pose[0]


# -- URDF and SDF


def _read_link(name: str, link: Element, root: Element, path: Path) -> Link:
    """Return a link of a URDF or SDF file; in SDF a mass left out is 1 kg, and a moment 1 kg m2."""
    inertial: Any = link.find("inertial")
    is_sdf = root.tag == "sdf"
    default, moments = "1" if is_sdf else "0", inertial.find("inertia")
    entries = [_numbers(moments, entry, default if entry[1] == entry[2] else "0", name)[0] for entry in ENTRIES]
    mass = _numbers(inertial, "mass", default, name) if is_sdf else _numbers(inertial.find("mass"), "value", "0", name)
    groups = ([(each, _pose(each, name)) for each in link.findall(group)] for group in ("visual", "collision"))
    points = (
        [_shape_points(shape, pose, name, path) for element, pose in group for shape in element.findall("geometry/*")]
        for group in groups
    )
    return _link(name, mass[0], _pose(inertial, name), entries, points)


def _shape_points(shape: Element, pose: Pose, name: str, path: Path) -> np.ndarray | None:
    """Return points that enclose a shape of URDF or SDF; None for an unknown shape and a mesh that cannot be read."""
    if shape.tag == "mesh":
        points = _mesh_points(path, shape.get("filename") or shape.findtext("uri") or "")
        scale = _numbers(shape, "scale", "1 1 1", name)
        return None if points is None else points * scale @ pose[1].T + pose[0]
    if shape.tag not in GEOM_SIZES:
        return None
    if shape.tag == "box":
        return _box("box", [edge / 2 for edge in _numbers(shape, "size", "0 0 0", name)], pose)
    sizes = *_numbers(shape, "radius", "0", name), _numbers(shape, "length", "0", name)[0] / 2
    return _box(shape.tag, sizes[: GEOM_SIZES[shape.tag]], pose)


def _mesh_points(path: Path, uri: str) -> np.ndarray | None:
    """Return the vertices of a mesh below the folder of a robot file or of its package; None for another file."""
    scheme, name = uri.rpartition("://")[::2]
    folders, steps = [path.resolve().parent], PurePosixPath(name).parts
    if scheme in ("package", "model"):
        folders, steps = [folder for folder in folders[0].parents if steps and folder.name == steps[0]], steps[1:]
    file = folders[0].joinpath(*steps).resolve() if folders else path
    is_mesh = scheme in ("", "package", "model") and file.suffix.lower() in MESH_SUFFIXES
    if is_mesh and file.is_relative_to(folders[0]) and file.is_file() and file.stat().st_size <= MAX_SHAPE_BYTES:
        with suppress(mesh.MeshError):
            return mesh.read(file)[0]
    return None


def _pose(element: Element, name: str) -> Pose:
    """Return the position and the rotation matrix of an element's origin (URDF) or pose (SDF)."""
    origin, pose = element.find("origin"), element.find("pose")
    if pose is None:
        position, angles = (_numbers(origin, key, "0 0 0", name) for key in ("xyz", "rpy"))
        return position, Rotation.from_euler("xyz", angles).as_matrix()
    if pose.get("relative_to"):
        raise UnreadableError((f"{name}: pose",), "", "is relative to another frame", "poses in the frame of the link")
    if pose.get("rotation_format") == "quat_xyzw":
        values = _numbers(element, "pose", "0 0 0 0 0 0 1", name)
        return values[:3], Rotation.from_quat(values[3:]).as_matrix()
    values = _numbers(element, "pose", "0 0 0 0 0 0", name)
    return values[:3], Rotation.from_euler("xyz", values[3:], pose.get("degrees") == "true").as_matrix()


# -- MJCF


def _read_body(name: str, body: Element, root: Element, path: Path) -> Link:
    """Return a body of an MJCF file."""
    inertial: Any = body.find("inertial")
    compiler = root.find("compiler")
    settings = {} if compiler is None else compiler.attrib
    moments = _numbers(inertial, "diaginertia", "0 0 0", name)
    values = _numbers(inertial, "fullinertia", " ".join(map(repr, [*moments, 0, 0, 0])), name)
    points = [_geom_points(geom, settings, name) for geom in body.findall("geom")]
    mass, pose = _numbers(inertial, "mass", "0", name)[0], _mjcf_pose(inertial, settings, name)
    return _link(name, mass, pose, [values[place] for place in (0, 3, 4, 1, 5, 2)], [points])


def _set_defaults(root: Element) -> None:
    """Give each geom of an MJCF file what it leaves to its class, or to the class of the bodies around it."""
    classes = {root: "main"}  # element → class of the geoms in it
    defaults: dict[str, dict[str, str]] = {}  # class → attributes of its geoms
    for element in root.iter():
        for child in element:
            classes[child] = child.get("class" if child.tag == "default" else "childclass", classes[element])
            if child.tag == "default":
                geoms = {} if (geom := child.find("geom")) is None else geom.attrib
                defaults[classes[child]] = defaults.get(classes[element], {}) | geoms
    for body in root.iter("body"):
        for geom in body.findall("geom"):
            geom.attrib.update(defaults.get(geom.get("class", classes[body]), {}) | geom.attrib)


def _geom_points(geom: Element, settings: Mapping[str, str], name: str) -> np.ndarray | None:
    """Return points that enclose a geom of MJCF; None for one of a mesh or a plane."""
    kind, count, has_ends = geom.get("type", "sphere"), len(geom.get("size", "").split()), "fromto" in geom.attrib
    num_sizes = GEOM_SIZES.get(kind, 4)
    if count < (1 if has_ends else num_sizes):
        return None
    sizes = _numbers(geom, "size", "0 " * count, name)
    if has_ends:  # `fromto` has both ends of the axis
        ends = np.reshape(_numbers(geom, "fromto", "0 " * 6, name), (2, 1, 3))
        return (ends + sizes[0] * CORNERS).reshape(-1, 3)
    return _box(kind, sizes[:num_sizes], _mjcf_pose(geom, settings, name))


def _mjcf_pose(element: Element, settings: Mapping[str, str], name: str) -> Pose:
    """Return the position and the rotation matrix of an inertial element or a geom, with the compiler's settings."""
    position, is_degrees = _numbers(element, "pos", "0 0 0", name), settings.get("angle") != "radian"
    if element.get("axisangle"):
        *axis, angle = _numbers(element, "axisangle", "0 0 1 0", name)
        rotation = Rotation.from_rotvec(np.array(axis) / (np.linalg.norm(axis) or 1.0) * angle, is_degrees)
    elif element.get("euler"):  # small letters are rotating axes in MuJoCo, and fixed ones in SciPy
        angles = _numbers(element, "euler", "0 0 0", name)
        rotation = Rotation.from_euler(settings.get("eulerseq", "xyz").swapcase(), angles, is_degrees)
    elif element.get("xyaxes") or element.get("zaxis"):
        raise UnreadableError((name,), "", "has an orientation by axes", "quat, euler or axisangle")
    else:
        rotation = Rotation.from_quat(_numbers(element, "quat", "1 0 0 0", name), scalar_first=True)
    return position, rotation.as_matrix()
