"""The inertia doctor: each known cause of a wrong tensor, applied to random bodies, and sound tensors."""

import json
import os
from collections import Counter

import numpy as np
import pytest
from calls import refusal_message, run_command
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

import sweeps
from sweeps.schema.refusals import DefinitionError
from sweeps.systems.bodies import inertia, inertia_diagnosis
from sweeps.systems.bodies.inertia_diagnosis import CAUSES, Evidence, check_tensor, diagnose

EQUAL_FIT = 1.0  # difference of two logarithms of likelihood, a factor e, below which two causes fit equally well
UNIT_FACTORS = (1e3, 1e-3, 1e4, 1e-4, 1e6, 1e-6, 1e7, 1e9, 1 / 2.926397e-4)  # g m2 to g mm2, lb in2: either way


def random_body(rng, thickness):
    """Tensor about the centre of mass, kg m2, and evidence, of boxes of different density within a tilted box.

    The link's origin lies on a face of that box, as a joint does.
    """
    edges = 10 ** rng.uniform(-2, 0.3) * rng.uniform(0.15, 1, 3)
    edges[rng.integers(3)] *= thickness
    ends = np.sort(rng.random((rng.integers(1, 9), 2, 3)), axis=1)
    ends = (ends - ends[:, 0].min(axis=0)) / np.ptp(ends, axis=(0, 1)) * edges
    sizes = ends[:, 1] - ends[:, 0]
    masses = sizes.prod(axis=1) * 10 ** rng.uniform(0, 1, len(ends))
    masses *= edges.prod() * 10 ** rng.uniform(1, 3.7) / masses.sum()  # 10 to 5,000 kg m-3 within the box
    centres, mass = ends.mean(axis=1), masses.sum()
    centre = masses @ centres / mass
    squares = np.diag(masses @ sizes**2 / 12) + (masses * (centres - centre).T) @ (centres - centre)
    rotation = Rotation.random(random_state=rng).as_matrix() if rng.random() < 0.7 else np.eye(3)
    corners = edges * np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)]) - centre
    origin = edges * rng.random(3) * (np.arange(3) != rng.integers(3))
    squares = rotation @ squares @ rotation.T
    tensor = np.trace(squares) * np.eye(3) - (squares + squares.T) / 2
    return tensor, Evidence(mass, rotation @ (centre - origin), corners @ rotation.T)


def spoil(cause, rng):
    """A tensor spoilt by a cause, and the evidence that comes with it; nothing but the tensor in half of the cases in
    which the tensor alone can have a trace."""
    tensor, evidence = random_body(rng, rng.choice([1.0, 0.3, 0.1]))
    diagonal, alone = np.diag(np.diag(tensor)), Evidence() if rng.random() < 0.5 else evidence
    offset = evidence.offset
    term = evidence.mass * (offset @ offset * np.eye(3) - np.outer(offset, offset))
    if cause == "power_of_ten":
        place, power = rng.integers(0, 3, 2), 10.0 ** rng.choice([-6, -3, -2, -1, 1, 2, 3, 6])
        tensor[tuple(place)] *= power
        tensor[tuple(place[::-1])] = tensor[tuple(place)]
        return tensor, alone
    if cause == "one_sided":
        rotation = Rotation.random(random_state=rng).as_matrix()
        return (rotation @ tensor if rng.random() < 0.5 else tensor @ rotation), Evidence()
    if cause == "axes_swapped":
        order = rng.permutation(3)
        return tensor[np.ix_(order, order)], evidence
    if cause == "negative":
        signs = rng.permutation([-1, *rng.choice([-1, 1], 2)])
        return tensor - diagonal + signs * diagonal, alone
    if cause == "degenerate":
        moments = rng.permutation(np.linalg.eigvalsh(tensor)) * [0, 1, 1]
        placeholder = 10.0 ** rng.integers(-9, 2) * np.eye(3)
        return [(np.zeros((3, 3)), evidence), (placeholder, evidence), (np.diag(moments), Evidence())][rng.integers(3)]
    if cause == "mass_mismatch":
        factor = rng.choice([1e3, 1e-3, 1 / 0.45359237, 0.45359237, 1 / evidence.mass])
        return tensor, evidence._replace(mass=evidence.mass * factor)
    if cause == "short_moment":
        moments, axes = np.linalg.eigh(tensor)
        return (axes * (moments * (1 - rng.uniform(0.005, 0.1) * np.array([1, 1, 0])))) @ axes.T, alone
    spoilt = {
        "units": (tensor * rng.choice(UNIT_FACTORS), evidence),
        "about_origin": (tensor + term, evidence),
        "parallel_axis_twice": (tensor + 2 * term, evidence),
        "parallel_axis_sign": (tensor - term, evidence),
        "product_sign": (2 * diagonal - tensor, alone),
    }
    return spoilt[cause]


def rank_of(cause, tensor, evidence):
    """0 if the cause is first, or fits as well as the first; otherwise its place in the list; None if not listed."""
    diagnosis = diagnose(tensor, evidence)
    names = [repair.cause for repair in diagnosis.repairs]
    if cause not in names:
        return None, names
    place = names.index(cause)
    is_tied = np.log(diagnosis.weights[0] / diagnosis.weights[place]) <= EQUAL_FIT
    return 0 if is_tied else place, names


def confusion(count, seed):
    """Cause → (number listed, number first or tied, first causes) of tensors in which each cause leaves a trace."""
    rng, table = np.random.default_rng(seed), {}
    for cause in CAUSES:
        ranks, firsts = [], Counter()
        while len(ranks) < count:
            tensor, evidence = spoil(cause, rng)
            if (tensor == tensor.T).all():  # as files print them
                digits = rng.choice([5, 9, 17])
                tensor = np.vectorize(lambda value, digits=digits: float(f"{value:.{digits}g}"))(tensor)
            if check_tensor(tensor, evidence).problems:
                rank, names = rank_of(cause, tensor, evidence)
                ranks.append(rank)
                firsts[(*names, "none")[0]] += 1
        table[cause] = sum(rank is not None for rank in ranks), ranks.count(0), firsts
    return table


def test_the_cause_is_listed_and_mostly_first():
    """Ten tensors of each cause; POLHODE_ALL_CASES=1 makes 30."""
    count = 30 if os.environ.get("POLHODE_ALL_CASES") else 10
    table = confusion(count, 1)
    num_listed, num_first = np.sum([row[:2] for row in table.values()], axis=0) / (count * len(CAUSES))
    assert num_listed >= 0.99, table
    assert num_first >= 0.95, table


def test_no_cause_is_found_in_sound_tensors():
    rng = np.random.default_rng(4)
    for number in range(500):
        tensor, evidence = random_body(rng, (1.0, 0.3, 0.1, 0.01)[number % 4])
        for known in (Evidence(), Evidence(evidence.mass), evidence):
            assert check_tensor(tensor, known).problems == (), number


def test_the_nearest_body_is_scipys():
    rng = np.random.default_rng(5)
    basis = np.eye(6)[:, [[0, 1, 2], [1, 3, 4], [2, 4, 5]]]

    def distance(entries, target):  # S = C Cᵀ is any matrix of second moments
        factor = np.tril(np.tensordot(entries, basis, 1))
        squares = factor @ factor.T
        return np.sum((np.trace(squares) * np.eye(3) - squares - target) ** 2)

    for _ in range(3):
        target = np.tensordot(rng.normal(size=6), basis, 1)
        least = min(minimize(distance, rng.normal(size=6), (target,), tol=1e-10).fun for _ in range(3))
        nearest = inertia_diagnosis.nearest_possible(target)
        # the minimiser's distance exceeds the least distance by less than its tolerance
        assert np.sum((nearest - target) ** 2) == pytest.approx(least, rel=1e-6, abs=1e-9)
        assert np.linalg.eigvalsh(inertia.second_moments(nearest))[0] > -1e-12


PUBLIC = {  # first cause → entries ixx, ixy, ixz, iyy, iyz, izz of public robots
    "power_of_ten": (2661.9e-6, -31.029e-6, 9.34e-6, 2302.5e-6, 151.466e-6, 1676359e-6),  # an arm's link
    "product_sign": (0.000115, 0.000052, 0.000025, 0.000153, 0.000034, 0.00019),  # a gripper's motor
    "negative": (-0.00120734714, 1.816e-05, 0.0, -0.00119932322, 0.0, 0.0003312),  # a hip
    "degenerate": (0.002, 0.0, 0.0002, 0.0, 0.0, 0.0002),  # a finger
}


@pytest.mark.parametrize("cause", PUBLIC)
def test_causes_of_public_tensors(cause):
    tensor = np.array(PUBLIC[cause])[[[0, 1, 2], [1, 3, 4], [2, 4, 5]]]
    assert diagnose(tensor).repairs[0].cause == cause


@pytest.mark.parametrize("scale", [1e-300, 1e-47, 1.0, 8e37, 1e300])
def test_the_diagnosis_does_not_depend_on_the_unit(scale):
    tensor = np.array(PUBLIC["product_sign"])[[[0, 1, 2], [1, 3, 4], [2, 4, 5]]]
    causes, scaled_causes = ([repair.cause for repair in diagnose(x * tensor).repairs] for x in (1.0, scale))
    assert scaled_causes == causes


def test_a_negative_tensor_with_its_centre_of_mass_had_the_parallel_axis_term_subtracted():
    tensor = np.array([[-4.98, 0, 2.7], [0, -5.952, 0], [2.7, 0, 0.828]])  # a shipped arm, 120 kg
    (repair,) = diagnose(tensor, Evidence(120.0, np.array([0.18, 0.0, 0.5]))).repairs
    assert repair.cause == "parallel_axis_sign"
    np.testing.assert_allclose(repair.tensor, [[25.02, 0, -8.1], [0, 27.936, 0], [-8.1, 0, 4.716]], rtol=1e-10)


def test_a_rotation_of_one_side_is_undone_exactly():
    rng = np.random.default_rng(6)
    tensor, _ = random_body(rng, 1.0)
    rotation = Rotation.random(random_state=rng).as_matrix()
    repaired = diagnose(rotation @ tensor).repairs[0].tensor
    # the polar decomposition is right to some roundings of the tensor
    np.testing.assert_allclose(repaired, rotation @ tensor @ rotation.T, rtol=0, atol=1e-14 * tensor.max())
    written = np.triu(rotation @ np.diag([1.0, 2.0, 2.9])) + np.triu(rotation @ np.diag([1.0, 2.0, 2.9]), 1).T
    diagnosis = diagnose(written, Evidence(rotation=rotation))
    assert "one_sided" in [repair.cause for repair in diagnosis.repairs]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--moments", 1, 2, 2.5, "--size", 1, 1, 1), "allowed: with --tensor"),
        (("--tensor", 1, 0, 0, 0, 2, 0, 0, 0, 2.5, "--mass", -1), "body: mass: -1 is out of range"),
        (
            ("--tensor", 1, 0, 0, 0, 2, 0, 0, 0, 2.5, "--size", 1, 1, "1 kg"),
            "size: [1, 1, '1 kg'] has the unit 'kg'",
        ),
    ],
)
def test_evidence_that_cannot_be_is_refused(capsys, arguments, words):
    assert words in refusal_message(capsys, "body", *arguments)


def test_command_and_function_report_the_diagnosis(capsys):
    tensor = ["2.6e-3", 0, 0, 0, "2.3e-3", 0, 0, 0, "1.6"]
    with pytest.raises(DefinitionError) as error:
        sweeps.body(np.reshape(tensor, (3, 3)).astype(float))
    assert "body: power_of_ten (" in str(error.value)
    out = run_command(capsys, "body", "--tensor", 2.6, 0, 0, 0, 2.3, 0, 0, 0, 1.6, "--mass", "1.5 kg",
                      "--size", "5 cm", "5 cm", "6 cm", "--json")  # fmt: skip
    facts = json.loads(out)
    assert facts["diagnosis"]["possible"]
    assert facts["diagnosis"]["causes"][0]["cause"] == "units"
    rotation = Rotation.from_quat(facts["principal_quaternion"], scalar_first=True)
    np.testing.assert_allclose(rotation.as_matrix(), np.transpose(facts["principal_axes"]), atol=1e-15)
    by_angles = Rotation.from_euler("xyz", facts["principal_rpy"])
    np.testing.assert_allclose(by_angles.as_matrix(), rotation.as_matrix(), atol=1e-15)
