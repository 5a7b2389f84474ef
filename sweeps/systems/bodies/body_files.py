"""Bodies from files of their own (`polhode body sat.yaml`), and from mappings of parts: readers by suffix."""

import re
from collections.abc import Callable
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


#: suffix → function that takes the path and returns the bodies of the file
READERS: dict[str, Callable[[str], list[FileBody]]] = {}


def find_bodies(body: object) -> list[FileBody]:
    """Return the bodies of a file, FILE or FILE:NAME for one of them, or of a mapping of parts; [] for other bodies."""
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
