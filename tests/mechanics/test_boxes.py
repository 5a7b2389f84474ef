import numpy as np
import pytest
import sympy as sp
from scipy.optimize import fsolve

from sweeps.mechanics import boxes
from sweeps.mechanics.tape import Tape

q = x, y, z, w = sp.symbols("x y z w", real=True)


def zeros(V, low, high):
    """Zeros of the gradient of a potential of x, y, …"""
    n = len(low)
    tape = Tape([V.diff(s) for s in q[:n]], q[:n], [])
    constants = tape.constants([])
    return boxes.zeros(lambda *box: tape.slopes(constants, *box), np.array([low], float), np.array([high], float))


def mueller_brown():
    """Müller and Brown, Theoretica Chimica Acta 53 (1979) 75: three minima and two saddles."""
    A, a, b = (-200, -100, -170, 15), (-1, -1, -6.5, 0.7), (0, 0, 11, 0.6)
    c, X, Y = (-10, -10, -6.5, 0.7), (1, 0, -0.5, -1), (0, 0.5, 1.5, 1)
    parts = zip(A, a, b, c, X, Y, strict=True)
    return sum(A * sp.exp(a * (x - X) ** 2 + b * (x - X) * (y - Y) + c * (y - Y) ** 2) for A, a, b, c, X, Y in parts)


TURN = (-3.3, -3.3 + 2 * np.pi)  # one turn, off the round numbers
KNOWN = {
    "torus 1 × 1": (sp.cos(x) + sp.cos(y), [TURN] * 2, 4),
    "torus 3 × 5": (sp.cos(3 * x) + sp.cos(5 * y), [TURN] * 2, 60),
    "torus 6 × 6": (sp.cos(6 * x) + sp.cos(6 * y), [TURN] * 2, 144),
    "torus 6 × 6, coupled": (sp.cos(6 * x) + sp.cos(6 * y) + sp.cos(x - y) / 10, [TURN] * 2, 144),
    "sixteen wells": (sum((s**2 - 1) ** 2 for s in q), [(-2, 2.1)] * 4, 81),
    "sixteen wells, coupled": (sum((s**2 - 1) ** 2 for s in q) + x * y / 10 + z * w / 7, [(-2, 2.1)] * 4, 81),
    "Müller-Brown": (mueller_brown(), [(-1.5, 1.2), (-0.5, 2)], 5),
    "Hénon-Heiles": ((x**2 + y**2) / 2 + x**2 * y - y**3 / 3, [(-1.5, 1.6)] * 2, 4),
    "coupled quartics": ((x**4 + y**4) / 4 - (x**2 + y**2) / 2 + x * y / 10, [(-3, 3)] * 2, 9),
    "coupled quartics, single": ((x**4 + y**4) / 4 + (x**2 + y**2) / 2 + x * y / 10, [(-3, 3)] * 2, 1),
    "Himmelblau": ((x**2 + y - 11) ** 2 + (x + y**2 - 7) ** 2, [(-6, 6)] * 2, 9),
    "six-hump camel": ((4 - 2.1 * x**2 + x**4 / 3) * x**2 + x * y + (4 * y**2 - 4) * y**2, [(-3, 3), (-2, 2)], 15),
    "magnetic pendulum": (  # over three magnets
        (x**2 + y**2) / 10
        - sum(
            1 / sp.sqrt((x - sp.cos(a)) ** 2 + (y - sp.sin(a)) ** 2 + sp.Rational(1, 10))
            for a in (0, 2 * sp.pi / 3, 4 * sp.pi / 3)
        ),
        [(-2, 2.1)] * 2,
        7,
    ),
    "sine-Gordon chain": (
        -sp.cos(x) - sp.cos(y) - sp.cos(z) + ((x - y) ** 2 + (y - z) ** 2) / 40,
        [(-3.5, 3.6)] * 3,
        17,
    ),
    "Duffing pair": ((x**2 - 1) ** 2 / 4 + (y**2 - 1) ** 2 / 4 + (x - y) ** 2, [(-2, 2.1)] * 2, 3),
    "three rods": (-3 * sp.cos(x) - 2 * sp.cos(y) - sp.cos(z), [TURN] * 3, 8),
}


@pytest.mark.parametrize("name", KNOWN)
def test_all_equilibria_of_a_known_potential_are_found_and_proved(name):
    V, bounds, count = KNOWN[name]
    found = zeros(V, *zip(*bounds, strict=True))
    assert found.left[0].size == 0
    assert found.owner.size == count
    gradient = sp.lambdify(q[: len(bounds)], [V.diff(s) for s in q[: len(bounds)]])
    for place in found.place:
        assert fsolve(lambda at: gradient(*at), place, xtol=1e-12) == pytest.approx(place, abs=1e-9)
    assert all(np.abs(found.place[i] - found.place[j]).max() > 1e-6 for i in range(count) for j in range(i))


@pytest.mark.parametrize("power", [4, 8, 12])
def test_a_stiff_direction_hides_no_soft_one(power):
    """Rotated by 45°, so that no coordinate is soft."""
    V = (x + y - 1) ** 2 / 2 + 10**power * (x - y - sp.Rational(1, 5)) ** 2 / 2
    found = zeros(V, (-1, -1), (2, 2))
    assert found.left[0].size == 0
    # Y is good to the ratio times a rounding
    assert found.place == pytest.approx(np.array([[0.6, 0.4]]), abs=1e-15 * 10**power + 1e-14)


def test_a_degenerate_place_is_left_and_no_more():
    found = zeros(x**4 + y**4 + (x - 1) ** 2 * y**2, (-1, -1), (2, 2))
    assert found.left[0].size >= 1
    assert np.abs(found.left[1]).max() < 1e-5
    assert np.abs(found.left[2]).max() < 1e-5
