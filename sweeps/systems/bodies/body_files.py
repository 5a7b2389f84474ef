"""Bodies from files of their own (`polhode body sat.yaml`), from mappings of parts, and from tensors."""

import re
from collections.abc import Mapping
from typing import Any

from sweeps.schema.refusals import DefinitionError, match_name
from sweeps.systems.bodies.body import FileBody

PARTS_SUFFIXES = ("yaml", "yml", "json", "csv")
ROBOT_SUFFIXES = ("urdf", "sdf", "xml", "mjcf", "xacro")
FILE = re.compile(rf"(.*\.({'|'.join(PARTS_SUFFIXES + ROBOT_SUFFIXES)}))(?::(.+))?", re.IGNORECASE)


class ImpossibleBodyError(DefinitionError):
    """A tensor that no rigid body has; `facts` has the diagnosis."""

    def __init__(self, text: str, facts: dict[str, Any]):
        super().__init__(text)
        self.facts = facts


def find_bodies(body: object) -> list[FileBody]:
    """Return the bodies of FILE or FILE:NAME, of a mapping of parts or a tensor; for any other body, one with it."""
    match = FILE.fullmatch(body) if isinstance(body, str) else None
    if match is None and not (isinstance(body, Mapping) and body.keys() & {"tensor", "parts"}):
        return [FileBody("", body, frame=None)]
    from sweeps.systems.bodies import diagnosed_bodies, parts

    if isinstance(body, Mapping) and "tensor" in body:
        return [diagnosed_bodies.diagnose_entry(body)]
    if match is None:
        return parts.read_bodies(body)
    path, suffix, name = match.groups()
    if suffix.lower() in ROBOT_SUFFIXES:
        return diagnosed_bodies.read_robot(path, name)
    bodies = parts.read_bodies(path)
    if name is None:
        return bodies
    name = match_name(name, [each.name for each in bodies], path, DefinitionError)
    return [each for each in bodies if each.name == name]


def only_body(body: object) -> FileBody:
    """Return the one body of a file or of a mapping of parts; any other body as the entry of a `FileBody`."""
    bodies = [body] if isinstance(body, FileBody) else find_bodies(body)
    if len(bodies) > 1:
        allowed = "one of them, FILE:NAME with NAME " + " or ".join(each.name for each in bodies)
        raise DefinitionError(f"body: is {len(bodies)} bodies; allowed: {allowed}")
    return bodies[0]
