"""Points per second of the survey kernel on the default sweep, on one core and on two, beside a plain SciPy loop.

    python tests/benchmarks/kernel.py

All in one run, warm; medians of several. Nothing is asserted: absolute times move from machine to machine.
"""

import statistics
import time

import numpy as np
import xarray as xr
from scipy.integrate import solve_ivp

from kernels import rigid_body, survey
from sweeps import catalogue, dataset
from sweeps.definition import load
from sweeps.grid import Grid

RUNS = 5
SCIPY_POINTS = 20


def seconds(call):
    """Median wall time of a call."""
    times = []
    for _ in range(RUNS):
        begun = time.perf_counter()
        call()
        times.append(time.perf_counter() - begun)
    return statistics.median(times)


def scipy_points(points, integration):
    """Integrate points one by one by SciPy's DOP853 at rtol 1e-12, sampled as the survey does."""
    times = 2.0 * np.pi / integration.samples_per_rotation * np.arange(integration.samples + 1)
    for i in range(SCIPY_POINTS):
        I1, I2, I3 = (points[name][i] for name in ("I1", "I2", "I3"))
        c = rigid_body.euler_coefficients(*rigid_body.relabel(I1, I2, I3, points["axis"][i]))
        size, phase = points["epsilon"][i], points["phase"][i]
        start = [1.0, size * np.cos(phase), size * np.sin(phase)]
        solve_ivp(
            lambda t, w, c=c: (c[0] * w[1] * w[2], c[1] * w[2] * w[0], c[2] * w[0] * w[1]),
            (0.0, times[-1]), start, method="DOP853", t_eval=times, rtol=1e-12, atol=1e-12 * size,
        )  # fmt: skip


def main():
    """Print the figures."""
    definition = load(catalogue.shipped()[catalogue.DEFAULT])
    grid = Grid(definition)
    points = grid.points(0, grid.size)
    arrays = {name: xr.DataArray(values, dims="point") for name, values in points.items()}
    run = definition.integration
    settings = (run.rotations, run.samples_per_rotation, run.tolerance)
    survey.run({name: values[:64] for name, values in points.items()}, *settings)
    speeds = {
        "kernel, one core": grid.size / seconds(lambda: survey.run(points, *settings)),
        "all columns, one core": grid.size / seconds(lambda: dataset.evaluate(arrays, run)),
        "all columns, two cores": grid.size / seconds(lambda: dataset.evaluate(arrays, run, threads=2)),
        "SciPy DOP853 loop, one core": SCIPY_POINTS / seconds(lambda: scipy_points(points, run)),
    }
    print(f"{catalogue.DEFAULT}: {grid.size:,} points of {run.samples} samples, medians of {RUNS} runs")
    slowest = min(speeds.values())
    for name, speed in speeds.items():
        print(f"{name:28s} {speed:12,.0f} points/s  {speed / slowest:9,.1f} x")


if __name__ == "__main__":
    main()
