"""A finished sweep is recognised by the sizes of its files; whatever could change a result causes a full check."""

import fcntl
import json
import os
import time
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest
from calls import python

from sweeps.pipeline import claims, up_to_date
from sweeps.points.loading import read_sweep

ROOT = Path(up_to_date.__file__).parents[2]
FOLDER = Path("results/mine")
MINE = {"grid": {"I1": [0.5, 1.0], "I2": 0.75, "I3": 1.0, "omega0": 1.0}}
HEAVY = {"numba", "llvmlite", "numpy", "xarray", "pandas", "matplotlib", "pydantic", "ruamel", "h5py", "netCDF4"}


@pytest.fixture
def mine(tmp_path, monkeypatch):
    """Return a definition, after writing a folder with recorded outputs of its run."""
    monkeypatch.chdir(tmp_path)
    path, folder = Path("mine.yaml"), FOLDER
    path.write_text(json.dumps(MINE))
    (folder / "figures").mkdir(parents=True)
    for name in ("stability_map.nc", "report.html", claims.CLAIM):
        (folder / name).write_text(name)
    up_to_date.record(folder, up_to_date.inputs_hash(path))
    return path


def outputs_of(path):
    outputs, inputs = up_to_date.unchanged_outputs(FOLDER)
    return [file.name for file in outputs if inputs == up_to_date.inputs_hash(path)]


def test_what_is_finished_and_unchanged_is_found(mine):
    assert outputs_of(mine) == list(up_to_date.OUTPUTS)
    assert up_to_date.inputs_hash("nowhere.yaml") == ""


def _edit_the_definition(path):
    path.write_text(json.dumps(MINE | {"title": "other"}))


def _move_the_definition(path):
    Path("elsewhere").mkdir()
    path.rename("elsewhere/mine.yaml")
    path.symlink_to("elsewhere/mine.yaml")


@pytest.mark.parametrize(
    "change",
    [
        _edit_the_definition,
        _move_the_definition,
        lambda path: os.utime("results/mine/stability_map.nc"),
        lambda path: Path("results/mine/report.html").unlink(),
        lambda path: Path("results/mine/figures").rmdir(),
        lambda path: Path(".numba_config.yaml").write_text("opt: 0"),
        lambda path: Path("results/mine/.finished").write_text("[" * 10_000),
    ],
)
def test_whatever_changes_sends_it_the_long_way(mine, change):
    change(mine)
    assert not outputs_of(mine)


def test_settings_processor_and_sources_count(mine, monkeypatch):
    basis = up_to_date.inputs_hash(mine)
    with monkeypatch.context() as patch:
        patch.setenv("NUMBA_OPT", "1")
        assert up_to_date.inputs_hash(mine) != basis
    with monkeypatch.context() as patch:
        patch.setenv("NUMBA_CACHE_DIR", "/elsewhere")
        assert up_to_date.inputs_hash(mine) == basis
    with monkeypatch.context() as patch:
        patch.setattr(up_to_date, "processor", lambda: ["another"])
        assert up_to_date.inputs_hash(mine) != basis
    sources = [*map(str, up_to_date._sources())]
    assert {str(ROOT / name) for name in ("kernels/free/exact.py", "sweeps/mechanics/library/pendulum.py")} <= {
        *sources
    }
    weigh = up_to_date._file_state
    changed_path = str(ROOT / "kernels/free/exact.py")
    monkeypatch.setattr(
        up_to_date, "_file_state", lambda p: (*weigh(p), "edited") if str(p) == changed_path else weigh(p)
    )
    assert up_to_date.inputs_hash(mine) != basis


def test_a_definition_that_was_edited_between_its_readings_is_not_noted(mine):
    """Restored, the definition would be served the edited definition's map."""
    before, basis = mine.read_text(), up_to_date.inputs_hash(mine)
    assert up_to_date.covers_text(basis, read_sweep(mine).definition.text)
    mine.write_text(f"# a comment\n{json.dumps(MINE)}")
    sweep = read_sweep(mine)
    mine.write_text(before)
    assert not up_to_date.covers_text(basis, sweep.definition.text)


def test_a_folder_where_another_run_is_at_work_is_not_finished(mine):
    with open(f"results/mine/{claims.CLAIM}") as claim:
        fcntl.flock(claim, fcntl.LOCK_EX)
        assert not outputs_of(mine)
    assert outputs_of(mine)


def test_a_definition_that_names_files_has_other_inputs(mine):
    assert not read_sweep(mine).has_other_inputs
    Path("rows.csv").write_text("I3\n1.0\n1.1\n")
    mine.write_text(json.dumps({"grid": {"I1": 0.5, "I2": 0.75, "omega0": 1.0}, "table": "rows.csv"}))
    assert read_sweep(mine).has_other_inputs
    sweep = read_sweep(MINE)
    for entries in (
        {"system": "swing.py"},
        {"text": "bodies: [{name: A, mesh: {file: a.stl}}]"},
        {"inputs": "a.csv 0"},
    ):
        definition = SimpleNamespace(**{"system": "rigid_body", "text": "", "inputs": ""} | entries)
        assert replace(sweep, definition=definition).has_other_inputs


def test_a_note_without_a_hash_sends_it_the_long_way_and_takes_none_from_unchanged_outputs(mine):
    up_to_date.record(FOLDER)
    assert outputs_of(mine)
    os.utime(FOLDER / "report.html")
    up_to_date.record(FOLDER)
    assert not outputs_of(mine)


def test_nothing_is_loaded_for_what_is_finished(mine):
    inputs_hash = up_to_date._hash(mine.read_bytes())
    up_to_date.record(FOLDER, inputs_hash)
    code = (
        f"import sys; from sweeps.pipeline import up_to_date; up_to_date.inputs_hash = lambda path: {inputs_hash!r}\n"
        "from sweeps.__main__ import main; assert main(['run', 'mine.yaml']) == 0\n"
        "print(*sys.modules)"
    )
    *outputs, modules_loaded = python(code).splitlines()
    assert outputs == [str(Path("results/mine") / name) for name in up_to_date.OUTPUTS]
    assert not HEAVY & set(modules_loaded.split())


# Figures and the report: each file counts

MAP = up_to_date.OUTPUTS[0]


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
    up_to_date.remove_damaged(outputs_folder)
    assert not (outputs_folder / output).exists()
    assert (outputs_folder / ("report.html" if output == "figures" else "figures/a.png")).exists()


def test_whole_figures_stay_and_an_own_file_beside_them_is_no_damage(outputs_folder):
    (outputs_folder / "figures/mine.txt").write_text("a note of the user")
    up_to_date.remove_damaged(outputs_folder)
    assert len(list((outputs_folder / "figures").iterdir())) == 4


def test_files_that_an_interrupted_run_has_drawn_again_are_no_damage(outputs_folder):
    (outputs_folder / MAP).write_bytes(b"another map")  # a run begins, replaces a file, and is killed
    os.utime(outputs_folder / MAP, ns=(time.time_ns() + 10**9,) * 2)
    (outputs_folder / "report.html").write_bytes(bytes(50))
    up_to_date.remove_damaged(outputs_folder)
    assert (outputs_folder / "report.html").exists()
