"""Journal of a map that is being measured: a line for each chunk, so that a run that is broken off can be continued.

The map grows under a name of its own in a folder, with its journal beside it. HDF5's index of an open file may not have
reached the disk when a process is killed, and is not used: a line states where in the file the bytes of a chunk lie,
and their checksum.
"""

import json
import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import NamedTuple

from isal import isal_zlib

from sweeps.points.sweep import Sweep
from sweeps.process import living
from sweeps.shards.contract import identity

NAME = "measured-{}.nc"
SUFFIX = ".journal"


class Entry(NamedTuple):
    """One chunk that is in the file."""

    after: int  #: number after its last point
    motions: int  #: how many motions its block of chunks has taken, at the block's last chunk; 0 at the others
    #: name of a variable → number of the first byte, number of bytes, and their checksum.
    places: dict[str, tuple[int, int, int]]


class Journal:
    """The journal of one file; use it as a context, which leaves both where they are."""

    def __init__(self, sweep: Sweep, folder: Path):
        folder.mkdir(parents=True, exist_ok=True)
        self.path = folder / NAME.format(f"{living.mark()}.{os.urandom(4).hex()}")
        self._file = self.path.with_suffix(SUFFIX).open("x")
        self._write(identity(sweep))

    def add(self, entry: Entry) -> None:
        """Write the line of a chunk whose bytes are in the file."""
        self._write(entry)

    def _write(self, content) -> None:
        self._file.write(json.dumps(content) + "\n")
        self._file.flush()

    def __enter__(self):
        return self

    def __exit__(self, *failure):
        self._file.close()


def longest(sweep: Sweep, folder: Path) -> tuple[Path, list[Entry]] | None:
    """Return the file of this sweep in a folder that holds most whole blocks, and its chunks; None without any."""
    found = [(path.with_suffix(".nc"), _blocks(sweep, path)) for path in folder.glob("*" + SUFFIX)]
    return max(found, key=lambda one: len(one[1]), default=None)


def _blocks(sweep: Sweep, path: Path) -> list[Entry]:
    """Return the chunks of whole blocks in a journal; none for that of another definition or other kernels."""
    entries = []
    try:
        for k, line in enumerate(path.read_text().splitlines()):
            content = json.loads(line)
            if k:
                entries.append(Entry(*content))
            elif content != identity(sweep):
                break
    except (OSError, ValueError, TypeError):  # cut short as it was written
        pass
    while entries and not entries[-1].motions:
        entries.pop()
    return entries


def chunks(path: Path, entries: list[Entry]) -> Iterator[list[tuple[Entry, Mapping[str, bytes]]]]:
    """Yield the chunks of each block in turn with their bytes, up to the first that is damaged."""
    block = []
    try:
        handle = os.open(path, os.O_RDONLY)
    except OSError:
        return
    try:
        for entry in entries:
            stored = {name: os.pread(handle, size, first) for name, (first, size, _) in entry.places.items()}
            if any(isal_zlib.crc32(stored[name]) != check for name, (_, _, check) in entry.places.items()):
                return
            block.append((entry, stored))
            if entry.motions:
                yield block
                block = []
    finally:
        os.close(handle)


def remove(folder: Path, but: Path | None = None) -> None:
    """Remove all such files and their journals from a folder, but for those of one file."""
    for path in (*folder.glob(NAME.format("*")), *folder.glob(NAME.format("*").replace(".nc", SUFFIX))):
        if but is None or path.stem != but.stem:
            path.unlink(missing_ok=True)
