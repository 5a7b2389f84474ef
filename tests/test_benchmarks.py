import json
import math
import subprocess
import sys
import time
from pathlib import Path

import attitude
import bodies as task
import contenders
import error_bars
import error_bars_described
import history
import kernel
import large
import mpmath as mp
import numpy as np
import pandas
import parts
import pytest
import race
import random_motions
import roof
import searching
from scipy.integrate import solve_ivp

from kernels import direct, exact, survey, taylor
from kernels.statuses import OK

SCRIPT = Path(race.__file__)


@pytest.fixture(scope="module")
def drawn():
    return task.draw(300)


@pytest.fixture(scope="module")
def told(tmp_path_factory):
    """What the whole race leaves behind, with next to no bodies and whoever is installed."""
    out = tmp_path_factory.mktemp("race")
    command = [sys.executable, str(SCRIPT), "--tiny", "--threads", "2", "--out", str(out)]
    done = subprocess.run(command, cwd=SCRIPT.parents[2], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return json.loads((out / "race.json").read_text()), (out / "race.md").read_text(), out / "race.png"


@pytest.mark.slow
def test_everybody_races_or_is_a_row_that_says_why(told):
    result, table, _ = told
    raced = {entry["name"] for entry in result["entries"]}
    assert raced | set(result["absent"]) == {kind.name for kind in contenders.ALL}
    assert {"Polhode direct", "Polhode exact", "SciPy DOP853"} <= raced
    for name, why in result["absent"].items():
        assert f"| {name} | – " in table
        assert why in table


@pytest.mark.slow
def test_everybody_solves_the_task(told):
    for entry in told[0]["entries"]:
        # adaptive solvers keep their tolerance each step; over the run errors of 600 tolerances were seen (Dopri8's
        # dense output); fixed steps and the exact step are good to 1e-11 at any setting
        bound = 5e3 * entry["setting"] if 0 < entry["setting"] < 1 else 1e-11
        assert entry["error"] < bound, entry["name"]
        # the rate comes from the samples, whose second differences divide their errors by the spacing squared
        assert entry["rate_error"] < 40 * max(bound, 1e-14), entry["name"]


@pytest.mark.slow
def test_everybody_is_timed_in_every_round(told):
    result = told[0]
    for entry in (*result["entries"], result["roof"]):
        assert len(entry["wall"]) == len(entry["processor"]) == result["machine"]["rounds"]
        assert min(entry["wall"] + entry["processor"]) > 0
    assert all(name in told[1] for name in result["ratios"])


@pytest.mark.slow
def test_figure_is_a_picture(told):
    assert told[2].read_bytes().startswith(b"\x89PNG")


def test_bodies_can_exist_and_keep_their_window_open_to_the_end(drawn):
    I1, I2, I3 = (drawn.points[name] for name in ("I1", "I2", "I3"))
    assert (2 * np.maximum(np.maximum(I1, I2), I3) <= I1 + I2 + I3).all()
    assert set(drawn.points["axis"]) == {1, 2, 3}
    used = survey.measured(drawn.points, *contenders.Polhode.run, 1e-10, wanted=("samples_used", "regime"))
    assert (used["samples_used"] == task.TIMES.size).all()
    assert len(set(used["regime"])) == 3  # about the least, the middle and the greatest moment


def test_truth_is_the_solution_of_eulers_equations(drawn):
    few = drawn[::60]
    wanted = task.truth(few)
    for i in range(len(few)):
        found = solve_ivp(
            lambda t, w, k=few.k[i]: (k[0] * w[1] * w[2], k[1] * w[2] * w[0], k[2] * w[0] * w[1]),
            (0.0, task.END), few.start[i], "DOP853", task.TIMES, rtol=1e-13, atol=1e-13,
        )  # fmt: skip
        # DOP853 at this tolerance keeps some 10 of its tolerances
        assert task.errors(found.y[1:].T[None], wanted[i : i + 1])[0] < 1e-11


def test_thirty_digits_are_enough_for_the_truth(drawn, monkeypatch):
    few = drawn[::150]
    wanted = task.truth(few)
    monkeypatch.setattr(task, "DIGITS", 60)
    assert np.abs(task.truth(few) - wanted).max() < 1e-15  # what is left of 30 digits where 1e-12 cancels, in doubles
    assert mp.mp.dps == 15


def test_error_is_relative_to_the_largest_size_so_far():
    wanted = np.array([[[3.0, 4.0], [0.0, 1.0], [0.0, 10.0]]])
    shift = np.array([[0.0, 0.0], [0.5, 0.0], [0.0, 0.5]])
    assert task.errors(wanted + shift, wanted) == pytest.approx([0.1])


@pytest.mark.parametrize("order", direct.ORDERS)
def test_operations_of_a_step_are_those_of_its_recurrence(order):
    # term n + 1: n + 1 products and n sums, times k/(n + 1), itself a product but for n = 0; then N sums
    component = sum((n + 1) + n + 1 + (n > 0) for n in range(order)) + order
    whole, near, _ = taylor.STEPS[3 * direct.ORDERS.index(order) :][:3]
    assert roof.step_flops(whole) == 3 * component
    # the spin to its 7th term; of every transverse product five at most
    spin = sum((n + 1) + n + 1 + (n > 0) for n in range(7)) + 7
    transverse = sum(min(n + 1, 5) + min(n, 4) + 1 + (n > 0) for n in range(order)) + order
    assert roof.step_flops(near) == spin + 2 * transverse


@pytest.mark.slow
def test_chains_of_the_roof_do_all_their_links():
    S = np.linspace(0.5, 1.5, roof.CHAINS * 32).reshape(roof.CHAINS, 32).repeat(roof.LANES // 32, axis=1)
    begun = S.copy()
    roof.multiply_adds(S, 0.9999, 0.0)
    # each link multiplies once: (LINKS * PASSES) roundings of 1e-16
    assert pytest.approx(begun * 0.9999 ** (roof.LINKS * roof.PASSES), rel=1e-12) == S


@pytest.mark.parametrize(
    ("errors", "speeds", "expected"),
    [
        ((1e-8, 1e-12), [400.0, 100.0], 200.0),  # between settings, in log-log
        ((1e-8, 1e-10, 1e-12), [400.0, 50.0, 100.0], 200.0),  # one that another beats in both does not count
        ((1e-11, 1e-13), [400.0, 500.0], 500.0),  # always better: at its fastest
        ((1e-6, 1e-9), [400.0, 100.0], math.nan),  # never good enough
    ],
)
def test_speed_at_an_error(errors, speeds, expected):
    entries = [race.Entry("x", 1.0, 1, 1, error=error) for error in errors]
    assert race.speed_at(entries, 1e-10, speeds) == pytest.approx(expected, nan_ok=True)


def test_the_kernels_benchmark_runs(capsys):
    kernel.main(["--tiny"])
    told = capsys.readouterr().out
    for name, *_ in kernel.RATIOS:
        assert name in told


@pytest.mark.slow
def test_the_pipelines_benchmark_runs(capsys):
    large.main(["1200", "2700", "--columns", "all", "--rounds", "1"])
    said = capsys.readouterr().out.splitlines()
    assert [line.split("|")[1].strip() for line in said[2:5]] == ["1.2e+03", "1.2e+03", "2.7e+03"]
    assert "slope" in said[5]
    assert said[6].startswith("as `run` makes 2.7e+03 points")
    assert [line.split(" | ")[0].strip("| ") for line in said[11:]] == [*large.STAGES, "the rest"]


def test_a_slope_is_that_above_the_start_up_of_every_process():
    start_up = (1, 1, 2.0, 1.0)
    found = [(n, count, 2.0 * count + 3e-6 * n, 1.0 + 1e-6 * n) for n, count in ((1e5, 1), (1e6, 1), (1e8, 20))]
    assert large.slope(start_up, found) == pytest.approx(1.0, abs=1e-12)


@pytest.mark.parametrize("kind", ["random", "near-symmetric", "needles and plates"])
def test_errors_cover(kind):
    for epsilon in (1e-8, 1e-3, 1e-1):
        cells, marginal, wrong, _ = error_bars.rigid(kind, 100, epsilon)
        assert wrong == 0
        for name, cell in cells.items():
            # 999 of 1,000 is what is promised, of 600 points: none outside, and none twice the error
            assert cell.cover == 1.0, (name, cell)
            assert cell.worst <= 1.0 + 1e-9, (name, cell)
        assert kind != "random" or marginal <= {1e-1: 0.03}.get(epsilon, 0.005)


@pytest.mark.parametrize("name", ["pendulum", "rotating_saddle"])
def test_errors_cover_in_random_definitions_of_described_systems(name):
    """A sample of `error_bars.py --only-described`."""
    drawn = error_bars_described.described(6, 6, 3, most=200, names=[name], integrations=error_bars.random_integration)
    ((_, table),) = drawn
    ok = table["status"] == OK
    assert 0.3 < ok.mean() < 1.0
    assert not (table["wrong"] & ok).any()
    assert not (table["missing"] & ok).any()
    for column in error_bars_described.columns_of(table):
        off = table[column][ok]
        # the error of a rate that holds the amplitude's shift is met at large amplitudes: one, and its rounding
        assert (off[np.isfinite(off)] <= 1.0 + 1e-6).all(), column


def test_errors_cover_in_random_definitions():
    """A sample of `error_bars.py --only-definitions`, whose 1e5 points hold the bar tenth by tenth."""
    table = error_bars.random_definitions(80, points=40, seed=29, most=2e3)
    assert not error_bars.wrong_regimes(table).any()
    assert not error_bars.lost_in_silence(table).any()
    missing = table["omega_squared lost"]
    assert (np.abs(table["omega0"][missing]) < 1e-130).all()
    assert 0.001 < missing.mean() < 0.1
    for name in error_bars.COLUMNS:
        off = table[name][np.isfinite(table[name])]
        # 999 of 1,000 is what is promised, and none twice the error; of 3,200 points, where 1 in 10,000 is outside
        assert np.mean(off > 1.0 + 1e-9) <= 1e-3, name
        assert off.max() <= 2.0, name
    assert sum(line.startswith("|") for line in error_bars.of_definitions(table)) == 2 + len(error_bars.COLUMNS)


@pytest.mark.parametrize(
    ("name", "definitions", "points"),
    [
        ("tumbling", 25, 4),
        ("symmetric_top", 60, 10),
    ],
)
def test_errors_cover_in_random_definitions_of(name, definitions, points):
    """A sample of `random_motions.py`; of so few points the promise of 999 in 1,000 allows one outside."""
    table = random_motions.random_definitions(name, definitions, points, seed=29, most=500)
    assert not random_motions.lost_in_silence(name, table).any()
    assert table["asked"].mean() > 0.3
    for column in random_motions.COLUMNS[name]:
        off = table[column][~np.isnan(table[column]) & (table["status"] == 0)]
        assert np.sum(off > 1.0 + 1e-9) <= 1, column
        assert off.max() <= 2.0, column
    assert sum(line.startswith("|") for line in random_motions.lines(name, table)) == 2 + len(
        random_motions.COLUMNS[name]
    )


def test_the_table_of_coverage_is_whole():
    lines = list(error_bars.rows(8, 2, decades=(1e-4,), systems=("pendulum",), gaps=(0.5, 1e-6)))
    assert sum(line.startswith("| pendulum") for line in lines) == 1
    assert sum(line.startswith(("| random", "| near", "| needles", "| default")) for line in lines) == 4
    assert all("100.00 %" in line for line in lines if "%" in line)


@pytest.mark.slow
def test_the_attitudes_benchmark_steps_what_it_says(monkeypatch, capsys):
    """The lanes end where the closed form does, after as many steps."""
    scratch = attitude.prepared()
    attitude.step_attitudes(scratch, 200)
    q = scratch[attitude.Q0 :].reshape(4, -1)
    wanted = exact.attitude(attitude.MOMENTS, attitude.START, [200 * attitude.STEP])[0]
    assert np.abs(q[0] - wanted[0]).max() < 1e-12  # the scalar part has no axis to be named by
    monkeypatch.setattr(sys, "argv", ["attitude.py", "--quick"])
    attitude.main()
    assert "points/s" in capsys.readouterr().out


def test_a_ratio_that_has_dropped_is_told_in_red(tmp_path):
    file = tmp_path / "history.jsonl"
    lines = [{"processor": "here", "ratios": {"a": value, "b": 1.0}} for value in (9.0, 2.0, 2.1, 1.9, 2.0, 2.2)]
    lines += [{"processor": "elsewhere", "ratios": {"a": 99.0}}]
    file.write_text("".join(json.dumps(line) + "\n" for line in lines))
    before = history.earlier(file, "here")
    assert [each["a"] for each in before] == [2.0, 2.1, 1.9, 2.0, 2.2]
    slower, alike, new = history.told({"a": 1.6, "b": 0.9, "c": 5.0}, before)
    assert slower.startswith(history.RED)
    assert "-20 %: slower" in slower
    assert alike.endswith("-10 %")
    assert "%" not in new
    assert history.earlier(tmp_path / "none", "here") == []


@pytest.mark.slow
def test_parts_of_an_exact_run_are_told_beside_the_whole(capsys):
    parts.main(["--tiny"])
    assert "the whole over steps and samples" in capsys.readouterr().out


@pytest.mark.slow
def test_ratios_of_speeds_are_kept_line_by_line(tmp_path, capsys):
    for _ in range(2):
        history.main(["--file", str(tmp_path / "new" / "history.jsonl"), "--points", "300", "--rounds", "1"])
    lines = [json.loads(line) for line in (tmp_path / "new" / "history.jsonl").read_text().splitlines()]
    assert [set(line["ratios"]) for line in lines] == [set(history.RATIOS)] * 2
    assert all(value > 0.0 for line in lines for value in line["ratios"].values())
    assert pandas.json_normalize(lines).plot(x="time").lines  # as the script says that it may be plotted
    assert "%" in capsys.readouterr().out


@pytest.mark.slow
def test_relative_equilibria_are_told_by_their_table(capsys):
    import relative_equilibria  # compiles what no quick test needs

    relative_equilibria.main(["rotor", "--points", "20"])
    header, row = capsys.readouterr().out.splitlines()
    told = dict(zip(header.split(), row.split(), strict=True))
    assert told["system"] == "rotor"
    assert float(told["theory"]) < 1e-12
    assert float(told["error"]) < 1e-8
    assert float(told["covered"]) == 1.0
    assert float(told["invariants"]) < 1e-9
    assert float(told["regimes"]) == float(told["ok"]) == 1.0
    assert float(told["points/s"]) > 0


@pytest.mark.slow
def test_points_are_searched_once_each_from_the_moment_that_is_said(monkeypatch):
    monkeypatch.setattr(searching, "COUNT", 100)
    _, columns = searching.prepared("pendulum", 7)
    assert all(c.size == 100 for c in columns)
    begin = time.monotonic() + 0.05
    own, begun, ended = searching.search("pendulum", 7, begin)
    assert begin <= begun <= ended
    assert own > 0.0
