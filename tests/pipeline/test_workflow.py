"""The workflow as people run it: `python -m snakemake` in a copy of the repository."""

import importlib.util
import json
import re
import shutil
from pathlib import Path

import compiled
import pytest
from compiled import copy_sources, run

import sweeps
import sweeps.maps.dataset  # the kernels imported are of the same moment as their copy
from sweeps.__main__ import main
from sweeps.pipeline import targets
from sweeps.points import catalogue
from sweeps.schema.refusals import DefinitionError

ROOT = Path(__file__).parents[2]
OWN_DEFINITION = {"axes": [1], "grid": {"I1": [1.0, 2.0], "I2": 1.5, "I3": 3.0, "omega0": [-2.0, 1.0]}, "shards": 2}
OWN_DEFINITION["integration"] = {"variables": ["omega_squared", "omega_squared_theory", "regime", "status"]}
OWN = ("--config", "definition=own.json", "--")
SOUND = "grid: {I1: 1.0, I2: 2.0, I3: 3.0, omega0: 1.0}\n"
INVALID = {
    "values.yaml": "grid: {I1: 1.0, I2: -2.0, I3: .nan, omega0: 1.0, ipsilon: 0.1}\n",
    "syntax.yaml": "grid: {I1: [1.0\n",
    "huge.yaml": re.sub(r"(I\d): [^,]*", r"\1: {start: 1, stop: 2, num: 100000}", SOUND),
    "bad name.yaml": SOUND,
    "tiny.yaml": SOUND,
}


def snakemake(folder, *arguments):
    return run(folder, "-m", "snakemake", "--cores", 2, *arguments)


@pytest.fixture(scope="module")
def fresh(tmp_path_factory):
    """A copy in which nothing is ever made."""
    return copy_sources(tmp_path_factory.mktemp("fresh"))


@pytest.fixture(scope="module")
def workflow_copy(tmp_path_factory):
    """A copy, with this checkout's kernels, in which all outputs of a JSON definition have been made."""
    folder = copy_sources(tmp_path_factory.mktemp("made"))
    compiled.share(folder, folder / ".cache")
    (folder / "own.json").write_text(json.dumps(OWN_DEFINITION))
    process = snakemake(folder, *OWN)
    assert process.returncode == 0, process.stderr
    return folder


@pytest.mark.slow
def test_a_definition_in_json_end_to_end(workflow_copy):
    """The shipped `tiny`, with all its pictures, is run by .ci/run."""
    folder = workflow_copy / "results/own"
    with sweeps.open_map(folder / "stability_map.nc") as ds:
        assert ds.attrs["content_hash"] == sweeps.survey(OWN_DEFINITION).attrs["content_hash"]
        assert json.loads(ds.attrs["definition"]) == OWN_DEFINITION
    assert len(list(folder.glob("logs/shard-*-of-2.log"))) == 2
    assert not list(folder.glob("shards/*.nc"))
    assert list(folder.glob("figures/*.png"))
    assert (folder / "report.html").stat().st_size > 700_000  # Plotly's plane charts are 661,524 of it
    assert "Nothing to be done" in snakemake(workflow_copy, "-n", *OWN).stdout


EDITS = {  # file → its edit, and the reason of Snakemake
    "kernels/free/linear.py": (lambda text: text + "# another comment\n", "Params have changed since last execution"),
    "own.json": (lambda text: json.dumps(OWN_DEFINITION | {"axes": [2]}), ""),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", EDITS)
def test_an_edited_kernel_or_definition_runs_the_sweep_again(workflow_copy, name):
    (edit, reason), file = EDITS[name], workflow_copy / name
    before = file.read_text()
    file.write_text(edit(before))
    try:
        process = snakemake(workflow_copy, "-n", *OWN, "results/own/stability_map.nc")
    finally:
        file.write_text(before)
    output = process.stdout + process.stderr
    assert process.returncode == 0
    for words in ("Measuring shard 2 of 2 of own", "Merging the shards of own", reason):
        assert words in output


@pytest.mark.slow
def test_a_shard_that_compiled_the_kernels_is_kept_by_a_workflow_that_finds_them_compiled(workflow_copy):
    definition = {"system": "pendulum", "grid": {"length": [0.5, 1.0]}, "shards": 2}
    (workflow_copy / "rocking.json").write_text(json.dumps(definition))
    for mark in (workflow_copy / ".cache").rglob(
        "ready/system_*"
    ):  # code of described systems that earlier tests have compiled
        mark.unlink()
    arguments = ("--config", "definition=rocking.json", "--")
    first = snakemake(workflow_copy, *arguments, "results/rocking/shards/1-of-2.nc")
    assert first.returncode == 0, first.stderr
    assert "compiling the kernels of pendulum, once per machine" in first.stderr
    process = snakemake(workflow_copy, "-n", *arguments, "results/rocking/stability_map.nc")
    output = process.stdout + process.stderr
    assert "Measuring shard 2 of 2 of rocking" in output
    assert "Measuring shard 1" not in output


@pytest.mark.slow
@pytest.mark.skipif(
    importlib.util.find_spec("snakemake_executor_plugin_slurm") is not None, reason="the plugin for Slurm is here"
)
def test_the_profile_for_slurm_says_what_it_needs(fresh):
    shutil.copytree(ROOT / ".slurm", fresh / ".slurm", dirs_exist_ok=True)
    answer = run(fresh, "-m", "snakemake", "--profile", ".slurm")
    assert answer.returncode == 2
    assert "--profile: .slurm needs a plugin that is not here; allowed: pip install -e '.[slurm]'" in answer.stderr
    assert "invalid choice" not in answer.stderr


@pytest.mark.parametrize("name", INVALID)
def test_what_both_doors_ask_refuses_in_the_same_words(tmp_path, monkeypatch, capsys, name):
    """Without their processes: the Snakefile's first checks, and its message before it exits with 2."""
    monkeypatch.chdir(tmp_path)
    Path(name).write_text(INVALID[name])
    assert main(["run", name]) == 2
    with pytest.raises(DefinitionError) as error:
        catalogue.plan_targets({"definition": name}, [])
    words = [capsys.readouterr().err, f"{error.value}\n"]
    if name == "huge.yaml":  # how much room is free differs from one moment to the next
        words = [text.partition("; allowed: ")[0] for text in words]
    else:
        assert "allowed" in words[0]
    assert words[0] == words[1]
    assert name.removesuffix(".yaml") in words[0]
    assert not Path("results").exists()


@pytest.mark.parametrize(
    "target", ["results/tiney/stability_map.nc", "results/../../etc/passwd", "results/a;touch owned/stability_map.nc"]
)
def test_the_workflow_is_told_of_sweeps_that_it_knows(target):
    with pytest.raises(DefinitionError, match=r"^target: .*tennis_racket, tiny") as error:
        catalogue.plan_targets({}, [target])
    assert ("did you mean tiny?" in str(error.value)) == ("tiney" in target)


class Rule:
    """Targets of Snakemake's rules."""

    def __init__(self, *output):
        self.output = output

    def is_producer(self, target):
        patterns = (re.sub(r"\\{(\w+)\\}", r"[^/]+", re.escape(output)) for output in self.output)
        return any(re.fullmatch(pattern, target) for pattern in patterns)


@pytest.mark.parametrize("file", ["nonsense.nc", "stability_map", "figures/axis.png", "shards/0", ""])
def test_files_that_rules_do_not_make_are_refused(file):
    rules = [Rule(*re.findall(r'"(results/\{sweep\}/[^"]*)"', (ROOT / "Snakefile").read_text()))]
    targets.refuse_unknown(["results/tiny/stability_map.nc", "results/tiny/shards/1-of-2.nc"], rules, ["tiny"])
    with pytest.raises(DefinitionError) as error:
        targets.refuse_unknown([f"results/tiny/{file}"], rules, ["tiny"])
    what, _, allowed = str(error.value).partition("; allowed: ")
    assert what.startswith(f"target: 'results/tiny/{file}' is made by no rule")
    assert ("did you mean results/tiny/stability_map.nc?" in what) == ("stability" in file)
    assert {"results/tiny/stability_map.nc", "results/tiny/figures"} <= set(allowed.split(", "))
