"""Potentials of one coordinate with known equilibria: V, bounds and the positions of the equilibria."""

from itertools import pairwise

import numpy as np
import sympy as sp

x = sp.Symbol("x", real=True)
R = sp.Rational


def _wells(roots):
    """Π(x − r)²: minima at the roots, a maximum between each two."""
    return sp.prod([(x - r) ** 2 for r in roots])


def _between(roots):
    """Zeros of Σ 1/(x − r), one between each two roots, by bisection."""
    zeros = []
    for low, high in pairwise(roots):
        a, b = float(low), float(high)
        for _ in range(200):
            middle = 0.5 * (a + b)
            total = sum(1 / (middle - float(r)) for r in roots if middle != float(r))
            a, b = (middle, b) if total > 0 else (a, middle)
        zeros.append(0.5 * (a + b))
    return [*map(float, roots), *zeros]


def _turns(n, low, high):
    """Zeros of sin(n x) between bounds."""
    k = np.arange(np.ceil(low * n / np.pi), np.floor(high * n / np.pi) + 1)
    return (k * np.pi / n).tolist()


def _polynomials():
    yield "harmonic", x**2 / 2, (-1, 2), [0]
    yield "double well", x**4 / 4 - x**2 / 2, (-2, 2), [-1, 0, 1]
    yield "at both bounds", x**3 / 3 - x, (-1, 1), [-1, 1]
    yield "at the lower bound", (x - 1) ** 2, (1, 3), [1]
    yield "none", x, (-1, 2), []
    yield "far off", (x - 1000) ** 2, (-1, 2000), [1000]
    for n in (3, 8, 20):
        yield f"{n} wells", _wells(range(1, n + 1)), (0, n + R(3, 2)), _between(range(1, n + 1))
    for gap in (3, 9):
        second = 1 + R(1, 10**gap)
        yield f"1e-{gap} apart", _wells([1, second]), (0, R(23, 10)), [1, 1 + 0.5 * 10.0**-gap, 1 + 10.0**-gap]
    yield (
        "Chebyshev by its angle, 40",
        sp.cos(40 * sp.acos(x)),
        (-R(99, 100), R(99, 100)),
        [v for k in range(1, 40) if abs(v := np.cos(k * np.pi / 40)) <= 0.99],
    )
    yield "two wells 2e-3 apart in 2e4", ((x - R(1, 3)) ** 2 - R(1, 10**6)) ** 2, (-10000, 10000), [
        1 / 3 - 1e-3, 1 / 3, 1 / 3 + 1e-3,
    ]  # fmt: skip


def _trigonometric():
    for n in (1, 16, 200):
        yield f"cos {n} x", -sp.cos(n * x), (-3, R(31, 10)), _turns(n, -3, 3.1)
    for n in (3, 50):
        yield f"sin² {n} x", sp.sin(n * x) ** 2, (-1, R(31, 10)), _turns(2 * n, -1, 3.1)
    yield "tilted", -sp.cos(x) - x / 2, (-3, 4), [np.arcsin(0.5), np.pi - np.arcsin(0.5)]
    yield "tilted beyond", -sp.cos(x) - R(11, 10) * x, (-3, 4), []
    yield "two harmonics", -sp.cos(x) - sp.cos(2 * x), (-3, 3), [-np.arccos(-0.25), 0, np.arccos(-0.25)]


def _special():
    yield "Morse", (1 - sp.exp(-x)) ** 2, (-1, 5), [0]
    yield "bump", x**2 * sp.exp(-(x**2)), (-3, 3), [-1, 0, 1]
    yield "x log x", x * sp.log(x) - x, (R(1, 10), 3), [1]
    yield "erf", x * sp.erf(x) + sp.exp(-(x**2)) / sp.sqrt(sp.pi), (-3, 4), [0]
    yield "power", x ** R(5, 2) - x, (R(1, 100), 2), [0.4 ** (2 / 3)]


def _poles():
    yield "r/a - log(r/a)", x - sp.log(x), (0, 10), [1]
    yield "tan²", sp.tan(x) ** 2, (-3, 4), [0, np.pi]
    yield "Lennard-Jones", x**-12 - 2 * x**-6, (0, 20), [1]
    yield "1/x", 1 / x, (-1, 2), []
    yield "1/(x² - 1)", 1 / (x**2 - 1), (-3, 3), [0]
    yield "log²", sp.log(x) ** 2, (0, 5), [1]
    yield "three poles", 1 / (x - 1) + 1 / (x + 1) - 2 / x, (-3, 4), [-1 / np.sqrt(3), 1 / np.sqrt(3)]
    yield "1/x⁶ - cos", R(1, 10**6) / x**6 + x**2 / 2, (-1, 2), [-(6e-6 ** (1 / 8)), 6e-6 ** (1 / 8)]


def _multiple():
    """Double and triple zeros of ∂V/∂q: the search finds them and names those that it cannot prove."""
    yield "double", x**3 / 3, (-1, 2), [0]
    yield "triple", x**4 / 4, (-1, 2), [0]
    yield "high and flat", x**20, (-2, 3), [0]
    yield "double and single", x**3 / 3 + 75 * x**4, (-1, R(3, 2)), [-1 / 300, 0]
    yield "double off 0", (x - R(1, 3)) ** 3, (-1, 2), [1 / 3]
    yield "x - sin x", x**2 / 2 + sp.cos(x), (-1, 2), [0]
    yield "double of a cosine", x - sp.sin(x), (-1, 7), [0, 2 * np.pi]
    yield "two double", (x - 1) ** 3 * (x - 2) ** 3, (0, R(31, 10)), [1, 1.5, 2]
    yield "double at a bound", (x - 1) ** 3, (-1, 1), [1]


def _physical():
    """Potentials of textbooks and of laboratories."""
    well = np.arccosh(np.exp(2) / 2) / 2  # (A - B)(1 - A - B) = 0 with A = exp(-2 (x + 1)), B = exp(2 (x - 1))
    yield "double Morse", (1 - sp.exp(-2 * (x + 1))) ** 2 + (1 - sp.exp(2 * (x - 1))) ** 2, (-3, 3), [-well, 0, well]
    yield "Kapitza", -sp.cos(x) + 2 * sp.sin(x) ** 2, (-3, R(33, 10)), [
        -np.arccos(-0.25), 0, np.arccos(-0.25), np.pi,
    ]  # fmt: skip
    yield "ellipse that turns", -sp.cos(x) - R(9, 5) * sp.sin(x) ** 2, (-3, R(33, 10)), [
        -np.arccos(1 / 3.6), 0, np.arccos(1 / 3.6), np.pi,
    ]  # fmt: skip
    yield "Chebyshev expanded, 12", sp.expand(sp.chebyshevt(12, x)), (-1, 1), [
        np.cos(k * np.pi / 12) for k in range(1, 12)
    ]  # fmt: skip
    yield "far out of Coulomb's reach", 1 / x - 2 / x**2 + 1 / x**3, (0, 10**6), [1, 3]
    yield "overflows", sp.exp(x**2) - sp.E * x**2, (-50, 51), [-1, 0, 1]
    yield "overflows inside", sp.exp(sp.exp(x)) - sp.E * x, (-5, 9), [0]
    yield "logarithms at both ends", -sp.log(x) - sp.log(1 - x), (0, 1), [0.5]


def _faint():
    """V that underflows within the bounds: the search finds no root there and reports it."""
    yield "Gaussian", -sp.exp(-(x**2)), (-30, 31), [0]
    yield "falls for ever", sp.exp(-x), (0, 800), []
    yield "Yukawa", sp.exp(-x) * (1 / x**2 - 2 / x), (0, 1000), [(np.sqrt(17) - 1) / 4]


KNOWN = {
    name: entry for group in (_polynomials, _trigonometric, _special, _poles, _physical) for name, *entry in group()
}
MULTIPLE = {name: entry for name, *entry in _multiple()}
FAINT = {name: entry for name, *entry in _faint()}
