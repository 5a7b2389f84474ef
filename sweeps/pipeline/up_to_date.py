"""Detect missing, damaged and outdated pictures and reports of a finished sweep, from the sizes and times of its files.

A finished run leaves a note in the sweep's folder: size and time of each output. Maps and shards state themselves which
definition and kernels they are of.
"""

import json
import shutil
from pathlib import Path

from sweeps.process.files import replace_output

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


def remove_damaged(folder: Path) -> None:
    """Remove figures, or a report, with a file that is missing or was cut short, so that they are made again.

    A note of another map is ignored: a later run, cut short, may have drawn files again.
    """
    files = _note(folder)
    if files.get(MAP) != _file_state(folder / MAP):
        return
    damaged_files = [name for name, (size, _) in files.items() if _file_state(folder / name)[:1] != [size]]
    for path in {folder / Path(name).parts[0] for name in damaged_files}:
        shutil.rmtree(path) if path.is_dir() else path.unlink(missing_ok=True)


def find_outdated(folder: Path) -> set[str]:
    """Return which of figures and report are missing, damaged, or older than the map."""
    remove_damaged(folder)
    map_time = (folder / MAP).stat().st_mtime
    paths = {name: folder / name for name in (FIGURES, REPORT)}
    return {name for name, path in paths.items() if not path.exists() or path.stat().st_mtime < map_time}


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
