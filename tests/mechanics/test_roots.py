"""All zeros of F(x) = 0 in a box, against closed forms, SciPy, NumPy's roots and mpmath."""

from fractions import Fraction

import mpmath
import numpy as np
import pytest
import repeated
import sympy as sp
from potentials import FAINT, KNOWN, MULTIPLE, x
from scipy.optimize import fsolve

from kernels.search import codes, enclosures
from sweeps.mechanics import System, equilibria
from sweeps.mechanics.equations import Equations
from sweeps.mechanics.equilibria import FAMILY, PROVED, ROUNDING, TOO_LARGE
from sweeps.mechanics.landscape import Landscape
from sweeps.mechanics.tape import FUNCTIONS, Tape

q = x, y, z, w = (x, *sp.symbols("y z w", real=True))


def search(F, bounds, max_places=200, order=None):
    """Return the zeros of F(q) within bounds; `order` permutes the unknowns."""
    system, n = System("F", most=max_places), len(bounds)
    order = range(n) if order is None else order
    names = [system.state(str(q[i]), bounds=bounds[i]) for i in order]
    F = [sp.sympify(F[i]).subs({q[k]: name for k, name in zip(order, names, strict=True)}) for i in order]
    equations = Equations(system, tuple(names), (), tuple(F), None, sp.Integer(0), natural=False, hamiltonian=False)
    zeros = equilibria.find(Landscape(equations), [])
    assert not zeros.is_crowded.any()
    return zeros


def places(zeros):
    """The places that are found, shape (count, n)."""
    return zeros.places[0, : zeros.counts[0]]


def slope(V, n=1):
    return [V.diff(s) for s in q[:n]]


QUICK = [name for name in (KNOWN | MULTIPLE | FAINT) if name != "20 wells"]


@pytest.mark.parametrize("name", repeated.but(QUICK, KNOWN | MULTIPLE | FAINT))
def test_all_equilibria_of_a_potential_are_found_and_proved_or_undecided(name):
    """Multiple zeros are undecided; where V underflows nothing is invented."""
    V, bounds, expected = (KNOWN | MULTIPLE | FAINT)[name]
    zeros = search(slope(V), [bounds], max_places=400)
    # a double zero of terms of size 1 is known to the root of a rounding, a triple one to its cube root; else to the
    # closed forms' own rounding, over their distance from 0
    tolerances = {"abs": 1e-7} if name in MULTIPLE else {"rel": 1e-13, "abs": 1e-14}
    assert places(zeros)[:, 0] == pytest.approx(np.sort(np.array(expected, dtype=float)), **tolerances)
    assert zeros.certified[0] == (PROVED if name in KNOWN else ROUNDING)
    assert not zeros.is_flat.any()
    assert np.isfinite(zeros.undecided_box).all() == (name not in KNOWN)


def test_a_line_of_zeros_is_flat():
    zeros = search([0 * x], [(-1, 2)])
    assert zeros.is_flat.all()
    assert zeros.certified[0] == FAMILY


def test_a_family_beside_single_zeros_is_the_same_after_few_boxes_as_after_many(monkeypatch):
    circle = x**2 + y**2 - sp.Rational(1, 2)
    for num_boxes in (equilibria.FEW_NARROW, equilibria.MAX_NARROW):
        monkeypatch.setattr(equilibria, "FEW_NARROW", num_boxes)
        zeros = search([circle * (x - sp.Rational(1, 5)) * (x + 1), circle * (y - sp.Rational(1, 3))], [(-2, 3)] * 2)
        assert zeros.certified[0] == FAMILY
        assert zeros.is_flat.all()
        assert np.isfinite(zeros.direction).all()


def test_what_is_undecided_about_a_pole_does_not_depend_on_what_was_searched_before():
    F = [1 / sp.sin(x * y) + z, y * z + x, z / x - sp.tan(y)]
    first = search(F, [(-1, 2)] * 3)
    search([sp.exp(40 * x) - 1, y**3 * x - z, z - y], [(-1, 3)] * 3)
    assert first.undecided_box == pytest.approx(search(F, [(-1, 2)] * 3).undecided_box, rel=0, abs=0, nan_ok=True)


def test_a_search_that_is_cut_short_says_so(monkeypatch):
    monkeypatch.setattr(equilibria, "SEARCH_OPERATIONS", 0)
    monkeypatch.setattr(equilibria, "MIN_BOXES", 100)
    zeros = search(slope(-sp.cos(200 * x)), [(-3, 3)], max_places=400)
    assert zeros.certified[0] == TOO_LARGE


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("unit", [1e-12, 1.0, 1e15])
def test_polynomials_have_their_roots_in_any_unit(unit, seed):
    """Roots at random, some in close pairs; the polynomial is a product, so that they are known exactly."""
    rng = np.random.default_rng(seed)
    roots = rng.uniform(-1, 1, rng.integers(3, 9))
    roots = np.sort(np.concatenate([roots, roots[:2] + 10.0 ** rng.uniform(-9, -3, 2)])) * unit
    F = 1e-7 / unit**3 * sp.Mul(*[x - sp.Float(root, 17) for root in roots])
    zeros = search([F], [(-1.5 * unit, 1.5 * unit)])
    assert places(zeros)[:, 0] == pytest.approx(roots, rel=1e-14, abs=1e-15 * unit)
    assert zeros.certified[0] == PROVED


@pytest.mark.parametrize("seed", range(3))
def test_trigonometric_polynomials_have_the_roots_of_their_companions(seed):
    """Σ a_k cos kx + b_k sin kx is a polynomial in exp(ix): NumPy's roots on the unit circle are its zeros."""
    rng = np.random.default_rng(seed)
    degree = int(rng.integers(2, 7))
    c = rng.normal(size=degree + 1) + 1j * rng.normal(size=degree + 1)
    c[0] = c[0].real / 2
    F = sum(float(c[k].real) * sp.cos(k * x) - float(c[k].imag) * sp.sin(k * x) for k in range(degree + 1))
    series = np.concatenate([np.conj(c[:0:-1]), [2 * c[0].real], c[1:]]) / 2
    series[degree] = c[0].real
    circle = np.roots(series[::-1])
    angles = np.sort(np.angle(circle[np.abs(np.abs(circle) - 1) < 1e-9]))
    zeros = search([F], [(-sp.pi, sp.pi)])
    assert places(zeros)[:, 0] == pytest.approx(angles, abs=1e-11)
    assert zeros.certified[0] == PROVED


@pytest.mark.parametrize("seed", range(4))
def test_neither_order_nor_units_of_unknowns_change_what_is_found(seed):
    """Coupled cubics in units from 1e-12 to 1e12, and their permutations."""
    rng = np.random.default_rng(seed)
    A, c = rng.normal(size=(3, 3)) * 0.3, rng.normal(size=3) * 0.2

    def cubics(scales):
        unknowns = [s / u for s, u in zip((x, y, z), scales, strict=True)]
        rows = [u**3 - u + sum(float(a) * v for a, v in zip(row, unknowns, strict=True)) + float(b)
                for u, row, b in zip(unknowns, A, c, strict=True)]  # fmt: skip
        return rows, [(-1.7 * u, 1.8 * u) for u in scales]

    plain = search(*cubics([1.0] * 3))
    scales = 2.0 ** rng.integers(-40, 40, 3)
    scaled = search(*cubics(scales.tolist()))
    permuted = search(*cubics([1.0] * 3), order=(2, 0, 1))
    assert plain.certified[0] == scaled.certified[0] == permuted.certified[0] == PROVED
    assert places(scaled) / scales == pytest.approx(places(plain), abs=1e-13)
    restored = places(permuted)[:, [1, 2, 0]]
    assert restored[np.lexsort(restored.T[::-1])] == pytest.approx(places(plain), abs=1e-13)
    for place in places(plain):
        assert place**3 - place + A @ place + c == pytest.approx(np.zeros(3), abs=1e-13)


@pytest.mark.parametrize(("lift", "count"), [(1e-12, 0), (0.0, 1), (-1e-12, 2)])
def test_a_near_miss_is_none_and_a_near_pair_is_two(lift, count):
    zeros = search([(x - 1) ** 2 + sp.Float(lift, 17)], [(-3, 5)])
    assert zeros.counts[0] == count
    assert (zeros.certified[0] == PROVED) == (lift != 0.0)
    assert np.abs(places(zeros)[:, 0] - 1) == pytest.approx(np.full(count, np.sqrt(max(-lift, 0.0))), rel=1e-9)


def test_a_near_miss_that_rounding_hides_is_undecided():
    zeros = search([x**2 - 2 * x + 1 + sp.Float(1e-18, 17)], [(-3, 5)])
    assert zeros.certified[0] == ROUNDING


def mueller_brown():
    """Müller and Brown, Theoretica Chimica Acta 53 (1979) 75: three minima and two saddles."""
    A, a, b = (-200, -100, -170, 15), (-1, -1, -6.5, 0.7), (0, 0, 11, 0.6)
    c, X, Y = (-10, -10, -6.5, 0.7), (1, 0, -0.5, -1), (0, 0.5, 1.5, 1)
    terms = zip(A, a, b, c, X, Y, strict=True)
    return sum(A * sp.exp(a * (x - X) ** 2 + b * (x - X) * (y - Y) + c * (y - Y) ** 2) for A, a, b, c, X, Y in terms)


ANGLE_BOUNDS = (-3.3, -3.3 + 2 * np.pi)  # one turn, off the round numbers
SEVERAL = {
    "torus 3 × 5": (sp.cos(3 * x) + sp.cos(5 * y), [ANGLE_BOUNDS] * 2, 60),
    "torus 6 × 6": (sp.cos(6 * x) + sp.cos(6 * y), [ANGLE_BOUNDS] * 2, 144),
    "torus 6 × 6, coupled": (sp.cos(6 * x) + sp.cos(6 * y) + sp.cos(x - y) / 10, [ANGLE_BOUNDS] * 2, 144),
    "sixteen wells": (sum((s**2 - 1) ** 2 for s in q), [(-2, 2.1)] * 4, 81),
    "sixteen wells, coupled": (sum((s**2 - 1) ** 2 for s in q) + x * y / 10 + z * w / 7, [(-2, 2.1)] * 4, 81),
    "Müller-Brown": (mueller_brown(), [(-1.5, 1.2), (-0.5, 2)], 5),
    "Hénon-Heiles": ((x**2 + y**2) / 2 + x**2 * y - y**3 / 3, [(-1.5, 1.6)] * 2, 4),
    "coupled quartics": ((x**4 + y**4) / 4 - (x**2 + y**2) / 2 + x * y / 10, [(-3, 3)] * 2, 9),
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
    "three rods": (-3 * sp.cos(x) - 2 * sp.cos(y) - sp.cos(z), [ANGLE_BOUNDS] * 3, 8),
}


@pytest.mark.parametrize("name", SEVERAL)
def test_all_equilibria_of_several_coordinates_are_found_and_proved(name, monkeypatch):
    monkeypatch.setattr(equilibria, "SEARCH_OPERATIONS", 10**8)
    V, bounds, count = SEVERAL[name]
    zeros = search(slope(V, len(bounds)), bounds)
    assert zeros.certified[0] == PROVED
    assert zeros.counts[0] == count
    gradient = sp.lambdify(q[: len(bounds)], slope(V, len(bounds)))
    for place in places(zeros):
        assert fsolve(lambda at: gradient(*at), place, xtol=1e-12) == pytest.approx(place, abs=1e-8)  # MINPACK's


@pytest.mark.parametrize("distance", [0, 1e-13, 1e-10, 1e-6, 1e-3])
def test_a_zero_beside_a_pole_is_found_however_near(distance):
    """F of a charge at (0.3, -0.7), moved by so much from its own centre; without that it is nowhere 0."""
    u, v = x - sp.Rational(3, 10), y + sp.Rational(7, 10)
    distance_cubed = (u**2 + v**2) ** sp.Rational(3, 2)
    zeros = search([(u - sp.Rational(distance)) / distance_cubed, v / distance_cubed], [(-2, 2)] * 2)
    assert zeros.certified[0] == PROVED
    assert places(zeros) == pytest.approx(np.array([[0.3 + distance, -0.7]][: distance > 0]).reshape(-1, 2), abs=1e-15)


@pytest.mark.parametrize("power", [4, 8, 12])
def test_a_stiff_direction_hides_no_soft_one(power):
    """Rotated by 45°, so that no coordinate is soft."""
    V = (x + y - 1) ** 2 / 2 + 10**power * (x - y - sp.Rational(1, 5)) ** 2 / 2
    zeros = search(slope(V, 2), [(-1, 2)] * 2)
    assert zeros.certified[0] == PROVED
    # Y is good to the ratio times a rounding
    assert places(zeros) == pytest.approx(np.array([[0.6, 0.4]]), abs=1e-15 * 10**power + 1e-14)


def test_a_degenerate_place_is_undecided_and_no_more():
    zeros = search(slope(x**4 + y**4 + (x - 1) ** 2 * y**2, 2), [(-1, 2)] * 2)
    assert zeros.certified[0] == ROUNDING
    assert np.abs(zeros.undecided_box).max() < 1e-5
    assert np.abs(places(zeros)).max() < 1e-5


ARGUMENTS = {sp.asin: (-0.9, 0.9), sp.acos: (-0.9, 0.9), sp.atanh: (-0.9, 0.9), sp.acosh: (1.1, 4), sp.log: (0.1, 4)}


POWERS = [lambda u: u**5, lambda u: u**-3, lambda u: (u + 5) ** sp.Rational(17, 10)]


@pytest.mark.parametrize("function", [*FUNCTIONS, *POWERS], ids=lambda f: f.__name__)
def test_enclosures_hold_what_mpmath_gives_anywhere_in_the_box(function):
    rng = np.random.default_rng(5)
    tape = Tape([function(x)], [x], [])
    low, high = ARGUMENTS.get(function, (-4, 4))
    a = rng.uniform(low, high, 100)
    b = np.minimum(a + rng.choice([0.0, 1e-12, 1e-3, 0.3], 100), high)
    values, states = tape.slopes(tape.constants([]), np.zeros(100, dtype=np.int64), a[:, None], b[:, None])
    exact = [sp.lambdify(x, f, "mpmath") for f in (function(x), function(x).diff(x))]
    with mpmath.workdps(40):
        for i in np.flatnonzero(states == codes.REGULAR):
            for place in (a[i], b[i], a[i] + 0.37 * (b[i] - a[i])):
                for k, f in enumerate(exact):
                    assert values[i, 0, k, 0] <= f(mpmath.mpf(place)) <= values[i, 0, k, 1]
    thin = np.flatnonzero((a == b) & (states == codes.REGULAR))
    width = values[thin, 0, 0, 1] - values[thin, 0, 0, 0]
    assert (width <= 40 * codes.UNIT * (np.abs(values[thin, 0, 0]).max(axis=1) + 1e-300)).all()


def test_sums_and_products_hold_the_exact_ones():
    rng = np.random.default_rng(6)
    for a, b in rng.normal(size=(300, 2)) * 10.0 ** rng.uniform(-3, 3, (300, 2)):
        a_plus_b, a_times_b = Fraction(a) + Fraction(b), Fraction(a) * Fraction(b)
        for operation, value in ((enclosures._interval_sum, a_plus_b), (enclosures._interval_product, a_times_b)):
            low, high = operation(a, a, b, b)
            assert Fraction(low) <= value <= Fraction(high)


@pytest.mark.parametrize("function", [sp.sin, sp.cos])
def test_boxes_that_hold_a_crest_or_a_trough_reach_it(function):
    """Up to 10^11, at which a position is known to 1e-4 of a turn; crests are at an end, or inside."""
    rng, tape = np.random.default_rng(8), Tape([function(x)], [x], [])
    turns = np.floor(10.0 ** rng.uniform(0, 10.2, 500))
    for height, quarter in zip((1.0, -1.0), (1, 3) if function is sp.sin else (0, 2), strict=True):
        with mpmath.workdps(40):
            exact = [mpmath.pi / 2 * (4 * int(k) + quarter) for k in turns]
            places = np.array([float(place) for place in exact])
            above = np.array([place > extremum for place, extremum in zip(places.tolist(), exact, strict=True)])
        before = np.where(above, np.nextafter(places, 0.0), places)
        after = np.where(above, places, np.nextafter(places, np.inf))
        for a, b in ((after - 0.3, after), (before, before + 0.3), (before - 0.2, after + 0.2)):
            values, _ = tape.slopes(tape.constants([]), np.zeros(500, dtype=np.int64), a[:, None], b[:, None])
            assert (values[:, 0, 0] == height).any(axis=1).all()


def test_a_box_is_said_to_hold_a_pole_or_to_lie_outside():
    boxes = np.array([[-2.0], [-1.5], [0.5], [1.5]]), np.array([[-1.5], [1.0], [0.6], [2.0]])
    regular, pole, outside = codes.REGULAR, codes.POLE, codes.OUTSIDE
    expected = {f(x): [outside, pole, regular, regular] for f in (sp.log, sp.sqrt)}
    expected |= {f(x): [outside, pole, regular, outside] for f in (sp.asin, sp.acos)}
    expected |= {1 / x: [regular, pole, regular, regular], sp.acosh(x): [outside, pole, outside, regular]}
    for f, states in expected.items():
        tape = Tape([f], [x], [])
        assert tape.slopes(tape.constants([]), np.zeros(4, dtype=np.int64), *boxes)[1].tolist() == states, f


def test_constants_are_enclosed():
    p = sp.Symbol("p", positive=True)
    tape = Tape([sp.pi * sp.sqrt(p) * x / 3], [x], [p])
    low, high = tape.constants([np.array([2.0, 7.0])])[:, 0].T
    for k, value in enumerate((2, 7)):
        with mpmath.workdps(40):
            assert low[k] <= mpmath.pi * mpmath.sqrt(value) / 3 <= high[k]
        assert high[k] - low[k] < 1e-13
