import errno
import math
from types import SimpleNamespace

import h5py
import netCDF4
import numpy as np
import pytest

from sweeps.schema.variables import Variable, table
from sweeps.shards import chunkfile, chunks, merging
from sweeps.shards.chunkfile import ChunkFile, define, written
from sweeps.shards.chunks import Chunks
from sweeps.shards.content import ContentHash, run_digest
from sweeps.shards.shard import Piece

DIMENSIONS = {"x": 3, "y": 11}  # two chunks a line, the second of which sticks out
SHAPE = tuple(DIMENSIONS.values())
VARIABLES = table(
    Variable("raw", "s", "a double"),
    Variable("packed", "s", "a double, mostly zero", sparse=True),
    Variable("single", "1", "a diagnostic", "f4"),
    Variable("count", "1", "a count", "i4"),
    Variable("flag", None, "a flag", "i1", ("no", "yes")),
)


@pytest.fixture(autouse=True)
def small(monkeypatch):
    monkeypatch.setattr(chunks, "CHUNK_POINTS", 6)


@pytest.fixture
def values():
    rng = np.random.default_rng(7)
    return {name: (rng.normal(size=SHAPE) * 100).astype(spec.dtype) for name, spec in VARIABLES.items()}


@pytest.fixture
def path(tmp_path):
    path = tmp_path / "file.nc"
    with netCDF4.Dataset(path, "w") as file:
        define(file, DIMENSIONS, VARIABLES)
    return path


def test_what_is_put_as_chunks_netcdf_reads_as_values(path, values):
    cut = Chunks(SHAPE)
    with h5py.File(path, "r+") as hdf:
        file = ChunkFile(hdf, VARIABLES, cut)
        for name, array in values.items():
            for k in range(6):
                first, after = cut.bounds(k)
                file.put(name, k, file.encode(name, k, first, array.reshape(-1)[first:after]))
    with netCDF4.Dataset(path) as file:
        file.set_auto_maskandscale(False)
        for name, array in values.items():
            assert file[name][:].tobytes() == array.tobytes(), name
            assert file[name].filters()["zlib"] == (name != "raw")


def test_what_netcdf_wrote_is_taken_as_chunks(path, values):
    with netCDF4.Dataset(path, "a") as file:
        for name, array in values.items():
            file[name][:] = array
    cut = Chunks(SHAPE)
    with h5py.File(path) as hdf:
        file = ChunkFile(hdf, VARIABLES, cut)
        for name, array in values.items():
            for k in range(6):
                first, after = cut.bounds(k)
                found = file.decode(name, k, first, after, file.take(name, k))
                assert found.tobytes() == array.reshape(-1)[first:after].tobytes(), name
                some = file.decode(name, k, first + 1, after, file.take(name, k))
                assert some.tobytes() == array.reshape(-1)[first + 1 : after].tobytes(), name


def test_a_part_of_a_chunk_keeps_its_place(path, values):
    cut = Chunks(SHAPE)
    with h5py.File(path, "r+") as hdf:
        file = ChunkFile(hdf, VARIABLES, cut)
        for name, array in values.items():
            stored = file.encode(name, 2, 13, array.reshape(-1)[13:15])
            assert file.decode(name, 2, 13, 15, stored).tobytes() == array.reshape(-1)[13:15].tobytes()
            beside = file.decode(name, 2, 11, 17, stored)
            assert np.count_nonzero(beside[:2]) == np.count_nonzero(beside[4:]) == 0


@pytest.mark.parametrize("hashed_whole", [True, False])
def test_pieces_of_shards_make_the_chunks_of_a_map_and_its_hash(path, values, hashed_whole):
    """One sticks out, and in it a shard ends, one lies and one begins; whole ones bring their hashes or none."""
    cut, digest, wanted = Chunks(SHAPE), ContentHash(), ContentHash()
    for name, array in values.items():
        for one in (digest, wanted):
            one.declare(name, ("x", "y"), SHAPE, array.dtype)
        wanted.update(name, array)
    cuts = [(k, *cut.bounds(k), True) for k in range(5)] + [(5, 28, 29, False), (5, 29, 31, False), (5, 31, 33, False)]
    with h5py.File(path, "r+") as hdf:
        file = ChunkFile(hdf, VARIABLES, cut)

        def part(name, piece):
            return values[name].reshape(-1)[piece.first : piece.after]

        def pieces():
            for piece in map(Piece._make, cuts):
                yield piece, {name: file.encode(name, piece.chunk, piece.first, part(name, piece)) for name in values}

        def digests(piece):
            assert hashed_whole
            return {name: run_digest(part(name, piece)) for name in values}

        merging._Target(file, digest, hashed_whole).take(SimpleNamespace(pieces=pieces, digests=digests))
    assert digest.hexdigest() == wanted.hexdigest()
    with netCDF4.Dataset(path) as file:
        file.set_auto_maskandscale(False)
        for name, array in values.items():
            assert file[name][:].tobytes() == array.tobytes(), name


def test_a_file_is_as_large_as_its_chunks(path):
    with netCDF4.Dataset(path) as file:
        assert math.prod(file["raw"].chunking()) == Chunks(SHAPE).points
    with h5py.File(path) as hdf:
        assert all(hdf[name].id.get_num_chunks() == 0 for name in VARIABLES)


@pytest.mark.parametrize(
    ("raised", "told"),
    [
        (OSError(errno.ENOSPC, "[Errno 28] Can't synchronously write data"), "No space left on device"),
        (OSError("Can't synchronously write data"), "cannot be written"),
        (RuntimeError("NetCDF: HDF error"), "cannot be written"),
    ],
)
def test_a_failing_write_is_told_in_the_systems_words(tmp_path, raised, told):
    with pytest.raises(OSError, match=told) as error, written(tmp_path / "map.nc"):
        raise raised
    assert error.value.filename == str(tmp_path / "map.nc")
    assert not list(tmp_path.iterdir())


def test_a_disk_that_is_full_explains_what_netcdf_does_not(tmp_path, monkeypatch):
    def full(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(chunkfile.os, "posix_fallocate", full)
    with pytest.raises(OSError, match="No space left on device"), written(tmp_path / "map.nc"):
        raise RuntimeError("NetCDF: HDF error")
