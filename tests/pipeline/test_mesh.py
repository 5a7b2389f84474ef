"""A body given as a mesh, from its file to its pictures and its page: the example of the handbook, run."""

import re
from pathlib import Path

import numpy as np
import pytest

import sweeps
from sweeps.__main__ import main

PAGE = (Path(__file__).parents[2] / "sweeps/handbook/text/howto/bodies.md").read_text(encoding="utf-8")


@pytest.mark.slow
@pytest.mark.usefixtures("few_frames")
def test_the_racket_of_the_readme_goes_the_whole_way(tmp_path, monkeypatch, capsys):
    trimesh = pytest.importorskip("trimesh")
    monkeypatch.chdir(tmp_path)
    size = np.array([0.27, 0.2, 0.01])  # m
    trimesh.creation.box(size).export("racket.stl")
    Path("real.yaml").write_text(re.search(r"```yaml\n(bodies:\n.*?)```", PAGE, re.DOTALL)[1])
    assert main(["run", "real.yaml", "--cores", "1"]) == 0, capsys.readouterr()
    folder = tmp_path / "results/real"
    names = {file.name for file in (folder / "figures").iterdir()}
    assert {"bodies.png", "theory_against_measured.png", "polhodes.png", "flip.gif"} <= names
    with sweeps.open_map(folder / "stability_map.nc") as ds:
        racket = ds.sel(body="Racket")
        mass = 600.0 * size.prod()
        expected = np.sort(mass / 12 * (np.square(size).sum() - np.square(size)))  # of a box, kg m2
        moments = [float(racket[f"I{i}"]) for i in (1, 2, 3)]
        np.testing.assert_allclose(moments, expected, rtol=1e-6)  # coordinates in STL files are single precision
        assert "racket.stl" in ds.attrs["inputs"]
    (tmp_path / "racket.stl").unlink()  # a map is enough for all that reads it
    path = str(folder / "stability_map.nc")
    assert main(["figures", path, "-o", "again", "--only", "bodies"]) == 0
    assert main(["show", path]) == main(["report", path, "-o", "again.html"]) == 0
