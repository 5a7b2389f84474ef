import numpy as np
import pytest

from sweeps.mechanics.proofs import proofs
from sweeps.points import catalogue
from sweeps.systems import resolve


def said(name, **values):
    """Return the lines about a shipped system at two points, which have the default parameters but for some values."""
    model = resolve(name).mechanism
    given = [values.get(p.name, p.default) for p in model.system.parameters.values()]
    return "\n".join(proofs(model, [x * np.ones(2) for x in given]))


@pytest.mark.parametrize(
    ("name", "symmetric", "words"),
    [
        ("foucault", {"drag": 0.0}, "eigenvalues come in pairs ±μ"),
        ("mathieu", {"damping": 0.0}, "multipliers come in pairs μ, 1/μ"),
        ("mathieu", {"damping": 0.0}, "about an equilibrium half a period gives the whole"),
        ("swing", {"damping": 0.0}, "multipliers come in pairs μ, 1/μ"),
    ],
)
def test_a_symmetry_is_said_where_it_holds_and_of_how_many_points(name, symmetric, words):
    (parameter,) = symmetric
    assert words in said(name, **symmetric)
    assert words not in said(name, **{parameter: 0.1})
    assert f"{words} (at 1 of 2 looked at)" in said(name, **{parameter: [0.0, 0.1]})


def test_what_is_conserved_and_linear_is_said():
    assert "1 of 3 eigenvalues, which are zero, are left out" in said("gyrostat")
    assert "conserved: energy" in said("pendulum")
    assert "linear about an equilibrium" in said("mathieu")
    assert "linear about an equilibrium" not in said("swing")
    assert said("rotor") == ""


def test_check_says_what_is_proved(capsys):
    from sweeps.__main__ import main

    assert main(["check", "kapitzas_racket"]) == 0
    assert "proved      Hamilton's equations, or no divergence" in capsys.readouterr().out
    assert catalogue.plan(catalogue.resolve("tiny")).sweep.system.proofs(None) == ()
