"""One reader for every file: damaged files are refused, and accepted files have the values of other libraries."""

import errno
import os
import random
import shutil
import signal
import sys
import time

import damages
import h5py
import netCDF4
import numpy as np
import pytest
import repeated
import xarray as xr
from hypothesis import given, settings
from hypothesis import strategies as st
from maps import DEFINITION, write

import sweeps
from sweeps.__main__ import main
from sweeps.reading import files, hdf5, sandbox
from sweeps.schema.refusals import MapError
from sweeps.schema.variables import extremes
from sweeps.shards import content_hash

QUICK_DAMAGES = 2
DAMAGES = int(os.environ.get("POLHODE_DAMAGES", 12))  # number of damages of each system's map, from some 1,500


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    return write(tmp_path_factory.mktemp("map"), damages.BASES["rigid"])


CASES = [
    *((name, slice(0, QUICK_DAMAGES)) for name in damages.QUICK),
    *(pytest.param(name, slice(QUICK_DAMAGES, DAMAGES), marks=pytest.mark.slow) for name in damages.QUICK),
    *(
        pytest.param(name, slice(0, DAMAGES), marks=pytest.mark.faults)
        for name in damages.BASES
        if name not in damages.QUICK
    ),
]


@pytest.mark.parametrize(("base", "selection"), CASES)
def test_strange_files_end_well_or_are_refused_in_words(tmp_path, monkeypatch, base, selection):
    """POLHODE_DAMAGES=2000 pytest -m "slow or faults" FILE tries the whole table of each system."""
    monkeypatch.chdir(tmp_path)
    path = write(tmp_path, damages.BASES[base], "base.nc")
    damage_items = list(damages.table(path).items())
    random.Random(base).shuffle(damage_items)
    for k, (name, damage) in enumerate(damage_items[selection]):
        folder = tmp_path / str(k)
        folder.mkdir()
        assert not damages.try_damage(folder, path, damage, number=k), name


# Bounds


LARGE = ["2^40 long", "2^40 in one chunk", "2^60 long", "2^20 by 2^20", "unlimited", "1e10 texts", "1e10 characters"]
LARGE += ["long texts", "bomb", "swollen"]


@pytest.mark.parametrize("holder", ["regime", pytest.param("I1", marks=pytest.mark.slow)])
@pytest.mark.parametrize("name", LARGE)
def test_what_a_file_only_declares_is_refused_before_it_is_allocated(path, tmp_path, holder, name):
    copy = shutil.copy(path, tmp_path / "map.nc")
    damages.replace_variable(copy, holder, damages.REPLACED[name])

    def load():
        with pytest.raises(MapError, match="allowed"):
            sweeps.open_map(copy).load()
        return 3

    assert damages.run_in_room(load, 2**28) == 3


ENDS = {
    "dies": lambda path: os.kill(os.getpid(), signal.SIGSEGV),
    "is busy for ever": lambda path: [None for _ in iter(int, 1)],
    "sleeps": lambda path: time.sleep(1000),
    "says nonsense": lambda path: {"refused"},
    "aborts": lambda path: os.abort(),
    "takes all memory": lambda path: bytearray(2**40),
    "leaves": lambda path: sys.exit(3),
}


@pytest.mark.parametrize("how", repeated.but([*ENDS][:4], ENDS))
def test_a_library_that_comes_down_is_a_refusal(path, monkeypatch, how, capfd):
    monkeypatch.setattr(hdf5, "_structure", ENDS[how])
    monkeypatch.setattr(sandbox, "MAX_SECONDS", 0.5)
    monkeypatch.setattr(sandbox, "PATIENCE", 0.2 if how == "sleeps" else 60.0)
    with pytest.raises(MapError, match="cannot be read as netCDF"):
        sweeps.open_map(path)
    assert capfd.readouterr().err == ""


# Accepted files


STORED = {
    "as another program deflates": {"zlib": True, "complevel": 9, "shuffle": False},
    "shuffled and deflated": {"zlib": True, "complevel": 4, "shuffle": True},
    "with checksums": {"zlib": True, "fletcher32": True},
    "checksums alone": {"fletcher32": True},
    "in small chunks": {"chunksizes": (1, 3, 2, 1, 2, 1, 1)},
    "the other way round": {},
}


QUICK = ("shuffled and deflated", "in small chunks", "the other way round")


@pytest.fixture(scope="module", params=repeated.but(QUICK, STORED))
def variant(request, path, tmp_path_factory):
    """Return the map as further libraries may store it."""
    copy = tmp_path_factory.mktemp("stored") / "map.nc"
    with xr.open_dataset(path, decode_times=False) as ds:
        ds.load().drop_encoding()
        encoding = {name: dict(STORED[request.param]) for name in ds.data_vars}
        ds.to_netcdf(copy, encoding=encoding)
    if request.param == "the other way round":
        store_big_endian(copy)
    return copy


def store_big_endian(path):
    """Stores the numbers of a map with their most significant byte first, which xarray does not."""
    with h5py.File(path, "r+") as file:
        for name in ("omega_squared", "energy_drift"):
            values, attributes = file[name][()], dict(file[name].attrs)
            scales = [file[name].dims[k][0].name for k in range(values.ndim)]
            del file[name]
            file.create_dataset(name, data=values.astype(values.dtype.newbyteorder(">")))
            for key in set(attributes) - {"DIMENSION_LIST", "_Netcdf4Dimid"}:
                file[name].attrs[key] = attributes[key]
            for k, scale in enumerate(scales):
                file[name].dims[k].attach_scale(file[scale])


def test_values_are_what_other_libraries_read(variant, path):
    with sweeps.open_map(variant) as ds, h5py.File(variant) as file, sweeps.open_map(path) as original:
        for name in ds.variables:
            values = file[name][()]
            for step in (-1, -2, 1):
                part = (slice(None, None, step),) * values.ndim
                np.testing.assert_array_equal(ds[name].variable[part].values, values[part])
        assert content_hash.content_hash(ds) == original.attrs["content_hash"]


@pytest.fixture(scope="module")
def map_and_arrays(variant):
    """The map as this reader reads it, and three of its variables as h5py does."""
    with sweeps.open_map(variant) as ds, h5py.File(variant) as file:
        yield ds, {name: file[name][()] for name in ("regime", "omega_squared", "energy_drift")}


@settings(max_examples=8)
@given(st.data())
def test_any_part_is_what_other_libraries_read(map_and_arrays, data):
    ds, arrays = map_and_arrays
    ends = st.integers(-6, 6) | st.none()
    steps = st.sampled_from([None, 1, 2, 3])  # xarray itself reads slices wrong that start outside
    key = tuple(data.draw(st.integers(-n, n - 1) | st.builds(slice, ends, ends, steps)) for n in ds["regime"].shape)
    for name, values in arrays.items():
        np.testing.assert_array_equal(ds[name].variable[key].values, values[key])


DECIDING = {
    "scale_factor": "two",
    "add_offset": np.nan,
    "missing_value": "x",
    "valid_range": np.array([0.0, 0.0]),
    "_Unsigned": "true",
    "_Encoding": "ebcdic",
    "coordinates": "I1 nowhere",
    "bounds": "nowhere",
    "calendar": "none",
}


def test_no_attribute_decides_how_numbers_are_read(path, tmp_path):
    copy = shutil.copy(path, tmp_path / "map.nc")
    for holder in ("omega_squared", "regime", "I1"):
        for attribute, value in DECIDING.items():
            damages.set_attribute(copy, holder, attribute, value)
    with sweeps.open_map(copy) as ds, sweeps.open_map(path) as original:
        assert content_hash.content_hash(ds) == original.attrs["content_hash"]
        assert list(ds.variables) == list(original.variables)
        assert all(ds[name].attrs.keys() == original[name].attrs.keys() for name in ds.variables)


@pytest.mark.parametrize("encoding", [{"scale_factor": 0.5}, {"add_offset": 100.0}, {"_FillValue": -999.0}])
def test_numbers_that_other_libraries_change_as_they_read_are_refused(path, tmp_path, encoding):
    """The file contains scaled numbers: they were once read unscaled, without a message."""
    with xr.open_dataset(path) as ds:
        ds.drop_encoding().to_netcdf(tmp_path / "map.nc", encoding={"omega_squared": encoding})
    with pytest.raises(MapError, match=f"omega_squared: has the {next(iter(encoding))}"):
        sweeps.open_map(tmp_path / "map.nc")


def test_a_lazy_map_travels_between_processes(path):
    import pickle

    with sweeps.open_map(path, chunks={}) as ds:
        twin = pickle.loads(pickle.dumps(ds))
        assert content_hash.content_hash(twin) == ds.attrs["content_hash"]


@pytest.mark.parametrize("change", [lambda copy: os.truncate(copy, 5000), lambda copy: os.utime(copy, ns=(1, 1))])
def test_a_file_that_changes_while_it_is_open_is_refused(path, tmp_path, change):
    copy = shutil.copy(path, tmp_path / "map.nc")
    with sweeps.open_map(copy) as ds:
        change(copy)
        with pytest.raises(MapError, match="was changed while it was read"):
            ds.load()


@pytest.mark.parametrize(
    ("owner", "name", "error", "words"),
    [
        (files.os, "pread", OSError(errno.EIO, "Input/output error"), "map.nc: Input/output error; allowed: "),
        (files.os, "open", PermissionError(errno.EACCES, "Permission denied"), "map.nc: cannot be opened (Permission"),
        (files.FileBytes, "read_at", OSError(errno.ENOENT, "No such file"), "system (at hdf5.py, line "),
    ],
)
def test_an_error_of_the_system_is_one_line_with_its_place(path, monkeypatch, capsys, owner, name, error, words):
    unraisable = []
    monkeypatch.setattr(sys, "unraisablehook", unraisable.append)

    def fail(*_):
        raise error

    monkeypatch.setattr(owner, name, fail)
    assert main(["show", str(path)]) == 2
    message = capsys.readouterr().err
    assert words in message
    assert message.count("\n") == 1
    assert not unraisable


def test_a_flag_without_a_meaning_is_refused_as_it_is_read(path, tmp_path):
    copy = shutil.copy(path, tmp_path / "map.nc")
    with netCDF4.Dataset(copy, "a") as file:
        flag = file["regime"].flag_values.max() + 1
        file["regime"][0, 0, 0, 0, 0] = flag
    message = f"regime: holds the flag {flag}, without a meaning"
    with sweeps.open_map(copy) as ds, pytest.raises(MapError, match=message):
        ds["regime"].load()


def test_a_version_of_many_lines_is_refused_in_one(path, tmp_path, capsys):
    copy = shutil.copy(path, tmp_path / "map.nc")
    damages.set_attribute(copy, "", "contract_version", "a\nb")
    assert main(["show", str(copy)]) == 2
    assert "contract_version: is a?b; allowed: 3.0" in capsys.readouterr().err


def test_what_is_no_part_of_a_map_is_left_alone(path, tmp_path):
    copy = shutil.copy(path, tmp_path / "map.nc")
    with netCDF4.Dataset(copy, "a") as file:
        file.createDimension("bnds", 2)
        file.createVariable("I1_bnds", "f8", ("I1", "bnds"))[:] = 0.0
        file.createVariable("mine", "i8", ())[:] = 3
    with sweeps.open_map(copy) as ds, sweeps.open_map(path) as original:
        assert list(ds.variables) == list(original.variables)
        assert set(ds.encoding["ignored"]) == {"I1_bnds", "mine", "bnds"}


def test_only_files_are_written_in_the_place_of_files(path, tmp_path, capsys):
    os.mkfifo(tmp_path / "pipe.csv")
    (tmp_path / "folder.csv").mkdir()
    (tmp_path / "link.csv").symlink_to("file.csv")
    place = ["--axis", "2", "--I1", "0.5", "--I2", "0.75", "--omega0", "1", "--epsilon", "1e-6"]

    def status(name):
        return main(["point", str(path), *place, "--trajectory", str(tmp_path / name)])

    assert status("pipe.csv") == status("folder.csv") == status("link.csv") == 2
    assert capsys.readouterr().err.count("is a link, a folder or a device, not a file; allowed: ") == 3
    assert (tmp_path / "pipe.csv").is_fifo()
    assert (tmp_path / "link.csv").is_symlink()
    assert {p.name for p in tmp_path.iterdir()} == {"pipe.csv", "folder.csv", "link.csv"}


def test_a_value_that_lies_beyond_all_files_is_refused(tmp_path, monkeypatch):
    path = write(tmp_path, DEFINITION)
    file = files.FileBytes(path)
    structure = sandbox.run_in_child(lambda: hdf5._structure(file), file.size)
    structure["variables"]["status"]["places"][0][-1] = 2**64
    monkeypatch.setattr(sandbox, "run_in_child", lambda *_: structure)
    with pytest.raises(MapError, match="lies where no file reaches"):
        hdf5.read_structure(files.FileBytes(path))


@pytest.mark.parametrize("filters", [(), (1,)])
@pytest.mark.parametrize("odd_chunk", [0, 1, 2])
def test_one_chunk_of_another_size_than_the_others_is_refused(filters, odd_chunk):
    """Chunks are of 8 bytes as stored, or of more than deflating could make of so few."""
    places = np.array([[k, 0, 1000 + 5000 * k, 8] for k in range(3)])
    hdf5._check_places("map.nc", "x", hdf5.StoredVariable(("x",), (3,), "<f8", {}, (1,), filters, places), 10**6)
    places[odd_chunk, -1] = 2000
    with pytest.raises(MapError, match="x: has chunks of another size than it declares"):
        hdf5._check_places("map.nc", "x", hdf5.StoredVariable(("x",), (3,), "<f8", {}, (1,), filters, places), 10**6)


def test_values_that_tell_of_all_are_the_ends_on_both_sides_of_zero():
    values = np.array([-2.0, -0.5, -1.0, 0.0, 3.0, 0.25, 1.0])
    assert {*extremes(values)} == {-2.0, -0.5, 0.0, 0.25, 3.0}
    assert {*extremes(np.array([4, 7, 5]))} == {4, 7}
