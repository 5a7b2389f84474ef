"""Satellites in the gravity gradient given by bodies or by moments, as a table of k1 and k3."""

import csv
import io
from collections.abc import Mapping
from dataclasses import astuple
from itertools import product
from typing import Any

import numpy as np
from pydantic import ValidationError

from sweeps.schema.parameters import Parameter, Range, Strict, grid_model, key, spread
from sweeps.schema.refusals import UnreadableError, display, validation_problems
from sweeps.systems.bodies.body import Body, list_of
from sweeps.systems.bodies.variables import MOMENT

RATIOS = {"k1": "(I2 - I3)/I1", "k3": "(I2 - I1)/I3"}  # parameter of a system → its meaning, by which it is recognised
MAX_RATIO = 0.9999  # largest |k1| and |k3| of these systems; flat bodies and rods have 1
NAMES = ("roll_moment", "pitch_moment", "yaw_moment")
PARAMETERS = [Parameter(name, MOMENT, name.replace("_", " ") + " of inertia", required=True) for name in NAMES]
Bodies: Any = list_of(Body)
MomentsGrid: Any = grid_model("MomentsGrid", PARAMETERS, __name__)


def inertia_ratios(roll: float, pitch: float, yaw: float) -> tuple[float, float]:
    """Return k1 and k3 of moments about the axes of roll, pitch and yaw."""
    return (pitch - yaw) / roll, (pitch - roll) / yaw


class Satellites(Strict):
    """Bodies with axes 1, 2, 3 along the path (roll), across it (pitch) and down (yaw), or moments about these axes."""

    bodies: Bodies = key("a list of bodies", ())
    grid: MomentsGrid = key("moments about the axes of roll, pitch and yaw", None)


def list_points(values: Mapping, folder: str) -> tuple[dict, bytes] | None:
    """Return a definition's values without its bodies or moments, and a table (CSV) of k1 and k3; None without these.

    The order of all combinations of several moments is that of a grid.
    """
    grid = values.get("grid", {})
    moments = {name: grid[name] for name in NAMES if name in grid} if isinstance(grid, Mapping) else {}
    if not (moments or "bodies" in values):
        return None
    where = ("grid", next(iter(moments))) if moments else ("bodies",)
    if moments and "bodies" in values:
        raise UnreadableError(where, "", "is given beside bodies", "one of them")
    try:
        source = {"grid": moments} if moments else {"bodies": values["bodies"]}
        satellites = Satellites.model_validate(source, context={"folder": folder})
    except ValidationError as error:
        raise UnreadableError(*astuple(validation_problems(error, Satellites)[0])) from None
    entries = [spread(getattr(satellites.grid, name)) for name in NAMES] if moments else []
    grid_values = (entry.values(np.arange(entry.num)) if isinstance(entry, Range) else entry for entry in entries)
    rows = [(body.name, *body.moments) for body in satellites.bodies]
    rows = rows or [("", *each) for each in product(*(column.tolist() for column in grid_values))]
    text = io.StringIO()
    writer = csv.writer(text)
    writer.writerow(("name", "k1", "k3"))
    for name, roll, pitch, yaw in rows:
        ratios = inertia_ratios(roll, pitch, yaw)
        if not max(map(abs, ratios)) <= MAX_RATIO:
            reason = f"have k1 = {ratios[0]:.6g} and k3 = {ratios[1]:.6g}"
            allowed = f"possible bodies that are neither flat nor rods: up to ±{MAX_RATIO} each"
            raise UnreadableError(where, display([roll, pitch, yaw]), reason, allowed)
        writer.writerow((name, *map(repr, ratios)))
    kept_grid = {name: entry for name, entry in grid.items() if name not in NAMES}
    kept_values = {name: value for name, value in values.items() if name != "bodies"}
    return kept_values | {"grid": kept_grid}, text.getvalue().encode()
