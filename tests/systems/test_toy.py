"""A system of equations from a folder of its own, which no source file names, from the definition to the report."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from calls import run_command
from toy_package import TOY, write_metadata

import sweeps
from sweeps import systems
from sweeps.pipeline import run as pipeline

TEXT = (TOY / "honey.yaml").read_text()


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A folder with a definition, in which the toy's package is found as if it were installed."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(TOY)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(map(str, (tmp_path, TOY, TOY.parents[1]))))
    write_metadata(tmp_path)
    systems.forget_external()
    (tmp_path / "honey.yaml").write_text(TEXT)
    yield tmp_path
    systems.forget_external()


def test_a_system_of_ones_own_goes_the_whole_way(folder, capsys):
    assert "damped_top" in systems.system_names()
    outputs = list(pipeline.run(Path("honey.yaml"), cores=1))
    assert [path.name for path in outputs] == ["stability_map.nc", "figures", "report.html"]
    path = str(outputs[0])
    with sweeps.open_map(path) as ds:
        assert dict(ds.sizes) == {"spin": 2, "tau": 12}
        np.testing.assert_allclose(ds.decay, 1 / ds.tau.broadcast_like(ds.decay), rtol=1e-6)  # h = 1/64: h^4 = 6e-8
    assert [file.name for file in outputs[1].iterdir()] == ["decay.png"]
    page = outputs[2].read_text()
    for words in ("When does it stop?", "slows down", "damped-top", '"drag":"viscous"', "τ"):
        assert words in page
    text = run_command(capsys, "show", path)
    assert "v slows" in text
    assert "decay against decay_theory" in text
    facts = json.loads(run_command(capsys, "show", path, "--json"))
    assert facts["compared"] == 24
    assert facts["deviations"]["decay"]["value"] < 1e-6
    assert facts["table"] == {"slows": {"ok": 18, "coarse": 0}, "lasts": {"ok": 6, "coarse": 0}}
    run_command(capsys, "point", path, "--spin", "20", "--tau", "1", "--trajectory", "t.csv")
    assert np.loadtxt("t.csv", delimiter=",", skiprows=1)[0, 1] == 20.0
    verdict = " ".join(run_command(capsys, "verify", path).split())
    for check in ("content", "grid", "values", "this project's kernels", "SciPy", "closed form"):
        assert check in verdict
    assert "not checked" not in verdict
    run_command(capsys, "figures", path, "-o", "drawn")
    run_command(capsys, "report", path, "-o", "again.html")
    assert Path("again.html").read_text() == page


def test_a_wrong_value_of_such_a_system_is_refused_in_words(folder, capsys):
    (folder / "honey.yaml").write_text(TEXT.replace("[1.0, 20.0]", "-1.0"))
    message = run_command(capsys, "check", "honey.yaml", status=2)
    assert "grid.spin: -1.0 is out of range; allowed: a number from 1e-9 to 1e9" in message


def test_it_is_there_in_a_process_of_its_own(folder):
    check = [sys.executable, "-m", "sweeps", "check", "honey.yaml"]
    output = subprocess.run(check, stdout=subprocess.PIPE, text=True, check=True).stdout
    assert "24 = 2 spin × 12 tau" in output


def test_without_its_package_it_is_no_system(tmp_path, capsys):
    (tmp_path / "honey.yaml").write_text(TEXT)
    message = run_command(capsys, "check", tmp_path / "honey.yaml", status=2)
    assert "system: 'damped_top' is not available" in message
