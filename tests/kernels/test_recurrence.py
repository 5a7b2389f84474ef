"""The recurrence of three terms against Jacobi's functions in thirty digits, and against the closed form."""

import mpmath as mp
import numpy as np
import pytest

from kernels.estimator import reduction
from kernels.free import exact, recurrence, rigid_body

BODIES = [(0.6, 1.0, 1.3), (1.3, 0.6, 1.0), (1.0, 1.3, 0.6), (1.0, 1.0, 1.7), (0.7, 1.0, 1.0 + 1e-9), (1.0, 1.0, 1.0)]


@pytest.mark.parametrize("middle", [0.0, 1e-12, 0.3, 0.5, 1.0])
def test_the_series_is_weierstrass_function(middle):
    # least and greatest X as far apart as a quarter, the most that the spacing allows; wp = e_3 + (e_1 - e_3) ns^2
    with mp.workdps(30):
        X = [mp.mpf(0), mp.mpf(middle) / 4, mp.mpf(1) / 4]
        e = sorted((sum(X) / 3 - x for x in X), reverse=True)
        p2 = e[0] - e[2]
        expected = e[2] + p2 / mp.ellipfun("sn", mp.sqrt(p2), m=(e[1] - e[2]) / p2) ** 2
        assert abs(1.0 + recurrence.weierstrass(*map(float, e)) - expected) < 2e-16  # roundings of numbers below 1/10


def iterate(moments, epsilon, start, h, n):
    """Samples (n + 1, 3), the transverse components in units of epsilon."""
    *steps, ga, gb, gc, q = recurrence.constants(moments, epsilon, start, h)
    state, samples = start, [start]
    for _ in range(n):
        state = tuple(x + dx for x, dx in zip(state, steps, strict=True))
        bend = recurrence.bend_factor(state[1], q)
        steps = [
            recurrence.next_difference(dx, x, g, bend) for dx, x, g in zip(steps, state, (ga, gb, gc), strict=True)
        ]
        samples.append(state)
    return np.array(samples)


@pytest.mark.parametrize("epsilon", [1e-12, 1e-6, 2e-6])
@pytest.mark.parametrize("moments", BODIES)
def test_it_is_the_closed_form(moments, epsilon):
    c, n = rigid_body.euler_coefficients(*moments), 96
    h = 0.5 / max(1.0, *map(abs, c))
    assert reduction.is_small(c[0], epsilon, n * h)
    for spin, phase in ((1.0, 0.6), (-1.0, 2.0), (1.0, 0.0)):
        start = (spin, np.cos(phase), np.sin(phase))
        unit = np.array([1.0, epsilon, epsilon])
        expected = exact.rotation(moments, start * unit, np.arange(n + 1) * h) / unit
        error = abs(iterate(moments, epsilon, start, h, n) - expected)
        largest = np.maximum.accumulate(np.hypot(expected[:, 1], expected[:, 2]))
        is_small = np.cumsum(largest > 1000.0) == 0
        assert error[is_small, 0].max() < 1e-14
        assert (error[is_small, 1:].max(1) / largest[is_small]).max() < 3e-14  # some two roundings a step, 96 steps


def test_what_does_not_turn_goes_straight():
    # a symmetric top spins about a transverse axis: a component stays and its neighbour drifts, both to the last bit
    samples = iterate((1.0, 1.0, 2.0), 0.0, (1.0, 1.0, 0.5), 0.25, 40)
    assert (samples[:, 0] == 1.0).all()
    assert (np.diff(samples[:, 1]) == 0.125).all()
    assert (samples[:, 2] == 0.5).all()
