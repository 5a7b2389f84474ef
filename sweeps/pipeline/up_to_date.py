"""Detect missing, damaged and outdated outputs of a finished sweep: its map, pictures and report.

A finished run leaves a note in the sweep's folder: size and time of each output. Maps and shards state themselves which
definition and kernels they are of.
"""

import json
import shutil
from pathlib import Path
from typing import TYPE_CHECKING

from sweeps.process.files import replace_output
from sweeps.reading.files import FileBytes
from sweeps.reading.hdf5 import read_structure
from sweeps.schema.refusals import MapError
from sweeps.schema.variables import CONTRACT_VERSION
from sweeps.shards import contract

if TYPE_CHECKING:
    from sweeps.points.sweep import Sweep

NOTE = ".finished"
MAP, FIGURES, REPORT = "stability_map.nc", "figures", "report.html"
OUTPUTS = (MAP, FIGURES, REPORT)  # A run yields them in this order.


def record(folder: Path) -> None:
    """Write the note of a sweep after its outputs are made."""
    files = [file for name in OUTPUTS for file in ((folder / name), *(folder / name).glob("*")) if file.is_file()]
    states = {str(file.relative_to(folder)): _file_state(file) for file in files}
    if states != _note(folder):
        with replace_output(folder / NOTE, flush=False) as temporary:
            temporary.write_text(json.dumps(states))


def find_outdated(folder: Path, sweep: "Sweep") -> set[str]:
    """Return which outputs are missing, damaged, of another definition or kernels, or older than the map."""
    if not _holds_map(folder / MAP, sweep):
        return set(OUTPUTS)
    map_time = (folder / MAP).stat().st_mtime
    paths = {name: folder / name for name in (FIGURES, REPORT)}
    missing = {name for name, path in paths.items() if not path.exists() or path.stat().st_mtime < map_time}
    return missing | _find_damaged(folder)


def remove_damaged(folder: Path) -> None:
    """Remove figures, or a report, with a file that is missing or was cut short, so that they are made again."""
    for path in (folder / name for name in _find_damaged(folder)):
        shutil.rmtree(path) if path.is_dir() else path.unlink(missing_ok=True)


def _find_damaged(folder: Path) -> set[str]:
    """Return which of figures and report have a file that is missing or was cut short since the note was written.

    A note of another map is ignored: a later run, cut short, may have drawn files again.
    """
    files = _note(folder)
    if files.get(MAP) != _file_state(folder / MAP):
        return set()
    return {Path(name).parts[0] for name, (size, _) in files.items() if _file_state(folder / name)[:1] != [size]}


def _holds_map(path: Path, sweep: "Sweep") -> bool:
    """Return True if a file is the map of a sweep, measured by the present kernels."""
    try:
        with FileBytes(path) as file:
            attributes = read_structure(file).attributes
    except (OSError, MapError):
        return False
    expected = contract.identity(sweep) | {"contract_version": CONTRACT_VERSION}
    return all(attributes.get(name, "") == value for name, value in expected.items())


def _note(folder: Path) -> dict[str, list[int]]:
    """Return the note of the last run, name of each output → [size, time]; empty if it left no sound note."""
    try:
        note = json.loads((folder / NOTE).read_text())
        return {name: [int(size), int(changed_at)] for name, (size, changed_at) in note.items()}
    except (OSError, ValueError, TypeError, AttributeError, RecursionError):
        return {}


def _file_state(path: Path) -> list[int]:
    """Return [size, time in ns] of a file; [] if there is none."""
    try:
        status = path.stat()
    except OSError:
        return []
    return [status.st_size, status.st_mtime_ns]
