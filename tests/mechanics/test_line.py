from fractions import Fraction

import mpmath
import numpy as np
import pytest
import sympy as sp
from potentials import FAINT, KNOWN, MULTIPLE, x

from kernels import enclosures
from sweeps.mechanics import line
from sweeps.mechanics.graph import lambdified
from sweeps.mechanics.tape import FUNCTIONS, Tape


def zeros(V, bounds, plain=None):
    """Zeros of dV/dx of a potential of x, sought in plain numbers first."""
    in_numbers = lambdified([x], [V.diff(x), V.diff(x, 2)])
    tape = Tape([sp.factor_terms(V.diff(x))], [x], [])
    constants = tape.constants([])

    def curve(owner, low, high):
        values, states = tape.curves(constants, owner, low, high)
        return values[:, 0], states

    def slope(owner, low, high):
        values, states = tape.slopes(constants, owner, low[:, None], high[:, None])
        return values[:, 0], states

    low, high = (np.array([float(b)]) for b in bounds)
    return line.zeros(curve, low, high, plain or (lambda owner, at: in_numbers(at)), slope)


def test_there_are_sixty():
    assert len(KNOWN) + len(MULTIPLE) >= 60


LONG = ("12 wells", "16 wells", "20 wells")  # degree 24 to 40


@pytest.mark.parametrize("name", [pytest.param(n, marks=pytest.mark.slow) if n in LONG else n for n in KNOWN])
def test_all_equilibria_of_a_known_potential_are_found_and_proved(name):
    V, bounds, expected = KNOWN[name]
    found = zeros(V, bounds)
    expected = np.sort(np.array(expected, dtype=float))
    assert found.place.size == expected.size
    # the closed forms' own rounding, over their distance from 0
    assert found.place == pytest.approx(expected, rel=1e-13, abs=1e-14)
    assert found.proved.all()
    assert not found.flat.any()


@pytest.mark.parametrize("value", [np.nan, 0.0, -1.0])
def test_plain_numbers_that_mislead_cost_time_and_no_zero(value):
    for V, bounds, expected in list(KNOWN.values())[::25]:
        found = zeros(V, bounds, lambda owner, at: (np.full(at.size, value), np.full(at.size, 0.1)))
        assert found.place == pytest.approx(np.sort(np.array(expected, dtype=float)), rel=1e-13, abs=1e-14)
        assert found.proved.all()


@pytest.mark.parametrize("name", MULTIPLE)
def test_multiple_zeros_are_found_and_named(name):
    V, bounds, expected = MULTIPLE[name]
    found = zeros(V, bounds)
    # a double zero of terms of size 1 is known to the root of a rounding, a triple one to its cube root; where the
    # terms vanish with it to a rounding
    assert found.place == pytest.approx(np.sort(np.array(expected, dtype=float)), abs=1e-7)
    for k in np.flatnonzero(found.kind == line.CLUSTER):
        low, high = found.doubt[1], found.doubt[2]
        assert ((low <= found.place[k]) & (found.place[k] <= high)).any()
    assert found.proved.all() == (found.kind == line.SIMPLE).all()


@pytest.mark.parametrize("name", FAINT)
def test_where_numbers_end_nothing_is_invented(name):
    V, bounds, expected = FAINT[name]
    found = zeros(V, bounds)
    assert found.place == pytest.approx(np.array(expected, dtype=float), rel=1e-13, abs=1e-14)
    assert not found.flat.any()
    assert not found.proved.any()
    assert not found.exhausted.any()


def test_a_line_of_zeros_is_flat():
    found = zeros(0 * x, (-1, 2))
    assert found.flat.all()


def test_a_search_that_is_cut_short_says_so(monkeypatch):
    monkeypatch.setattr(line, "MOST_BOXES", 200)
    found = zeros(-sp.cos(200 * x), (-3, 3))
    assert found.exhausted.all()
    assert not found.proved.any()


ARGUMENTS = {sp.asin: (-0.9, 0.9), sp.acos: (-0.9, 0.9), sp.atanh: (-0.9, 0.9), sp.acosh: (1.1, 4), sp.log: (0.1, 4)}


POWERS = [lambda u: u**5, lambda u: u**-3, lambda u: (u + 5) ** sp.Rational(17, 10)]


@pytest.mark.parametrize("function", [*FUNCTIONS, *POWERS], ids=lambda f: f.__name__)
def test_enclosures_hold_what_mpmath_gives_anywhere_in_the_box(function):
    rng = np.random.default_rng(5)
    tape = Tape([function(x)], [x], [])
    low, high = ARGUMENTS.get(function, (-4, 4))
    a = rng.uniform(low, high, 100)
    b = np.minimum(a + rng.choice([0.0, 1e-12, 1e-3, 0.3], 100), high)
    values, states = tape.curves(tape.constants([]), np.zeros(100, dtype=np.int64), a, b)
    slopes = tape.slopes(tape.constants([]), np.zeros(100, dtype=np.int64), a[:, None], b[:, None])[0]
    np.testing.assert_array_equal(slopes, values[:, :, :2])
    exact = [sp.lambdify(x, f, "mpmath") for f in (function(x), function(x).diff(x), function(x).diff(x, 2) / 2)]
    with mpmath.workdps(40):
        for i in np.flatnonzero(states == enclosures.SOUND):
            for place in (a[i], b[i], a[i] + 0.37 * (b[i] - a[i])):
                for k, f in enumerate(exact):
                    assert values[i, 0, k, 0] <= f(mpmath.mpf(place)) <= values[i, 0, k, 1]
    thin = np.flatnonzero((a == b) & (states == enclosures.SOUND))
    width = values[thin, 0, 0, 1] - values[thin, 0, 0, 0]
    assert (width <= 40 * enclosures.UNIT * (np.abs(values[thin, 0, 0]).max(axis=1) + 1e-300)).all()


def test_sums_and_products_hold_the_exact_ones():
    rng = np.random.default_rng(6)
    for a, b in rng.normal(size=(300, 2)) * 10.0 ** rng.uniform(-3, 3, (300, 2)):
        exact = {enclosures._add: Fraction(a) + Fraction(b), enclosures._mul: Fraction(a) * Fraction(b)}
        for operation, value in exact.items():
            low, high = operation(a, a, b, b)
            assert Fraction(low) <= value <= Fraction(high)


@pytest.mark.parametrize("function", [sp.sin, sp.cos])
def test_boxes_that_hold_a_crest_or_a_trough_reach_it(function):
    """Up to 10^11, where a place is known to a ten thousandth of a turn; crests lie right at an end, or within."""
    rng, tape = np.random.default_rng(8), Tape([function(x)], [x], [])
    turns = np.floor(10.0 ** rng.uniform(0, 10.2, 500))
    for height, quarter in zip((1.0, -1.0), (1, 3) if function is sp.sin else (0, 2), strict=True):
        with mpmath.workdps(40):
            exact = [mpmath.pi / 2 * (4 * int(k) + quarter) for k in turns]
            places = np.array([float(place) for place in exact])
            above = np.array([place > there for place, there in zip(places.tolist(), exact, strict=True)])
        before = np.where(above, np.nextafter(places, 0.0), places)
        beyond = np.where(above, places, np.nextafter(places, np.inf))
        for a, b in ((beyond - 0.3, beyond), (before, before + 0.3), (before - 0.2, beyond + 0.2)):
            values, _ = tape.curves(tape.constants([]), np.zeros(500, dtype=np.int64), a, b)
            assert (values[:, 0, 0] == height).any(axis=1).all()


def test_a_box_is_said_to_hold_a_pole_or_to_lie_outside():
    boxes = np.array([-2.0, -1.0, 0.5]), np.array([-1.5, 1.0, 0.6])
    states = {}
    for f in (sp.log(x), 1 / x, sp.sqrt(x)):
        tape = Tape([f], [x], [])
        states[f] = tape.curves(tape.constants([]), np.zeros(3, dtype=np.int64), *boxes)[1].tolist()
    assert states[sp.log(x)] == states[sp.sqrt(x)] == [enclosures.OUTSIDE, enclosures.POLE, enclosures.SOUND]
    assert states[1 / x] == [enclosures.SOUND, enclosures.POLE, enclosures.SOUND]


def test_constants_are_enclosed():
    p = sp.Symbol("p", positive=True)
    tape = Tape([sp.pi * sp.sqrt(p) * x / 3], [x], [p])
    low, high = tape.constants([np.array([2.0, 7.0])])[:, 0].T
    for k, value in enumerate((2, 7)):
        with mpmath.workdps(40):
            assert low[k] <= mpmath.pi * mpmath.sqrt(value) / 3 <= high[k]
        assert high[k] - low[k] < 1e-13
