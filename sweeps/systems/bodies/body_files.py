"""Bodies from files of their own (`polhode body sat.yaml`), and from mappings of parts: readers by suffix."""

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from sweeps.schema.refusals import DefinitionError, match_name


@dataclass(frozen=True)
class FileBody:
    """A body that a file describes, as a definition would give it, and what the file has in addition."""

    name: str  #: name among the bodies of the file, by which FILE:NAME selects it
    entry: dict[str, Any]  #: entry of a definition: name, and tensor about the centre of mass, kg m2
    omega: tuple[float, float, float] | None = None  #: angular velocity that the file gives, rad s-1, in its axes
    facts: dict[str, Any] = field(default_factory=dict)  #: further numbers for JSON
    lines: tuple[str, ...] = ()  #: further lines for people


class ImpossibleBodyError(DefinitionError):
    """A tensor that no rigid body has; `facts` has the diagnosis."""

    def __init__(self, text: str, facts: dict[str, Any]):
        super().__init__(text)
        self.facts = facts


def _read_robot(path: str) -> list[FileBody]:
    from sweeps.systems.bodies import diagnosed_bodies

    return [FileBody(**values) for values in diagnosed_bodies.read_robot(path)]


#: suffix → function that takes the path and returns the bodies of the file
READERS: dict[str, Callable[[str], list[FileBody]]] = dict.fromkeys(
    (".urdf", ".sdf", ".xml", ".mjcf", ".xacro"), _read_robot
)


def find_bodies(body: object) -> list[FileBody]:
    """Return the bodies of a file, FILE or FILE:NAME for one of them, or of a mapping of parts; [] for other bodies."""
    if isinstance(body, Mapping) and "tensor" in body:
        from sweeps.systems.bodies import diagnosed_bodies

        return [FileBody(**values) for values in diagnosed_bodies.diagnose_entry(body)]
    if not isinstance(body, str):
        return []
    suffixes = "|".join(map(re.escape, READERS))
    match = re.fullmatch(rf"(.*(?:{suffixes}))(?::(.+))?", body, re.IGNORECASE | re.DOTALL) if READERS else None
    if match is None:
        return []
    path, name = match.groups()
    suffix = next(suffix for suffix in READERS if path.lower().endswith(suffix))
    bodies = READERS[suffix](path)
    if name is None:
        return bodies
    return [each for each in bodies if each.name == match_name(name, [b.name for b in bodies], path, DefinitionError)]


def only_entry(body: object) -> object:
    """Return the entry of a definition for a file of one body; `body` itself if it is no file."""
    bodies = find_bodies(body)
    if len(bodies) > 1:
        allowed = ", ".join(f"{body}:{each.name}" for each in bodies)
        raise DefinitionError(f"body: {body} holds {len(bodies)} bodies; allowed: {allowed}")
    return bodies[0].entry if bodies else body


def write_definition(body: object, path: str) -> None:
    """Write the possible bodies of a file, at 1 rad s-1, as a definition for sweeps to a YAML file `path`."""
    from sweeps.process.files import replace_output
    from sweeps.reading.definitions import as_yaml

    bodies = [each for each in find_bodies(body) if each.facts.get("diagnosis", {}).get("possible", True)]
    if not bodies or not path.endswith(".yaml"):
        allowed = "a file .yaml, and a file of physically possible bodies"
        raise DefinitionError(f"{path}: holds no definition of {body}; allowed: {allowed}")
    entries = [{"name": "your body"} | each.entry for each in bodies]
    text = as_yaml({"title": f"Bodies of {body}"[:200], "bodies": entries, "grid": {"omega0": 1.0}})
    with replace_output(path) as temporary:
        temporary.write_text(text, encoding="utf-8")
