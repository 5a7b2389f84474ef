"""Files that point elsewhere, or are no regular files: refused, without opening or waiting for the target."""

import os
import socket
from functools import partial

import h5py
import numpy as np
import pytest
from maps import DEFINITION, write

import sweeps
from sweeps.points import tables
from sweeps.points.loading import read_sweep
from sweeps.reading import hdf5, sandbox
from sweeps.reading.files import FileBytes
from sweeps.schema.refusals import DefinitionError, MapError


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    return write(tmp_path_factory.mktemp("map"), DEFINITION | {"integration": {"variables": ["regime", "status"]}})


def virtual(file, name, target, kind="f8"):
    layout = h5py.VirtualLayout((3,), kind)
    layout[...] = h5py.VirtualSource(str(target), "x", shape=(3,))
    file.create_virtual_dataset(name, layout)


def external(file, name, target, kind="f8"):
    file.create_dataset(name, (3,), kind, external=[(str(target), 0, h5py.h5f.UNLIMITED)])


def make_link(file, name, target):
    file[name] = h5py.ExternalLink(str(target), "/x")


ELSEWHERE = {
    "virtual numbers": virtual,
    "virtual texts": lambda f, n, t: virtual(f, n, t, h5py.string_dtype()),
    "virtual characters": lambda f, n, t: virtual(f, n, t, "S8"),
    "external numbers": external,
    "external characters": lambda f, n, t: external(f, n, t, "S8"),
    "external link": make_link,
}


@pytest.fixture(params=["a file", "a FIFO"])
def target(request, tmp_path):
    """Return the target: a complete file, which could be read, or a FIFO, at which a reader waits for ever."""
    place = tmp_path / "target"
    if request.param == "a FIFO":
        os.mkfifo(place)
    else:
        with h5py.File(place, "w") as file:
            file["x"] = np.array(["secret"] * 3, dtype=h5py.string_dtype())
    return place


@pytest.mark.parametrize("how", ELSEWHERE)
def test_a_map_of_which_a_part_lies_elsewhere_is_refused(tmp_path, target, how):
    with h5py.File(tmp_path / "map.nc", "w") as file:
        file.attrs["contract_version"] = "1.0"
        ELSEWHERE[how](file, "body", target)
    with pytest.raises(MapError, match=r"body: (lies in other files|is a link to somewhere else); allowed") as error:
        hdf5.read_structure(FileBytes(tmp_path / "map.nc"))
    assert "secret" not in str(error.value)


@pytest.mark.parametrize("how", ELSEWHERE)
def test_a_table_of_which_a_part_lies_elsewhere_is_refused(tmp_path, monkeypatch, target, how):
    monkeypatch.setattr(tables, "cache_folder", lambda: tmp_path / "cache")
    with h5py.File(tmp_path / "rows.nc", "w") as file:
        ELSEWHERE[how](file, "I1", target)
    with pytest.raises(DefinitionError, match=r"is no netCDF file that can be read .I1: .*; allowed"):
        read_sweep(definition(tmp_path, "rows.nc"))


def definition(folder, name):
    (folder / "my.yaml").write_text(f"table: {name}\ngrid: {{I2: 1.0, I3: 1.0, omega0: 1.0}}\n")
    return folder / "my.yaml"


@pytest.mark.parametrize(
    "make", [os.mkfifo, os.mkdir, lambda p: os.symlink("/dev/zero", p), lambda p: os.symlink(p, p)]
)
def test_what_is_no_regular_file_is_refused_at_once(tmp_path, monkeypatch, make):
    monkeypatch.setattr(tables, "cache_folder", lambda: tmp_path / "cache")
    make(tmp_path / "rows.csv")
    with pytest.raises(DefinitionError, match=r"table: .*allowed"):
        read_sweep(definition(tmp_path, "rows.csv"))
    if not (tmp_path / "rows.csv").is_dir():
        with pytest.raises(MapError, match="there is no such file"):
            sweeps.open_map(tmp_path / "rows.csv")


def read_by_cat():
    process = os.posix_spawn("/bin/cat", ["cat", "/etc/hostname"], {})
    assert os.waitpid(process, 0)[1] == 0


ATTEMPTS = {
    "opens another file": lambda: open("/etc/hostname").close(),
    "writes a file": lambda: os.write(os.open("owned", os.O_CREAT | os.O_WRONLY), b"x"),
    "opens a socket": lambda: socket.socket().close(),
    "opens a pipe": lambda: os.pipe(),
    "starts a process that reads": read_by_cat,
}


def attempt(what):
    return {"done": str({**ATTEMPTS, "computes": int}[what]())}


@pytest.mark.parametrize("what", ATTEMPTS)
@pytest.mark.parametrize("forks", [True, pytest.param(False, marks=pytest.mark.slow)])
def test_a_reader_in_a_child_can_reach_nothing_else(tmp_path, monkeypatch, what, forks):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sandbox, "FORKS", forks)
    assert sandbox.run_in_child(partial(attempt, "computes"), 1) == {"done": "0"}
    with pytest.raises(sandbox.ChildError):
        sandbox.run_in_child(partial(attempt, what), 1)
    assert not list(tmp_path.iterdir())


def test_a_spawned_child_reads_what_a_forked_one_reads(path, monkeypatch):
    by_fork = hdf5.read_structure(FileBytes(path))
    monkeypatch.setattr(sandbox, "FORKS", False)
    by_spawn = hdf5.read_structure(FileBytes(path))
    assert by_spawn.attributes == by_fork.attributes
    assert list(by_spawn.variables) == list(by_fork.variables)


@pytest.mark.parametrize("mode", ["r", "r+"])
@pytest.mark.parametrize("options", [{}, {"locking": False}, {"driver": "stdio"}])
def test_a_map_that_this_process_has_open_in_h5py_is_read(path, mode, options):
    with h5py.File(path, mode, **options), sweeps.open_map(path) as ds:
        assert ds["regime"].shape == ds["regime"].load().shape


def test_a_file_that_comes_in_pieces_is_read_whole(path, monkeypatch):
    """As on network file systems, and of more than 2 GiB."""
    pread = os.pread
    monkeypatch.setattr(os, "pread", lambda file, size, place: pread(file, min(size, 700), place))
    assert FileBytes(path).read_at(3, 1000) == path.read_bytes()[3:1003]
