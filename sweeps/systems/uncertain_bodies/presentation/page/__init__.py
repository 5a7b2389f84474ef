"""The part of the page of uncertain bodies: a table, clouds of draws, quantiles and sensitivities.

Draws that the map keeps are shown as they were measured. Where it keeps none, bodies are drawn again as its definition
says, with its own seed: they show which bodies were meant, and nothing was measured of these.
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
from sweeps.systems.rigid_body.presentation.page import FILES as OF_RIGID_BODIES
from sweeps.systems.rigid_body.presentation.page import natural_axes
from sweeps.systems.uncertain_bodies import designs
from sweeps.systems.uncertain_bodies.system import KEPT, TWISTS, VARIABLES

if TYPE_CHECKING:
    from sweeps.systems.uncertain_bodies.distribution import Distribution
    from sweeps.systems.uncertain_bodies.measuring import BodySampling

SHARED = tuple(path for path in OF_RIGID_BODIES if path.stem in ("bodies", "triangle"))
_OWN = ("first.html", "spread.html", "drawn.css", "drawn.js", "spread.js", "part.js")
FILES = (*SHARED, *(Path(__file__).parent / name for name in _OWN))
QUESTION = "With which probability is each spin unstable?"
KEYS = "★ marks the usual spin axis."

MOMENTS = ("I1_draw", "I2_draw", "I3_draw")
MOST_SHOWN = 2048  # draws of a body
MOST_TOLD = 300_000  # numbers of all clouds
LEAST_SHOWN = 50  # draws of a body: fewer are no cloud
MOST_NUMBERS = 60_000  # of quantiles and sensitivities, with their errors
SEED = 1  # of which draws are shown
MEANT = ("bodies", "grid", "uncertainty", "draws", "seed", "method")  # keys without which no body is drawn


def page(ds: Dataset) -> Page:
    """Return the system's part of the page of a map."""
    return Page(FILES, QUESTION, KEYS, True, {"nature": natural_axes(ds), **facts(ds)})


def facts(ds: Dataset) -> dict:
    """Return `drawn`, `spread` and `inputs` for the scripts, each empty where there is nothing to show."""
    extra = {dim for spec in (VARIABLES | TWISTS | KEPT).values() for dim in spec.over} & set(ds.dims)
    points = dimensions(ds.drop_dims(extra))
    return {"drawn": _drawn(ds, points), **_spread(ds, points)}


def _packed(values: np.ndarray) -> dict:
    """Return numbers in single precision as base64, and their common factor."""
    finite = np.abs(values[np.isfinite(values)])
    scale = float(finite.max(initial=0.0)) or 1.0
    text = base64.b64encode((values / scale).astype("<f4").tobytes()).decode("ascii")
    return {"scale": scale, "values": text}


# ---------------------------------------------------------------------------------------------------------
# Draws that the map keeps, or that are made again


def _drawn(ds: Dataset, points: dict[str, int]) -> dict:
    """Return draws of each body, with their measured values in each spin where the map keeps them."""
    is_kept = "draw" in ds.dims
    measured = [name for name in KEPT if is_kept and name in ds.data_vars and name not in MOMENTS]
    if "body" not in points or (is_kept and any(name not in ds.data_vars for name in MOMENTS)):
        return {}
    spins = math.prod(points.values()) // points["body"]
    most = min(MOST_SHOWN, MOST_TOLD // max(1, points["body"] * (len(MOMENTS) + len(measured) * spins)))
    if most < LEAST_SHOWN:
        return {}
    bodies = {}
    for name, of, numbers, columns in _kept(ds, points, measured, most) if is_kept else _again(ds, most):
        packed = {column: [_packed(row) for row in rows] for column, rows in columns.items()}
        bodies[name] = {"of": of, "shown": len(columns["I1_draw"][0]), "numbers": numbers, "columns": packed}
    described = [_described(ds, name) for name in (*MOMENTS, *measured)]
    return {"measured": is_kept, "bodies": bodies, "columns": described} if bodies or is_kept else {}


def _kept(ds: Dataset, points: dict[str, int], measured: list[str], most: int) -> Iterator[tuple]:
    """Yield name, number of draws, which are shown, and their columns, of each body."""
    chosen = np.sort(np.random.default_rng(SEED).permutation(ds.sizes["draw"])[:most])
    part, first = ds[[*MOMENTS, *measured]].isel(draw=chosen).transpose(*points, "draw"), {dim: 0 for dim in points}
    for number, name in enumerate(ds["body"].values.tolist()):
        of_body = part.isel(body=slice(number, number + 1)).load()
        moments = np.stack([of_body[name].isel(first, missing_dims="ignore").values for name in MOMENTS])
        there = np.isfinite(moments).all(axis=0)
        columns = {name: [row[there] for row in _rows(of_body[name].values)] for name in measured}
        columns |= {name: [row[there]] for name, row in zip(MOMENTS, moments, strict=True)}
        of = int(np.isfinite(ds["I1_draw"].isel(first | {"body": number}, missing_dims="ignore").values).sum())
        yield str(name), of, chosen[there].tolist(), columns


def _rows(values: np.ndarray) -> np.ndarray:
    """Return rows along the last dimension, one at each of the page's points or spins of a body, in order."""
    return np.asarray(values, "f8").reshape(-1, values.shape[-1])


def _described(ds: Dataset, name: str) -> dict:
    spec = KEPT[name]
    units = "" if spec.units in (None, "1") else spec.units
    meanings = flags(ds[name]) if name in ds.data_vars else {}
    meanings_of_flag = [{"value": value, "meaning": word} for value, word in meanings.items()]
    return {"name": name.removesuffix("_draw"), "longName": spec.long_name, "units": units, "flags": meanings_of_flag}


def _again(ds: Dataset, most: int) -> Iterator[tuple]:
    """Yield the same of bodies drawn again from the map's definition, where nothing else is needed to draw them."""
    for number, (distribution, sampling) in _meant(ds).items():
        draws = min(sampling.draws, most)
        normals = designs.normals(sampling.method, distribution.dimension, draws, sampling.seed)
        moments, _, _ = distribution.inertia(normals.reshape(-1, normals.shape[-1])[:most])
        columns = {name: [row] for name, row in zip(MOMENTS, moments.T, strict=True)}
        yield str(ds["body"].values[number]), designs.made(sampling.draws), [], columns


def _meant(ds: Dataset) -> "dict[int, tuple[Distribution, BodySampling]]":
    """Return number of each body → its uncertainty and sampling, by the definition in the map; no file is read."""
    from pydantic import ValidationError

    from sweeps.systems.uncertain_bodies.system import UncertainDefinition

    values = {key: value for key, value in definition_of(ds.attrs).items() if key in MEANT}
    given, meant = values.get("bodies"), {}
    named = {str(one.get("name")): one for one in (given if isinstance(given, tuple) else ()) if isinstance(one, dict)}
    for number, name in enumerate(map(str, ds["body"].values.tolist())):
        try:
            body = named[name]
            if "mesh" in body:  # that is not read: the map carries its moments
                moments = {n: float(ds[n].isel(body=number, missing_dims="ignore").values) for n in ("I1", "I2", "I3")}
                body = {key: value for key, value in body.items() if key != "mesh"} | moments
            definition = UncertainDefinition.model_validate({"title": name} | values | {"bodies": (body,)})
        except (ValidationError, DefinitionError, ValueError, KeyError):  # what is shown beside is the map's own
            continue
        meant[number] = definition.distributions[name], definition.sampling(definition.bodies[0])
    return meant


# ---------------------------------------------------------------------------------------------------------
# Quantiles and sensitivities


def _spread(ds: Dataset, points: dict[str, int]) -> dict:
    """Return quantiles and sensitivities, and their errors: a row at each point, in the order of the page's points."""
    names = [name for name, spec in (VARIABLES | TWISTS).items() if spec.over and name in ds.data_vars]
    size = sum(math.prod(points.values()) * ds.sizes[(VARIABLES | TWISTS)[name].over[0]] for name in names)
    if not names or size > MOST_NUMBERS:
        return {"spread": {}, "levels": [], "inputs": []}
    values = {name: _rows(ds[name].transpose(*points, ...).values).tolist() for name in names}
    rows = {n: [[float(f"{v:.6g}") if math.isfinite(v) else None for v in row] for row in v] for n, v in values.items()}
    levels, inputs = (ds[dim].values.tolist() if dim in ds.coords else [] for dim in ("quantile", "input"))
    return {"spread": rows, "levels": levels, "inputs": inputs}
