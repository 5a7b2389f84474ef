"""Shards: runs of a sweep's points, each measured and written as a whole file.

A shard is a map that holds the chunks of its own points and no others, encoded as they will lie in the sweep's map.
It says which points those are, of which definition and which kernels, and of each chunk a checksum and the hash that
the content hash is made of. So what was cut short or changed on the disk is found before it reaches a map, and a merge
copies.
"""

from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from functools import partial
from math import ceil
from pathlib import Path
from typing import NamedTuple

import h5py
import netCDF4
import numpy as np
from isal import isal_zlib

from sweeps.points.columns import begun, measurers
from sweeps.points.estimate import BLOCK_POINTS, BLOCKS_BEGUN, integration_seconds
from sweeps.points.sweep import Sweep
from sweeps.process import memory
from sweeps.reading import sandbox
from sweeps.reading.files import FileBytes
from sweeps.schema.refusals import MapError, shortened
from sweeps.shards.chunkfile import UNREADABLE, ChunkFile, cut, define, written
from sweeps.shards.chunks import Chunks
from sweeps.shards.content import run_digest
from sweeps.shards.contract import identity

GROUP = "checks"  # whose dimensions cannot be taken for the sweep's own
CHECKSUMS, DIGESTS = f"{GROUP}/checksums", f"{GROUP}/digests"
TOLD = ("first_point", "point_after_last", "motions_integrated")
TABLE = ("variable", "piece", "byte")
DIGEST_BYTES = 32
PART_SECONDS = 1.0  # at most about what a thread measures at once: who breaks off waits for its end


class DamagedError(MapError):
    """A shard that was cut short or changed on the disk."""

    def __init__(self, path: str | Path, what: str, allowed: str = "a whole file of `polhode shard`"):
        super().__init__(f"{path}: {what}; allowed: {allowed}")
        self.path = Path(path)


class ForeignError(DamagedError):
    """A shard of another definition, or of other kernels."""


class Piece(NamedTuple):
    """The part of one chunk of the map that a shard holds."""

    chunk: int  #: number of the chunk
    first: int  #: number of the piece's first point
    after: int  #: number after its last point
    whole: bool  #: whether that is the whole chunk


class _Checks:
    """Of each variable (row) and piece (column): the checksum of its chunk, and of a whole one the hash as well."""

    def __init__(self, names: Sequence[str], pieces: Sequence[Piece]):
        self.names, self.pieces = tuple(names), tuple(pieces)
        self.checksums = np.zeros((len(self.names), len(self.pieces)), dtype="<u4")
        self.digests = np.zeros((len(self.names), len(self.pieces), DIGEST_BYTES), dtype="u1")

    def seal(self, told: Iterable[str]) -> int:
        """One checksum of all of these, and of what else a shard tells."""
        seal = isal_zlib.crc32("\0".join(told).encode())
        return isal_zlib.crc32(self.digests.tobytes(), isal_zlib.crc32(self.checksums.tobytes(), seal))


def pieces(chunks: Chunks, first: int, after: int) -> list[Piece]:
    """Return the overlaps of the chunks with the points first … after − 1."""
    shares = chunks.between(first, after)
    return [Piece(number, low, high, (low, high) == chunks.bounds(number)) for number, low, high in shares]


def chunks_of(sweep: Sweep) -> Chunks:
    """Return the chunks of the points of a sweep."""
    return cut(sweep.grid.shape, {name: sweep.shape_at(name) for name in sweep.variables})


def further(sweep: Sweep) -> dict[str, int]:
    """Return name → length of the dimensions of its variables other than those of the points."""
    return {dim: values.size for dim, values in sweep.grid.further.items()}


# -- writing


def write_shard(
    sweep: Sweep,
    number: int,
    count: int,
    path: str | Path,
    threads: int = 1,
    progress: Callable[[int], None] = lambda points: None,
) -> None:
    """Measure shard `number` (from 1) of `count` and write it to `path`, each block while the next is measured."""
    start, stop = sweep.grid.shard_bounds(count)[number - 1]
    chunks, variables = chunks_of(sweep), sweep.variables
    checks = _Checks(tuple(variables), pieces(chunks, start, stop))
    with written(path, flush=False) as temporary:
        _create(temporary, sweep, checks)
        with h5py.File(temporary, "r+") as hdf:
            file = ChunkFile(hdf, variables, chunks)

            def put(index: int, piece: Piece, columns: Mapping[str, np.ndarray]) -> None:
                for row, (name, values) in enumerate(columns.items()):
                    stored = file.encode(name, piece.chunk, piece.first, values)
                    checks.checksums[row, index] = isal_zlib.crc32(stored)
                    if piece.whole:
                        checks.digests[row, index] = np.frombuffer(run_digest(values), np.uint8)
                    file.put(name, piece.chunk, stored)

            motions = measure(sweep, checks.pieces, put, threads, progress)
            # as text: a grid may have more points than an attribute's integer
            told = dict(zip(TOLD, map(str, (start, stop, motions)), strict=True))
            hdf.attrs.update(told | {"seal": str(checks.seal(told.values()))} | identity(sweep))
            hdf[CHECKSUMS][:], hdf[DIGESTS][:] = checks.checksums, checks.digests


def _create(path: Path, sweep: Sweep, checks: _Checks) -> None:
    with netCDF4.Dataset(path, "w", format="NETCDF4") as file:
        define(file, dict(zip(sweep.grid.dims, sweep.grid.shape, strict=True)), sweep.variables, None, further(sweep))
        for name, size in zip(TABLE, checks.digests.shape, strict=True):
            file.createGroup(GROUP).createDimension(name, size)
        file[GROUP].createVariable("checksums", "u4", TABLE[:2], fill_value=False)
        file[GROUP].createVariable("digests", "u1", TABLE, fill_value=False)


def measure(
    sweep: Sweep,
    pieces: Sequence[Piece],
    put: Callable[[int, Piece, Mapping[str, np.ndarray]], None],
    threads: int = 1,
    progress: Callable[[int], None] = lambda points: None,
) -> int:
    """Measure pieces block by block, and store each block while the next is measured.

    Args:
        sweep: the sweep.
        pieces: its chunks' shares, one after the other.
        put: called with the number of each piece in turn, the piece and its columns.
        threads: threads for the kernel.
        progress: called with the number of points after each block.
    """
    memory.keep_freed()
    motions = 0
    with measurers(threads) as pool:
        for block, low, integrated, waited_for in _begun(sweep, pieces, pool, threads):
            motions, columns = motions + integrated, waited_for()
            for index in block:
                piece = pieces[index]
                put(index, piece, {n: values[piece.first - low : piece.after - low] for n, values in columns.items()})
            progress(pieces[block[-1]].after - low)
    return motions


def _blocks(pieces: Sequence[Piece]) -> Iterator[range]:
    """Runs of pieces that are measured at once: of at most `BLOCK_POINTS` points together, or one."""
    begin = 0
    for index, piece in enumerate(pieces):
        if index > begin and piece.after - pieces[begin].first > BLOCK_POINTS:
            yield range(begin, index)
            begin = index
    yield range(begin, len(pieces))


def _begun(
    sweep: Sweep, pieces: Sequence[Piece], pool: ThreadPoolExecutor, threads: int
) -> Iterator[tuple[range, int, int, Callable[[], dict]]]:
    """Block after block, its first point, number of motions, and what waits for its columns: the next is begun then."""
    waiting = deque()
    for block in _blocks(pieces):
        low, high = pieces[block[0]].first, pieces[block[-1]].after
        points = sweep.grid.points(low, high)
        motions = sweep.system.motions(points, sweep.definition.integration)
        parts = max(threads, ceil(integration_seconds(sweep, high - low) / PART_SECONDS))
        waiting.append((block, low, motions, begun(points, sweep, pool, parts)))
        if len(waiting) == BLOCKS_BEGUN:
            yield waiting.popleft()
    yield from waiting


# -- reading


def holds_shard(path: str | Path, sweep: Sweep, number: int, count: int) -> bool:
    """Return True if a file holds shard `number` of `count` of a sweep, as these kernels measure it."""
    try:
        with Shard(path, sweep) as shard:
            return (shard.first, shard.after) == sweep.grid.shard_bounds(count)[number - 1]
    except MapError:
        return False


def _walked(opened: FileBytes) -> dict:
    """Read what a merge reads of a shard but for its values, in a child, to see whether the library survives it.

    Return the names of what lies in other files.
    """
    elsewhere = []
    with suppress(*UNREADABLE), h5py.File(opened, "r") as file:
        for holder in (file, file.get(GROUP, {}) if _is_inside(file, GROUP) else {}):
            elsewhere += [name for name in holder if not _is_inside(holder, name)]
        if elsewhere:
            return {"elsewhere": elsewhere}
        dict(file.attrs)
        for holder in (file, file.get(GROUP, {})):
            for name in holder:
                if isinstance(found := holder[name], h5py.Dataset):
                    if found.chunks and holder is file:
                        found.id.chunk_iter(lambda chunk: None)
                    elif holder is not file:
                        found[()]
    return {"elsewhere": elsewhere}


def _is_inside(holder: h5py.Group, name: str) -> bool:
    """Whether a member, if there is one, is no link to elsewhere and has its values in this file."""
    encoded = name.encode("utf-8", "surrogateescape")
    if not holder.id.links.exists(encoded):
        return True
    if holder.id.links.get_info(encoded).type != h5py.h5l.TYPE_HARD:
        return False
    found = h5py.h5o.open(holder.id, encoded)
    if not isinstance(found, h5py.h5d.DatasetID):
        return True
    properties = found.get_create_plist()
    return properties.get_layout() != h5py.h5d.VIRTUAL and not properties.get_external_count()


class Shard:
    """An open shard; use it as a context."""

    def __init__(self, path: str | Path, sweep: Sweep):
        self.path = Path(path)  #: its file
        try:
            opened = FileBytes(path)
        except (OSError, ValueError):
            allowed = "a file of `polhode shard`"
            raise MapError(f"{path}: there is no such file; allowed: {allowed}") from None
        found = sandbox.run_in_child(partial(_walked, opened), opened.size)
        if found is None:
            raise DamagedError(path, "cannot be read as netCDF (reading it took too long or failed)")
        if found["elsewhere"]:
            raise DamagedError(path, f"{shortened(repr(found['elsewhere'][0]))}: lies in other files")
        try:
            self._file = h5py.File(self.path)
        except UNREADABLE as error:
            raise DamagedError(path, f"cannot be read as netCDF ({error})") from None
        try:
            self._check(sweep)
        except MapError:
            self.close()
            raise
        except UNREADABLE as error:
            self.close()
            raise DamagedError(path, f"cannot be read ({error})") from None

    def _check(self, sweep: Sweep) -> None:
        held = {name: str(value) for name, value in self._file.attrs.items()}
        grid, wanted, variables = sweep.grid, identity(sweep), sweep.variables
        self._need(name for name in (*TOLD, "seal", *wanted) if name not in held)
        for name, value in wanted.items():
            if held[name] != value:
                raise ForeignError(
                    self.path, f"{name}: is not that of this sweep", "shards of this definition and kernels"
                )
        self._need(name for name in (*variables, CHECKSUMS, DIGESTS) if name not in self._file)
        try:
            #: first: number of its first point; after: number after its last point; motions: how many motions were
            #: integrated for its points
            self.first, self.after, self.motions, seal = (int(held[name]) for name in (*TOLD, "seal"))
        except ValueError:
            raise DamagedError(self.path, "has attributes that are no numbers") from None
        chunks = chunks_of(sweep)
        if not 0 <= self.first < self.after <= grid.size:
            raise DamagedError(self.path, "holds points that the sweep has not")
        found = {name: (self._file[name].shape, self._file[name].chunks) for name in variables}
        own = {name: sweep.shape_at(name) for name in variables}
        if any(found[name] != (grid.shape + own[name], chunks.shape + own[name]) for name in variables):
            raise DamagedError(self.path, "holds another number of points than it says")
        for name, spec in variables.items():  # a merge copies chunks as they lie
            if (self._file[name].compression, self._file[name].shuffle) != ("gzip" if spec.deflated else None, False):
                raise DamagedError(self.path, f"{name}: is packed in another way")
        self._chunked = ChunkFile(self._file, variables, chunks)
        self._checks = _Checks(tuple(variables), pieces(chunks, self.first, self.after))
        self._checks.checksums[:] = self._file[CHECKSUMS][:]
        self._checks.digests[:] = self._file[DIGESTS][:]
        if self._checks.seal(held[name] for name in TOLD) != seal:
            raise DamagedError(self.path, "its list of checksums has another checksum than it was written with")

    def _need(self, missing: Iterable[str]) -> None:
        for name in missing:
            raise DamagedError(self.path, f"{name}: is missing")

    def pieces(self) -> Iterator[tuple[Piece, dict[str, bytes]]]:
        """Yield each piece, in order, with its chunk of every variable as stored in the file."""
        for index, piece in enumerate(self._checks.pieces):
            stored = {}
            for row, name in enumerate(self._checks.names):
                try:
                    stored[name] = self._chunked.take(name, piece.chunk)
                except UNREADABLE as error:
                    raise DamagedError(self.path, f"{name}: cannot be read ({error})") from None
                if isal_zlib.crc32(stored[name]) != self._checks.checksums[row, index]:
                    raise DamagedError(self.path, f"{name}: has another checksum than it was written with")
            yield piece, stored

    def digests(self, piece: Piece) -> dict[str, bytes]:
        """Return name → hash of a whole piece's values."""
        index = piece.chunk - self._checks.pieces[0].chunk
        return {name: self._checks.digests[row, index].tobytes() for row, name in enumerate(self._checks.names)}

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def __enter__(self):
        return self

    def __exit__(self, *failure):
        self.close()
