"""A finished run notes the sizes of its files; figures and a report that are not whole are made again."""

import os
import shutil
import time

import maps
import pytest

from sweeps.pipeline import up_to_date
from sweeps.points.loading import read_sweep

MAP, OUTPUTS = up_to_date.MAP, up_to_date.OUTPUTS
DEFINITION = {"grid": {"I1": [1.0, 1.5], "I2": 2.0, "I3": 2.5, "omega0": 1.0}}


@pytest.fixture(scope="module")
def sweep():
    return read_sweep(DEFINITION)


@pytest.fixture(scope="module")
def map_file(tmp_path_factory):
    return maps.write(tmp_path_factory.mktemp("map"), DEFINITION)


@pytest.fixture
def outputs_folder(tmp_path, map_file):
    """Return a sweep's folder with its map, and figures and a report of recorded sizes."""
    shutil.copyfile(map_file, tmp_path / MAP)
    (tmp_path / "figures").mkdir()
    for name in ("figures/a.png", "figures/b.png", "figures/flip.gif", "report.html"):
        (tmp_path / name).write_bytes(bytes(100))
    up_to_date.record(tmp_path)
    return tmp_path


NOTHING: set[str] = set()
DAMAGES = {  # damage → file, change, outputs that are outdated by it, outputs that are removed before the workflow runs
    "nothing": ("figures/a.png", lambda file: None, NOTHING, NOTHING),
    "a file of the user": ("figures/mine.txt", lambda file: file.write_text("a note"), NOTHING, NOTHING),
    "deleted": ("figures/a.png", lambda file: file.unlink(), {"figures"}, {"figures"}),
    "cut short": ("figures/b.png", lambda file: os.truncate(file, 60), {"figures"}, {"figures"}),
    "older than the map": ("figures", lambda file: os.utime(file, (0, 0)), {"figures"}, NOTHING),
    "report cut short": ("report.html", lambda file: os.truncate(file, 60), {"report.html"}, {"report.html"}),
    "map cut short": (MAP, lambda file: os.truncate(file, 600), {*OUTPUTS}, NOTHING),
    "map deleted": (MAP, lambda file: file.unlink(), {*OUTPUTS}, NOTHING),
}


@pytest.mark.parametrize("damage", DAMAGES)
def test_what_is_missing_cut_short_or_older_than_its_map_is_outdated(outputs_folder, sweep, damage):
    name, change, outdated, removed = DAMAGES[damage]
    change(outputs_folder / name)
    files = set(outputs_folder.rglob("*"))
    assert up_to_date.find_outdated(outputs_folder, sweep) == outdated
    assert set(outputs_folder.rglob("*")) == files
    up_to_date.remove_damaged(outputs_folder)
    assert {file.name for file in files - set(outputs_folder.rglob("*")) if file.parent == outputs_folder} == removed


def test_a_map_of_another_definition_is_outdated(outputs_folder):
    other_sweep = read_sweep(DEFINITION | {"axes": [2]})
    assert up_to_date.find_outdated(outputs_folder, other_sweep) == {*OUTPUTS}


@pytest.mark.parametrize("note", ["[" * 10_000, '{"inputs": "0", "files": {}}', "[]", '{"report.html": 3}', None])
def test_a_note_that_is_none_removes_nothing(outputs_folder, sweep, note):
    (outputs_folder / up_to_date.NOTE).write_text(note) if note else (outputs_folder / up_to_date.NOTE).unlink()
    os.truncate(outputs_folder / "report.html", 60)
    assert up_to_date.find_outdated(outputs_folder, sweep) == set()


def test_files_that_an_interrupted_run_has_drawn_again_are_no_damage(outputs_folder):
    (outputs_folder / MAP).write_bytes(b"another map")  # a run begins, replaces a file, and is killed
    os.utime(outputs_folder / MAP, ns=(time.time_ns() + 10**9,) * 2)
    (outputs_folder / "report.html").write_bytes(bytes(50))
    up_to_date.remove_damaged(outputs_folder)
    assert (outputs_folder / "report.html").exists()
