"""Response to a harmonic force against 40-digit solutions of the equations, and closed forms.

POLHODE_ALL_CASES=1 has 400 random systems in place of 120.
"""

import json

import mpmath
import numpy as np
import pytest
import repeated
from described import flow
from PIL import Image

import sweeps
from sweeps.__main__ import main
from sweeps.maps.selection import SelectionError
from sweeps.mechanics import System, forced_response
from sweeps.schema.refusals import RefusedError


def exact_response(mass, damping, stiffness, force, frequency):
    """Return (K - w² M + iwC)⁻¹ f to 40 digits, rounded."""
    with mpmath.workdps(40):
        M, C, K = (mpmath.matrix(part.tolist()) for part in (mass, damping, stiffness))
        w = mpmath.mpf(frequency)
        solution = mpmath.lu_solve(K - w**2 * M + 1j * w * C, mpmath.matrix(force.tolist()))
        return np.array([complex(x) for x in solution])


@pytest.mark.parametrize("number", [10, pytest.param(repeated.number(120, 400), marks=pytest.mark.slow)])
def test_responses_are_within_their_errors_of_40_digit_solutions(number):
    """Damping from 1e-5 of the stiffness to 1, gyroscopic forces, and frequencies through all resonances."""
    rng, excess, sharpness = np.random.default_rng(7), [], []
    for _ in range(number):
        count = rng.integers(1, 5)
        mass, damping, stiffness = (part @ part.T for part in rng.uniform(-1.0, 1.0, (3, count, count)))
        turn = np.triu(rng.uniform(-1.0, 1.0, (count, count)), 1)
        mass, stiffness = mass + np.eye(count), stiffness + 0.1 * np.eye(count)
        damping = damping * 10.0 ** rng.uniform(-5.0, 0.0) + turn - turn.T
        force, frequencies = rng.uniform(-1.0, 1.0, count), rng.uniform(0.01, 4.0, 5)
        blocks = [-np.linalg.solve(mass, part) for part in (stiffness, damping)]
        matrix = np.block([[np.zeros((count, count)), np.eye(count)], blocks])
        push = np.append(np.zeros(count), np.linalg.solve(mass, force))
        answers = forced_response.respond(matrix, push, np.linalg.norm(matrix, 2), frequencies)
        for w, theory, measured, error in zip(frequencies, *answers, strict=True):
            right = exact_response(mass, damping, stiffness, force, w)
            full = np.append(right, 1j * w * right)
            distance = np.linalg.norm(measured - full)
            assert np.linalg.norm(theory - full) <= 1e-11 * np.linalg.norm(full)  # a hundred times its actual error
            excess.append(distance > error)
            sharpness.append(error / np.linalg.norm(full))
    assert np.mean(excess) <= 1e-3
    assert np.median(sharpness) < 1e-12  # the bound is near rounding, not merely safe


def test_a_resonance_without_damping_is_missing_and_a_frequency_beside_it_is_not():
    ds = sweeps.survey(system="pendulum", length=2.0, gravity=2.0)  # M = 4 kg m², K = 4 N m
    frequencies = ["1 rad s-1", 1e-300, 0.5, 2.0]  # a period of so many steps is not measured either
    answer = sweeps.response(ds, {"theta": 3.0}, frequencies, equilibrium="hanging").squeeze()
    assert np.isnan(answer.response_amplitude[:2]).all()
    np.testing.assert_allclose(answer.response_amplitude_theory[:2], [np.nan, 3.0 / 4.0], rtol=1e-12)
    np.testing.assert_allclose(answer.response_amplitude[2:], [3.0 / 3.0, 3.0 / 12.0], rtol=1e-12)
    np.testing.assert_allclose(np.abs(answer.response_phase[2:]), [0.0, np.pi], atol=1e-12)


@pytest.mark.slow
def test_states_and_many_coordinates_respond_too():
    relay = flow(lambda x: [-2 * x], "x", places={"rest": [0]})
    answer = sweeps.response(sweeps.survey(system=relay), {"x": 1.0}, [1.5]).squeeze()
    np.testing.assert_allclose(answer.response_amplitude, 0.4, rtol=1e-13)  # 1/|2 + 1.5i|
    np.testing.assert_allclose(answer.response_phase, -np.arctan(0.75), rtol=1e-12)
    chain, count = System("Chain"), 12
    stiffness = 2.0 * np.eye(count) - np.eye(count, k=1) - np.eye(count, k=-1)
    chain.matrices(np.eye(count), stiffness, C=0.01 * stiffness)
    answer = sweeps.response(sweeps.survey(system=chain), {"q1": 1.0}, [0.3, 1.0]).squeeze()
    for w, amplitudes in zip((0.3, 1.0), answer.response_amplitude.values, strict=True):
        right = exact_response(np.eye(count), 0.01 * stiffness, stiffness, np.eye(count)[0], w)
        np.testing.assert_allclose(amplitudes, np.abs(right), rtol=1e-11)


def test_the_command_prints_resonances_and_refuses_what_does_not_respond(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    sweeps.survey(system="rotor", spin_rate=[0.5, 6.0]).to_netcdf("shaft.nc")
    words = ["response", "shaft.nc", "--force", "x=1", "--frequency", "0.5", "1.5"]
    assert main([*words, "--spin_rate", "0.5", "--samples", "101"]) == 0
    rows = [line.split() for line in capsys.readouterr().out.splitlines()]
    assert ["x", "1", "14.58333333"] in [row[:3] for row in rows]  # 1/(0.07 - 0.01²/0.07)
    assert main([*words, "--spin_rate", "0.5", "--json", "--samples", "3"]) == 0
    assert json.loads(capsys.readouterr().out)["coords"]["angular_frequency"]["data"] == [0.5, 1.0, 1.5]
    for suffix in ("png", "csv"):
        assert main([*words, "--spin_rate", "0.5", "-o", f"shake.{suffix}", "--samples", "20"]) == 0
    assert Image.open("shake.png").width > Image.open("shake.png").height  # two panels
    assert len((tmp_path / "shake.csv").read_text().splitlines()) == 1 + 20 * 2
    capsys.readouterr()
    assert main([*words, "--spin_rate", "6"]) == 2
    assert "the regime of this point is flutter" in capsys.readouterr().err
    ds = sweeps.open_map("shaft.nc")
    for error, message, setting in [
        (SelectionError, "spin_rate", ({"x": 1.0}, [1.0], {})),
        (RefusedError, "z is no component", ({"z": 1.0}, [1.0], {"spin_rate": 0.5})),
        (RefusedError, "force: is 0", ({"x": 0.0}, [1.0], {"spin_rate": 0.5})),
        (RefusedError, "numbers > 0", ({"x": 1.0}, [0.0], {"spin_rate": 0.5})),
    ]:
        force, frequencies, places = setting
        with pytest.raises(error, match=message):
            sweeps.response(ds, force, frequencies, **places)
    with pytest.raises(RefusedError, match="conserved"):
        sweeps.response(sweeps.survey(system="gyrostat", rotor_momentum=0.0, I2=4.0), {"omega1": 1.0}, [1.0])
