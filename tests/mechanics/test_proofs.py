import numpy as np
import pytest
import sympy as sp
from described import flow

from sweeps.mechanics import relative
from sweeps.mechanics.model import Model
from sweeps.mechanics.relative import is_proved_stable
from sweeps.points import catalogue
from sweeps.systems import resolve
from sweeps.systems.relative_equilibrium.system import REGIMES


def proof_lines(name, **values):
    """Return the lines about a shipped system at two points, which have the default parameters but for some values."""
    model = resolve(name).mechanism
    point = [values.get(p.name, p.default) for p in model.system.parameters.values()]
    return "\n".join(model.proofs([x * np.ones(2) for x in point]))


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
    assert words in proof_lines(name, **symmetric)
    assert words not in proof_lines(name, **{parameter: 0.1})
    assert f"{words} (at 1 of 2 looked at)" in proof_lines(name, **{parameter: [0.0, 0.1]})


def test_what_is_conserved_and_linear_is_said():
    assert "1 of 3 eigenvalues, which are zero, are left out" in proof_lines("gyrostat")
    assert "conserved: energy" in proof_lines("pendulum")
    words = "stable by a definite conserved quantity"
    assert f"{words} (at 1 of 2 looked at)" in proof_lines("gravity_gradient", k1=[0.7, -0.3])
    assert "linear about an equilibrium" in proof_lines("mathieu")
    assert "linear about an equilibrium" not in proof_lines("swing")
    assert proof_lines("rotor") == ""


def test_check_says_what_is_proved(capsys):
    from sweeps.__main__ import main

    assert main(["check", "kapitzas_racket"]) == 0
    assert "proved      Hamilton's equations, or no divergence" in capsys.readouterr().out
    assert catalogue.plan_sweep(catalogue.find_definition("tiny")).sweep.system.proofs(None) == ()


def is_proved(rates, quantities, place):
    """Return whether conserved quantities, functions of the states, prove that a place of x' = rates(x) is stable."""
    conserved = {f"C{k}": quantity for k, quantity in enumerate(quantities)}
    system = flow(rates, "xyuv"[: len(place)], most=1, places={"place": place}, conserved=conserved)
    return is_proved_stable(Model(system), [np.zeros(1)], np.array([place], dtype=float), np.zeros((1, len(place))))[0]


def free_body(moments, axes, k, scale=(1.0, 1.0)):
    """Return whether energy and momentum prove the rotation about a principal axis, in axes that are turned, stable."""
    inverse = axes @ np.diag(1.0 / moments) @ axes.T

    def energy(*L):
        return scale[0] * (sp.Matrix(L).T * sp.Matrix(inverse) * sp.Matrix(L))[0]

    return is_proved(
        lambda *L: list(sp.Matrix(L).cross(sp.Matrix(inverse) * sp.Matrix(L))),
        [energy, lambda *L: scale[1] * sum(x**2 for x in L)],
        tuple(2.0 * axes[:, k]),
    )


def test_rotation_of_a_free_body_is_proved_stable_but_about_the_intermediate_axis():
    """In any axes of the body, and in any units of the conserved quantities: Euler's theorem."""
    rng = np.random.default_rng(3)
    for _ in range(2):
        moments = np.sort(rng.uniform(1.0, 2.0, 3)) + 0.1 * np.arange(3)
        axes = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        verdicts = [free_body(moments, axes, k, 10.0 ** rng.uniform(-9, 9, 2)) for k in range(3)]
        assert verdicts == [True, False, True]
    for moments, stable in (([1, 1, 2], [False, False, True]), ([1, 2, 2], [True, False, False])):
        assert [free_body(np.array(moments, float), np.eye(3), k) for k in range(3)] == stable  # along the equator: no


@pytest.mark.parametrize(
    ("quantities", "is_definite"),
    [
        ([lambda x, y, u, v: x**2 + y**2 + u**2 + v**2], True),
        ([lambda x, y, u, v: -(x**2) - y**2 - 3 * u**2 - 3 * v**2], True),
        ([lambda x, y, u, v: x**2 + y**2 - u**2 - v**2], False),
        ([lambda x, y, u, v: x**2 + y**2, lambda x, y, u, v: x**2 + y**2 + u**2 + v**2], True),
        ([lambda x, y, u, v: x**2 + y**2], False),
        ([lambda x, y, u, v: (x**2 + y**2) ** 2 + u**2 + v**2], False),
        ([lambda x, y, u, v: x**2 + y**2 + 1e-14 * (u**2 + v**2)], False),  # rounding could have made it
    ],
)
def test_two_oscillators_are_proved_stable_by_what_is_definite(quantities, is_definite):
    assert is_proved(lambda x, y, u, v: (y, -x, 2 * v, -2 * u), quantities, (0, 0, 0, 0)) == is_definite


def test_the_gyrostats_and_gravity_gradients_conserved_quantities_prove_what_books_say():
    """Ω² > 0 of the gyrostat; the gravity gradient's minimum of the energy, but not the region of gyroscopic forces."""
    rng = np.random.default_rng(4)
    I1, I2, I3, h, W = values = [*rng.uniform(1.0, 2.0, (3, 400)), *rng.uniform(-2.0, 2.0, (2, 400))]
    place = np.stack([0.0 * W, W, 0.0 * W], axis=1)
    omega_squared = ((I2 - I3) * W + h) * ((I2 - I1) * W + h)
    np.testing.assert_array_equal(
        is_proved_stable(resolve("gyrostat").mechanism, values, place, 0.0 * place), omega_squared > 0.0
    )
    k1, k3 = rng.uniform(-0.99, 0.99, (2, 400))
    place = np.zeros((400, 6))
    place[:, 1] = -np.abs(W)
    is_stable = is_proved_stable(resolve("gravity_gradient").mechanism, [k1, k3, np.abs(W)], place, 0.0 * place)
    np.testing.assert_array_equal(is_stable, (k3 > 0.0) & (k3 < k1))


def test_a_proof_decides_a_marginal_spectrum_alone():
    """No point with measured growth, and no point with errors above its rates."""
    marginal, unstable = (REGIMES.index(word) - 1 for word in ("marginal", "unstable"))
    regime = np.array([marginal, unstable, marginal, marginal, -1])
    re = np.array([[0.0, 0.0], [1.0, 1.0], [2e-8, 2e-8], [0.0, 0.0], [np.nan, np.nan]])
    im, error = np.tile([-1.0, 1.0], (5, 1)), np.full((5, 2), 1e-8)
    error[3] = 2.0
    assert relative._is_marginal_rotation(regime, re, im, error).tolist() == [True, False, False, False, False]
