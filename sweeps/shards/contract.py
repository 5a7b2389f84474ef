"""Attributes and coordinates of a map, in memory and on disk; results/README.md describes this contract."""

import platform
from datetime import UTC, datetime
from typing import TYPE_CHECKING

import numpy as np

from sweeps.schema.variables import CONTRACT_VERSION, POINT, POINT_NAME

if TYPE_CHECKING:
    from sweeps.points.scattered import OnDemand
    from sweeps.points.sweep import Sweep

CONVENTIONS = "CF-1.11"


def coordinates(sweep: "Sweep") -> "dict[str, tuple[tuple[str, ...], np.ndarray | OnDemand, dict]]":
    """Return name → (dimensions, values, CF attributes) of each coordinate of a map, the dimensions first."""
    grid = sweep.grid
    table = {POINT.name: POINT, POINT_NAME.name: POINT_NAME} | sweep.system.coordinates(sweep.definition)
    variables = {dim: ((dim,), values) for dim, values in grid.coordinates.items()}
    for name, (dims, values) in grid.auxiliary.items():
        is_right = values.dtype.kind == "U" or values.dtype == np.dtype(table[name].dtype)
        variables[name] = dims, values if is_right else values.astype(table[name].dtype)
    variables |= {dim: ((dim,), values) for dim, values in grid.extra_dimensions.items()}
    return {name: (*variable, table[name].attributes) for name, variable in variables.items()}


def provenance(sweep: "Sweep") -> dict[str, str]:
    """Return the global attributes of a map, without its history and content hash."""
    from importlib.metadata import version

    definition, system = sweep.definition, sweep.system
    return {
        "title": definition.title,
        "source": f"Polhode {version('polhode')} (Python {platform.python_version()}, NumPy {version('numpy')}, "
        f"Numba {version('numba')}), {system.method(definition)}",
        "references": system.references,
        "Conventions": CONVENTIONS,
        "contract_version": CONTRACT_VERSION,
        "system": definition.system,
        "definition": definition.text,
        "kernel_fingerprint": system.fingerprint(),
    } | {name: text for name in ("inputs", "input_notes", "outlines") if (text := getattr(definition, name))}


def identity(sweep: "Sweep") -> dict[str, str]:
    """Return the attributes that identify the definition, its files and the kernels of a shard or a map."""
    definition, kernels = sweep.definition, sweep.system.fingerprint()
    return {"definition": definition.text, "inputs": definition.inputs, "kernel_fingerprint": kernels}


def history(command: str = "") -> str:
    """Return a line of the attribute `history` with the current time."""
    return f"{datetime.now(UTC):%Y-%m-%dT%H:%M:%SZ} polhode {command}".rstrip()
