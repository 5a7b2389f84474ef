"""Bodies from files of their own (`polhode body sat.yaml`), and from mappings of parts: readers by suffix."""

import re
from collections.abc import Callable, Mapping
from typing import Any

from sweeps.schema.refusals import DefinitionError, match_name
from sweeps.systems.bodies.body import FileBody


def _read_parts(path: str) -> list[FileBody]:
    from sweeps.systems.bodies import parts

    return parts.read_bodies(path)


class ImpossibleBodyError(DefinitionError):
    """A tensor that no rigid body has; `facts` has the diagnosis."""

    def __init__(self, text: str, facts: dict[str, Any]):
        super().__init__(text)
        self.facts = facts


def _read_robot(path: str) -> list[FileBody]:
    from sweeps.systems.bodies import diagnosed_bodies

    return diagnosed_bodies.read_robot(path)


#: suffix → function that takes the path and returns the bodies of the file
READERS: dict[str, Callable[[str], list[FileBody]]] = dict.fromkeys((".yaml", ".yml", ".json", ".csv"), _read_parts)
READERS |= dict.fromkeys((".urdf", ".sdf", ".xml", ".mjcf", ".xacro"), _read_robot)


def find_bodies(body: object) -> list[FileBody]:
    """Return the bodies of a file, FILE or FILE:NAME for one of them, or of a mapping of parts; [] for other bodies."""
    if isinstance(body, Mapping) and "tensor" in body:
        from sweeps.systems.bodies import diagnosed_bodies

        return diagnosed_bodies.diagnose_entry(body)
    if isinstance(body, Mapping) and "parts" in body:
        from sweeps.systems.bodies import parts

        return parts.bodies_of(body)
    suffixes = "|".join(map(re.escape, READERS))
    match = re.fullmatch(rf"(.*({suffixes}))(?::(.+))?", body, re.IGNORECASE) if isinstance(body, str) else None
    if match is None:
        return []
    path, suffix, name = match.groups()
    bodies = READERS[suffix.lower()](path)
    if name is None:
        return bodies
    name = match_name(name, [each.name for each in bodies], path, DefinitionError)
    return [each for each in bodies if each.name == name]


def only_body(body: object) -> FileBody:
    """Return the one body of a file or of a mapping of parts; any other body as the entry of a `FileBody`."""
    bodies = [body] if isinstance(body, FileBody) else find_bodies(body) or [FileBody("", body, frame=None)]
    if len(bodies) > 1:
        allowed = "one of them, FILE:NAME with NAME " + " or ".join(each.name for each in bodies)
        raise DefinitionError(f"body: is {len(bodies)} bodies; allowed: {allowed}")
    return bodies[0]
