"""Bodies with a diagnosis of their tensors: links of robot files, and tensors with mass, size and centre of mass."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Annotated

import numpy as np

from sweeps.reading import robot_files
from sweeps.schema.parameters import Strict, key
from sweeps.schema.refusals import DefinitionError, validate
from sweeps.schema.values import Amount, in_unit, numbers
from sweeps.systems.bodies import inertia_diagnosis
from sweeps.systems.bodies.body import FileBody, Tensor

MAX_ENTRY = 1e300  # kg m2, bound on entries, so that their sums do not overflow


class KnownProperties(Strict):
    """A tensor, and properties of its body that the diagnosis alone uses."""

    tensor: Tensor = key("tensor of inertia about the centre of mass, kg m2", ...)
    mass: in_unit("kg", Amount) = key("mass, kg: > 0")
    size: Annotated[tuple, numbers(("x", "y", "z"), "m", is_size=True)] = key("edges of the box around the body, m")
    centre: Annotated[tuple, numbers(("x", "y", "z"), "m")] = key("centre of mass from the link's origin, m")


def read_robot(path: str, name: str | None = None) -> list[FileBody]:
    """Return the links of a robot file as bodies, tensors in the links' axes; of one name if it is given.

    The size of a link is that of its shapes, unless its centre of mass is outside of them. Frames, links without mass
    and moments, are left out.
    """
    bodies = []
    for link in robot_files.read_links(path, name):
        points = (link.points - link.centre) @ link.rotation
        is_inside = len(points) > 0 and (points.min(axis=0) <= 0).all() and (points.max(axis=0) >= 0).all()
        offset = link.rotation.T @ link.centre
        evidence = inertia_diagnosis.Evidence(link.mass, offset, points if is_inside else None, link.rotation)
        if link.mass or link.tensor.any() or name is not None:
            tensor = link.rotation @ link.tensor @ link.rotation.T
            entry = {"name": link.name, "tensor": ((tensor + tensor.T) / 2).tolist()}
            bodies.append(_diagnose(entry, link.tensor, evidence, {"mass": link.mass, "centre": link.centre.tolist()}))
    if not bodies:
        raise DefinitionError(f"{path}: has no link with mass; allowed: {robot_files.FORMATS}")
    return bodies


def diagnose_entry(entry: Mapping) -> FileBody:
    """Return the body of an entry with a tensor, without mass, size and centre, which the diagnosis uses."""
    names = [name for name in KnownProperties.model_fields if name in entry]
    known = validate(KnownProperties, {name: entry[name] for name in names}, "body")
    entry = {name: value for name, value in entry.items() if name == "tensor" or name not in names}
    if np.abs(known.tensor).max() > MAX_ENTRY:
        return FileBody("", entry, frame=None)
    centre = None if known.centre is None else np.array(known.centre)
    points = None if known.size is None else robot_files.CORNERS * known.size / 2
    evidence = inertia_diagnosis.Evidence(known.mass, centre, points)
    facts = known.model_dump(include={"mass", "size", "centre"}, exclude_none=True)
    return replace(_diagnose(entry, np.array(known.tensor), evidence, facts), frame=None)


def _diagnose(entry: dict, tensor: np.ndarray, evidence: inertia_diagnosis.Evidence, facts: dict) -> FileBody:
    diagnosis = inertia_diagnosis.diagnose(tensor, evidence)
    facts = facts | {"diagnosis": diagnosis.facts}
    return FileBody(entry.get("name", ""), entry, facts=facts, lines=tuple(diagnosis.lines))
