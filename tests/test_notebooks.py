"""The notebooks, executed from the top as a reader would, by a kernel of their own."""

import json
import os
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]


def execute(name, folder):
    """The outputs of each cell, as text."""
    nbclient = pytest.importorskip("nbclient", reason="nbclient is not here: pip install -e . --group slow")
    nbformat = pytest.importorskip("nbformat", reason="nbformat is not here: pip install -e . --group slow")
    notebook = nbformat.read(ROOT / "sweeps" / "notebooks" / name, as_version=4)
    assert not any(cell.get("outputs") for cell in notebook.cells), "a notebook ships without outputs"
    nbclient.NotebookClient(
        notebook, timeout=600, kernel_name="python3", resources={"metadata": {"path": str(folder)}}
    ).execute()
    return [str(cell.get("outputs", "")) for cell in notebook.cells]


def test_maps_of_regimes_are_drawn_by_the_public_function():
    """An array's own `plot` colours impossible bodies like possible bodies."""
    code = [
        "".join(cell["source"]) for cell in json.loads((ROOT / "sweeps/notebooks/first_map.ipynb").read_text())["cells"]
    ]
    assert sum("sweeps.plot.stability(brick, axis=2)" in source for source in code) == 1
    assert not any("regime.squeeze().plot(" in source for source in code)


@pytest.mark.slow
def test_the_first_map_is_what_its_words_say(tmp_path, monkeypatch):
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")]))
    monkeypatch.setenv("MPLBACKEND", "module://matplotlib_inline.backend_inline")
    outputs = execute("first_map.ipynb", tmp_path)
    output_text = "\n".join(outputs)
    assert "'axis': 3, 'I1_over_I3': 48, 'thickness': 48, 'I3': 6, 'omega0': 8" in output_text
    assert "{1: 'stable_minor', 2: 'unstable', 3: 'stable_major'}" in output_text
    table = next(text for text in outputs if "growth_rate_theory" in text and "<table" in text)
    assert "epsilon" not in table  # rates, and no coordinates but the axis
    assert output_text.count("image/png") == 4
    deviation = float(output_text.split("worst relative deviation over ")[1].split(": ")[1][:7])
    assert 0 < deviation < 1e-6
    assert any("'True'" in text for text in outputs)  # equal content hashes
    longer, tenfold = (output_text.split(words)[1][:5] for words in ("longer by ", "2 ln 10 / σ = "))
    assert longer == tenfold  # ten times less at the start: one tenfold growth more there and one back
    measured, theory = (output_text.split(f"{words} ")[1][:11] for words in ("measured", "s-1, theory"))
    assert measured == theory
    assert "Worker process" not in output_text  # Dask's warning that a worker was killed
