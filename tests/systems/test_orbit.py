"""Satellites in the gravity gradient, from bodies and orbits: published librations, and the full equations' regions."""

import itertools
import json
import math
import re

import numpy as np
import pytest

import sweeps
from sweeps.__main__ import main
from sweeps.points.loading import read_sweep
from sweeps.schema.refusals import DefinitionError
from sweeps.systems.rigid_body import orbit


def dimorphos():
    """Moments of an ellipsoid of semi-axes 1.3, 1, 1.3/1.6, ascending."""
    a, b, c = 1.3, 1.0, 1.3 / 1.6
    return b * b + c * c, a * a + c * c, a * a + b * b


def test_the_librations_of_dimorphos():
    """Long axis towards the primary: pitch 0.877221, roll and yaw 0.399833 and 1.498147 over the orbital rate."""
    least, middle, greatest = dimorphos()
    word, squares = orbit.judge_orientation(middle, greatest, least)
    assert word == "stable"
    np.testing.assert_allclose(np.sqrt(squares), [0.877221, 1.498147, 0.399833], atol=6e-7)  # printed digits


def test_the_orbits_of_the_earth_and_of_another_body():
    """An orbit 500 km up takes 94.6 min; the Moon's circle, from the same number, 27.45 days of 384,400 km."""
    assert 2.0 * math.pi / orbit.orbital_rate("500 km", None) / 60.0 == pytest.approx(94.62, abs=0.01)
    assert orbit.orbital_rate(500, None) == orbit.orbital_rate("500000 m", None)
    assert 2.0 * math.pi / orbit.orbital_rate(384_400, 398_600.4418) / 86_400.0 == pytest.approx(27.45, abs=0.01)
    for bad in ((-1, None), (0.0, 1.0), (7000, -1.0), ("5 kg", None)):
        with pytest.raises(DefinitionError, match=r"allowed: "):
            orbit.orbital_rate(*bad)


def test_verdicts_and_periods_are_those_of_the_full_equations():
    """Over random bodies in all six orientations: the system `gravity_gradient` derives its Jacobian from SymPy."""
    rng, bodies = np.random.default_rng(4), []
    while len(bodies) < 30:
        moments = rng.uniform(0.3, 1.0, 3)
        if 2.0 * moments.max() < 0.99 * moments.sum():
            bodies.append(moments)
    entries = [moments[list(order)] for moments in bodies for order in itertools.permutations(range(3))]
    listed = [
        dict(zip(("name", "I1", "I2", "I3"), (f"b{k}", *map(float, e)), strict=True)) for k, e in enumerate(entries)
    ]
    ds = sweeps.survey(system="gravity_gradient", bodies=listed).squeeze()
    assert ds["name"].values.tolist() == [body["name"] for body in listed]
    words = []
    for k, moments in enumerate(entries):
        word, squares = orbit.judge_orientation(*moments)
        spectrum = ds.isel(point=k)
        is_stable = spectrum["growth_rate_theory"].values[0] < 1e-6  # a rate: the root of a rounding of 1e-13
        assert word.startswith("stable") == bool(is_stable)
        if is_stable:
            rates = np.sort(np.abs(spectrum["eigenvalue_imag_theory"].values))[::2]
            np.testing.assert_allclose(np.sort(np.sqrt(squares)), rates, rtol=1e-9)  # where two rates nearly meet
            assert (word == "stable") == (float(spectrum["k3"]) > 0.0)
        words.append(word)
    assert {words.count("stable") == 30, words.count("stable_without_loss") > 0, "unstable" in words} == {True}


@pytest.mark.slow
def test_damping_leaves_what_is_called_stable_and_unsettles_what_is_not():
    # a body in Lagrange's region, one in DeBra and Delp's
    moments = {"stable": (1.1, 1.2, 1.0), "stable_without_loss": (1.1, 1.0, 1.05)}
    assert [orbit.judge_orientation(*body)[0] for body in moments.values()] == [*moments]
    bodies = [{"name": name} | dict(zip(("I1", "I2", "I3"), body, strict=True)) for name, body in moments.items()]
    ds = sweeps.survey(system="gravity_gradient_damped", bodies=bodies).squeeze()
    growth = ds["growth_rate"].values.reshape(2, -1)[:, 0]
    assert growth[0] < 0.0 < growth[1]


def test_moments_in_the_grid_are_points_of_k1_and_k3():
    grid = {"roll_moment": [10.0, 11.0], "pitch_moment": 12.0, "yaw_moment": {"start": 4.0, "stop": 6.0, "num": 2}}
    points = read_sweep({"system": "gravity_gradient", "grid": grid}).grid
    k1, k3 = (np.asarray(points.auxiliary[name][1]) for name in ("k1", "k3"))
    roll, yaw = np.array([10.0, 10.0, 11.0, 11.0]), np.array([4.0, 6.0, 4.0, 6.0])
    np.testing.assert_array_equal(k1, (12.0 - yaw) / roll)
    np.testing.assert_array_equal(k3, (12.0 - roll) / yaw)


THREE = {"roll_moment": 1.0, "pitch_moment": 1.1, "yaw_moment": 1.0}
REFUSED = {  # message → grid, moments of a body
    "grid.pitch_moment: is missing; allowed: pitch moment of inertia, kg m2": ({"roll_moment": 1.0}, None),
    "bodies[0].I3: is missing; allowed: I1, I2 and I3": ({}, {"I1": 1.0, "I2": 2.0}),
    "[1.0, 2.0, 1.0] have k1 = 1 and k3 = 1; allowed": ({}, {"I1": 1.0, "I2": 2.0, "I3": 1.0}),
    "grid.yaw_moment: is given beside bodies; allowed": ({"yaw_moment": 1.0}, {"I1": 1.0, "I2": 1.1, "I3": 1.0}),
    "table.k1: 'k1' is a column of the table and given in grid too; allowed: one": (THREE | {"k1": 0.1}, None),
}


@pytest.mark.parametrize("message", REFUSED)
def test_satellites_that_are_refused(message):
    grid, moments = REFUSED[message]
    bodies = {"bodies": [{"name": "A"} | moments]} if moments else {}
    with pytest.raises(DefinitionError, match=re.escape(message)):
        read_sweep({"system": "gravity_gradient", "grid": grid} | bodies)


def test_the_command_reports_which_axis_may_point_down(capsys):
    moments = ("--moments", "1", "1.05", "1.1")
    assert main(["body", *moments, "--orbit", "500km"]) == 0
    out = " ".join(capsys.readouterr().out.split())
    assert "axis 1 down, 2 along the path, 3 across stable, also with dissipation; librations " in out
    assert "axis 2 down, 3 along the path, 1 across stable without dissipation only (DeBra and Delp's" in out
    assert " 244.3 min (pitch)" in out
    assert main(["body", *moments, "--orbit", "500km", "--json"]) == 0
    facts = json.loads(capsys.readouterr().out)["orbit"]
    assert [each["verdict"] for each in facts["orientations"]] == ["stable", "stable_without_loss"]
    assert facts["orientations"][1]["pitch_period"] == pytest.approx(244.3 * 60.0, rel=1e-3)  # the printed digits
    assert main(["body", *moments, "--mu", "1"]) == 2
    assert "mu: is given without orbit" in capsys.readouterr().err
    assert main(["body", "--tensor", *map(str, [2, 0, 0, 0, 3, 0, 0, 0, 2.5]), "--orbit", "500km"]) == 0
    assert "axis 1 (tensor +x or its opposite)" in " ".join(capsys.readouterr().out.split())
    assert main(["body", "--moments", "1", "1", "1", "--orbit", "500km"]) == 0
    assert "not stable: two moments are equal" in " ".join(capsys.readouterr().out.split())
