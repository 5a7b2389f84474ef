import errno
import math

import netCDF4
import numpy as np
import pytest

from sweeps.schema.variables import Variable, table
from sweeps.shards import content_hash, mapfile
from sweeps.shards.content_hash import ContentHash
from sweeps.shards.mapfile import new_file

SIZES = {"x": 3, "y": 11, "k": 2}
VARIABLES = table(
    Variable("raw", "s", "a double"),
    Variable("packed", "s", "a double, mostly zero", sparse=True),
    Variable("single", "1", "a diagnostic", "f4"),
    Variable("count", "1", "a count", "i4"),
    Variable("flag", None, "a flag", "i1", ("no", "yes")),
    Variable("pair", "s", "two at every point", over=("k",)),
)


@pytest.mark.parametrize("cuts", [[33], [1, 10, 12, 30, 33], [*range(1, 34)]])
def test_columns_of_any_runs_of_points_make_the_same_file_and_hash(tmp_path, monkeypatch, cuts):
    monkeypatch.setattr(content_hash, "CHUNK_POINTS", 6)  # a line of y is two chunks, the second of which sticks out
    rng, wanted = np.random.default_rng(7), ContentHash()
    values = {
        name: (rng.normal(size=(33, *(2 for _ in spec.over))) * 100).astype(spec.dtype)
        for name, spec in VARIABLES.items()
    }
    for name, spec in VARIABLES.items():
        wanted.declare(name, ("x", "y", *spec.over), (3, 11, *values[name].shape[1:]), spec.dtype)
        wanted.update(name, values[name])
    with new_file(tmp_path / "map.nc", SIZES) as file:
        file.add_columns(("x", "y"), VARIABLES)
        for first, after in zip([0, *cuts], cuts, strict=False):
            file.put_columns({name: column[first:after] for name, column in values.items()})
        assert file.seal({"title": "a map"}) == wanted.hexdigest()
    with netCDF4.Dataset(tmp_path / "map.nc") as file:
        assert (file.title, file.content_hash) == ("a map", wanted.hexdigest())
        file.set_auto_maskandscale(False)
        for name, column in values.items():
            assert file[name][:].tobytes() == column.tobytes(), name
            assert file[name].filters()["zlib"] == VARIABLES[name].deflated
            assert not file[name].filters()["shuffle"]
            assert math.prod(file[name].chunking()) <= 6
            assert file[name].sha256 == wanted.digests()[name]


@pytest.mark.parametrize(
    ("raised", "told"),
    [
        (OSError(errno.ENOSPC, "[Errno 28] Can't synchronously write data"), "No space left on device"),
        (OSError("Can't synchronously write data"), "cannot be written"),
        (RuntimeError("NetCDF: HDF error"), "cannot be written"),
    ],
)
def test_a_failing_write_is_told_in_the_systems_words(tmp_path, raised, told):
    with pytest.raises(OSError, match=told) as error, new_file(tmp_path / "map.nc", {}):
        raise raised
    assert error.value.filename == str(tmp_path / "map.nc")
    assert not list(tmp_path.iterdir())


def test_a_disk_that_is_full_explains_what_netcdf_does_not(tmp_path, monkeypatch):
    def full(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(mapfile.os, "posix_fallocate", full)
    with pytest.raises(OSError, match="No space left on device"), new_file(tmp_path / "map.nc", {}):
        raise RuntimeError("NetCDF: HDF error")
