"""Detect an up-to-date sweep from sizes and times of its inputs and outputs, without importing heavy modules.

A finished run leaves a note in the sweep's folder: a hash of its inputs, and size and time of each output. The inputs
are the definition's bytes, place, size and time of every source file here and of the packages that determine bits, and
the settings and the processor that the kernels' fingerprint covers. A definition that names files of its own has no
hash: these would have to be read.
"""

import codecs
import hashlib
import json
import os
import shutil
import sys
from collections.abc import Iterator
from importlib.machinery import PathFinder
from pathlib import Path

from kernels.compile.fingerprint import processor
from sweeps.pipeline import claims
from sweeps.process.files import replace_output
from sweeps.reading.files import content
from sweeps.reading.limits import MAX_FILE_BYTES

NOTE = ".finished"
MAP, FIGURES, REPORT = "stability_map.nc", "figures", "report.html"
OUTPUTS = (MAP, FIGURES, REPORT)  # A run yields them in this order.
PACKAGES = ("numba", "llvmlite", "numpy", "scipy", "sympy")  # Their versions determine bits.
SETTINGS = ".numba_config.yaml"  # Numba reads it in the folder in which a process starts.
CACHE = "NUMBA_CACHE_DIR"


def unchanged_outputs(folder: Path) -> tuple[list[Path], str]:
    """Return the outputs in a sweep's folder, and the hash of their inputs; none if one is missing or was changed."""
    note, outputs = _note(folder), [folder / name for name in OUTPUTS]
    is_unchanged = (
        all(path.exists() for path in outputs)
        and all(_file_state(folder / name)[2:] == tuple(state) for name, state in note["files"].items())
        and not claims.is_claimed(folder)
    )
    return (outputs, note["inputs"]) if is_unchanged and note["inputs"] else ([], "")


def inputs_hash(definition: str | Path) -> str:
    """Return a hash of the inputs of a run, "" if its definition cannot be read. Call before loading Numba."""
    try:
        text = content(definition, MAX_FILE_BYTES)
    except (OSError, ValueError):
        return ""
    inputs = [os.path.realpath(definition), sys.version, *processor(), *_settings(), *map(_file_state, _sources())]
    return _hash(json.dumps(inputs).encode()) + _hash(text.removeprefix(codecs.BOM_UTF8))


def covers_text(inputs: str, text: str) -> bool:
    """Return True if a hash of inputs is that of a definition of this text: the file may be edited while it is read."""
    return inputs.endswith(_hash(text.encode()))


def _hash(text: bytes) -> str:
    return hashlib.sha256(text).hexdigest()


def record(folder: Path, inputs: str = "") -> None:
    """Write the note of a sweep after its outputs are made.

    Without a hash of inputs, the note is kept if the outputs are unchanged; the next run then checks the outputs.
    """
    files = [file for name in OUTPUTS for file in ((folder / name), *(folder / name).glob("*")) if file.is_file()]
    states = {str(file.relative_to(folder)): [*_file_state(file)[2:]] for file in files}
    if not inputs and states == _note(folder)["files"]:
        return
    with replace_output(folder / NOTE, flush=False) as temporary:
        temporary.write_text(json.dumps({"inputs": inputs, "files": states}))


def remove_damaged(folder: Path) -> None:
    """Remove figures, or a report, with a file that is missing or was cut short, so that they are made again.

    A note of another map is ignored: a later run, cut short, may have drawn files again.
    """
    files = _note(folder)["files"]
    if files.get(MAP) != list(_file_state(folder / MAP)[2:]):
        return
    damaged_files = [name for name, (size, _) in files.items() if _file_state(folder / name)[2:3] != (size,)]
    for path in {folder / Path(name).parts[0] for name in damaged_files}:
        shutil.rmtree(path) if path.is_dir() else path.unlink(missing_ok=True)


def find_outdated(folder: Path) -> set[str]:
    """Return which of figures and report are missing, damaged, or older than the map."""
    remove_damaged(folder)
    map_time = (folder / MAP).stat().st_mtime
    paths = {name: folder / name for name in (FIGURES, REPORT)}
    return {name for name, path in paths.items() if not path.exists() or path.stat().st_mtime < map_time}


def _note(folder: Path) -> dict:
    """Return {"inputs": hash, "files": {name: [size, time]}} of the last run; both empty if it left no sound note."""
    try:
        note = json.loads((folder / NOTE).read_text())
        return {"inputs": str(note["inputs"]), "files": {str(n): [int(x) for x in s] for n, s in note["files"].items()}}
    except (OSError, ValueError, TypeError, KeyError, AttributeError, RecursionError):
        return {"inputs": "", "files": {}}


def _file_state(path: str | Path) -> tuple:
    """Return (path, number, size, time) of a file; the path alone if there is none."""
    try:
        status = os.stat(path)
    except OSError:
        return (str(path),)
    return str(path), status.st_ino, status.st_size, status.st_mtime_ns


def _sources() -> Iterator[str | Path]:
    """Yield every source file here, and the first file of each package that determines bits."""
    root = Path(__file__).parents[2]
    yield from sorted(path for package in ("kernels", "sweeps") for path in (root / package).rglob("*.py"))
    for name in PACKAGES:
        spec = PathFinder.find_spec(name)
        yield (spec.origin if spec else None) or name


def _settings() -> Iterator[str]:
    """Yield Numba's settings by the environment and by a file; the place of its cache changes no bit."""
    yield from sorted(f"{name}={v}" for name, v in os.environ.items() if name.startswith("NUMBA_") and name != CACHE)
    try:
        yield Path(SETTINGS).read_text()
    except (OSError, ValueError):
        yield ""
