"""Compiled code that is stored on the disk: is it still what was stored there? Numba does not look: it would run it.

A ledger in the cache's folder keeps the checksum of every file of the cache. It is compared whenever ``kernels`` is
imported, before Numba reads anything, and added to when a process that has compiled something ends.
"""

import atexit
import json
import os
import pickle
import sys
import zlib
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from io import BytesIO
from pathlib import Path

try:
    import fcntl
except ImportError:  # there is none on Windows
    fcntl = None

LEDGER = "checksums.json"
GONE = None  # in the place of a checksum: was damaged and removed, and has not been made again


def watch(folder: Path) -> None:
    """Removes what has changed on the disk, now; notes what Numba stores, when this process ends."""
    remove_damaged(folder)
    atexit.register(lambda: "numba" in sys.modules and remove_damaged(folder))


def store_in_turn() -> None:
    """Lets processes compile side by side: whatever each of them stores from now on, it stores alone.

    Numba reads the index of a function, adds to it and writes it again; of two that do so at one moment, one would be
    lost, or both would give one name to two codes.
    """
    from numba.core.caching import IndexDataCacheFile

    save = IndexDataCacheFile.save
    if fcntl is None or getattr(save, "in_turn", False):
        return

    def save_in_turn(self, key, data):
        path = Path(self._index_path)
        path.parent.mkdir(parents=True, exist_ok=True)
        handle = os.open(path.with_suffix(".lock"), os.O_RDWR | os.O_CREAT, 0o600)
        try:
            with suppress(OSError):
                fcntl.flock(handle, fcntl.LOCK_EX)
            if key not in self._load_index():
                save(self, key, data)
        finally:
            os.close(handle)

    save_in_turn.in_turn = True
    IndexDataCacheFile.save = save_in_turn


def remove_damaged(folder: Path) -> None:
    """Removes what has changed on the disk, which Numba then compiles again; notes what is new.

    Parameters
    ----------
    folder : Path
        Folder of the compiled kernels. One that cannot be read or written is left as it is.
    """
    try:
        with _locked(folder):
            noted, found = _ledger(folder), {}
            for file in sorted(folder.rglob("*.nb[ic]")):
                name, content = str(file.relative_to(folder)), file.read_bytes()
                found[name] = zlib.crc32(content)
                if noted.get(name) != found[name] and not _is_sound(file, content, noted.get(name) is not GONE):
                    found[name] = GONE
            _remove(folder, found)
            now = {name: GONE for name, checksum in noted.items() if checksum is GONE} | found
            if now != noted:
                write_whole(folder / LEDGER, now)
    except OSError:
        return


def _remove(folder: Path, found: dict[str, int | None]) -> None:
    """Removes files without a checksum; with an index goes its code, whose names would be given to other code."""
    for index in [name for name, checksum in found.items() if checksum is GONE and name.endswith(".nbi")]:
        found.update({name: GONE for name in found if name.startswith(index.removesuffix("nbi"))})
    for name in [name for name, checksum in found.items() if checksum is GONE]:
        (folder / name).unlink(missing_ok=True)


def note(folder: Path) -> None:
    """Notes what a compilation has stored; whatever else was removed is not waited for."""
    remove_damaged(folder)
    try:
        with _locked(folder):
            kept = {name: checksum for name, checksum in _ledger(folder).items() if checksum is not GONE}
            write_whole(folder / LEDGER, kept)
    except OSError:
        return


def holds(folder: Path, module: str) -> bool:
    """Whether some kernel of a module of ``kernels`` is there that Python can call."""
    return any(folder.glob(f"*/{module}.*.nbi"))


def is_whole(folder: Path) -> bool:
    """Whether nothing was removed that has not been made again."""
    return GONE not in _ledger(folder).values()


def _is_sound(file: Path, content: bytes, noted: bool) -> bool:
    """Whether content that is not as the ledger has it may be used.

    Code never changes where it lies. An index grows with each new signature: it holds Numba's version, then a stamp
    and the name of each signature's code.
    """
    if file.suffix == ".nbc":
        return not noted
    from importlib.metadata import version  # takes 20 ms to load, and is seldom asked

    index = BytesIO(content)
    try:
        if pickle.load(index) != version("numba"):
            return False
        _, names = _Names(index).load()
        return len(set(names.values())) == len(names)
    except Exception:
        return False


class _Names(pickle.Unpickler):
    """Reads an index for the names of its codes: what its keys are made of is Numba's, which may be about to load."""

    def find_class(self, module: str, name: str) -> type:
        """Something in the place of whatever is asked for."""
        return _Unread


class _Unread:
    """A part of a key that nobody reads."""

    def __new__(cls, *parts, **more):
        return super().__new__(cls)

    def __init__(self, *parts, **more):
        pass

    def __setstate__(self, state):
        pass


def _ledger(folder: Path) -> dict[str, int | None]:
    """File → checksum; empty where there is no ledger yet, or a damaged one."""
    try:
        ledger = json.loads((folder / LEDGER).read_text())
    except (OSError, ValueError):
        return {}
    return ledger if isinstance(ledger, dict) else {}


def write_whole(path: Path, told: dict) -> None:
    """Writes a JSON file, of which no other process sees a half."""
    temporary = path.with_name(f".{path.name}.{os.urandom(8).hex()}")
    try:
        temporary.touch(0o600, exist_ok=False)
        temporary.write_text(json.dumps(told))
        temporary.replace(path)
    finally:
        temporary.unlink(missing_ok=True)


@contextmanager
def _locked(folder: Path) -> Iterator[None]:
    """One process at once, where the file system has locks."""
    handle = os.open(folder / f".{LEDGER}.lock", os.O_RDWR | os.O_CREAT, 0o600)
    try:
        if fcntl is not None:
            with suppress(OSError):
                fcntl.flock(handle, fcntl.LOCK_EX)
        yield
    finally:
        os.close(handle)
