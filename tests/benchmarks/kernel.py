"""Points per second of the survey on the default sweep, and the ratios that its parts are judged by.

    python tests/benchmarks/kernel.py [--tiny]

All in one run, warm, everybody in every round and the rounds interleaved; medians, and ratios within a round. Nothing
is asserted: absolute times move from machine to machine.
"""

import argparse
import os
import statistics
import time
from concurrent.futures import ThreadPoolExecutor

from kernels.free import linear
from kernels.near_axis import survey
from sweeps.points import catalogue
from sweeps.points.loading import read_sweep
from sweeps.process import machine

BARE = ("omega_squared", "omega_squared_stderr", "growth_rate", "frequency", "regime", "status")
UNCERTIFIED = (*linear.NAMES, *(name for name in survey.MEASURED if name != "propagation_error"))
BLOCK = 2**15


def blocks(points, size=BLOCK):
    """Points in runs of one size."""
    n = points["I1"].size
    return [{name: values[low : low + size] for name, values in points.items()} for low in range(0, n, size)]


def seconds(measure, blocks_of_points, cores):
    """Wall time of measuring all parts by so many threads."""
    begin = time.perf_counter()
    if cores == 1:
        for block in blocks_of_points:
            measure(block)
    else:
        with ThreadPoolExecutor(cores) as pool:
            list(pool.map(measure, blocks_of_points))
    return time.perf_counter() - begin


def contenders(settings):
    """Return name → (function that measures a block, threads)."""
    return {
        "all columns, one core": (lambda part: survey.survey(part, *settings), 1),
        "all columns, two cores": (lambda part: survey.survey(part, *settings), 2),
        "all but the certificate": (lambda part: survey.survey(part, *settings, wanted=UNCERTIFIED), 1),
        "rates alone, one core": (lambda part: survey.measure_points(part, *settings, wanted=BARE), 1),
        "rates alone, two cores": (lambda part: survey.measure_points(part, *settings, wanted=BARE), 2),
        "exact propagator": (lambda part: survey.measure_points(part, *settings, propagator="exact", wanted=BARE), 1),
        "measured, all columns": (lambda part: survey.measure_points(part, *settings), 1),
        "measured, collapsed": (lambda part: survey.measure_collapsed(part, *settings), 1),
    }


RATIOS = (
    ("two cores over one, all columns", "all columns, one core", "all columns, two cores"),
    ("two cores over one, rates alone", "rates alone, one core", "rates alone, two cores"),
    ("with certificates over without", "all columns, one core", "all but the certificate"),
    ("all columns over rates alone", "all columns, one core", "rates alone, one core"),
    ("direct over exact", "rates alone, one core", "exact propagator"),
    ("full over collapsed", "measured, all columns", "measured, collapsed"),
)


def main(arguments=None):
    """Print the figures."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--tiny", action="store_true", help="a few points and two rounds: does it run")
    tiny = parser.parse_args(arguments).tiny
    machine.keep_freed_memory()  # as for a shard
    sweep = read_sweep(catalogue.shipped_files()[catalogue.DEFAULT])
    grid, run = sweep.grid, sweep.definition.integration
    points = grid.points(0, 2000 if tiny else grid.size)
    settings = (run.rotations, run.samples_per_rotation, run.tolerance)
    blocks_of_points, rounds = blocks(points), 2 if tiny else 7
    field = contenders(settings)
    for measure, _ in field.values():
        measure(blocks_of_points[-1])
    times = {name: [] for name in field}
    for _ in range(rounds):
        for name, (measure, cores) in field.items():
            times[name].append(seconds(measure, blocks_of_points, cores))
    n = points["I1"].size
    load_average = ", ".join(f"{x:.1f}" for x in os.getloadavg())
    print(f"{sweep.name}: {n:,} points of {run.samples} samples, {rounds} rounds, load average {load_average}")
    for name, seconds_of_rounds in times.items():
        print(f"{name:32s} {n / statistics.median(seconds_of_rounds):12,.0f} points/s")
    for name, above, below in RATIOS:
        ratios = [x / y for x, y in zip(times[above], times[below], strict=True)]
        print(f"{name:32s} {statistics.median(ratios):8.3f}  ({min(ratios):.3f} to {max(ratios):.3f})")


if __name__ == "__main__":
    main()
