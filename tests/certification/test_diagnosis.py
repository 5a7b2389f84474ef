"""Words of the diagnosis: planted faults, sound and ill-conditioned files, and evidence with the right figures."""

import numpy as np
import planted_faults
import pytest
import repeated
from scipy.spatial.transform import Rotation
from trajectories import BRICK, BRICK_START, exact_rows, table, write_csv

import sweeps

KINDS = [(word, name) for word, kinds in planted_faults.kinds().items() for name in kinds]
TIMES = np.linspace(0.0, 30.0, 61)
QUICK = [  # these faults need searches that no test below reaches
    ("space_rates", "space"), ("left_handed", "matrix"), ("not_unit", "growing"), ("gap", "missing"), ("gap", "lost"),
    ("momentum_drift", "rates alone"),
]  # fmt: skip


def certified(columns, moments, **options):
    return sweeps.certify(columns, list(map(float, moments)), **options).attrs


@pytest.mark.parametrize("fault", repeated.but(QUICK, KINDS), ids=": ".join)
def test_a_planted_fault_is_found(fault):
    """On one body; `benchmarks/planted_faults.py` counts them on twenty."""
    word, name = fault
    ((moments, start, q0, rng),) = planted_faults.bodies(1)
    rows = exact_rows(moments, start, planted_faults.TIMES, q0)
    facts = certified(planted_faults.kinds()[word][name](rows, moments, start, q0, rng), moments)
    assert facts["diagnosis"][0] == word
    assert len(facts["evidence"]) == len(facts["diagnosis"])
    assert (facts["verdict"] == "pass") == (word == "none" or name == "missing")


def test_the_evidence_states_clock_delay_and_ratios():
    fast = exact_rows(BRICK, BRICK_START, 1.0002 * TIMES) | {"t": TIMES}
    assert "time runs 1.0002 times as fast" in certified(table(fast), BRICK)["evidence"][0]
    late = exact_rows(BRICK, BRICK_START, TIMES)
    late["w"] = exact_rows(BRICK, BRICK_START, TIMES + 0.03)["w"]
    assert "the rates are those of 0.03 s after the attitudes" in certified(table(late), BRICK)["evidence"][0]
    other = exact_rows([0.26, 0.9, 1.0], BRICK_START, TIMES)
    assert "I1:I2:I3 = 0.26:0.9:1" in certified(table(other), [0.27, 0.9, 1.0])["evidence"][0]


def test_a_common_factor_of_time_and_rates_is_degrees_or_a_clock():
    motion = exact_rows(BRICK, BRICK_START, TIMES)
    degrees = certified(table(motion | {"t": np.degrees(TIMES)}), BRICK)
    assert degrees["diagnosis"][0] == "degrees"
    minutes = certified(table(motion | {"t": TIMES / 60}), BRICK)
    assert minutes["diagnosis"][0] == "clock"
    assert "60 times" in minutes["evidence"][0]


def test_a_steady_spin_does_not_tell_conventions_apart():
    motion = exact_rows(BRICK, [0.0, 0.0, 0.5], TIMES)
    facts = certified(table(motion | {"w": -motion["w"]}), BRICK)
    assert {"negated_rates", "inverse_quaternion"} <= set(facts["diagnosis"])
    assert facts["diagnosis"][-1] == "ambiguous"


@pytest.mark.parametrize(("moments", "start", "digits", "word"), [
    ([1.0, 2.0, 3.0], [1.2e-8, 1.0, 0.9e-8], 8, "intermediate_axis"),
    ([1.0, 2.0, 3.0], [0.5, 0.5, 0.288675134594813], 9, "near_separatrix"),  # L^2 = 2T I2 but for rounding
    (BRICK, BRICK_START, 5, "rounding"),
])  # fmt: skip
def test_an_ill_conditioned_file_has_its_reason(moments, start, digits, word, tmp_path):
    rows = table(exact_rows(moments, start, np.linspace(0, 200, 800)))
    facts = certified(write_csv(tmp_path / "run.csv", rows, f"%.{digits}f"), moments)
    assert facts["verdict"] == "ill_conditioned"
    assert facts["diagnosis"] == [word]


def test_noise_says_whether_a_fitted_start_passes():
    rng = np.random.default_rng(3)
    motion = exact_rows(BRICK, BRICK_START, TIMES)
    motion["w"] = motion["w"] + 1e-7 * rng.normal(size=(TIMES.size, 3))
    motion["q"] = motion["q"] + 1e-7 * rng.normal(size=(TIMES.size, 4))
    facts = certified(table(motion), BRICK, tolerance=1.5e-6)
    assert facts["verdict"] == "fail"
    assert facts["diagnosis"] == ["noise"]
    assert "with --fit-start the file passes" in facts["evidence"][0]
    assert certified(table(motion), BRICK, tolerance=1.5e-6, fit_start=True)["verdict"] == "pass"


def test_an_outlier_is_named_by_its_row():
    motion = exact_rows(BRICK, BRICK_START, TIMES)
    motion["w"][41] *= 1.01
    facts = certified(table(motion), BRICK)
    assert facts["diagnosis"] == ["outlier"]
    assert "row 42 is off" in facts["evidence"][0]


def test_a_local_frame_is_diagnosed_in_inertial_space():
    motion = exact_rows(BRICK, BRICK_START, TIMES)
    turning = Rotation.from_rotvec(np.outer(0.1 * TIMES, [0.0, 0.0, 1.0]))
    local = turning.inv() * Rotation.from_quat(motion["q"], scalar_first=True)
    options = {"frame": "local", "frame_rate": 0.1, "frame_axis": [0, 0, 1]}
    columns = table(motion | {"q": local.as_quat(scalar_first=True)})
    assert certified(columns, BRICK, **options)["diagnosis"] == ["none"]
    conjugate = table(motion | {"q": local.inv().as_quat(scalar_first=True)})
    assert certified(conjugate, BRICK, **options)["diagnosis"] == ["inverse_quaternion"]


def test_rows_unevenly_spaced_are_no_gap():
    times = np.sort(np.random.default_rng(8).uniform(0.0, 30.0, 300))
    assert certified(table(exact_rows(BRICK, BRICK_START, times - times[0])), BRICK)["diagnosis"] == ["none"]
    times = np.geomspace(1e-3, 30.0, 300) - 1e-3
    assert certified(table(exact_rows(BRICK, BRICK_START, times)), BRICK)["diagnosis"] == ["none"]
