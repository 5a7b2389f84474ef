"""Elliptic functions and integrals against mpmath, at both ends of the parameter."""

import math
from fractions import Fraction

import mpmath as mp
import numpy as np
import pytest
import repeated
from naive import jacobi

from kernels.free import elliptic

SMALL = [0.0, *(10.0**-k for k in (300, 200, 100, 40, 30, 20, 16, 14, 12, 9, 6, 4, 3, 2, 1)), 0.3, 0.5]
PARAMETERS = [(x, 1.0 - x) for x in SMALL] + [(1.0 - x, x) for x in SMALL]
BAR = 4e-16  # absolute, times 1 + |u|: two units in the last place of one, and of the argument


def real_ellipfun(u, m, m1):
    """(sn, cn, dn) by mpmath; the smaller of m and m1 counts.  Jacobi's imaginary transformation near m = 1."""
    u = mp.mpf(u)
    if m1 == 0.0:
        return mp.tanh(u), mp.sech(u), mp.sech(u)
    if m <= 0.5:
        return tuple(mp.ellipfun(name, u, m=mp.mpf(m)) for name in ("sn", "cn", "dn"))
    with mp.workdps(int(40 - 1.5 * mp.log10(m1))):
        half = 2 * quarter_period(m, m1)
        turns = mp.nint(u / half)
        sn, cn, dn = (mp.ellipfun(name, 1j * (u - turns * half), m=mp.mpf(m1)) for name in ("sn", "cn", "dn"))
        sign = (-1) ** int(turns)
        return sign * (sn / cn).imag, sign * (1 / cn).real, (dn / cn).real


def quarter_period(m, m1):
    if m <= 0.5:
        return mp.ellipk(mp.mpf(m))
    return mp.pi / 2 / mp.agm(1, mp.sqrt(mp.mpf(m1)))


def arguments(m, m1, rng):
    near_zero_and_large = rng.choice([-1.0, 1.0], 8) * 10.0 ** rng.uniform([-12, -6, -2, 0, 0, 1, 2, 3], 5)
    ordinary = rng.uniform(-4.0, 4.0, 6)
    if m1 == 0.0:
        return [0.0, *ordinary, *near_zero_and_large, 800.0, -1e4]
    K = elliptic.K(m, m1)
    return [0.0, *ordinary, *near_zero_and_large, *(K * np.array([0.5, 0.99999, 1, 1.00001, 1.5, 2, -3, 4, 41]))]


@pytest.fixture(autouse=True)
def forty_digits():
    with mp.workdps(40):
        yield


@pytest.fixture(scope="module", params=repeated.but([0], range(4)))
def table(request):
    """Rows (u, m, m1, ours, mpmath's) over both ends of the parameter and all sizes of argument, every fourth."""
    rng = np.random.default_rng(1)
    random_parameters = [(x, 1.0 - x) for x in rng.random(8)][:4]
    with mp.workdps(40):
        return [
            (u, m, m1, jacobi(u, m, m1), real_ellipfun(u, m, m1))
            for m, m1 in PARAMETERS + random_parameters
            for u in map(float, arguments(m, m1, rng)[request.param :: 4])
        ]


def test_jacobi_is_right_to_two_roundings(table):
    for u, m, m1, ours, theirs in table:
        for value, expected in zip(ours, theirs, strict=True):
            assert abs(value - expected) <= BAR * (1.0 + abs(u)), (u, m, m1)


def test_small_values_keep_their_relative_digits(table):
    # Some ten roundings of the recurrence, and those of sin and cos of u reduced to [-K, K].  cn crosses zero
    # where dn is least, so its scale is dn; sn is small of itself only while |u| < K.
    for u, m, m1, (sn, cn, dn), theirs in table:
        if m1 == 0.0 and abs(u) > 700.0:  # underflow
            continue
        reach = min(abs(u), elliptic.K(m, m1))
        bar = 12e-16 + 4e-16 * reach
        assert abs(dn - theirs[2]) <= bar * theirs[2], (u, m, m1)
        assert abs(cn - theirs[1]) <= bar * theirs[2], (u, m, m1)
        if reach == abs(u):
            assert abs(sn - theirs[0]) <= 9e-16 * abs(theirs[0]) + 1e-40, (u, m, m1)


def test_jacobi_is_odd_and_even_to_the_bit(table):
    for u, m, m1, (sn, cn, dn), _ in table:
        assert jacobi(-u, m, m1) == (-sn, cn, dn)


def test_jacobi_far_past_the_separatrix_is_finite():
    assert jacobi(1e5, 1.0, 0.0) == (1.0, 0.0, 0.0)
    assert np.isfinite(jacobi(1e12, 1.0, 5e-324)).all()


def test_jacobi_short_agrees_on_its_range():
    rng = np.random.default_rng(2)
    for u in [0.5, -0.5, 1e-9, *rng.uniform(-0.5, 0.5, 60)]:
        for m in [0.0, 1.0, float(rng.random())]:
            expected = real_ellipfun(u, m, 1.0 - m)
            for result, value in zip(elliptic.jacobi_short(u, m), expected, strict=True):
                assert abs(result - value) <= 1e-15 * abs(value)  # three duplications, some nine roundings


def test_complete_integral():
    for m, m1 in PARAMETERS:
        if m1 > 0.0:
            expected = quarter_period(m, m1)
            assert abs(elliptic.K(m, m1) - expected) <= 3e-16 * expected  # two roundings and that of pi/2
    assert elliptic.K(1.0, 0.0) == math.inf


def test_double_doubles_are_exact():
    rng = np.random.default_rng(4)
    for x, y in rng.normal(size=(200, 2)) * 10.0 ** rng.uniform(-20, 20, (200, 2)):
        s, e = elliptic.two_sum(x, y)
        assert Fraction(s) + Fraction(e) == Fraction(x) + Fraction(y)
        r, e = elliptic.two_product(x, y)
        assert Fraction(r) + Fraction(e) == Fraction(x) * Fraction(y)
        h, e = elliptic.double_product(x, 1e-17 * x, y, -1e-17 * y)
        expected = (Fraction(x) + Fraction(1e-17 * x)) * (Fraction(y) + Fraction(-1e-17 * y))
        assert abs(Fraction(h) + Fraction(e) - expected) <= abs(expected) * Fraction(2) ** -100
        h, e = elliptic.double_sqrt(abs(x), 1e-17 * abs(x))
        expected = Fraction(abs(x)) + Fraction(1e-17 * abs(x))
        assert abs((Fraction(h) + Fraction(e)) ** 2 - expected) <= expected * Fraction(2) ** -98
