"""Bodies from parts against textbook moments and trimesh, their draws against draws of our own, and their files."""

import json
import math
import re
from pathlib import Path

import calls
import numpy as np
import pytest

import sweeps
from sweeps.__main__ import main
from sweeps.schema.refusals import DefinitionError
from sweeps.systems.bodies import body_files
from sweeps.systems.uncertain_bodies import designs, possible, uncertain_parts

trimesh = pytest.importorskip("trimesh")

# moments of uniform shapes about their centres, over the mass: Goldstein, Classical Mechanics; MacMillan, Dynamics
TEXTBOOK = {
    "box": (3, lambda a, b, c: [b * b + c * c, a * a + c * c, a * a + b * b], 12),
    "cylinder": (2, lambda r, h: [3 * r * r + h * h, 3 * r * r + h * h, 6 * r * r], 12),
    "sphere": (1, lambda r: [2 * r * r] * 3, 5),
    "shell": (1, lambda r: [2 * r * r] * 3, 3),
    "plate": (2, lambda a, b: [b * b, a * a, a * a + b * b], 12),
    "rod": (1, lambda h: [h * h, h * h, 0], 12),
    "point": (0, lambda: [0, 0, 0], 1),
}


def random_part(rng, number):
    """Return the mapping of a part, its mass, place, and tensor of inertia about its centre, in the body's axes."""
    shape = list(TEXTBOOK)[number % len(TEXTBOOK)]
    count, moments, divisor = TEXTBOOK[shape]
    sizes, mass, place = rng.uniform(0.1, 2, count), rng.uniform(0.1, 5), rng.uniform(-3, 3, 3)
    quaternion = trimesh.transformations.random_quaternion(rng.random(3))
    rotation = trimesh.transformations.quaternion_matrix(quaternion)[:3, :3]
    tensor = rotation @ np.diag(moments(*sizes)) @ rotation.T * mass / divisor
    part = {"name": f"{shape} {number}", shape: sizes.tolist() or True, "mass": mass, "at": place.tolist()}
    return part | {"turned": quaternion.tolist()}, mass, place, tensor


def by_steiner(pieces):
    """Return mass, centre and tensor of the sum of (mass, place, tensor), or of draws of them, by Steiner's theorem."""
    masses, places, tensors = (np.array(values) for values in zip(*pieces, strict=True))
    mass = masses.sum(axis=0)
    centre = np.einsum("k...,k...i->...i", masses, places) / mass[..., None]
    d = places - centre
    about = np.einsum("...k,...k,ij->...ij", d, d, np.eye(3)) - np.einsum("...i,...j->...ij", d, d)
    return mass, centre, (tensors + masses[..., None, None] * about).sum(axis=0)


@pytest.mark.parametrize("seed", range(8))
def test_a_body_of_parts_has_the_moments_of_the_textbook(seed):
    """Two to seven parts, which begin with another shape each time; the first seven seeds begin with each shape."""
    rng = np.random.default_rng(seed)
    pieces = [random_part(rng, seed + k) for k in range(2 + seed % 6)]
    (body,) = body_files.find_bodies({"parts": [part for part, *_ in pieces]})
    mass, centre, tensor = by_steiner([piece for _, *piece in pieces])
    # sums of some ten rounded numbers
    assert body.facts["mass"] == pytest.approx(mass, rel=1e-13)
    np.testing.assert_allclose(body.facts["centre"], centre, rtol=0, atol=1e-13)
    np.testing.assert_allclose(body.entry["tensor"], tensor, rtol=0, atol=1e-12 * np.abs(tensor).max())
    facts = sweeps.body({"parts": [part for part, *_ in pieces]}).facts
    np.testing.assert_allclose(facts["moments"], np.linalg.eigvalsh(tensor), rtol=0, atol=1e-12 * np.abs(tensor).max())


def test_a_box_and_a_mesh_are_those_of_trimesh(tmp_path):
    transform = trimesh.transformations.random_rotation_matrix(np.array([0.3, 0.9, 0.6]))
    box = trimesh.creation.box((0.2, 0.5, 0.9), transform)
    turned = trimesh.transformations.quaternion_from_matrix(transform).tolist()
    cylinder = trimesh.creation.cylinder(0.3, 1.0, sections=64)
    cylinder.export(tmp_path / "cylinder.obj", digits=17)
    parts = [
        {"name": "box", "box": [0.2, 0.5, 0.9], "density": "2 g/cm3", "turned": turned},
        {"name": "mesh", "mesh": {"file": str(tmp_path / "cylinder.obj")}, "density": 2000, "at": [0, 8, 0]},
    ]
    whole = trimesh.util.concatenate([box, cylinder.apply_translation([0, 8, 0])])
    whole.density = 2000.0
    (body,) = body_files.find_bodies({"parts": parts})
    # trimesh integrates about the origin, 8 m away: some digits are lost to cancellation
    np.testing.assert_allclose(body.entry["tensor"], whole.moment_inertia, rtol=0, atol=1e-12 * 1e5)
    np.testing.assert_allclose(body.facts["centre"], whole.center_mass, atol=1e-12)


def test_moments_of_a_mesh_in_single_precision_are_equal_in_every_draw(tmp_path):
    box = trimesh.creation.box((1, 1, 2), trimesh.transformations.random_rotation_matrix(np.array([0.1, 0.7, 0.4])))
    box.export(tmp_path / "box.stl")
    part = {"name": "box", "mesh": str(tmp_path / "box.stl"), "mass": 1, "tolerance": {"mass": 0.05}}
    judged = sweeps.body({"parts": [part]}, axis=2).judged
    assert (judged.nominal, judged.word, judged.odds.largest_contribution) == ("marginal", "marginal", None)
    assert judged.odds.probability["marginal"] == 1.0


def test_another_body_is_a_part_with_all_of_its_parts():
    rng = np.random.default_rng(3)
    (first, *of_first), (second, *of_second), (third, *of_third) = (random_part(rng, k) for k in range(3))
    place, angle = np.array([0.3, -0.2, 1.0]), 0.4
    group = {"name": "group", "body": {"parts": [first, second]}, "at": place.tolist(), "turned": {"y": angle}}
    known = {"name": "known", "body": {"tensor": of_third[2].tolist()}, "mass": third["mass"], "at": third["at"]}
    (body,) = body_files.find_bodies({"parts": [group, known]})
    turn = trimesh.transformations.rotation_matrix(angle, [0, 1, 0])[:3, :3]
    moved = [(m, place + turn @ at, turn @ own @ turn.T) for m, at, own in (of_first, of_second)]
    tensor = by_steiner([*moved, of_third])[2]
    np.testing.assert_allclose(body.entry["tensor"], tensor, rtol=0, atol=1e-12 * np.abs(tensor).max())


def test_angles_turn_about_fixed_axes_in_the_order_given():
    part = {"name": "rod", "rod": 2.0, "mass": 1.0, "turned": {"x": "90 deg", "z": "90 deg"}}
    point = {"name": "tip", "point": True, "mass": 1.0, "at": [0, 0, 1]}
    (body,) = body_files.find_bodies({"parts": [part, point]})
    along_x = np.diag([0.0, 1 / 3, 1 / 3])  # z turns to -y about x, then -y to x about z
    np.testing.assert_allclose(body.entry["tensor"], along_x + np.diag([0.5, 0.5, 0.0]), atol=1e-15)


# ---------------------------------------------------------------------------------------------------------
# Tolerances


HEIGHT = 0.18  # m, for which I2 and I3 differ by some per cent
UNCERTAIN = {
    "tolerance": {"mass": "8 %", "place": "4 mm"},
    "parts": [
        {"name": "Bus", "box": [0.2, 0.25, HEIGHT], "mass": 6.0, "tolerance": {"mass": "3 %"}},
        {"name": "Tank", "sphere": 0.05, "mass": 2.0, "at": [0.0, 0.01, -0.08], "tolerance": {"mass": "60 %"}},
        {
            "name": "Wing",
            "at": [0.3, 0, 0],
            "tolerance": {"mass": "10 %", "place": "15 mm"},
            "body": {
                "parts": [
                    {"name": "Panel", "plate": [0.3, 0.2], "mass": 0.4},
                    {"name": "Spar", "rod": 0.3, "mass": 0.2, "turned": {"y": "90 deg"}, "tolerance": {"place": 0}},
                ]
            },
        },
    ],
}
#: pieces of UNCERTAIN: mass, place, moments of its own, and its deviations: of mass (own and of the wing), of place
BY_HAND = [
    (6.0, (0, 0, 0), tuple(6 * (a**2 + b**2) / 12 for a, b in ((0.25, HEIGHT), (0.2, HEIGHT), (0.2, 0.25)))),
    (2.0, (0.0, 0.01, -0.08), (2 * 0.4 * 0.05**2,) * 3),
    (0.4, (0.3, 0, 0), (0.4 * 0.2**2 / 12, 0.4 * 0.3**2 / 12, 0.4 * (0.3**2 + 0.2**2) / 12)),
    (0.2, (0.3, 0, 0), (0, 0.2 * 0.3**2 / 12, 0.2 * 0.3**2 / 12)),
]


def draw_by_hand(count, seed):
    """Return tensors of independent draws of UNCERTAIN about their centres of mass, each entry as a sum over pieces."""
    rng = np.random.default_rng(seed)

    def factor(deviation):
        sigma = math.sqrt(math.log(1 + deviation**2))
        return rng.lognormal(-(sigma**2) / 2, sigma, count)

    wing, wing_step = factor(0.10), rng.normal(0, 0.015, (count, 3))
    masses = [factor(0.03), factor(0.60), factor(0.08) * wing, factor(0.08) * wing]
    steps = [rng.normal(0, s, (count, 3)) for s in (0.004, 0.004, 0.004, 0.0)]
    steps = [step + wing_step * (k > 1) for k, step in enumerate(steps)]
    drawn = [
        (mass * relative, np.array(place) + step, relative[:, None, None] * np.diag(own))
        for (mass, place, own), relative, step in zip(BY_HAND, masses, steps, strict=True)
    ]
    return by_steiner(drawn)[2]


def words_by_hand(tensors, direction):
    """Return the fractions of draws whose axis nearest to a direction is that of least, middle and greatest inertia."""
    vectors = np.linalg.eigh(tensors)[1]
    order = np.abs(np.einsum("nij,i->nj", vectors, direction)).argmax(axis=1)
    return np.bincount(order, minlength=3) / len(order)


def test_probabilities_are_those_of_many_draws_of_the_whole_assembly():
    answer, count = sweeps.body(UNCERTAIN, axis=2), 2 * 10**5
    odds = answer.judged.odds
    tensors = draw_by_hand(count, 7)
    reference = words_by_hand(tensors, answer.judged.direction)
    assert 0.01 < reference[1] < 0.99
    for word, value in zip(("stable_without_loss", "unstable", "stable"), reference, strict=True):
        sigma = math.hypot(odds.error[word], math.sqrt(value * (1 - value) / count))
        assert abs(odds.probability[word] - value) <= 4 * sigma + 4 / count, word
    assert odds.draws == 2**17
    assert answer.judged.word == "uncertain"
    moments = np.linalg.eigvalsh(tensors[: 2**17])
    for row, column in zip(odds.moment_quantile, moments.T, strict=True):
        # a quantile at p has the error sqrt(p (1 - p)/n) in p: 4 of them of both sides at the 1 % level
        levels = [np.mean(column <= value) for value in row]
        np.testing.assert_allclose(levels, odds.quantile, atol=0.008)
    covariance = np.array(answer.entry["uncertainty"]["covariance"])
    entries = np.stack([tensors[:, i, j] for i, j in possible.ENTRIES.values()], axis=1)
    unit = np.sqrt(np.outer(np.diag(covariance), np.diag(covariance)))
    # variances of 2e5 draws of a distribution with tails: some 2 %
    np.testing.assert_allclose(np.cov(entries, rowvar=False) / unit, covariance / unit, atol=0.07)


def test_the_largest_contribution_is_the_part_whose_exact_knowledge_helps_most():
    facts = sweeps.body(UNCERTAIN, axis=3).facts["verdict"]
    assert facts["largest_contribution"] == "mass of Tank"
    exact = json.loads(json.dumps(UNCERTAIN))
    exact["parts"][1]["tolerance"]["mass"] = 0
    (body,), (reference,) = body_files.find_bodies(exact), body_files.find_bodies(UNCERTAIN)

    def spread(each):
        part = uncertain_parts.UncertainParts(each.pieces, np.array(facts["direction"]))
        normals = designs.normals("sobol", sum(map(len, part.inputs.values())), 2**14, 2).reshape(2**14, -1)
        return part.relative_rate(normals).var()

    # the variance that is left if the mass is known is less than 1 - first-order index ≤ … of the whole
    assert spread(body) < 0.75 * spread(reference)


def test_masses_never_become_negative_and_every_draw_is_a_body():
    wild = {"parts": [{"name": n, "box": [0.1, 0.2, 0.3], "mass": 1.0, "at": [k, 0, 0]} for k, n in enumerate("ab")]}
    (body,) = body_files.find_bodies({**wild, "tolerance": {"mass": "99 %", "place": 0.5}})
    part = uncertain_parts.UncertainParts(body.pieces, np.array([0.0, 0.0, 1.0]))
    tensors = part.draw_tensors(designs.normals("sobol", 8, 2**14, 1).reshape(-1, 8))
    moments = np.linalg.eigvalsh(tensors)
    assert (2 * moments[:, 2] <= moments.sum(axis=1) * (1 + 1e-12)).all()
    assert (moments > 0).all()
    assert tensors[:, 0, 0].mean() > 2 * (0.2**2 + 0.3**2) / 12  # displacements across add to the moment


def test_without_tolerances_there_is_no_probability():
    answer = sweeps.body({"parts": [{"name": "Box", "box": [0.1, 0.2, 0.3], "mass": 1.0}]})
    assert (answer.judged.odds, answer.judged.word) == (None, "stable")
    with pytest.raises(DefinitionError, match="known exactly"):
        answer.meets("stable", 0.9)


# ---------------------------------------------------------------------------------------------------------
# Margins


def test_the_margin_of_a_part_is_where_its_moments_cross():
    # two masses on a plate in the plane: I = (1/12 + 2 m y², 4/12 + 2 m x², …)
    plate, ball = {"name": "Plate", "box": [1.0, 2.0, 0.2], "mass": 12.0}, {"name": "Ball", "point": True, "mass": 1.0}
    margin = sweeps.body({"parts": [plate, ball]}, axis=3).judged.part_margin
    # I3 - I1 = 12 (1² + 2² - 2² - 0.2²)/12 = 0.96; a displacement z of the ball adds μ z² to I1 and I2, μ = 12/13
    assert margin["place"]["part"] in ("Ball", "Plate")
    assert margin["place"]["along"] in ("+z", "-z")
    assert margin["place"]["change"] == pytest.approx(math.sqrt(0.96 * 13 / 12), rel=1e-9)
    assert margin["mass"] is None  # both at the centre: the moments keep their ratios, or their order


# ---------------------------------------------------------------------------------------------------------
# Files, and the page of the handbook

PAGE = (Path(sweeps.__file__).parent / "handbook/text/howto/parts.md").read_text(encoding="utf-8")


def page_file(folder, suffix, kind):
    path = folder / f"cubesat.{suffix}"
    path.write_text(re.search(rf"```{kind}\n(.*?)```", PAGE, re.DOTALL)[1], encoding="utf-8")
    return str(path)


@pytest.fixture(scope="module")
def deployed(tmp_path_factory):
    """The answer for the deployed satellite of the handbook."""
    return sweeps.body(f"{page_file(tmp_path_factory.mktemp('page'), 'yaml', 'yaml')}:deployed")


def test_the_satellite_of_the_handbook_is_judged_as_printed(deployed, tmp_path, capsys):
    sentence = re.search(r"```text\n(.*?)\n```", PAGE, re.DOTALL)[1]
    assert f"CubeSat, deployed {sentence} judged spin" in " ".join(str(deployed).split())
    command = ("body", page_file(tmp_path, "yaml", "yaml"), "--omega0", "30 rpm", "--draws", 1024, "--json")
    facts = json.loads(calls.run_command(capsys, *command))["bodies"]
    words = {name: each["verdict"]["word"] for name, each in facts.items()}
    assert words == {"CubeSat, stowed": "stable_without_loss", "CubeSat, deployed": "stable"}
    assert facts["CubeSat, deployed"]["omega0"] == pytest.approx(math.pi)
    for margin in facts["CubeSat, deployed"]["verdict"]["part_margin"].values():
        assert margin["part"] == "Bus"


def test_a_requirement_is_met_not_met_or_undecided(deployed):
    """P(unstable) is 0.022 %; without a probability the word alone counts."""
    assert deployed.meets("stable")
    assert deployed.meets("stable", 0.999)
    assert deployed.meets("stable_without_loss", 0.999)
    assert not deployed.meets("unstable")
    assert not deployed.meets("stable", 0.99995)
    for probability, words in ((0.99978, "allowed: more draws"), (1.5, "allowed: above 0 and below 1")):
        with pytest.raises(DefinitionError, match=words):
            deployed.meets("stable", probability)


@pytest.mark.parametrize(("required", "status"), [("stable", 0), ("unstable", 3), ("stable --probability 1.5", 2)])
def test_a_requirement_sets_the_exit_status(tmp_path, capsys, required, status):
    path = page_file(tmp_path, "yaml", "yaml")
    assert main(["body", f"{path}:deployed", "--draws", "1024", "--require", *required.split()]) == status
    assert ("Spin about axis 3" in capsys.readouterr().out) == (status != 2)


def test_the_sums_are_a_definition_with_the_uncertainty_of_the_parts(deployed, tmp_path):
    deployed.write_definition(tmp_path / "sums.yaml")
    ds = sweeps.survey(tmp_path / "sums.yaml").sel(body="CubeSat, deployed", axis=3)
    # of 10,240 normal draws of the tensor: the tails of P = 2e-4 differ from those of the parts
    assert ds.probability_unstable.item() == pytest.approx(deployed.judged.odds.probability["unstable"], abs=5e-4)
    assert ds.attrs["system"] == "uncertain_bodies"


def test_a_table_of_parts_is_the_same_body_as_its_mapping(tmp_path):
    (body,) = body_files.find_bodies(page_file(tmp_path, "csv", "csv"))
    parts = [
        {"name": "Bus", "box": [0.1, 0.1, 0.227], "mass": 2.1},
        {"name": "Battery", "box": [0.09, 0.09, 0.04], "mass": 0.45, "at": [0, 0, 0.03]},
        {"name": "Antenna", "rod": 0.5, "mass": 0.03, "at": [0, 0, 0.35]},
        {"name": "Wheel", "cylinder": [0.03, 0.02], "mass": 0.18, "at": [0, 0, -0.06]},
    ]
    (same,) = body_files.find_bodies({"parts": parts})
    np.testing.assert_allclose(body.entry["tensor"], same.entry["tensor"], rtol=1e-14, atol=1e-18)
    assert [source.mass for source in body.pieces.sources] == [0.01, 0.05, 0.1, 0.03]


BOX = {"name": "A", "box": [1, 1, 1], "mass": 1}


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"parts": []}, "parts: [] is empty"),
        ({"parts": [BOX, BOX]}, "parts[1].name: 'A' is an earlier name"),
        ({"parts": [{"name": "A", "mass": 1}]}, "has no shape; allowed: one of box, cylinder"),
        ({"parts": [BOX | {"rod": 1}]}, "has box and rod; allowed: one of"),
        ({"parts": [BOX | {"box": [1, 1]}]}, "parts[0].box: [1, 1] is out of range; allowed: 3 numbers > 0 in m"),
        ({"parts": [BOX | {"box": [1, 1, -1]}]}, "is out of range; allowed: 3 numbers > 0 in m"),
        ({"parts": [BOX | {"mass": "1 m"}]}, "parts[0].mass: '1 m' has the unit 'm'"),
        ({"parts": [BOX | {"mass": -1}]}, "parts[0].mass: -1 is out of range; allowed: a finite number > 0"),
        ({"parts": [BOX | {"density": 1}]}, "parts[0].density: is not as a box needs it; allowed: mass or density"),
        ({"parts": [{"name": "A", "rod": 1, "density": 1}]}, "needs it; allowed: mass"),
        ({"parts": [{"name": "A", "rod": 1}]}, "parts[0].mass: is missing"),
        ({"parts": [BOX | {"at": [1, 2]}]}, "parts[0].at: [1, 2] is out of range; allowed: 3 numbers in m"),
        ({"parts": [BOX | {"turned": {"w": 1}}]}, "parts[0].turned: {w: 1} is no rotation"),
        ({"parts": [BOX | {"turned": [1, 1, 0, 0]}]}, "is no rotation"),
        ({"parts": [BOX | {"tolerance": {"mass": "120 %"}}]}, "parts[0].tolerance.mass: 1.2 is out of range"),
        ({"parts": [BOX | {"tolerance": {"place": -1}}]}, "parts[0].tolerance.place: -1 is out of range"),
        ({"parts": [BOX | {"colour": 1}]}, "parts[0].colour: is an unknown key"),
        ({"parts": [BOX], "spin": [0, 0, 0]}, "spin: [0.0, 0.0, 0.0] is no spin"),
        ({"parts": [BOX], "states": {"open": {"A": 5}}}, "states.open.A: 5 is not a mapping; allowed: a mapping of"),
        ({"parts": [BOX | {"mass": 1e200}]}, "parts[0].mass: 1e+200 is out of range"),
        ({"parts": [BOX | {"name": str(k)} for k in range(1001)]}, "have 1,001 rigid pieces"),
        ({"parts": [BOX], "states": {"open": {"B": {}}}}, "states.open.B: is no part"),
        ({"parts": [BOX], "states": {"open": {"A": {"mass": 0}}}}, "states.open': parts[0].mass: 0 is out of"),
        ({"parts": [{"name": "A", "point": True, "mass": 1}]}, "three principal moments > 0"),
        ({"parts": [{"name": "A", "mesh": "none.stl", "mass": 1}]}, "mesh.file: 'none.stl' is not there"),
        ({"parts": [{"name": "A", "body": {"tensor": [[1, 0, 0], [0, 1, 0], [0, 0, 5]]}, "mass": 1}]}, "no rigid body"),
        ({"parts": [{"name": "A", "body": {"parts": [BOX]}, "mass": 1}]}, "allowed: no mass: it follows"),
    ],
)
def test_parts_are_refused_with_key_and_reason(values, words):
    with pytest.raises(DefinitionError) as error:
        sweeps.body(values)
    assert words in str(error.value)
    assert "; allowed: " in str(error.value)


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("a.yaml", "grid: {}", "parts: is missing; allowed: a list of parts (a definition of a sweep"),
        ("a.yaml", "parts: [", "is not YAML"),
        ("a.csv", "name,shape,weight\nA,box,1", "'weight' is an unknown or a repeated column"),
        ("a.csv", "name,shape,mass,mass\nA,point,1,2", "'mass' is an unknown or a repeated column"),
        ("a.csv", "name,shape,mass\nA,point,1,5", "row 1 has more values than columns; allowed: a decimal point"),
        ("a.csv", "", "parts: [] is empty"),
        ("a.csv", "name,shape,mass\nA,box,heavy", "'heavy'"),
        ("a.csv", "name,shape,mass\nA,,1", "parts[0]: {name: 'A', at: [0.0, 0.0, 0.0], mass: 1.0} has no shape"),
        ("a.yaml", "parts: [&a {name: A, parts: *a}]", "whole value"),
    ],
)
def test_files_of_no_parts_are_refused(tmp_path, capsys, name, text, words):
    (tmp_path / name).write_text(text)
    assert words in calls.refusal_message(capsys, "body", tmp_path / name)


def test_one_state_is_needed_where_one_body_is(tmp_path, capsys):
    path = page_file(tmp_path, "yaml", "yaml")
    message = calls.refusal_message(capsys, "motion", path, "-o", tmp_path / "a.csv")
    assert "is 2 bodies; allowed: one of them, FILE:NAME with NAME stowed or deployed" in message
    assert main(["motion", f"{path}:stowed", "-o", str(tmp_path / "a.csv")]) == 0
    assert "in the axes of the file" in capsys.readouterr().err
    assert "allowed: stowed, deployed" in calls.refusal_message(capsys, "body", f"{path}:closed")


def test_tolerances_of_a_list_are_those_of_its_pieces_and_those_of_a_body_its_own():
    group = {"name": "Wing", "body": {"parts": [BOX, {"name": "Tip", "point": True, "mass": 1, "at": [1, 0, 0]}]}}
    both = [{**group, "name": "Free"}, {**group, "tolerance": {"mass": "2 %"}}, {**BOX, "tolerance": {"place": 0.1}}]
    (body,) = body_files.find_bodies({"tolerance": {"mass": "5 %"}, "parts": both})
    assert {tuple(source): numbers for source, numbers in body.pieces.sources.items()} == {
        ("Free/A", 0.05, 0.0): [0],
        ("Free/Tip", 0.05, 0.0): [1],
        ("Wing/A", 0.05, 0.0): [2],
        ("Wing/Tip", 0.05, 0.0): [3],
        ("Wing", 0.02, 0.0): [2, 3],
        ("A", 0.05, 0.1): [4],
    }
