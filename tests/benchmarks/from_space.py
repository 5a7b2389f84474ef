"""What is measured of bodies in space, held against closed forms and SciPy on more points than the tests take.

    python tests/benchmarks/from_space.py [--points N]

The twist at every point beside its closed form, the law of its defect fitted to what is measured, both periods of
tumblers with their errors, and attitudes beside SciPy's DOP853 at 1e-13.
"""

import argparse
import math

import numpy as np
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from kernels import direct, exact, tumbling, twist


def bodies(rng, n):
    """Moments (3, n) of bodies that can exist, ascending, the greatest one."""
    squares = rng.uniform(0.0, 1.0, (3, n))
    moments = np.sort(squares.sum(axis=0) - squares, axis=0)
    return moments / moments[2]


def twists(rng, n):
    """Whether measured and exact twist agree within the error at every point."""
    I1, I2, I3 = bodies(rng, n)
    points = {"I1": I1, "I2": I2, "I3": I3, "omega0": 1.0, "theta": 0.5 * math.pi}
    found = twist.survey(points | {"chi": 10.0 ** rng.uniform(-4, 0, n)}, 1e-10)
    off, error = np.abs(found["twist"] - found["twist_exact"]), found["twist_error"]
    print(f"twist: {n} throws, {(off > error).sum()} beyond their error; largest distance {off.max():.1e} rad")


def law(rng, n):
    """Slope and constant of the measured defect on the separatrix: one and zero for ever smaller defects."""
    I1, I2, I3 = bodies(rng, n)
    a, b = I2 / I1 - 1.0, 1.0 - I2 / I3
    growth = np.sqrt(a * b)
    eps = 0.5 * np.array([twist.defect_theory(*one) for one in zip(I1, I2, I3, strict=True)])
    points = {"I1": I1, "I2": I2, "I3": I3, "chi": -eps, "omega0": 1.0}
    found = twist.survey(points | {"theta": np.arctan(np.sqrt(a / b) / np.sin(eps))}, 1e-10)
    x = -growth * (math.pi + np.arctan(np.sqrt(b / a)))
    y = np.log((math.pi - np.abs(found["twist"])) / (4.0 * np.sqrt(a / (a + b))))
    for least in (0.3, 0.6, 0.75):
        some = growth > least
        slope, constant = np.polyfit(x[some], y[some], 1)
        print(
            f"defect's law, growth > {least}: {some.sum()} bodies, slope {slope:.4f}, constant {constant:+.4f}, "
            f"largest distance from the law {np.abs(y - x)[some].max():.1e}"
        )


def periods(rng, n):
    """Errors of measured periods: how many cover, and how large they are away from the separatrix."""
    I1, I2, I3 = bodies(rng, n)
    energy = 1.0 + rng.uniform(0.0, 1.0, n) * (I3 / I1 - 1.0)
    found = tumbling.survey({"I1": I1, "I2": I2, "I3": I3, "energy": energy, "omega0": 1.0}, 1e-10)
    for name in tumbling.PERIODS:
        off, error = np.abs(found[name] - found[f"{name}_exact"]), found[f"{name}_error"]
        known = np.isfinite(off)
        relative = error[known] / np.abs(found[f"{name}_exact"][known])
        print(
            f"{name}: {known.sum()} known, {(off[known] > error[known]).sum()} beyond their error; "
            f"relative error median {np.median(relative):.1e}, above 1e-9 at {100 * (relative > 1e-9).mean():.2f} %"
        )


def attitudes(rng, n):
    """Closed form and direct integration beside SciPy, over six units of time."""
    worst = np.zeros(2)
    for _ in range(n):
        moments, start = rng.uniform(0.4, 1.2, 3), rng.normal(size=3)
        c = (np.roll(moments, -1) - np.roll(moments, -2)) / moments

        def rates(_, y, c=c):
            w, (s, *v) = y[:3], y[3:]
            turned = s * w + np.cross(v, w)
            return [*(c * np.roll(w, -1) * np.roll(w, -2)), -0.5 * np.dot(v, w), *(0.5 * turned)]

        times = np.linspace(0.0, 6.0, 5)
        run = solve_ivp(rates, (0, 6), [*start, 1, 0, 0, 0], "DOP853", times, rtol=1e-13, atol=1e-13)
        wanted = Rotation.from_quat(run.y[3:].T, scalar_first=True)
        ways = exact.attitude(moments, start, times), direct.attitude(moments, start, times, 1e-12)
        off = [(Rotation.from_quat(q, scalar_first=True).inv() * wanted).magnitude().max() for q in ways]
        worst = np.maximum(worst, off)
    print(f"attitude: {n} starts, closed form {worst[0]:.1e} rad from SciPy, direct integration {worst[1]:.1e}")


def main() -> None:
    """Prints all of it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--points", type=int, default=20_000, help="of each survey (a hundredth of them with SciPy)")
    n, rng = parser.parse_args().points, np.random.default_rng(1)
    twists(rng, n)
    law(rng, n)
    periods(rng, n)
    attitudes(rng, max(1, n // 100))


if __name__ == "__main__":
    main()
