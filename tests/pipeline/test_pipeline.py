import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from calls import python

import sweeps
from sweeps.__main__ import main
from sweeps.pipeline import claims, up_to_date
from sweeps.pipeline import run as pipeline
from sweeps.points import catalogue
from sweeps.schema.refusals import DefinitionError
from sweeps.shards import shard as shards

GRID = {"I1": [0.5, 1.0, 1.5], "I2": [0.75, 1.25], "I3": 1.0, "omega0": [1.0, 10.0]}
FEW = {"grid": GRID, "axes": [2], "integration": {"variables": ["omega_squared", "regime"]}}  # soon drawn

pytestmark = pytest.mark.usefixtures("few_frames")


@pytest.fixture
def mine(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.yaml").write_text(json.dumps(FEW | {"shards": 3}))
    return Path("mine.yaml")


def make_files(path, results="results", **options):
    return list(pipeline.run(Path(path), results=results, **{"cores": 1} | options))


@pytest.fixture
def measured(monkeypatch):
    """Numbers of the shards that this process measures."""
    numbers = []
    write = pipeline.write_shard

    def count_shard(definition, number, *rest):
        numbers.append(number)
        write(definition, number, *rest)

    def write_empty_views(sweep, folder, *rest):  # pictures take seconds
        (folder / "figures").mkdir(exist_ok=True)
        (folder / "figures").touch()
        (folder / "report.html").touch()

    monkeypatch.setattr(pipeline, "write_shard", count_shard)
    monkeypatch.setattr(pipeline, "_write_views", write_empty_views)
    return numbers


@pytest.mark.slow
def test_a_script_of_one_line_is_run_once(mine):
    """No process that it starts may run it again, though it guards nothing by its name."""
    mine.write_text(json.dumps(FEW))
    Path("script.py").write_text('print("begun")\nimport sweeps\nsweeps.run("mine.yaml", cores=2)\n')
    run = subprocess.run([sys.executable, "script.py"], capture_output=True, text=True, check=True)
    assert run.stdout == "begun\n"
    assert list(Path("results/mine/figures").glob("*.png"))
    finished = 'import sys; from sweeps.__main__ import main; main(["run", "mine.yaml"]); print(*sys.modules)'
    modules = python(finished).split()
    assert modules[:3] == [f"results/mine/{name}" for name in up_to_date.OUTPUTS]
    assert not {"xarray", "numba", "matplotlib", "pandas", "scipy"} & set(modules)  # an answer within 0.5 s


@pytest.mark.slow
def test_run_makes_what_the_workflow_makes(mine, capsys):
    assert main(["run", "mine.yaml", "--cores", "1"]) == 0
    output = capsys.readouterr()
    folder = Path("results/mine")
    assert output.out.split() == [str(folder / name) for name in ("stability_map.nc", "figures", "report.html")]
    assert "8 of 12 points" in output.err or "12 of 12 points" in output.err
    with sweeps.open_map(folder / "stability_map.nc") as ds:
        assert ds.attrs["content_hash"] == sweeps.survey("mine.yaml").attrs["content_hash"]
    assert {path.name for path in folder.iterdir()} == {
        *(claims.CLAIM, claims.DEFINITION, up_to_date.NOTE),
        *up_to_date.OUTPUTS,
    }
    assert list(folder.glob("figures/*.png"))


def test_a_run_announces_its_work_and_its_folder_or_is_quiet(mine, measured, capsys):
    assert main(["run", "mine.yaml", "--cores", "1", "-o", "elsewhere"]) == 0
    assert capsys.readouterr().err.startswith("mine: 12 points of rigid_body, about ")
    assert Path("elsewhere/mine/stability_map.nc").exists()
    assert not Path("results").exists()
    assert main(["run", "mine.yaml", "--cores", "1", "--again", "--quiet", "-o", "elsewhere"]) == 0
    outputs = "".join(f"elsewhere/mine/{name}\n" for name in up_to_date.OUTPUTS)
    assert capsys.readouterr() == (outputs, "")


def test_what_is_not_cut_is_written_at_once_unless_its_shard_is_there(mine, measured):
    mine.write_text(json.dumps(FEW))
    sweep = catalogue.plan_sweep(mine).sweep
    path, *_ = make_files(mine, cores=2)
    assert measured == []
    content = path.read_bytes()
    path.unlink()
    shards.write_shard(sweep, 1, 1, Path("results/mine/shards/1-of-1.nc"))
    path, *_ = make_files(mine)
    assert measured == []  # not again
    assert not Path("results/mine/shards").exists()
    with sweeps.open_map(path) as merged_map:
        attributes = merged_map.attrs
    path.write_bytes(content)
    with sweeps.open_map(path) as ds:
        for name in ("content_hash", "motions_integrated"):
            assert ds.attrs[name] == attributes[name]
        assert ds.attrs["content_hash"] == sweeps.survey("mine.yaml").attrs["content_hash"]


def test_what_is_finished_is_not_made_again(mine, measured):
    sweep = catalogue.plan_sweep(mine).sweep
    folder = Path("results/mine/shards")
    shards.write_shard(sweep, 2, 3, folder / "2-of-3.nc")
    (folder / "3-of-3.nc").write_bytes((folder / "2-of-3.nc").read_bytes()[:500])
    make_files(mine)
    assert measured == [1, 3]
    before = {path: path.stat().st_mtime_ns for path in [Path("results/mine"), *Path("results/mine").rglob("*")]}
    (claim,) = claims.claim(["mine"])  # a folder that cannot be claimed, like one that cannot be written
    assert make_files(mine) == [Path("results/mine") / name for name in up_to_date.OUTPUTS]
    assert measured == [1, 3]
    os.close(claim)
    after = {path: path.stat().st_mtime_ns for path in [Path("results/mine"), *Path("results/mine").rglob("*")]}
    changed_paths = {path.name for path in after if after[path] != before.get(path)}
    assert changed_paths == {claims.CLAIM}  # The claim of this test wrote it.
    make_files(mine, again=True)
    assert measured == [1, 3, 1, 2, 3]


def test_an_interrupted_run_states_how_many_shards_are_finished(mine, monkeypatch, capsys):
    def interrupt(sweep, number, *rest):
        if number == 3:
            raise KeyboardInterrupt
        write(sweep, number, *rest)

    write = pipeline.write_shard
    monkeypatch.setattr(pipeline, "write_shard", interrupt)
    assert main(["run", "mine.yaml", "--cores", "1"]) == 130
    assert capsys.readouterr().err.splitlines()[-1] == "interrupted: 2 of 3 shards finished"


def test_shards_and_maps_of_another_definition_or_kernel_are_made_again(mine, measured, monkeypatch):
    for definition in (FEW, FEW | {"axes": [3]}):
        mine.write_text(json.dumps(definition | {"shards": 2}))
        make_files(mine)
    assert measured == [1, 2] * 2
    system = type(sweeps.systems.resolve("rigid_body"))
    monkeypatch.setattr(system, "fingerprint", lambda self: "0" * 64)
    make_files(mine)
    assert measured == [1, 2] * 3


def test_a_systems_own_equations_are_compiled_before_its_shards(mine, measured, monkeypatch):
    mine.write_text(json.dumps({"system": "pendulum", "grid": {"length": [0.5, 1.0]}, "shards": 2}))
    monkeypatch.setattr(pipeline.compile_kernels, "compile_seconds", lambda sweep: 1.0)
    monkeypatch.setattr(pipeline.compile_kernels, "ensure_compiled", lambda sweep: measured.append(sweep.system.name))
    make_files(mine)
    assert measured[0] == "pendulum"
    assert [number for number in measured if number != "pendulum"] == [1, 2]


@pytest.mark.parametrize("arguments", [["nowhere.yaml"], ["tinny"], ["mine.yaml", "--cores", "0"]])
def test_run_refuses_before_any_work(mine, capsys, arguments):
    assert main(["run", *arguments]) == 2
    assert "allowed: " in capsys.readouterr().err
    assert not Path("results").exists()


# Two definitions of one file name


@pytest.fixture
def two(tmp_path, monkeypatch, measured):
    monkeypatch.chdir(tmp_path)
    for folder, spin in (("a", 1.0), ("c", 2.0)):
        (tmp_path / folder).mkdir()
        text = json.dumps({"grid": {"I1": 1.0, "I2": 1.5, "I3": 2.5, "omega0": spin}})
        (tmp_path / folder / "mine.yaml").write_text(text)
    make_files("a/mine.yaml")
    return tmp_path


def spin():
    with sweeps.open_map("results/mine") as ds:
        return ds.omega0.item()


def test_another_definition_of_the_same_name_is_refused_unless_it_is_to_replace_the_results(two):
    with pytest.raises(DefinitionError) as error:
        make_files("c/mine.yaml")
    assert str(error.value).startswith(f"c/mine.yaml: results/mine contains the results of {two}/a/mine.yaml; allowed")
    assert spin() == 1.0
    make_files("c/mine.yaml", replace=True)
    assert spin() == 2.0
    make_files("c/mine.yaml")  # the folder's present owner
    with pytest.raises(DefinitionError):
        make_files("a/mine.yaml")


CHANGES = {  # change of the first definition → the definition that is run then
    "edited": (lambda old: old.write_text(old.read_text().replace("1.5", "1.6")), "a/mine.yaml"),
    "moved": (lambda old: old.rename("mine.yaml"), "mine.yaml"),
    "copied": (lambda old: Path("mine.yaml").write_text(old.read_text()), "mine.yaml"),
    "another folder of results": (lambda old: None, "c/mine.yaml"),
}


@pytest.mark.parametrize("change", CHANGES)
def test_one_definition_is_not_refused(two, change):
    make_change, path = CHANGES[change]
    make_change(two / "a/mine.yaml")
    make_files(path, results="others" if path == "c/mine.yaml" else "results")
    assert spin() == 1.0
