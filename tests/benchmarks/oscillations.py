"""Points per second of small oscillations, on one core and on two, and operations per second beside the rigid body's.

    python tests/benchmarks/oscillations.py [system …]

All in one run, warm; the best of several. Nothing is asserted: absolute times move from machine to machine.
"""

import re
import sys
import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from kernel import part_of_default
from timing import least

from kernels import oscillations, survey
from sweeps.points import catalogue
from sweeps.points.loading import read
from sweeps.systems import resolve

RUNS = 7
POINTS = 100_000


def seconds(call):
    """Least wall time of a call."""
    return least(RUNS, call, clock=time.perf_counter)[0]


def operations(text):
    """Additions and multiplications of one generated step."""
    body = text.split('"""')[3]  # after the title, and what stands between
    return len(re.findall(r" [*+/-] | -(?=u)", re.sub(r"S\[.*?\]", "S", body)))


def captured(kernel, mechanism, points):
    """Return the arguments of each call of a kernel for some points."""
    calls, honest = [], kernel.run
    kernel.run = lambda *arguments: (calls.append(arguments), honest(*arguments))[1]
    try:
        mechanism.survey(points)
    finally:
        kernel.run = honest
    return calls


def measure(name):
    """Print the figures of one system."""
    system = resolve(name)
    sweep = read(catalogue.shipped()[name])
    grid = sweep.grid
    points = grid.points(0, min(grid.size, 8192))
    repeats = POINTS // len(points["mode"]) + 1
    points = {key: np.tile(values, repeats) for key, values in points.items()}
    names = {label: k for k, label in enumerate(system.description.names)}
    points["equilibrium"] = np.array([names[str(label)] for label in points["equilibrium"]])
    arguments, *_ = captured(oscillations, system.mechanism, points)
    count = arguments[1].scale.size
    one = seconds(lambda: oscillations.run(*arguments))
    with ThreadPoolExecutor(2) as pool:
        two = seconds(lambda: list(pool.map(lambda _: oscillations.run(*arguments), range(2))))
    raw = oscillations.run(*arguments)
    runs = 3 * (1 + arguments[1].twice)  # of the nudge, its half and quarter, from one side or both
    steps = float(((raw[:, oscillations.RAW.samples] - 1) * runs * raw[:, oscillations.RAW.steps]).sum())
    work = operations(system.mechanism.code.text)
    print(f"{name:20s} kernel, one core {count / one:10,.0f} points/s; two cores {2 * count / two:10,.0f} points/s")
    print(f"{'':20s} {work:,} operations a step, {steps * work / one / 1e9:.1f} GFLOP/s on one core at least")
    whole = seconds(lambda: system.mechanism.survey(points))
    print(f"{'':20s} all columns, one core {len(points['mode']) / whole:10,.0f} points/s", end="; ")
    with ThreadPoolExecutor(2) as pool:
        both = seconds(lambda: list(pool.map(lambda _: system.mechanism.survey(points), range(2))))
    print(f"two cores {2 * len(points['mode']) / both:10,.0f} points/s")


def rigid_body():
    """Print the rigid body's points per second and operations per second on the default sweep."""
    settings, points = part_of_default(POINTS)
    count = points["I1"].size
    found = survey.measured(points, *settings)
    took = seconds(lambda: survey.measured(points, *settings))
    steps = float(((found["samples_used"] - 1) * found["steps_per_sample"]).sum())
    print(f"rigid body           all that is measured, one core {count / took:10,.0f} points/s")
    low, most = (steps * 2 * work / took / 1e9 for work in (108, 234))  # multiply-adds at orders 8 and 12
    print(f"{'':20s} {low:.1f} to {most:.1f} GFLOP/s on one core at least")


if __name__ == "__main__":
    for chosen in sys.argv[1:] or ["pendulum"]:
        measure(chosen)
    rigid_body()
