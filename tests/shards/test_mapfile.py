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
    monkeypatch.setattr(content_hash, "CHUNK_POINTS", 6)  # a line of y is two chunks, and the second extends beyond it
    rng, expected = np.random.default_rng(7), ContentHash()
    values = {
        name: (rng.normal(size=(33, *(2 for _ in spec.over))) * 100).astype(spec.dtype)
        for name, spec in VARIABLES.items()
    }
    for name, spec in VARIABLES.items():
        expected.declare(name, ("x", "y", *spec.over), (3, 11, *values[name].shape[1:]), spec.dtype)
        expected.update(name, values[name])
    with new_file(tmp_path / "map.nc", SIZES) as file:
        file.add_columns(("x", "y"), VARIABLES)
        for first, after in zip([0, *cuts], cuts, strict=False):
            file.put_columns({name: column[first:after] for name, column in values.items()})
        assert file.seal({"title": "a map"}) == expected.hexdigest()
    with netCDF4.Dataset(tmp_path / "map.nc") as file:
        assert (file.title, file.content_hash) == ("a map", expected.hexdigest())
        file.set_auto_maskandscale(False)
        for name, column in values.items():
            assert file[name][:].tobytes() == column.tobytes(), name
            assert file[name].filters()["zlib"] == VARIABLES[name].deflated
            assert not file[name].filters()["shuffle"]
            assert math.prod(file[name].chunking()) <= 6
            assert file[name].sha256 == expected.digests()[name]


@pytest.mark.parametrize(
    ("error_of_system", "message"),
    [
        (OSError(errno.ENOSPC, "[Errno 28] Can't synchronously write data"), "No space left on device"),
        (OSError("Can't synchronously write data"), "cannot be written"),
        (RuntimeError("NetCDF: HDF error"), "cannot be written"),
    ],
)
def test_a_failing_write_is_told_in_the_systems_words(tmp_path, error_of_system, message):
    with pytest.raises(OSError, match=message) as error, new_file(tmp_path / "map.nc", {}):
        raise error_of_system
    assert error.value.filename == str(tmp_path / "map.nc")
    assert not list(tmp_path.iterdir())


def test_a_disk_that_is_full_explains_what_netcdf_does_not(tmp_path, monkeypatch):
    def full(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(mapfile.os, "posix_fallocate", full)
    with pytest.raises(OSError, match="No space left on device"), new_file(tmp_path / "map.nc", {}):
        raise RuntimeError("NetCDF: HDF error")
