"""The examples of the public functions' docstrings, run as a reader would run them."""

import doctest

import pytest

import sweeps
from sweeps import plot
from sweeps.pipeline import run

CLASSES_AND_FUNCTIONS = [getattr(sweeps, name) for name in sweeps.__all__ if name != "plot"] + [plot.Polhode]


@pytest.mark.parametrize("module", [sweeps, *CLASSES_AND_FUNCTIONS], ids=lambda module: module.__name__)
def test_every_example_prints_what_it_says(module, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(run, "_write_views", lambda *_: None)  # pictures take seconds, and have tests of their own
    examples = doctest.DocTestFinder(recurse=False).find(module, module.__name__, globs={"sweeps": sweeps})
    results = [doctest.DocTestRunner(verbose=False).run(each) for each in examples]
    assert sum(result.attempted for result in results) > 0
    assert sum(result.failed for result in results) == 0
