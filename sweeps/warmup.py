"""Compiling the kernels before anything else needs them.

Numba's disk cache is not safe when several processes compile at once, so the workflow compiles in jobs of their own:
what all sweeps share in one, and what is generated for one system in another. Nor does Numba look whether a disk has
kept what was stored: the checksums written here do.
"""

import fcntl
import json
import os
import pickle
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path

from kernels.fingerprint import cache_folder
from sweeps import claims, systems
from sweeps.files import replaced

CHECKSUMS = "checksums.json"


@contextmanager
def _alone() -> Iterator[None]:
    """One process at once."""
    handle = os.open(cache_folder() / ".compiling", os.O_RDWR | os.O_CREAT, 0o600)
    try:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX)
        except OSError as error:
            if error.errno not in claims.UNSUPPORTED:
                raise
        yield
    finally:
        os.close(handle)


def compile_kernels() -> None:
    """Compiles, and stores in the cache, every kernel that is no one system's alone; one process at once."""
    with _alone():
        _compile_shared()


def compile_system(system: systems.System) -> None:
    """Compiles, and stores in the cache, what one system calls, and says so there; one process at once.

    Raises:
        DescriptionError: for what is wrong with its description.
    """
    with _alone():
        system.compile()
        _note_checksums()
    compiled = system.compiled()
    compiled.parent.mkdir(parents=True, exist_ok=True)
    with replaced(compiled) as temporary:
        temporary.write_text(system.fingerprint() + "\n")


def mend_cache() -> None:
    """Compiles again what is not on the disk as it was stored; call it before any kernel."""
    if not _damaged():
        return
    with _alone():
        for file in _damaged():
            file.unlink(missing_ok=True)
        _compile_shared()


def _compile_shared() -> None:
    for name in systems.MODULES:
        systems.resolve(name).compile()
    from kernels import oscillations

    assert oscillations.run
    _note_checksums()


def _note_checksums() -> None:
    stored = sorted(cache_folder().rglob("*.nb[ic]"))
    checksums = {str(file.relative_to(cache_folder())): zlib.crc32(file.read_bytes()) for file in stored}
    with replaced(cache_folder() / CHECKSUMS) as temporary:
        temporary.write_text(json.dumps(checksums))


def _damaged() -> list[Path]:
    """Compiled code with another checksum than it was stored with, and indexes that cannot be read."""
    try:
        checksums = json.loads((cache_folder() / CHECKSUMS).read_text())
        return [cache_folder() / name for name, stored in checksums.items() if not _is_sound(name, stored)]
    except (OSError, ValueError, AttributeError):  # nothing was compiled here yet, or the list itself is damaged
        return []


def _is_sound(name: str, checksum: int) -> bool:
    file = cache_folder() / name
    if not file.is_file():  # Numba makes again what is missing
        return True
    content = file.read_bytes()
    if zlib.crc32(content) == checksum:
        return True
    if file.suffix == ".nbc":
        return False
    index = BytesIO(content)  # which grows with each new signature: Numba's version, and the names of the code
    try:
        return bool(pickle.load(index)) and bool(pickle.loads(index.read()))
    except Exception:
        return False
