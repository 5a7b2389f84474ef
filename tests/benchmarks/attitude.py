"""How fast the attitude is: the exact step beside that of the angular velocity, and both beside Carlson's integrals.

    python tests/benchmarks/attitude.py [--quick]

One process, user time, the least of several rounds taken in turn, so that a busy machine moves all alike.
"""

import argparse
import math

import numpy as np
from numba import njit
from scipy.special import ellipj, ellipk, elliprf, elliprj
from timing import least

from kernels import attitude, exact, rigid_body, tumbling
from kernels.blocks import W
from kernels.jit import OPTIONS

MOMENTS, START = (1.0, 2.0, 3.0), (0.1, 0.2, 1.0)
STEP = 0.3


# Rows of one array, W lanes each: the loops over lanes are packed only where nothing can overlap.
MD, MJ, MK, CD, CJ, CK, R0, RD, RJ, RK, SIZE, X0, XD, XDD, XJK, Y0, YD, YDD, YJK, Q0, QD, QJ, QK = (
    W * row for row in range(23)
)


@njit(**OPTIONS)
def step_rates(S, n):
    """Exact steps of the angular velocity alone (of its direction of L), W lanes side by side."""
    for _ in range(n):
        for i in range(W):
            S[MD + i], S[MJ + i], S[MK + i] = exact.step(
                S[MD + i], S[MJ + i], S[MK + i], S[CD + i], S[CJ + i], S[CK + i]
            )


@njit(**OPTIONS)
def step_attitudes(S, n):
    """The same with the attitude: step, landing and a unit quaternion each time."""
    for _ in range(n):
        for i in range(W):
            m_d, m_j, m_k = S[MD + i], S[MJ + i], S[MK + i]
            r0, rd, rj, rk = attitude.step(
                (m_d, m_j, m_k),
                (S[R0 + i], S[RD + i], S[RJ + i], S[RK + i]),
                S[SIZE + i],
                (S[X0 + i], S[XD + i], S[XDD + i], S[XJK + i]),
                (S[Y0 + i], S[YD + i], S[YDD + i], S[YJK + i]),
            )
            S[R0 + i], S[RD + i], S[RJ + i], S[RK + i] = r0, rd, rj, rk
            S[MD + i], S[MJ + i], S[MK + i] = exact.step(m_d, m_j, m_k, S[CD + i], S[CJ + i], S[CK + i])
        for i in range(W):
            S[Q0 + i], S[QD + i], S[QJ + i], S[QK + i], S[SIZE + i] = attitude.land(
                (S[MD + i], S[MJ + i], S[MK + i]), (S[R0 + i], S[RD + i], S[RJ + i], S[RK + i])
            )


def prepared():
    """The array of both loops."""
    d, turned, g, x, y = attitude.short_step_constants(MOMENTS, START, STEP)
    q = exact.short_step_constants(MOMENTS, START, STEP)
    c = attitude.of_direction(rigid_body.relabel(*q, d), g)
    m = np.array(rigid_body.relabel(*START, d)) * [turned, 1.0, turned] * g
    r = attitude.lifted(tuple(m), 1.0, 0.0)
    return np.repeat(np.array([*m, *c, *r, 0.5, *x, *y, *r]), W)


def by_carlson(times):
    """Azimuth of the encircled axis and the angular velocity by SciPy, which an attitude then consists of."""
    I1, I2, I3 = MOMENTS
    L2 = sum((a * b) ** 2 for a, b in zip(MOMENTS, START, strict=True))
    T2 = sum(a * b * b for a, b in zip(MOMENTS, START, strict=True))
    s, c, d = (I2, I1, I3) if L2 > T2 * I2 else (I2, I3, I1)
    both = (d - s) * (L2 - T2 * c)
    p, m = math.sqrt(abs(both) / (I1 * I2 * I3)), (s - c) * (T2 * d - L2) / both
    n = -d * (s - c) / (c * (d - s))
    K, u = ellipk(m), p * times
    turns = np.floor(u / (2 * K) + 0.5)
    sn, cn, dn, _ = ellipj(u - 2 * K * turns, m)
    third = sn * elliprf(cn * cn, dn * dn, 1.0) + n / 3 * sn**3 * elliprj(cn * cn, dn * dn, 1.0, 1 - n * sn * sn)
    azimuth = math.sqrt(L2) / d * (times + (d / c - 1) * third / p)
    half = 0.5 * azimuth
    return np.stack([np.cos(half), np.sin(half), sn, cn, dn])


def main() -> None:
    """Prints the three rates and their ratios."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="fewer steps")
    quick = parser.parse_args().quick
    n, points = (200, 2_000) if quick else (20_000, 200_000)
    scratch = prepared()
    times = np.linspace(0.0, 100.0, n)
    grid = np.random.default_rng(1).uniform(0.5, 1.0, (2, points))
    bodies = {"I1": grid.min(axis=0), "I2": grid.max(axis=0), "I3": np.ones(points)}
    bodies |= {"energy": 1.0 + 0.9 * (1.0 / bodies["I1"] - 1.0), "omega0": np.ones(points)}
    runs = (
        lambda: step_rates(scratch, n),
        lambda: step_attitudes(scratch, n),
        lambda: by_carlson(times),
        lambda: tumbling.survey(bodies, 1e-10, False),
    )
    for run in runs:
        run()
    rates, attitudes, carlson, periods = least(3 if quick else 9, *runs)
    rates, attitudes, carlson = rates / n / W, attitudes / n / W, carlson / n
    print(f"exact step of the angular velocity   {1e9 * rates:8.2f} ns")
    print(f"exact step with the attitude         {1e9 * attitudes:8.2f} ns   {attitudes / rates:.2f} times that")
    print(f"an attitude by Carlson in SciPy      {1e9 * carlson:8.2f} ns   {carlson / attitudes:.0f} times that")
    print(f"both periods of a tumbler, exact     {1e9 * periods / points:8.2f} ns   {points / periods:.3g} points/s")


if __name__ == "__main__":
    main()
