"""Physically possible bodies: one rule for every command, and questions about one body."""

import itertools
import json
import math
from fractions import Fraction

import calls
import numpy as np
import pytest
from scipy.stats import binomtest

import sweeps
from sweeps.maps import summary
from sweeps.points.estimate import count_impossible
from sweeps.points.loading import read_sweep
from sweeps.systems.uncertain_bodies import designs


def printed_words(capsys, *arguments, status=0):
    return " ".join(calls.run_command(capsys, *arguments, status=status).split())


IMPOSSIBLE = [
    (["--moments", 1, 2, 5], "I3 = 5 > I1 + I2 = 3"),
    (["--moments", 5, 1, 2], "I1 = 5 > I2 + I3 = 3"),
    (["--ratios", 0.1, 1.2, 1], "I2 = 1.2 > I1 + I3 = 1.1"),
    (["--ratios", 1, 1, 2.00001], "I3 = 2.00001 > I1 + I2 = 2"),
    (["--tensor", 1, 0, 0, 0, 2, 0, 0, 0, 5], "I3 = 5 > I1 + I2 = 3"),
    (["--moments", 1, 2, 5, "--uncertainty", "5%"], "I3 = 5 > I1 + I2 = 3"),
]


@pytest.mark.parametrize(("body", "words"), IMPOSSIBLE)
def test_a_question_about_an_impossible_body_is_refused(capsys, body, words):
    message = printed_words(capsys, "body", *body, status=2)
    assert words in message
    assert "allowed: moments each at most the sum of the other two" in message


FLAT = [(0.1, 0.2, 0.3), (0.1, 0.7, 0.8), (0.333333333, 0.666666667, 1.0), (1.0, 1.0, 2.0), (1e-9, 1.0, 1.0)]


@pytest.mark.parametrize("moments", FLAT)
def test_a_flat_body_and_a_rod_are_bodies(capsys, moments):
    for order in itertools.permutations(moments):
        printed_words(capsys, "body", "--moments", *order)
    printed_words(capsys, "body", "--tensor", moments[0], 0, 0, 0, moments[1], 0, 0, 0, moments[2])


def test_a_body_of_a_definition_is_flagged_not_refused(capsys, tmp_path):
    assert "inertial defect 0.04923 amu Å², 2.7 % of the greatest moment" in printed_words(capsys, "body", "water")
    (tmp_path / "mine.yaml").write_text("bodies: [{name: Brick, I1: 1, I2: 2, I3: 5, omega0: 2.0}]\n")
    words = printed_words(capsys, "body", "brick", "--definition", tmp_path / "mine.yaml")
    assert "no rigid body has these moments: I3 = 5 > I1 + I2 = 3" in words


LISTS = {"I1": [0.1, 0.5, 1.0, 3.0], "I2": [0.2, 0.7, 1.0], "I3": [0.3, 0.8, 1.0, 2.0, 5.0]}


def by_fractions():
    """Impossible bodies of LISTS, the decimal digits taken as they are written."""
    moments = ([Fraction(str(value)) for value in values] for values in LISTS.values())
    return sum(2 * max(body) > sum(body) for body in itertools.product(*moments))


TWO_BODIES = [
    {"name": "A", "I1": 1.0, "I2": 2.0, "I3": 5.0},
    {"name": "B", "ratios": {"I1": 0.1, "I2": 0.7, "I3": 0.8}},
]


@pytest.mark.parametrize(
    ("definition", "count"),
    [
        ({"axes": [1, 3], "grid": LISTS | {"omega0": [1.0, 2.0, 3.0]}}, 6 * by_fractions()),
        ({"system": "twist", "grid": LISTS | {"chi": [0.1, 0.2]}}, 2 * by_fractions()),
        ({"system": "tumbling", "grid": LISTS | {"energy": [1.0, 1.1]}}, 2 * by_fractions()),
        ({"system": "symmetric_top", "grid": {"ratio": [0.5, 2.0, 2.1], "omega3": 1.0, "half_angle": [1.0, 2.0]}}, 2),
        ({"grid": {"ratios": {"I1_over_I3": [0.1, 0.3, 0.9], "thickness": [0.0, 0.3, 1.0]}, "omega0": 1.0}}, 0),
        ({"bodies": TWO_BODIES, "grid": {"omega0": [1.0, 2.0]}}, 6),
    ],
)
def test_check_counts_what_the_map_flags(definition, count):
    assert count_impossible(read_sweep(definition)) == (count, True)
    assert summary.summarise(sweeps.survey(definition)).impossible == count


def test_check_counts_drawn_points_and_says_so(tmp_path, capsys):
    definition = {
        "grid": {"I1": {"start": 0.1, "stop": 1.0}, "I2": {"start": 0.1, "stop": 1.0}, "I3": 1.0, "omega0": 1.0},
        "sample": {"num": 1000},
    }
    num_impossible = summary.summarise(sweeps.survey(definition)).impossible
    assert count_impossible(read_sweep(definition)) == (num_impossible, True)
    (tmp_path / "my.yaml").write_text(json.dumps(definition))
    assert f"impossible {num_impossible:,} points violate the triangle inequality" in printed_words(
        capsys, "check", tmp_path / "my.yaml"
    )
    assert json.loads(printed_words(capsys, "check", tmp_path / "my.yaml", "--json"))["impossible"] == num_impossible


def test_a_grid_of_any_size_is_estimated():
    ends = {"start": 1e-4, "stop": 1.0, "num": 100_000}
    count, is_exact = count_impossible(read_sweep({"grid": {"I1": ends, "I2": ends, "I3": ends, "omega0": [1.0, 2.0]}}))
    assert not is_exact
    # half of the unit cube has one coordinate above the sum of the two: three pyramids of a sixth; 4 sigma of draws
    assert count / (6 * 1e15) == pytest.approx(0.5, abs=4 * 0.5 / math.sqrt(2**22) + 1e-3)


# ---------------------------------------------------------------------------------------------------------
# body: one axis, the twist, and how many draws


def test_one_axis_and_the_twist_need_no_uncertainty(capsys):
    out = printed_words(capsys, "body", "racket", "--axis", 3, "--twist", "--epsilon", 0.1)
    assert "axis 3" in out
    assert "axis 1 " not in out
    assert "axis 2" not in out.split("outcome")[1].split("note:")[0]
    assert "thrown with ε = 0.1, it twists by " in out
    facts = json.loads(printed_words(capsys, "body", "racket", "--twist", "--epsilon", 0.1, "--json"))
    assert [axis["axis"] for axis in facts["axes"]] == [1, 2, 3]
    assert facts["axes"][0]["twist_thrown"] is None  # spun about its handle
    assert "axis: 4 is out of range; allowed: 1, 2 or 3" in printed_words(
        capsys, "body", "racket", "--axis", 4, status=2
    )


@pytest.mark.parametrize(
    ("option", "words"),
    [
        (("--draws", "1e9"), "draws: 1000000000 is out of range; allowed: a whole number from 64 to 4,000,000"),
        (("--draws", "10.5"), "draws: 10.5 is not a whole number; allowed: a whole number from 64 to 4,000,000"),
        (("--turns", "inf"), "turns: "),
    ],
)
def test_numbers_of_draws_are_refused_in_one_message(capsys, option, words):
    message = printed_words(capsys, "body", "racket", "--uncertainty", "5%", *option, status=2)
    assert message.startswith(f"body: {words}")
    assert "usage" not in message


def test_draws_are_read_as_people_write_them(capsys):
    answer = json.loads(
        printed_words(capsys, "body", "racket", "--uncertainty", "5%", "--draws", "1e2", "--axis", 2, "--json")
    )
    assert answer["draws"] == designs.count_draws(100)


TENSOR = ("--tensor", 1, 0, 0, 0, 2, 0, 0, 0, 2.5, "--draws", 64)


def test_the_sigma_of_an_entry_that_is_0_is_not_ignored(capsys):
    shares = "{tensor: [1 %, 1 %, 1 %, 10 %, 0, 0]}"
    message = printed_words(capsys, "body", *TENSOR, "--uncertainty", shares, status=2)
    assert "10 % is a fraction of an entry that is 0 (Ixy): it has no effect; allowed: 0, or covariance" in message
    assert "taken as exactly 0: Ixy, Ixz, Iyz (a fraction of 0 is 0" in printed_words(
        capsys, "body", *TENSOR, "--uncertainty", "1%"
    )
    rows = np.diag([1e-4, 1e-4, 1e-4, 1e-3, 0, 0]).tolist()
    out = printed_words(capsys, "body", *TENSOR, "--uncertainty", f"{{covariance: {rows}}}")
    assert "uncertain: Ixx, Iyy, Izz, Ixy" in out
    assert "taken as exactly 0: Ixz, Iyz" in out


# ---------------------------------------------------------------------------------------------------------
# Probabilities without a hit, or without a miss


@pytest.mark.parametrize("draws", [64, 1024, 4_000_000])
def test_a_probability_without_a_hit_has_wilsons_interval(draws):
    shares, (count, _) = np.zeros(designs.replicates(draws)[0]), designs.replicates(draws)
    value, error = designs.probability(shares, draws)
    ends = binomtest(0, draws).proportion_ci(0.95, "wilson")
    assert value == 0.0
    assert value + designs.NORMAL_95 * error == pytest.approx(ends.high, rel=1e-12)
    value, error = designs.probability(shares + 1.0, draws)
    ends = binomtest(draws, draws).proportion_ci(0.95, "wilson")
    assert value - designs.NORMAL_95 * error == pytest.approx(ends.low, rel=1e-12)
    hit = np.eye(1, count)[0] / (draws / count)
    assert designs.probability(hit, draws)[1] >= 1.0 / draws


def test_no_probability_is_said_to_be_certain(capsys):
    call = ("body", "--moments", 1, 2, 2.5, "--uncertainty", "1%", "--draws", 1024)
    out = printed_words(capsys, *call)
    bound = designs.wilson_end(designs.count_draws(1024))
    assert f"P(unstable) < {bound:.2g} (95 %); P(intermediate axis) < {bound:.2g} (95 %)" in out
    assert f"P(unstable) > {1 - bound:.5f} (95 %)" in out
    assert "± 0.000" not in out
    answer = json.loads(printed_words(capsys, *call, "--json"))["axes"][0]
    assert answer["probability_unstable"] == 0
    assert answer["probability_unstable_error"] == pytest.approx(bound / designs.NORMAL_95)
