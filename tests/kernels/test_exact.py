"""The closed form and the exact step against the differential equation, solved in high precision.

Two references that are not ours (``tests/precise.py``).  ``taylor`` integrates Euler's equations in 220-bit integers by
their Taylor series; it uses no elliptic function.  ``Textbook`` is the solution in the textbook's terms, L^2, 2E and a
starting phase, by mpmath at 50 digits; it reaches any time.  The first test compares them with each other.
"""

import itertools
import math
from fractions import Fraction

import mpmath as mp
import numpy as np
import precise
import pytest
import repeated
from naive import jacobi
from precise import Textbook, taylor
from scipy.spatial import cKDTree

from kernels.compile.fingerprint import sources
from kernels.free import direct, elliptic_constants, exact

ROUNDING = 2.0**-53
BODIES = list(itertools.permutations((0.7, 1.0, 1.25)))
SIGNS = list(itertools.product((1, -1), repeat=3))
STARTING = [(0.3, 0.9, 0.2), (1.0, 0.2, 0.4), (0.4, 0.3, 1.0)]  # each about another axis, most of all


def textbook(moments, start, t):
    return Textbook(moments, start)(t)


def sensitivity(moments, start, t):
    """Greatest effect on a component of one rounding of each input, over 2^-53."""
    return float(max(precise.sensitivity(textbook, moments, start, t)))


def distance(rows, expected):
    """Largest difference over all components, ``wanted`` in mpmath numbers."""
    return max(float(abs(a - b)) for x, y in zip(rows, expected, strict=True) for a, b in zip(x, y, strict=True))


def perturbed(axis, omega0, epsilon, phi):
    """The start (w_a, w_b, w_c) = omega0 (1, epsilon cos phi, epsilon sin phi), in axis order."""
    start = np.zeros(3)
    start[[axis, (axis + 1) % 3, (axis + 2) % 3]] = (
        omega0,
        omega0 * epsilon * np.cos(phi),
        omega0 * epsilon * np.sin(phi),
    )
    return start


def step_constants(top, h):
    """Coefficients of the exact step of any length below 0.9 K."""
    h *= top.unit
    at_half = jacobi(0.5 * top.p * h, top.m, top.m1)
    return tuple(
        q / top.unit for q in elliptic_constants.by_axis(top.axes, *exact.step_coefficients(top.c, top.p, h, *at_half))
    )


def take_steps(moments, start, h, steps):
    """Take steps in plain Python: compiling a loop would take longer than all steps."""
    q = step_constants(exact.set_up(*moments, *start), h)
    out = [tuple(map(float, start))]
    for _ in range(steps):
        out.append(exact.step(*out[-1], *q))
    return np.array(out)


@pytest.fixture(autouse=True)
def fifty_digits():
    with mp.workdps(50):
        yield


# ---- the references ----


def test_the_two_references_agree():
    for moments, start in zip(BODIES, SIGNS, strict=False):
        start = np.array([0.4, 0.9, 0.5]) * start
        expected = taylor(moments, start, [3.0], order=64)
        assert distance([textbook(moments, start, 3.0)], expected) < 1e-47


# ---- the closed form ----


@pytest.mark.parametrize(
    "case", repeated.but(list(zip(BODIES, STARTING * 2, strict=True)), list(itertools.product(BODIES, STARTING)))
)
def test_every_order_of_axes_and_every_sign_solves_eulers_equations(case):
    moments, start = case
    for signs in SIGNS:
        begin = np.array(start) * signs
        motion = exact.rotation(moments, begin, [4.0])
        # 1e-15 (1 + |w| t + p t) max|w| with |w| t, p t <= 4.4
        assert distance(motion, taylor(moments, begin, [4.0], order=28)) < 1e-14


def test_any_time_up_to_ten_thousand_rotations():
    rng = np.random.default_rng(3)
    count = 0
    while count < 60:
        moments = rng.uniform(0.3, 1.5, 3) if count % 2 else 10.0 ** rng.uniform(-3, 3, 3)
        start = rng.normal(size=3) * 10.0 ** rng.uniform(-3, 3) * 10.0 ** rng.uniform(-4, 0, 3)
        size = np.linalg.norm(start)
        t = rng.choice([-1, 1]) * 2 * np.pi / size * 10.0 ** rng.uniform(-1, 4)
        top = exact.set_up(*moments, *start)
        p = top.p * top.unit
        if top.m1 <= 1e-6:
            continue
        count += 1
        error = distance(exact.rotation(moments, start, [t]), [textbook(moments, start, t)])
        bar = 1e-15 * (1 + size * abs(t) + p * abs(t)) * abs(start).max()
        if error > bar:  # the inputs' own roundings move the solution by more
            bar = 50 * ROUNDING * sensitivity(moments, start, t)
        assert error <= bar, (moments, start, t)


def near_separatrix(rng, offset, spread):
    moments = np.exp(rng.uniform(-spread, spread, 3))
    low, middle, high = np.argsort(moments)
    ratio = moments[low] * (moments[middle] - moments[low]) / (moments[high] * (moments[high] - moments[middle]))
    start = rng.normal(size=3)
    start[high] = np.sqrt(ratio) * start[low] * (1 + offset)
    return moments, start


@pytest.mark.parametrize("exponent", repeated.but((-15, -11, -6), range(-15, -5)))
def test_near_the_separatrix(exponent):
    rng = np.random.default_rng(-exponent)
    count = 0
    for sign in (-1, 1) * 8:
        moments, start = near_separatrix(rng, sign * 10.0**exponent, spread=0.3)
        m1 = exact.set_up(*moments, *start).m1
        if not 0.0 < m1 <= 1e-6:
            continue
        count += 1
        theirs = Textbook(moments, start)
        assert abs(m1 / theirs.m1 - 1) < 2e-15  # some eight roundings after an exact difference
        times = 2 * np.pi / np.linalg.norm(start) * np.array([1.0, 7.0, 20.0])
        error = distance(exact.rotation(moments, start, times), [theirs(t) for t in times])
        assert error <= 1e-13 * abs(start).max()  # the bar is 1e-10; p t reaches 100
    assert count >= 2


def test_the_difference_from_the_separatrix_is_exact():
    rng = np.random.default_rng(5)
    for exponent in range(-16, -2):
        moments, start = near_separatrix(rng, 10.0**exponent, spread=2.0)  # differences that round
        (low, middle, high), (w_low, w_high) = np.sort(moments), start[[np.argmin(moments), np.argmax(moments)]]
        a, b, c, x, y = (Fraction(v) for v in (low, middle, high, w_low, w_high))
        expected = c * (c - b) * y**2 - a * (b - a) * x**2
        motion = elliptic_constants.separatrix_offset(low, middle, high, w_low, w_high)
        assert abs(Fraction(motion) - expected) <= abs(expected) * Fraction(1e-15)  # rounded once


def test_on_the_separatrix_itself():
    moments, start = (1.0, 2.0, 2.25), (3.0, 5.0, 4.0)  # 2.25 (2.25 - 2) 4^2 = 1 (2 - 1) 3^2
    assert exact.set_up(*moments, *start)[1:3] == (1.0, 0.0)
    times = np.array([0.1, 1.0, 3.0, 6.0])
    motion, expected = exact.rotation(moments, start, times), taylor(moments, start, times)
    assert distance(motion, expected) < 1e-14  # max|w| = 7 and p t = 20, but the motion contracts
    for axis in (0, 2):  # the decaying components keep their relative digits
        assert all(abs(a[axis] / b[axis] - 1) < 2e-14 for a, b in zip(motion, expected, strict=True))
    # dw2/dt > 0 here: from -A_s to A_s; A_s^2 = 5^2 + 3^2 (I3 - I1) I1/(I2 (I3 - I2)) = 47.5
    ends = exact.rotation(moments, start, [-1e3, 1e3, 1e8])
    assert ends == pytest.approx(np.array([[0, -1, 0], [0, 1, 0], [0, 1, 0]]) * math.sqrt(47.5), rel=1e-15)


@pytest.mark.parametrize("moments", [*BODIES, (1.0, 1.0, 1.0), (1.0, 1.0, 2.0), (2.0, 1.0, 2.0), (1.0, 2.0, 3.0)])
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_an_exact_spin_stays(moments, axis):
    start = np.zeros(3)
    start[axis] = -1.3
    motion = exact.rotation(moments, start, [0.0, 1.0, 1e3, 1e6])
    assert np.delete(motion, axis, 1).tolist() == [[0.0, 0.0]] * 4
    assert motion[:, axis] == pytest.approx(-1.3, rel=1e-15)  # cos^2 + sin^2 to a few roundings


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("epsilon", [1e-12, 1e-6])
def test_a_perturbation_keeps_its_relative_digits(axis, epsilon):
    times = 2 * np.pi / 1.7 * np.array([0.25, 1.0, 2.0, 3.0, 4.0])
    across = [(axis + 1) % 3, (axis + 2) % 3]
    for moments, phi in zip(BODIES, (0.6, 2.5, 4.0) * 2, strict=True):
        start = perturbed(axis, 1.7, epsilon, phi)
        motion = exact.rotation(moments, start, times)
        with mp.workdps(80):
            expected = np.array([textbook(moments, start, t) for t in times])
        size = np.hypot(*expected[:, across].astype(float).T)
        largest = np.maximum.accumulate([np.hypot(*start[across]), *size])[1:]
        error = abs(motion - expected).astype(float)[:, across].max(1)
        assert (error / largest).max() < 3e-14  # the bar is 1e-12; roundings of p t = 15 grow no further


def test_a_perturbation_grows_though_its_square_underflows():
    # 1 - m is 0 in doubles; the linear solution is the true one to epsilon^2
    epsilon, t, rate = 1e-200, 40.0, mp.sqrt(mp.mpf(1) / 3)
    w1, w2, w3 = exact.rotation((1.0, 2.0, 3.0), (epsilon, 1.0, 0.0), [t])[0]
    assert w2 == pytest.approx(1.0, rel=1e-15)
    assert abs(w1 / (epsilon * mp.cosh(rate * t)) - 1) < 2e-14  # roundings of p t = 23
    assert abs(w3 / (-rate * epsilon * mp.sinh(rate * t)) - 1) < 2e-14


UP, UP2 = np.nextafter(1.0, 2.0), np.nextafter(2.0, 3.0)
DEGENERATE = {
    "oblate": (1.0, 1.0, 1.7),
    "prolate": (2.0, 2.0, 1.1),
    "oblate, one ulp": (1.0, UP, 1.7),
    "prolate, one ulp": (2.0, UP2, 1.1),
    "oblate, 1e-9": (1.0, 1.0 + 1e-9, 1.7),
    "prolate, 1e-9": (2.0, 2.0 * (1 + 1e-9), 1.1),
    "sphere": (1.0, 1.0, 1.0),
    "sphere, one ulp": (1.0, UP, 1.0),
    "sphere, 1e-9": (1.0, 1.0 + 1e-9, 1.0 + 2e-9),
    "rod": (1.0, 1.0, 1e-12),
    "rod of two widths": (1.0, 1.0 + 5e-13, 1e-12),
    "plate": (0.3, 0.5, 0.8),
    "disc": (1.0, 1.0, 2.0),
}
QUICK = ("oblate", "prolate, one ulp", "sphere, 1e-9", "rod of two widths", "plate")
STARTS = [
    (0.3, 0.7, -0.5),
    (1.0, 1e-6, 1e-6),
    (1e-6, 1.0, 1e-6),
    (1e-12, -1e-12, 1.0),
    (1.0, 1.0, 0.0),
    (0.0, 1.0, 1.0),
]


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("name", repeated.but(QUICK, DEGENERATE))
def test_degenerate_bodies(name):
    times = np.array([0.0, 2.0, 6.0])
    a, b, c = DEGENERATE[name]
    orders = [(a, b, c), (b, c, a), (c, b, a)]
    for moments, start in [(order, start) for k, order in enumerate(orders) for start in STARTS[k % 2 :: 2]]:
        motion = exact.rotation(moments, start, times)
        assert distance(motion, taylor(moments, start, times, order=26)) < 1.3e-14  # 1e-15 (1 + 6 + 6)


@pytest.mark.parametrize("moment_unit", [2.0**-996, 2.0**530, 2.0**990])
@pytest.mark.parametrize("rate_unit", [2.0**-498, 2.0**498])
def test_units_change_nothing(moment_unit, rate_unit):
    moments, start = np.array([1.0, 1.7, 2.3]), np.array([0.3, 1e-6, -0.8])
    times = np.array([-3.0, 0.1, 50.0])
    plain = exact.rotation(moments, start, times)
    in_units = exact.rotation(moments * moment_unit, start * rate_unit, times / rate_unit)
    assert (in_units == plain * rate_unit).all()  # powers of two: to the bit
    for axis in (1, 2, 3):
        tilt = exact.max_tilt(exact.set_up(*(moments * moment_unit), *(start * rate_unit)), axis)
        assert tilt == exact.max_tilt(exact.set_up(*moments, *start), axis)


@pytest.mark.parametrize("rotation", [exact.rotation, direct.rotation])
@pytest.mark.parametrize(("moments", "start", "times", "name"), [
    *((moments, (1, 1, 1), [0], "moments") for moments in ((1, 2), (1, 2, 0), (1, 2, -3), (1, 2, np.inf))),
    *(((1, 2, 3), start, [0], "omega_start") for start in ((1, np.nan, 1), (1, 1), [[1, 0, 0]])),
    ((1, 2, 3), (1, 1, 1), 0.0, "times"), ((1, 2, 3), (1, 1, 1), [np.inf], "times"),
])  # fmt: skip
def test_what_is_no_rotation_is_refused(rotation, moments, start, times, name):
    with pytest.raises(ValueError, match=f"{name} must be"):
        rotation(moments, start, times)


# ---- the exact step ----


@pytest.mark.parametrize("epsilon", [1e-12, 1e-6, 1e-2, 0.5])
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_the_step_is_the_closed_form_over_the_default_run(epsilon, axis):
    h, across = 2 * np.pi / 16, [(axis + 1) % 3, (axis + 2) % 3]
    for moments in BODIES:
        start = perturbed(axis, 1.0, epsilon, 0.6)
        motion, expected = take_steps(moments, start, h, 64), exact.rotation(moments, start, np.arange(65) * h)
        largest = np.maximum.accumulate(np.hypot(*expected[:, across].T))
        error = abs(motion - expected)
        assert error.max() < 1e-13  # the bar is 1e-12; some ten roundings a step, 64 steps
        assert (error[:, across].max(1) / largest).max() < 1e-13


@pytest.mark.parametrize("share", [1e-3, 1e-2, 0.1, 0.5, 0.9])
def test_a_thousand_steps_of_any_length(share):
    # Each rounding of the state moves it to a neighbouring trajectory with a period that differs as 1/m1: the bar is
    # constant down to m1 = 0.05, and grows as 1/m1 below.
    rng = np.random.default_rng(7)
    for _ in range(20):
        moments, start = rng.uniform(0.3, 1.5, 3), rng.normal(size=3)
        top = exact.set_up(*moments, *start)
        m1, h = top.m1, share * exact.flip_period(top)
        motion, expected = take_steps(moments, start, h, 1000), exact.rotation(moments, start, np.arange(1001) * h)
        bar = 1e-10 * max(1.0, 0.05 / m1)
        assert abs(motion - expected).max() <= bar * abs(start).max(), (moments, start)


@pytest.mark.parametrize("moments", BODIES)
def test_the_same_code_is_exact_in_thirty_digits(moments):
    step, coefficients = (getattr(f, "py_func", f) for f in (exact.step, exact.step_coefficients))
    with mp.workdps(30):
        for start in ((0.3, 0.9, -0.2), (-1.0, 0.2, 0.4)):
            theirs, h = Textbook(moments, start), mp.mpf("0.9")
            I1, I2, I3 = (mp.mpf(x) for x in moments)
            c = ((I2 - I3) / I1, (I3 - I1) / I2, (I1 - I2) / I3)
            at_half = [mp.ellipfun(name, theirs.p * h / 2, m=theirs.m) for name in ("sn", "cn", "dn")]
            by_role = coefficients([c[i] for i in theirs.roles], theirs.p, h, *at_half)
            q = [by_role[theirs.roles.index(axis)] for axis in range(3)]
            w = [mp.mpf(x) for x in start]
            for _ in range(20):
                w = step(*w, *q)
            assert distance([w], [theirs(20 * h)]) <= 1e-25


def test_step_constants_where_nothing_turns():
    # secular drift of a symmetric top about a transverse axis: the step must be the straight line, exactly
    q = step_constants(exact.set_up(1.0, 1.0, 2.0, 1.0, 0.0, 0.0), 0.3)
    assert exact.step(1.0, 0.0, 0.0, *q) == (1.0, 0.0, 0.0)
    assert q == (-0.15, 0.15, 0.0)


def test_the_short_constants_agree():
    rng = np.random.default_rng(8)
    for _ in range(200):
        moments, start = rng.uniform(0.3, 1.5, 3), rng.normal(size=3)
        top = exact.set_up(*moments, *start)
        h = rng.uniform(-1, 1) / (top.p * top.unit)
        expected = step_constants(top, h)
        motion = exact.short_step_constants(tuple(moments), tuple(start), h)
        assert motion == pytest.approx(expected, rel=3e-15)  # 1e-15 a function


# ---- properties of a trajectory ----


def drawn_trajectories(count, seed):
    rng = np.random.default_rng(seed)
    for _ in range(count):
        yield rng.uniform(0.5, 1.4, 3), rng.normal(size=3) * 10.0 ** rng.uniform(-3, 0, 3)


def test_constants_and_periods_of_a_trajectory():
    for moments, start in drawn_trajectories(60, 9):
        theirs = Textbook(moments, start)
        expected, top = 4 * theirs.K / theirs.p, exact.set_up(*moments, *start)
        # some eight roundings each, after the differences of the moments
        assert abs(top.p * top.unit / theirs.p - 1) < 1e-15
        assert abs(top.m / theirs.m - 1) < 2e-15
        assert abs(top.m1 / theirs.m1 - 1) < 2e-15
        assert top.axes == tuple(i + 1 for i in theirs.roles)
        for motion, amplitude in zip(exact.amplitudes(top), theirs.amplitudes, strict=True):
            assert abs(motion * top.unit / amplitude - 1) < 1e-15
        # m1's eight roundings count for at most a quarter of theirs in K
        assert abs(exact.period(top) / expected - 1) < 2e-15
        assert abs(exact.flip_period(top) / (expected / 2) - 1) < 2e-15
        assert abs(exact.frequency(top) * expected / (2 * mp.pi) - 1) < 2e-15
        with mp.workdps(30):
            assert distance([theirs(expected)], [start]) < 1e-25


@pytest.mark.compiled
def test_no_herpolhode_of_a_body_that_can_exist_has_an_inflexion():
    """Hess and de Sparre. The curvature's sign is that of L . (w' x (w'' + w x w')), w' and w'' in the body."""
    rng = np.random.default_rng(2)
    second = rng.uniform(0.0, 1.0, (200, 3))
    bodies = second.sum(axis=1, keepdims=True) - second
    assert not any(_inflects(moments, rng.normal(size=3)) for moments in bodies)
    assert any(_inflects(np.array([1.0, 1.3, rng.uniform(2.8, 4.0)]), rng.normal(size=3)) for _ in range(200))


def _inflects(moments, start):
    period = exact.period(exact.set_up(*moments, *start))
    w = exact.rotation(moments, start, np.linspace(0.0, period, 256))
    c = (np.roll(moments, -1) - np.roll(moments, -2)) / moments
    d = c * np.roll(w, -1, axis=1) * np.roll(w, -2, axis=1)
    dd = c * (np.roll(d, -1, axis=1) * np.roll(w, -2, axis=1) + np.roll(w, -1, axis=1) * np.roll(d, -2, axis=1))
    bend = np.einsum("ni,ni->n", moments * w, np.cross(d, dd + np.cross(w, d)))
    return bend.min() < -1e-12 * abs(bend).max() and bend.max() > 1e-12 * abs(bend).max()


STEADY = [
    ((1.0, 2.0, 3.0), (0.0, 1.0, 0.0)),  # an exact spin about the middle axis
    ((1.0, 1.0, 1.0), (0.3, 0.2, 0.1)),  # a sphere
    ((1.0, 1.0, 2.0), (0.6, 0.8, 0.0)),  # a symmetric top about a transverse axis
    ((1.0, 2.0, 3.0), (0.0, 0.0, 0.0)),
]


@pytest.mark.parametrize(("moments", "start"), [*STEADY, ((1.0, 2.0, 2.25), (3.0, 5.0, 4.0))])  # the separatrix
def test_what_never_returns_has_an_infinite_period(moments, start):
    top = exact.set_up(*moments, *start)
    assert exact.period(top) == exact.flip_period(top) == math.inf
    assert exact.frequency(top) == 0.0


def test_frequencies_of_an_exact_spin_and_of_a_symmetric_top():
    # Small perturbations turn at w3 sqrt((I3 - I1)(I3 - I2)/(I1 I2)), the top precesses at (I3 - I1)/I1 w3.
    assert exact.frequency(exact.set_up(1.0, 2.0, 3.0, 0.0, 0.0, 1.5)) == pytest.approx(1.5, rel=1e-15)
    assert exact.frequency(exact.set_up(1.0, 1.0, 1.7, 0.3, 0.4, -0.9)) == pytest.approx(0.7 * 0.9, rel=1e-15)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_the_largest_tilt_is_reached_and_not_passed(axis):
    slender = np.array([0.1, 0.5, 1.0]), np.array([0.2, 0.1, 1.0])  # tilts most towards its axis of least moment
    for moments, start in (*drawn_trajectories(8, 12), slender):
        theirs = Textbook(moments, start)
        end = -1 if start[axis] < 0 else 1

        def tilt(w, end=end):
            return mp.acos(end * w[axis] / mp.sqrt(sum(x**2 for x in w)))

        motion = exact.max_tilt(exact.set_up(*moments, *start), axis + 1)
        quarters = [theirs((n * theirs.K - theirs.u0) / theirs.p) for n in range(4)]
        assert motion == pytest.approx(float(max(tilt(w) for w in quarters)), rel=4e-15)  # some ten roundings
        between = [theirs((n * theirs.K / 3 - theirs.u0) / theirs.p) for n in range(12) if n % 3]
        assert all(float(tilt(w)) <= motion * (1 + 4e-15) for w in between)


def test_a_small_tilt_keeps_its_relative_digits():
    moments, start = (0.7, 1.0, 1.25), perturbed(2, 3.0, 1e-12, 0.6)
    with mp.workdps(80):
        theirs = Textbook(moments, start)
        expected = max(abs(theirs.amplitudes[0]), theirs.amplitudes[1]) / abs(theirs.amplitudes[2])
    assert exact.max_tilt(exact.set_up(*moments, *start), 3) == pytest.approx(float(expected), rel=1e-15)


@pytest.mark.parametrize(
    ("moments", "start", "tilts"),
    [
        # a body at rest keeps its angles to the three axes
        ((1, 2, 3), (0, -2, 0), (np.pi / 2, 0, np.pi / 2)),
        ((1, 1, 1), (2, -3, 6), (math.acos(2 / 7), math.acos(3 / 7), math.acos(6 / 7))),
        ((1, 2, 3), (0, 0, 0), (0, 0, 0)),
        # a symmetric top: w3 stays, (w1, w2) turns
        ((1, 1, 2), (0, 3, 4), (np.pi - math.atan2(4, 3), np.pi - math.atan2(4, 3), math.atan2(3, 4))),
        # the separatrix: cn and dn keep their signs, and w comes to lie on the middle axis
        ((1, 2, 2.25), (3, 0, -4), (np.pi / 2, np.pi, np.pi / 2)),
        ((1, 2, 2.25), (-3, 0, 4), (np.pi / 2, np.pi, np.pi / 2)),
    ],
)
def test_tilts_where_formulas_end(moments, start, tilts):
    top = exact.set_up(*map(float, moments), *map(float, start))
    assert [exact.max_tilt(top, axis) for axis in (1, 2, 3)] == pytest.approx(tilts, rel=1e-15)


# ---- the polhode ----


def off_the_ellipsoids(moments, start, curve):
    """Largest relative distance of a curve from the two ellipsoids of a start, 2E and L^2."""
    return max(abs(curve**2 @ moments**power / (start**2 @ moments**power) - 1).max() for power in (1, 2))


def test_a_polhode_lies_on_both_ellipsoids_and_closes():
    for moments, start in drawn_trajectories(60, 13):
        curve = exact.polhode(moments, start, 97)
        assert curve.shape == (97, 3)
        assert off_the_ellipsoids(moments, start, curve) < 4e-15  # some ten roundings
        np.testing.assert_array_equal(curve[[0, -1]], [start, start])
        assert (curve[1] - start) @ (np.cross(moments * start, start) / moments) > 0  # the way of the motion
        _, _, d = exact.set_up(*moments, *start).axes
        b, c = curve[:, d % 3], curve[:, (d + 1) % 3]
        assert (curve[:, d - 1] * start[d - 1] > 0).all()
        turns = np.unwrap(np.arctan2(c, b))
        assert abs(turns[-1] - turns[0]) == pytest.approx(2 * np.pi, rel=1e-14)
        assert (np.diff(turns) * (turns[-1] - turns[0]) > 0).all()


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_small_polhode_keeps_its_own_invariant(axis):
    for moments in BODIES:
        start = perturbed(axis, 3.0, 1e-9, 0.6)
        curve = exact.polhode(moments, start, 33)
        a, b, c = (np.roll(moments, -axis)[i] for i in range(3))
        terms = (np.roll(curve, -axis, axis=1) ** 2)[:, 1:] * [b * (b - a), c * (c - a)]
        invariant, scale = terms.sum(axis=1), abs(terms).sum(axis=1)
        assert (abs(invariant - invariant[0]) < 8e-15 * scale).all()  # some ten roundings, whatever the nudge


@pytest.mark.parametrize(("moments", "start"), [*STEADY, ((1.0, 2.0, 3.0), (0.0, 0.0, 1.5))])
def test_the_polhode_of_what_stands_still_is_a_point(moments, start):
    assert exact.polhode(moments, start, 5).tolist() == [list(start)] * 5


@pytest.mark.parametrize("moments", [(1.0, 1.0, 1.7), (2.0, 2.0, 1.1), (1.0, UP, 1.7), (1.0, 1.0, 1e-12)])
def test_the_polhode_of_a_symmetric_top_is_a_circle(moments):
    curve = exact.polhode(moments, (0.3, -0.4, 0.9), 41)
    assert np.hypot(curve[:, 0], curve[:, 1]) == pytest.approx(0.5, rel=1e-15)
    assert curve[:, 2] == pytest.approx(0.9, rel=1e-15)
    assert np.linalg.norm(np.diff(curve, axis=0), axis=1) == pytest.approx(np.sin(np.pi / 40), rel=1e-14)


def test_on_the_separatrix_the_polhode_is_one_branch():
    moments = np.array([1.0, 2.0, 2.25])
    curves = {}
    for start in itertools.product((3.0, -3.0), (5.0,), (4.0, -4.0)):
        start = np.array(start)
        curve = exact.polhode(moments, start, 801)
        assert off_the_ellipsoids(moments, start, curve) < 4e-15
        # w3/w1 = 4/3 or -4/3 all round: a plane; and the middle axis is reached at both ends, sqrt(47.5)
        assert curve[:, 2] * start[0] == pytest.approx(curve[:, 0] * start[2], abs=1e-13)
        assert abs(curve[:, 1]).max() == pytest.approx(math.sqrt(47.5), rel=1e-5)  # half a step, pi/800
        curves[*np.sign(start)] = curve
        # the motion itself is on it, on the side of its start
        path = exact.rotation(moments, start, np.linspace(-3, 3, 50))
        assert cKDTree(curve).query(path)[0].max() < 0.51 * np.linalg.norm(np.diff(curve, axis=0), axis=1).max()
    assert cKDTree(curves[1, 1, 1]).query(curves[-1, 1, -1])[0].max() < 0.06  # the same ellipse
    assert cKDTree(curves[1, 1, 1]).query(curves[1, 1, -1])[0].max() > 4


@pytest.mark.parametrize("n", [1, 0, 2.0, True, None])
def test_a_polhode_wants_a_number_of_points(n):
    with pytest.raises(ValueError, match="n must be"):
        exact.polhode((1.0, 2.0, 3.0), (1.0, 1.0, 1.0), n)


def test_the_exact_solution_shares_nothing_with_the_direct_integrator():
    ours, theirs, package = (
        {path.stem for path in sources(name)} for name in ("free.exact", "free.direct", "compile.jit")
    )
    assert (
        ours & theirs
        == package | {"llvm_formulas", "blocks"}
        == {"__init__", "fingerprint", "cache", "jit", "llvm_formulas", "blocks"}
    )


def test_what_stands_still_is_what_has_no_torque_of_its_own():
    for moments in ((1.0, 2.0, 2.5), (2.0, 2.0, 2.5), (1.0, 2.0, 2.0), (2.0, 1.0, 2.0), (2.0, 2.0, 2.0)):
        c = elliptic_constants.coefficients(*moments)
        for start in itertools.product((0.0, 1.0, -0.5), repeat=3):
            torque = np.cross(np.multiply(moments, start), start)
            assert elliptic_constants.is_stationary(c, start) == (not torque.any()), (moments, start)
