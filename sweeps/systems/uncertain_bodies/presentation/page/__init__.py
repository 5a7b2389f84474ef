"""The page of uncertain bodies: a table, clouds of draws, quantiles and sensitivities.

Draws in the map are shown with their measured values. Otherwise bodies are drawn again from the map's definition, with
its seed: they show the distribution of the moments, without measured values.
"""

import base64
import math
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from sweeps.reading.definitions import definition_of
from sweeps.schema.datasets import Dataset, dimensions, flags
from sweeps.schema.refusals import DefinitionError
from sweeps.systems.presentation import Page
from sweeps.systems.rigid_body.presentation.page import FILES as RIGID_BODY_FILES
from sweeps.systems.rigid_body.presentation.page import natural_axes
from sweeps.systems.uncertain_bodies import designs
from sweeps.systems.uncertain_bodies.system import DRAW_VARIABLES, TWISTS, VARIABLES

if TYPE_CHECKING:
    from sweeps.systems.uncertain_bodies.distribution import Distribution
    from sweeps.systems.uncertain_bodies.measuring import BodySampling

SHARED = tuple(path for path in RIGID_BODY_FILES if path.stem in ("bodies", "triangle"))
_OWN_FILES = ("first.html", "spread.html", "drawn.css", "drawn.js", "spread.js", "part.js")
FILES = (*SHARED, *(Path(__file__).parent / name for name in _OWN_FILES))
QUESTION = "With which probability is each spin unstable?"
KEYS = "★ marks the usual spin axis."

MOMENTS = ("I1_draw", "I2_draw", "I3_draw")
MAX_SHOWN = 2048  # draws of a body
MAX_CLOUD_NUMBERS = 300_000  # numbers of all clouds, some 2 MB of the page
MIN_SHOWN = 50  # draws of a body; fewer show no distribution
MAX_NUMBERS = 60_000  # quantiles and sensitivities, with their errors
SEED = 1  # seed of the selection of the draws
DEFINITION_KEYS = ("bodies", "grid", "uncertainty", "draws", "seed", "method")  # the keys from which bodies are drawn


def page(ds: Dataset) -> Page:
    """Return the system's content of the page of a map."""
    return Page(FILES, QUESTION, KEYS, True, {"nature": natural_axes(ds), **facts(ds)})


def facts(ds: Dataset) -> dict:
    """Return `drawn`, `spread` and `inputs` for the scripts, each empty if there is nothing to show."""
    extra = {dim for spec in (VARIABLES | TWISTS | DRAW_VARIABLES).values() for dim in spec.over} & set(ds.dims)
    points = dimensions(ds.drop_dims(extra))
    return {"drawn": _draws(ds, points), **_statistics(ds, points)}


def _pack_numbers(values: np.ndarray) -> dict:
    """Return numbers in single precision as base64, and their common factor."""
    finite = np.abs(values[np.isfinite(values)])
    scale = float(finite.max(initial=0.0)) or 1.0
    text = base64.b64encode((values / scale).astype("<f4").tobytes()).decode("ascii")
    return {"scale": scale, "values": text}


# -- draws in the map, or drawn again


def _draws(ds: Dataset, points: dict[str, int]) -> dict:
    """Return draws of each body, with their measured values in each spin if the map has draws."""
    has_draws = "draw" in ds.dims
    measured = [name for name in DRAW_VARIABLES if has_draws and name in ds.data_vars and name not in MOMENTS]
    if "body" not in points or (has_draws and any(name not in ds.data_vars for name in MOMENTS)):
        return {}
    spins = math.prod(points.values()) // points["body"]
    max_draws = min(MAX_SHOWN, MAX_CLOUD_NUMBERS // max(1, points["body"] * (len(MOMENTS) + len(measured) * spins)))
    if max_draws < MIN_SHOWN:
        return {}
    bodies = {}
    for name, num_draws, numbers, columns in (
        _stored_draws(ds, points, measured, max_draws) if has_draws else _redraw(ds, max_draws)
    ):
        packed_columns = {column: [_pack_numbers(row) for row in rows] for column, rows in columns.items()}
        bodies[name] = {
            "of": num_draws,
            "shown": len(columns["I1_draw"][0]),
            "numbers": numbers,
            "columns": packed_columns,
        }
    column_facts = [_describe_column(ds, name) for name in (*MOMENTS, *measured)]
    return {"measured": has_draws, "bodies": bodies, "columns": column_facts} if bodies or has_draws else {}


def _stored_draws(ds: Dataset, points: dict[str, int], measured: list[str], max_draws: int) -> Iterator[tuple]:
    """Yield (name, number of draws, numbers of the shown draws, their columns) of each body in the map."""
    numbers = np.sort(np.random.default_rng(SEED).permutation(ds.sizes["draw"])[:max_draws])
    draws, first = ds[[*MOMENTS, *measured]].isel(draw=numbers).transpose(*points, "draw"), {dim: 0 for dim in points}
    for number, name in enumerate(ds["body"].values.tolist()):
        body = draws.isel(body=slice(number, number + 1)).load()
        moments = np.stack([body[name].isel(first, missing_dims="ignore").values for name in MOMENTS])
        is_draw = np.isfinite(moments).all(axis=0)
        columns = {name: [row[is_draw] for row in _rows(body[name].values)] for name in measured}
        columns |= {name: [row[is_draw]] for name, row in zip(MOMENTS, moments, strict=True)}
        num_draws = int(np.isfinite(ds["I1_draw"].isel(first | {"body": number}, missing_dims="ignore").values).sum())
        yield str(name), num_draws, numbers[is_draw].tolist(), columns


def _rows(values: np.ndarray) -> np.ndarray:
    """Return rows along the last dimension, one for each of the page's points or spins of a body, in order."""
    return np.asarray(values, "f8").reshape(-1, values.shape[-1])


def _describe_column(ds: Dataset, name: str) -> dict:
    """Return name, long name, units and flags of a column of draws, for the page's script."""
    spec = DRAW_VARIABLES[name]
    units = "" if spec.units in (None, "1") else spec.units
    meanings = flags(ds[name]) if name in ds.data_vars else {}
    meanings_of_flag = [{"value": value, "meaning": word} for value, word in meanings.items()]
    return {"name": name.removesuffix("_draw"), "longName": spec.long_name, "units": units, "flags": meanings_of_flag}


def _redraw(ds: Dataset, max_draws: int) -> Iterator[tuple]:
    """Yield the same for bodies that can be drawn again from the map's definition alone."""
    for number, (distribution, sampling) in _distributions(ds).items():
        num_draws = min(sampling.draws, max_draws)
        normals = designs.normals(sampling.method, distribution.dimension, num_draws, sampling.seed)
        moments, _, _ = distribution.inertia(normals.reshape(-1, normals.shape[-1])[:max_draws])
        columns = {name: [row] for name, row in zip(MOMENTS, moments.T, strict=True)}
        yield str(ds["body"].values[number]), designs.count_draws(sampling.draws), [], columns


def _distributions(ds: Dataset) -> "dict[int, tuple[Distribution, BodySampling]]":
    """Return number of a body → its distribution and sampling, by the definition in the map; no file is read."""
    from pydantic import ValidationError

    from sweeps.systems.uncertain_bodies.system import UncertainDefinition

    values = {key: value for key, value in definition_of(ds.attrs).items() if key in DEFINITION_KEYS}
    entries, distributions = values.get("bodies"), {}
    by_name = {
        str(entry.get("name")): entry
        for entry in (entries if isinstance(entries, tuple) else ())
        if isinstance(entry, dict)
    }
    for number, name in enumerate(map(str, ds["body"].values.tolist())):
        try:
            body = by_name[name]
            if "mesh" in body:  # the file is not read, as the map has the moments
                moments = {n: float(ds[n].isel(body=number, missing_dims="ignore").values) for n in ("I1", "I2", "I3")}
                body = {key: value for key, value in body.items() if key != "mesh"} | moments
            definition = UncertainDefinition.model_validate({"title": name} | values | {"bodies": (body,)})
        except (ValidationError, DefinitionError, ValueError, KeyError):  # the body has no cloud
            continue
        distributions[number] = definition.distributions[name], definition.sampling(definition.bodies[0])
    return distributions


# -- quantiles and sensitivities


def _statistics(ds: Dataset, points: dict[str, int]) -> dict:
    """Return quantiles and sensitivities, and their errors: a row for each point, in the order of the page."""
    names = [name for name, spec in (VARIABLES | TWISTS).items() if spec.over and name in ds.data_vars]
    size = sum(math.prod(points.values()) * ds.sizes[(VARIABLES | TWISTS)[name].over[0]] for name in names)
    if not names or size > MAX_NUMBERS:
        return {"spread": {}, "levels": [], "inputs": []}
    values = {name: _rows(ds[name].transpose(*points, ...).values).tolist() for name in names}
    rows = {n: [[float(f"{v:.6g}") if math.isfinite(v) else None for v in row] for row in v] for n, v in values.items()}
    levels, inputs = (ds[dim].values.tolist() if dim in ds.coords else [] for dim in ("quantile", "input"))
    return {"spread": rows, "levels": levels, "inputs": inputs}
