"""A finished run notes the sizes of its files; figures and a report that are not whole are made again."""

import os
import time

import pytest

from sweeps.pipeline import up_to_date

MAP = up_to_date.MAP


@pytest.fixture
def outputs_folder(tmp_path):
    """Return a sweep's folder with figures and a report of recorded sizes."""
    (tmp_path / "figures").mkdir()
    for name in (MAP, "figures/a.png", "figures/b.png", "figures/flip.gif", "report.html"):
        (tmp_path / name).write_bytes(bytes(100))
    up_to_date.record(tmp_path)
    return tmp_path


DAMAGES = {  # damage of a file, and the outputs removed for it
    "deleted": ("figures/a.png", lambda file: file.unlink(), "figures"),
    "cut short": ("figures/b.png", lambda file: os.truncate(file, 60), "figures"),
    "report cut short": ("report.html", lambda file: os.truncate(file, 60), "report.html"),
}


@pytest.mark.parametrize("damage", DAMAGES)
def test_a_file_that_is_missing_or_cut_short_has_its_figures_made_again(outputs_folder, damage):
    name, change, output = DAMAGES[damage]
    change(outputs_folder / name)
    assert up_to_date.find_outdated(outputs_folder) == {output}
    assert not (outputs_folder / output).exists()
    assert (outputs_folder / ("report.html" if output == "figures" else "figures/a.png")).exists()


def test_figures_that_are_older_than_their_map_are_outdated(outputs_folder):
    os.utime(outputs_folder / "figures", (0, 0))
    assert up_to_date.find_outdated(outputs_folder) == {"figures"}


def test_whole_figures_stay_and_an_own_file_beside_them_is_no_damage(outputs_folder):
    (outputs_folder / "figures/mine.txt").write_text("a note of the user")
    assert up_to_date.find_outdated(outputs_folder) == set()
    assert len(list((outputs_folder / "figures").iterdir())) == 4


@pytest.mark.parametrize("note", ["[" * 10_000, '{"inputs": "0", "files": {}}', "[]", '{"report.html": 3}', None])
def test_a_note_that_is_none_removes_nothing(outputs_folder, note):
    (outputs_folder / up_to_date.NOTE).write_text(note) if note else (outputs_folder / up_to_date.NOTE).unlink()
    os.truncate(outputs_folder / "report.html", 60)
    assert up_to_date.find_outdated(outputs_folder) == set()


def test_files_that_an_interrupted_run_has_drawn_again_are_no_damage(outputs_folder):
    (outputs_folder / MAP).write_bytes(b"another map")  # a run begins, replaces a file, and is killed
    os.utime(outputs_folder / MAP, ns=(time.time_ns() + 10**9,) * 2)
    (outputs_folder / "report.html").write_bytes(bytes(50))
    up_to_date.remove_damaged(outputs_folder)
    assert (outputs_folder / "report.html").exists()
