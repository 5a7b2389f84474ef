"""Coverage of errors over samples of random definitions; and that the benchmarks of the README run."""

import subprocess
import sys
import tomllib
from pathlib import Path

import engines
import error_bars
import error_bars_described
import kernel
import numpy as np
import pytest
import race
import random_motions

from kernels.estimator.statuses import OK

SCRIPT = Path(race.__file__)


@pytest.mark.parametrize("kind", ["random", "near-symmetric", "needles and plates"])
def test_errors_cover(kind):
    for epsilon in (1e-8, 1e-3, 1e-1):
        cells, marginal, num_wrong, _ = error_bars.rigid(kind, 100, epsilon)
        assert num_wrong == 0
        for name, cell in cells.items():
            # the bar is 999 of 1,000 inside; of 600 points none is outside, and none beyond twice the error
            assert cell.cover == 1.0, (name, cell)
            assert cell.worst <= 1.0 + 1e-9, (name, cell)
        assert kind != "random" or marginal <= {1e-1: 0.03}.get(epsilon, 0.005)


@pytest.mark.parametrize("name", ["pendulum", "rotating_saddle"])
def test_errors_cover_in_random_definitions_of_described_systems(name):
    """A sample of `error_bars.py --only-described`."""
    ((_, table),) = error_bars_described.random_tables(6, 6, 3, max_samples=200, names=[name])
    ok = table["status"] == OK
    assert 0.3 < ok.mean() < 1.0
    assert not (table["wrong"] & ok).any()
    assert not (table["missing"] & ok).any()
    for column in error_bars_described.columns_of(table):
        ratio = table[column][ok]
        # the error of a rate contains the amplitude's shift, reached at large amplitudes: 1 and a rounding
        assert (ratio[np.isfinite(ratio)] <= 1.0 + 1e-6).all(), column
        assert sum(f"| {column} |" in line for line in error_bars_described.lines([(name, table)])) == 1


@pytest.mark.parametrize(("name", "definitions", "points", "seed"), [
    ("rigid_body", 80, 40, 29), ("tumbling", 2, 12, 35), ("symmetric_top", 60, 10, 35),
])  # fmt: skip
def test_errors_cover_in_random_definitions_of(name, definitions, points, seed):
    """A sample of `random_motions.py`; the promise of 999 in 1,000, of few points, allows one outside."""
    max_samples = 2e3 if name == "rigid_body" else 500
    table = random_motions.random_definitions(name, definitions, points, seed=seed, max_samples=max_samples)
    assert not random_motions.lost_in_silence(name, table).any()
    assert table["asked"].mean() > 0.3
    columns = random_motions.COLUMNS[name]
    for column in columns:
        ratio = table[column][~np.isnan(table[column]) & (name == "rigid_body" or table["status"] == OK)]
        assert np.sum(ratio > 1.0 + 1e-9) <= max(1, 1e-3 * ratio.size), column
        assert ratio.max() <= 2.0, column
    assert sum(line.startswith("|") for line in random_motions.lines(name, table)) == 2 + len(columns)
    if name == "rigid_body":
        assert not random_motions.wrong_regimes(table).any()
        missing = table["omega_squared lost"]
        assert (np.abs(table["omega0"][missing]) < 1e-130).all()
        assert 0.001 < missing.mean() < 0.1


def test_the_kernels_benchmark_runs(capsys):
    kernel.main(["--tiny"])
    output = capsys.readouterr().out
    for name, *_ in kernel.RATIOS:
        assert name in output


@pytest.mark.slow
def test_the_race_runs_and_everybody_is_a_row(tmp_path):
    command = [sys.executable, str(SCRIPT), "--tiny", "--threads", "2", "--out", str(tmp_path)]
    run = subprocess.run(command, cwd=SCRIPT.parents[2], capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    table = (tmp_path / "race.md").read_text()
    for kind in race.contenders.ALL:
        assert f"| {kind.name} | " in table


def test_engines_are_a_group_of_dependencies_and_rows_of_the_table():
    root = SCRIPT.parents[2]
    groups = tomllib.loads((root / "pyproject.toml").read_text(encoding="utf-8"))["dependency-groups"]
    assert groups["engines"] == sorted({row.package for row in engines.ROWS})
    assert {row.name for row in engines.ROWS} == {*engines.ENGINES}
    assert all(row.step > 0 or row.step_text == "adaptive" for row in engines.ROWS)
    assert len(engines.NOT_RUN) == 3
    brick = {(cells[1], cells[2], cells[4]): float(cells[5]) for cells in engines.page_table() if cells[0] == "MuJoCo"}
    assert brick["4.0.0", "implicitfast", "10 ms"] > 1000 * brick["3.10.0", "implicitfast", "10 ms"]
    assert brick["4.0.0", "RK4", "10 ms"] < 1e-8 < brick["3.10.0", "RK4", "10 ms"]
