"""Molecules: moments from rotational constants against published conversions, and the inertial defect."""

import json
import math

import pytest
from calls import refusal_message, run_command

import sweeps
from sweeps.schema.refusals import DefinitionError
from sweeps.systems.bodies import molecules

WATER = (27.8806, 14.5216, 9.2778)  # cm-1, ground state: Herzberg (1966), Electronic Spectra of Polyatomic Molecules
CM_IN_MHZ = 29979.2458  # MHz, 1 cm-1 times the speed of light


@pytest.mark.parametrize(("unit", "factor"), [("cm-1", 1.0), ("MHz", CM_IN_MHZ), ("GHz", CM_IN_MHZ / 1e3)])
def test_rotational_constants_in_each_unit(unit, factor):
    moments = sweeps.body({"rotational": [f"{value * factor!r} {unit}" for value in WATER]}).facts["moments"]
    amu = [moment / molecules.AMU_SQUARE_ANGSTROM for moment in moments]
    # both published factors have six or seven digits
    assert amu == pytest.approx([16.8576 / value for value in WATER], rel=1e-5)
    assert amu == pytest.approx([505379.0 / (value * CM_IN_MHZ) for value in WATER], rel=1e-6)


def test_moments_in_atomic_units_and_constants_agree(capsys):
    constants = [value * CM_IN_MHZ for value in WATER]
    facts = json.loads(run_command(capsys, "body", "--rotational", *constants, "--json"))
    spellings = ("amu Å2", "amu Å²", "amu angstrom^2")
    moments = [f"{505379.0 / value} {unit}" for value, unit in zip(constants, spellings, strict=True)]
    of_moments = json.loads(run_command(capsys, "body", "--moments", *moments, "--json"))
    assert facts["moments"] == pytest.approx(of_moments["moments"], rel=1e-6)
    # the published defect of water, amu Å²
    assert facts["inertial_defect"] / molecules.AMU_SQUARE_ANGSTROM == pytest.approx(0.0515, abs=1e-4)
    assert "inertial defect 0.051" in run_command(capsys, "body", "--rotational", *constants)


@pytest.mark.parametrize("share", [0.0, 0.01, 0.02, 0.029])
def test_a_small_defect_is_reported(share):
    answer = sweeps.body([f"{value} amu Å2" for value in (1.0, 2.0, 3.0 / (1 - share))])
    defect = answer.facts.get("inertial_defect", 0.0) / max(answer.facts["moments"])
    assert defect == pytest.approx(share, abs=1e-12)
    assert [axis["regime"] for axis in answer.facts["axes"]] == ["stable_minor", "unstable", "stable_major"]


def test_a_larger_defect_and_a_larger_body_are_refused(capsys):
    assert "of any rigid body" in refusal_message(capsys, "body", "--moments", *(f"{x} amu Å2" for x in (1, 2, 3.2)))
    assert "of any rigid body" in refusal_message(capsys, "body", "--moments", 1, 2, 3.03)


@pytest.mark.parametrize("value", [0, -1, "1 kg", "A", math.inf, None, True])
def test_constants_that_cannot_be_are_refused(value):
    with pytest.raises(DefinitionError, match="is not a list of rotational constants"):
        sweeps.body({"rotational": [1.0, 2.0, value]})
