import errno
import hashlib
import os
import resource
import shutil
import struct
import threading
from pathlib import Path

import h5py
import netCDF4
import numpy as np
import pytest
import xarray as xr
from maps import assert_same_bits

import sweeps
from sweeps.maps import dataset, storage
from sweeps.maps.storage import open_map
from sweeps.points import catalogue, columns
from sweeps.points.loading import read_sweep
from sweeps.process import files
from sweeps.reading import stored_values
from sweeps.reading.definitions import file_text, plain, read_text
from sweeps.schema.refusals import MapError
from sweeps.shards import content_hash, mapfile, merging
from sweeps.shards import shard as sharding

KINDS = ["omega_squared", "growth_rate", "growth_rate_error", "frequency", "regime", "status", "energy_drift"]
KINDS += ["samples_used"]  # variables of each type, deflated and in one piece
TINY = plain(read_text(file_text(catalogue.shipped_files()["tiny"])))
TINY = read_sweep({**TINY, "integration": {**TINY.get("integration", {}), "variables": KINDS}})
BODIES = read_sweep(
    {
        "bodies": [
            {"name": "Mond, größer", "I1": 1.0, "I2": 2.0, "I3": 2.5, "omega0": -3.0},
            {"name": "b", "ratios": {"I1": 0.4, "I2": 0.4, "I3": 1.0}, "omega0": 1.0},
            {"name": "sphere", "I1": 1.0, "I2": 1.0, "I3": 1.0, "omega0": 2.0},
        ],
        "grid": {"epsilon": [1e-8, 1e-3]},
        "integration": {"variables": KINDS},
    }
)
POINTS = read_sweep(
    {
        "axes": [1, 2],
        "sample": {"num": 200, "seed": 1},
        "grid": {"I1": {"start": 0.5, "stop": 1.5}, "I2": {"start": 0.5, "stop": 1.5}, "I3": 1.0, "omega0": 2.0},
        "integration": {"variables": KINDS},
    }
)


def write_shards(folder, definition, count, threads=1):
    paths = [folder / f"{number}-of-{count}-by-{threads}.nc" for number in range(1, count + 1)]
    for number, path in enumerate(paths, 1):
        sharding.write_shard(definition, number, count, path, threads)
    return paths


@pytest.fixture(scope="module")
def tiny():
    ds = dataset.survey_grid(TINY)
    return ds.assign_attrs(content_hash=content_hash.content_hash(ds))


@pytest.fixture(scope="module")
def shards(tmp_path_factory):
    return write_shards(tmp_path_factory.mktemp("shards"), TINY, 3)


@pytest.fixture(scope="module")
def tiny_map(shards, tmp_path_factory):
    path = tmp_path_factory.mktemp("map") / "tiny.nc"
    merging.merge_shards(TINY, shards, path)
    return path


@pytest.fixture
def small():
    return xr.Dataset(
        {"value": (("x", "y"), np.arange(6.0).reshape(2, 3)), "flag": (("x",), np.array([1, 2], "i1"))},
        coords={"x": [0.0, 1.0], "name": ("y", ["a", "b", "é"])},
    )


# The cut into shards and threads changes no bit


@pytest.mark.parametrize(
    ("definition", "count", "threads"),
    [(TINY, 4, 2), (POINTS, 3, 1), pytest.param(BODIES, 1, 2, marks=pytest.mark.slow)],
)
def test_shards_and_threads_change_no_bit(definition, count, threads, tmp_path, monkeypatch):
    monkeypatch.setattr(content_hash, "CHUNK_POINTS", 50)  # so that a shard is many chunks, and shares some
    monkeypatch.setattr(sharding, "BLOCK_POINTS", 120)
    expected = dataset.survey_grid(definition)
    path = tmp_path / "map.nc"
    written_hash = merging.merge_shards(definition, write_shards(tmp_path, definition, count, threads)[::-1], path)
    with storage.open_map(path) as ds:
        assert_same_bits(ds, expected)
        hashes = {ds.attrs["content_hash"], written_hash, content_hash.content_hash(ds)}
        assert hashes == {content_hash.content_hash(expected)}
        assert {n: ds.attrs[n] for n in expected.attrs} == expected.attrs


def test_flags_and_ancillary_names_reach_the_file(tiny_map):
    """CF-1.11: coordinates are never missing (2.5.1); a value names its error and status (3.4), a status none."""
    with netCDF4.Dataset(tiny_map) as file:
        assert file["regime"].flag_values.dtype == file["regime"].dtype == np.int8
        assert np.isnan(file["growth_rate"]._FillValue)
        assert "_FillValue" not in file["I1"].ncattrs()
        assert file.history.endswith("polhode")
        ancillary = {
            n: v.ancillary_variables for n, v in file.variables.items() if "ancillary_variables" in v.ncattrs()
        }
        assert ancillary["growth_rate"] == "growth_rate_error status"
        assert "status" not in ancillary
        assert all(name in file.variables for names in ancillary.values() for name in names.split())


# Shards that do not make a map


def merge_is_refused(paths, tmp_path, *words, definition=TINY):
    target = tmp_path / "map.nc"
    target.write_bytes(b"old")
    with pytest.raises(MapError) as error:
        merging.merge_shards(definition, paths, target)
    for word in words:
        assert word in str(error.value)
    assert target.read_bytes() == b"old"
    assert not list(tmp_path.glob(".*"))


def test_shards_that_do_not_cover_each_point_once_are_refused(shards, tmp_path):
    first, second, third = shards
    merge_is_refused([second, third], tmp_path, "points 0 to 287 are missing")
    merge_is_refused([first, second], tmp_path, "points 576 to 863 are missing")
    merge_is_refused([first, first, second, third], tmp_path, "points 0 to 287 are given twice")
    merge_is_refused([write_shards(tmp_path, TINY, 2)[0], second, third], tmp_path, "points 288 to 431 are given twice")


def of_other_kernels(path):
    with h5py.File(path, "r+") as file:
        file.attrs["kernel_fingerprint"] = "0" * 64


def without_a_variable(path):
    with h5py.File(path, "r+") as file:
        del file["frequency"]


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (of_other_kernels, "kernel_fingerprint"),
        (without_a_variable, "frequency: is missing"),
        (lambda path: path.unlink(), "allowed"),
        (lambda path: path.write_bytes(b""), "allowed"),
        (lambda path: path.write_bytes(b"not netCDF"), "allowed"),
        (lambda path: path.write_bytes(b"\x89HDF\r\n\x1a\n" + bytes(600)), "allowed"),
    ],
)
def test_another_file_in_place_of_a_shard_is_refused(shards, tmp_path, change, words):
    change(path := Path(shutil.copy(shards[1], tmp_path / "other.nc")))
    merge_is_refused([shards[0], path, shards[2]], tmp_path, "other.nc", words)


def test_shards_of_another_definition_and_maps_are_refused(shards, tiny_map, tmp_path):
    merge_is_refused(shards, tmp_path, shards[0].name, "definition", definition=BODIES)
    merge_is_refused([tiny_map], tmp_path, "first_point: is missing")
    with pytest.raises(MapError, match="contract_version"):
        sweeps.open_map(shards[0])


# A write that fails


def full_disk(*_, **__):
    raise OSError(errno.ENOSPC, "No space left on device")


@pytest.mark.parametrize(
    ("where", "what"),
    [
        ("while writing", "shard"),
        pytest.param("while writing", "merge", marks=pytest.mark.slow),
        ("while writing", "write_map"),
        ("while flushing", "merge"),  # shards carry checksums and do not wait
        pytest.param("while flushing", "write_map", marks=pytest.mark.slow),
    ],
)
def test_a_failing_write_leaves_what_was_there(shards, tiny, tmp_path, monkeypatch, what, where):
    path = tmp_path / "map.nc"
    path.write_bytes(b"old")
    if where == "while flushing":
        monkeypatch.setattr(os, "fsync", full_disk)
    else:
        monkeypatch.setattr(mapfile.MapFile, "put", full_disk)
        monkeypatch.setattr(xr.Dataset, "to_netcdf", full_disk)
    write = {
        "shard": lambda: sharding.write_shard(TINY, 1, 9, path, progress=full_disk),
        "merge": lambda: merging.merge_shards(TINY, shards, path),
        "write_map": lambda: storage.write_map(tiny, path),
    }[what]
    with pytest.raises(OSError, match="No space left"):
        write()
    assert [p.name for p in tmp_path.iterdir()] == ["map.nc"]
    assert path.read_bytes() == b"old"


def test_a_disk_that_cannot_flush_is_no_failure(tmp_path, monkeypatch):
    def fail(_):
        raise OSError(errno.EINVAL, "Invalid argument")

    monkeypatch.setattr(os, "fsync", fail)
    with files.replace_output(tmp_path / "deep" / "file") as temporary:
        temporary.write_text("new")
    assert (tmp_path / "deep" / "file").read_text() == "new"


def test_a_replaced_file_has_the_usual_permissions(tmp_path):
    usual = tmp_path / "usual"
    usual.write_text("")
    with files.replace_output(tmp_path / "file") as temporary:
        assert temporary.parent == tmp_path  # a rename is atomic within one file system only
        temporary.write_text("new")
    assert (tmp_path / "file").stat().st_mode == usual.stat().st_mode


# Opening


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda ds: ds.assign_attrs(contract_version="1.9"), r"contract_version: is 1\.9; allowed: 3\."),
        (lambda ds: ds.drop_vars(["status", "regime"]), r"regime: is missing \(2 in all\)"),
        (lambda ds: ds.assign_attrs(system="pendulums"), "system: 'pendulums' is not available; allowed: dissipative"),
        (lambda ds: xr.Dataset({"value": ("x", [1.0])}), "contract_version: is missing"),
        (lambda ds: ds.assign_attrs(contract_version="3.9"), ""),
        (lambda ds: ds.drop_attrs(deep=False).assign_attrs({k: v for k, v in ds.attrs.items() if k != "system"}), ""),
    ],
)
def test_open_map_takes_maps_of_its_contract_and_systems_alone(tiny, tmp_path, change, words):
    change(tiny).to_netcdf(tmp_path / "map.nc")
    if not words:
        sweeps.open_map(tmp_path / "map.nc").close()
        return
    with pytest.raises(MapError, match=rf"map\.nc: {words}"):
        sweeps.open_map(tmp_path / "map.nc")


# Writing a Dataset


@pytest.mark.parametrize(
    "definition", [pytest.param(TINY, id="grid", marks=pytest.mark.slow), pytest.param(POINTS, id="points")]
)
def test_write_map_of_a_lazy_dataset_or_an_opened_map_gives_the_same_map(definition, tmp_path):
    expected = dataset.survey_grid(definition)
    written_hash = storage.write_map(dataset.survey_grid(definition, chunks=40), tmp_path / "map.nc")
    assert written_hash == content_hash.content_hash(expected)
    with storage.open_map(tmp_path / "map.nc") as ds:
        assert ds.attrs["content_hash"] == written_hash == content_hash.content_hash(ds)
        assert_same_bits(ds, expected)
        assert storage.write_map(ds, tmp_path / "again.nc") == written_hash


def test_both_writers_deflate_the_same_variables(tiny_map, tiny, tmp_path):
    storage.write_map(tiny, tmp_path / "map.nc")
    with netCDF4.Dataset(tiny_map) as file_a, netCDF4.Dataset(tmp_path / "map.nc") as file_b:
        filters = {name: [file[name].filters()[k] for k in ("zlib", "shuffle")] for name in tiny for file in (file_a,)}
        assert filters == {name: [file_b[name].filters()[k] for k in ("zlib", "shuffle")] for name in tiny}
    assert {True, False} == {zlib for zlib, _ in filters.values()}


@pytest.mark.parametrize("has_chunks", [True, False])
def test_a_part_is_written_and_read_a_few_values_at_a_time(has_chunks, tiny, tmp_path, monkeypatch):
    """However the map is stored: of a map of 3 GB a plane may be a tenth."""
    small = tiny.isel(axis=[1], omega0=[0]).drop_encoding()
    encoding = {name: {"chunksizes": (1,) * v.ndim} for name, v in small.items() if has_chunks}
    small.to_netcdf(tmp_path / "map.nc", encoding=encoding)
    monkeypatch.setattr(mapfile, "PART_VALUES", 3)
    monkeypatch.setattr(stored_values, "PART_VALUES", 3)
    sizes = []
    box = stored_values.StoredValues._box
    monkeypatch.setattr(stored_values.StoredValues, "_box", lambda *args: sizes.append(box(*args).size) or box(*args))
    with open_map(tmp_path / "map.nc") as ds:
        sizes.clear()
        written_hash = mapfile.write_part(ds, tmp_path / "part.nc", "slice")
    assert max(sizes) <= 3
    with open_map(tmp_path / "part.nc") as ds:
        hashes = {ds.attrs["content_hash"], written_hash, content_hash.content_hash(ds)}
        assert hashes == {content_hash.content_hash(small)}


@pytest.mark.parametrize("writer", ["polhode", "xarray"])
def test_a_part_is_opened_as_it_was_written(writer, tmp_path):
    """Text is written of any length by xarray, character by character by Polhode."""
    plane = dataset.survey_grid(BODIES).isel(axis=0)
    if writer == "polhode":
        written_hash = mapfile.write_part(plane, tmp_path / "part.nc", "part")
        with xr.open_dataset(tmp_path / "part.nc") as ds:
            assert ds.equals(plane)
            assert ds["body"].values.tolist() == plane["body"].values.tolist()
            assert {*ds["regime"].coords} == {*plane["regime"].coords}
            assert np.isnan(ds["growth_rate"].encoding["_FillValue"])
            assert "_FillValue" not in ds["epsilon"].encoding
            assert ds.attrs["content_hash"] == written_hash == content_hash.content_hash(plane)
    else:
        plane.to_netcdf(tmp_path / "part.nc")
    with open_map(tmp_path / "part.nc") as ds:
        assert_same_bits(ds, plane)
        assert ds.equals(plane)


# The content hash


def test_the_content_hash_sees_values_names_dimensions_and_types(small):
    changed_value = small.copy(deep=True)
    changed_value["value"][1, 2] = np.nextafter(5.0, 6.0)
    negative = small.copy(deep=True)
    negative["value"][0, 0] = -0.0
    renamed_text = small.assign_coords(name=("y", ["a", "b", "e"]))
    joined_text = small.assign_coords(name=("y", ["ab", "", "é"]))
    variants = [
        changed_value,
        negative,
        renamed_text,
        joined_text,
        small.rename(value="other"),
        small.rename(y="z"),
        small.transpose("y", "x"),
        small.assign(flag=small.flag.astype("i2")),
        small.drop_vars("flag"),
        small.isel(x=[1, 0]),
        small.assign(value=(("x", "y"), small["value"].values.reshape(2, 3).T.reshape(2, 3))),
    ]
    hashes = [content_hash.content_hash(ds) for ds in (small, *variants)]
    assert len(set(hashes)) == len(hashes)


def test_the_content_hash_sees_no_attribute_encoding_or_order(small):
    expected = content_hash.content_hash(small)
    variant = small.assign_attrs(title="other")
    variant["value"].attrs["units"] = "m"
    variant["value"].encoding["zlib"] = True
    assert content_hash.content_hash(variant) == expected
    assert content_hash.content_hash(small[["flag", "value"]]) == expected
    assert content_hash.content_hash(small.assign(value=small["value"].astype(">f8"))) == expected
    assert content_hash.content_hash(small.chunk({"x": 1})) == expected
    fortran = small.assign(value=(("x", "y"), np.asfortranarray(small["value"].values)))
    assert content_hash.content_hash(fortran) == expected


def test_a_variables_own_hash_is_what_its_documentation_says(monkeypatch):
    monkeypatch.setattr(content_hash, "CHUNK_POINTS", 5)
    values = np.arange(24.0).reshape(2, 12)  # runs of 4 values: 12 in three even parts
    total = hashlib.sha256()
    for k in range(6):
        total.update(hashlib.sha256(struct.pack("<4d", *range(4 * k, 4 * k + 4))).digest())
    ds = xr.Dataset({"value": (("x", "y"), values)})
    assert content_hash.hash_content(ds).digests() == {"value": total.hexdigest()}
    assert content_hash.hash_content(ds, max_values=7).digests() == {"value": total.hexdigest()}
    text = hashlib.sha256(hashlib.sha256("a\0é\0".encode()).digest())
    content = b"value\0x=2,y=12\0<f8\0" + total.digest() + b"word\0k=2\0str\0" + text.digest()
    assert content_hash.content_hash(ds.assign(word=("k", ["a", "é"]))) == hashlib.sha256(content).hexdigest()


# Shards that the disk has changed


def cut(path):
    with open(path, "r+b") as file:
        file.truncate(path.stat().st_size // 2)


def flip(path):
    with netCDF4.Dataset(path) as file:
        value_bytes = file["omega_squared"][:].data[40:48].tobytes()
    content = bytearray(path.read_bytes())
    content[content.index(value_bytes) + 3] ^= 16
    path.write_bytes(content)


@pytest.mark.parametrize("damage", [cut, pytest.param(flip, marks=pytest.mark.slow)])
def test_a_damaged_shard_is_measured_again_and_never_merged(shards, tiny, tmp_path, damage, capsys):
    copies = [shutil.copy(path, tmp_path / f"{k}-of-3.nc") for k, path in enumerate(shards, 1)]
    damage(copies[1])
    merged_hash = merging.merge_shards(TINY, copies, tmp_path / "map.nc")
    assert merged_hash == tiny.attrs["content_hash"]
    assert "2-of-3.nc" in capsys.readouterr().err
    # and the shard is whole again
    assert merging.merge_shards(TINY, copies, tmp_path / "map.nc") == merged_hash
    assert capsys.readouterr().err == ""


def test_a_damaged_shard_of_another_name_is_refused(shards, tmp_path):
    copies = [shutil.copy(path, tmp_path / f"part{k}.nc") for k, path in enumerate(shards, 1)]
    flip(copies[0])
    merge_is_refused(copies, tmp_path, "part1.nc", "checksum")


def test_a_map_says_how_many_motions_were_integrated(tmp_path):
    mapping = {"grid": {"I1": [1.0, 2.0], "I2": 3.0, "I3": 4.0, "omega0": [1.0, 2.0, 5.0, -1.0]}}
    for collapse, motions in ((False, 24), (True, 12)):
        definition = read_sweep(mapping | {"integration": {"collapse": collapse, "variables": ["omega_squared"]}})
        merging.merge_shards(definition, write_shards(tmp_path, definition, 1), tmp_path / "map.nc")
        with storage.open_map(tmp_path / "map.nc") as ds:
            assert ds.attrs["motions_integrated"] == str(motions)


@pytest.mark.slow
def test_a_folder_of_more_shards_than_a_process_may_open_is_merged(tmp_path, tiny):
    definition = read_sweep(plain(read_text(TINY.definition.text)) | {"shards": 24})
    folder = tmp_path / "shards"
    for number in range(1, 25):
        sharding.write_shard(definition, number, 24, folder / f"{number}-of-24.nc")
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (max(map(int, os.listdir("/dev/fd"))) + 20, hard))
    try:
        merged_hash = merging.merge_shards(definition, [folder], tmp_path / "map.nc")
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))
    assert merged_hash == tiny.attrs["content_hash"]
    (folder / "7-of-24.nc").unlink()
    with pytest.raises(MapError, match="7-of-24"):
        merging.merge_shards(definition, [folder], tmp_path / "map.nc")


def test_threads_leave_what_they_have_not_begun_when_it_is_broken_off():
    has_begun, release, run = threading.Event(), threading.Event(), []

    def busy():
        has_begun.set()
        assert release.wait(60)

    def run_threads():
        with columns.open_pool(1) as pool:
            pool.submit(busy)
            pool.submit(run.append, 1)
            assert has_begun.wait(60)
            threading.Timer(0.1, release.set).start()
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_threads()
    assert run == []
