"""Bodies with a diagnosis of their tensors: links of robot files, and tensors with mass, size and centre of mass."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from sweeps.reading import robot_files
from sweeps.schema.refusals import DefinitionError
from sweeps.schema.variables import parse_amount
from sweeps.systems.bodies import inertia_diagnosis
from sweeps.systems.bodies.body import FileBody

EVIDENCE = {"mass": "kg", "centre": "m", "size": "m"}  # keys beside a tensor that only the diagnosis uses → unit

MAX_ENTRY = 1e300  # kg m2, bound on entries, so that their sums do not overflow


def read_robot(path: str) -> list[FileBody]:
    """Return the links of a robot file as bodies, tensors in the links' axes.

    The size of a link is that of its shapes, unless its centre of mass is outside of them. Frames, links without mass
    and moments, are left out.
    """
    bodies = []
    for link in robot_files.read_links(path):
        points = (link.points - link.centre) @ link.rotation
        is_inside = len(points) > 0 and (points.min(axis=0) <= 0).all() and (points.max(axis=0) >= 0).all()
        offset = link.rotation.T @ link.centre
        evidence = inertia_diagnosis.Evidence(link.mass, offset, points if is_inside else None, link.rotation)
        if link.mass or link.tensor.any():
            tensor = link.rotation @ link.tensor @ link.rotation.T
            entry = {"name": link.name, "tensor": ((tensor + tensor.T) / 2).tolist()}
            bodies.append(_diagnose(entry, link.tensor, evidence, {"mass": link.mass, "centre": link.centre.tolist()}))
    return bodies


def diagnose_entry(entry: Mapping) -> list[FileBody]:
    """Return the body of an entry with a tensor; [] for an invalid one, which the check of the definition refuses."""
    entry, values = dict(entry), {}
    for name, unit in EVIDENCE.items():
        if (given := entry.pop(name, None)) is not None:
            amounts = [parse_amount(f"body: {name}", value, unit) for value in np.atleast_1d(given).tolist()]
            if len(amounts) != (1 if name == "mass" else 3) or (name != "centre" and not min(amounts) > 0):
                allowed = "a positive mass, three edges > 0, or three coordinates of the centre of mass"
                raise DefinitionError(f"body: {name}: {given} is out of range; allowed: {allowed}")
            values[name] = np.array(amounts)
    try:
        rows = [[parse_amount("body: tensor", value, "kg m2") for value in row] for row in entry["tensor"]]
        tensor = np.reshape(rows, (3, 3))
    except (DefinitionError, TypeError, ValueError):
        return []
    if not np.abs(tensor).max() <= MAX_ENTRY:
        return []
    points = robot_files.CORNERS * values["size"] / 2 if "size" in values else None
    mass = values["mass"].item() if "mass" in values else None
    evidence = inertia_diagnosis.Evidence(mass, values.get("centre"), points)
    body = _diagnose(entry, tensor, evidence, {name: value.tolist() for name, value in values.items()})
    return [replace(body, frame=None)]


def _diagnose(entry: dict, tensor: np.ndarray, evidence: inertia_diagnosis.Evidence, facts: dict) -> FileBody:
    diagnosis = inertia_diagnosis.diagnose(tensor, evidence)
    facts = facts | {"diagnosis": diagnosis.facts}
    return FileBody(entry.get("name", ""), entry, facts=facts, lines=tuple(diagnosis.lines))
