import mpmath
import numpy as np
import pytest
from numba import config
from scipy.integrate import solve_ivp

from kernels import direct, rigid_body


def reference(c, start, t):
    """The state after t by mpmath's own Taylor integrator, 30 digits."""
    with mpmath.workdps(30):
        c = [mpmath.mpf(float(x)) for x in c]
        solution = mpmath.odefun(
            lambda _, w: [c[0] * w[1] * w[2], c[1] * w[2] * w[0], c[2] * w[0] * w[1]], 0, [mpmath.mpf(x) for x in start]
        )
        return np.array([float(x) for x in solution(t)])


def test_order_is_ten():
    c, start = (0.5, -0.9, 0.6), (1.0, 0.3, 0.2)
    exact = reference(c, start, 4.0)
    counts = np.array([4, 5, 6, 7, 8])
    errors = []
    for n in counts:
        state, h = start, 4.0 / n
        for _ in range(n):
            state = direct.step(*state, *(k * h for k in c))
        errors.append(np.abs(np.array(state) - exact).max())
    order = -np.polyfit(np.log(counts), np.log(errors), 1)[0]
    assert abs(order - direct.ORDER) < 0.3


@pytest.mark.skipif(bool(config.DISABLE_JIT), reason="500 bodies in plain Python are slow")
def test_agrees_with_scipy_on_random_bodies():
    rng = np.random.default_rng(3)
    for _ in range(500):
        masses = rng.uniform(0, 1, 3)
        c = np.array(rigid_body.euler_coefficients(*(masses.sum() - masses)))
        angle, e2 = rng.uniform(0, 2 * np.pi), 1e-12
        times = np.linspace(0, 8 * np.pi, 5)
        # a perturbation of 1e-6, in its own unit, so that SciPy's tolerances are relative to it
        scaled = solve_ivp(
            lambda t, w, c=c, e2=e2: (c[0] * e2 * w[1] * w[2], c[1] * w[2] * w[0], c[2] * w[0] * w[1]),
            (0, times[-1]),
            [1.0, np.cos(angle), np.sin(angle)],
            method="DOP853",
            t_eval=times,
            rtol=1e-13,
            atol=1e-14,
        ).y.T
        start = [1.0, 1e-6 * np.cos(angle), 1e-6 * np.sin(angle)]
        ours = direct.rotation(masses.sum() - masses, start, times, 1e-10)
        size = np.maximum.accumulate(np.hypot(scaled[:, 1], scaled[:, 2]))
        error = np.hypot(ours[:, 1] * 1e6 - scaled[:, 1], ours[:, 2] * 1e6 - scaled[:, 2]) / size
        assert error.max() < 1e-10


def test_a_broken_coefficient_shows_in_the_perturbation_alone():
    c = rigid_body.euler_coefficients(3.0, 1.0, 2.0)
    drifts = {}
    for broken in (0.0, 1e-6):
        a, b, w = 1.0, 8e-7, 6e-7
        before = rigid_body.perturbation_invariant(b, w, c[1], c[2])
        energy = rigid_body.twice_energy(a, b, w, 3.0, 1.0, 2.0)
        drifts[broken] = 0.0
        for _ in range(64):
            h = 2 * np.pi / 16
            a, b, w = direct.step(a, b, w, c[0] * h, c[1] * (1 + broken) * h, c[2] * h)
            after = rigid_body.perturbation_invariant(b, w, c[1], c[2])
            drifts[broken] = max(drifts[broken], abs(after[0] - before[0]) / before[1])
        # energy sees nothing of it: the perturbation is 1e-12 of it
        assert abs(rigid_body.twice_energy(a, b, w, 3.0, 1.0, 2.0) / energy - 1) < 1e-9
    assert drifts[0.0] < 1e-10
    assert drifts[1e-6] > 1e-8


def test_rotation_in_any_order_and_backwards():
    moments, start = [1.0, 2.0, 3.0], [1e-3, 2.0, 1e-3]
    times = np.array([3.0, -1.5, 0.0, 1.0])
    c = rigid_body.euler_coefficients(*moments)
    ours = direct.rotation(moments, start, times, 1e-12)
    for t, row in zip(times, ours, strict=True):
        # backwards in time is forwards with the opposite coefficients
        backwards = tuple(np.sign(t) * x for x in c)
        expected = reference(backwards, start, abs(t)) if t else start
        np.testing.assert_allclose(row, expected, rtol=0, atol=1e-11)


@pytest.mark.parametrize(
    ("moments", "omega", "times"),
    [
        ([1, 2], [1, 0, 0], [0]),
        ([1, 2, -3], [1, 0, 0], [0]),
        ([1, 2, 3], [np.nan, 0, 0], [0]),
        ([1, 2, 3], [1, 0, 0], 0),
    ],
)
def test_rotation_says_what_is_wrong(moments, omega, times):
    with pytest.raises(ValueError, match="must"):
        direct.rotation(moments, omega, times, 1e-10)


def test_no_spin_stays():
    assert (direct.rotation([1, 2, 3], [0, 0, 0], [0.0, 1.0]) == 0).all()
