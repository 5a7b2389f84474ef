"""Whether all of a sweep is there and nothing has changed since: told from what files weigh, before anything is loaded.

A finished run leaves a note in the sweep's folder: what it made, and of what: the definition's bytes, place, size and
date of every source file here and of the packages that decide over bits, and the settings and the processor that the
kernels' fingerprint covers. A definition that names files of its own has no note: these would have to be read.
"""

import codecs
import hashlib
import json
import os
import shutil
import sys
from collections.abc import Iterable, Iterator
from importlib.machinery import PathFinder
from pathlib import Path
from typing import TYPE_CHECKING

from kernels.fingerprint import processor
from sweeps.pipeline import claims
from sweeps.reading.files import content
from sweeps.reading.limits import MAX_FILE_BYTES

if TYPE_CHECKING:
    from sweeps.points.sweep import Sweep

NOTE = ".finished"
SIZES = ".sizes"  # contains the size of each figure, and of the report, when it was made
DRAWN = ("figures", "report.html")
MADE = ("stability_map.nc", *DRAWN)  # of a run, in the order in which it names them
DECIDING = ("numba", "llvmlite", "numpy", "scipy", "sympy")  # packages
SETTINGS = ".numba_config.yaml"  # in the folder where a process starts
CACHE = "NUMBA_CACHE_DIR"


def basis(definition: str | Path) -> str:
    """Return a hash of the inputs of a run, "" where its definition cannot be read. Call before loading Numba."""
    try:
        text = content(definition, MAX_FILE_BYTES)
    except (OSError, ValueError):
        return ""
    inputs = [os.path.realpath(definition), sys.version, *processor(), *_settings(), *map(_weight, _sources())]
    return hashlib.sha256(json.dumps(inputs).encode()).hexdigest() + _hash(text.removeprefix(codecs.BOM_UTF8))


def _hash(text: bytes) -> str:
    return hashlib.sha256(text).hexdigest()


def found(definition: str | Path, basis: str, results: str | Path = "results") -> list[Path]:
    """Return the files and folders of a finished sweep if unchanged since a run from this basis; else none."""
    folder = Path(results) / Path(definition).stem
    made = [folder / name for name in MADE]
    try:
        note = (folder / NOTE).read_text()
    except (OSError, ValueError):
        return []
    same = basis and note == _note(basis, made) and all(path.exists() for path in made)
    is_whole = same and not incomplete(folder)
    return made if is_whole and not claims.is_claimed(folder) else []


def note_sizes(folder: Path) -> None:
    """Store the sizes of the figures and of the report of a sweep, once they are made."""
    from sweeps.process.files import replaced

    files = [file for name in DRAWN for file in ((folder / name), *(folder / name).glob("*")) if file.is_file()]
    sizes = {str(file.relative_to(folder)): file.stat().st_size for file in files}
    with replaced(folder / SIZES, flush=False) as temporary:
        temporary.write_text(json.dumps(sizes))


def incomplete(folder: Path) -> set[Path]:
    """Return the folder of figures, or the report, of which a file is missing or has another size than when made.

    Sizes that were stored before the map was made tell nothing: a later run, cut short, may have drawn files again.
    """
    try:
        sizes = json.loads((folder / SIZES).read_text())
        is_older = (folder / SIZES).stat().st_mtime_ns < (folder / MADE[0]).stat().st_mtime_ns
    except (OSError, ValueError):  # never finished
        return set()
    if is_older:
        return set()
    changed = [name for name, size in sizes.items() if _weight(folder / name)[2:3] != (size,)]
    return {folder / Path(name).parts[0] for name in changed}


def remove_incomplete(folder: Path) -> None:
    """Remove the figures, or the report, of which a file is missing or was cut short, so that they are made again."""
    for path in incomplete(folder):
        shutil.rmtree(path) if path.is_dir() else path.unlink(missing_ok=True)


def keep(sweep: "Sweep", basis: str, results: str | Path = "results") -> None:
    """Note that a sweep is finished, unless its definition names other files, or was edited since it was read."""
    from sweeps.process.files import replaced

    folder = Path(results) / sweep.name
    if basis.endswith(_hash(sweep.definition.text.encode())) and not _names_files(sweep):
        with replaced(folder / NOTE, flush=False) as temporary:
            temporary.write_text(_note(basis, [folder / name for name in MADE]))


def _names_files(sweep: "Sweep") -> bool:
    """Return whether a definition, or its system, depends on more than its own text and the sources here."""
    from sweeps.reading.definitions import definition_of

    definition, system = sweep.definition, sweep.system
    ours = type(system).__module__.startswith("sweeps.") and not definition.system.endswith(".py")
    values = definition_of({"definition": definition.text})
    return bool(not ours or definition.inputs or system.model.needs_files(values) or "mesh" in definition.text)


def _note(basis: str, made: Iterable[Path]) -> str:
    return json.dumps({"basis": basis, "made": [_weight(path)[2:] for path in made]})


def _weight(path: str | Path) -> tuple:
    """Return (path, number, size, date) of a file; the path alone where there is none."""
    try:
        status = os.stat(path)
    except OSError:
        return (str(path),)
    return str(path), status.st_ino, status.st_size, status.st_mtime_ns


def _sources() -> Iterator[str | Path]:
    """Yield every source file here, and where the packages begin."""
    root = Path(__file__).parents[2]
    yield from sorted(path for part in ("kernels", "sweeps") for path in (root / part).rglob("*.py"))
    for name in DECIDING:
        spec = PathFinder.find_spec(name)
        yield (spec.origin if spec else None) or name


def _settings() -> Iterator[str]:
    """Yield Numba's settings by the environment and by a file; where its cache lies changes no bit."""
    yield from sorted(f"{name}={v}" for name, v in os.environ.items() if name.startswith("NUMBA_") and name != CACHE)
    try:
        yield Path(SETTINGS).read_text()
    except (OSError, ValueError):
        yield ""
