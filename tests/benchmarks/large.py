"""The pipeline of a large sweep, from the first shard's start to the closed map: time, memory, bytes.

    python tests/benchmarks/large.py 1e5 1e6 1e7 --cores 2
    python tests/benchmarks/large.py 1e7 --cores 2 --columns all
    python tests/benchmarks/large.py 1e8 --cores 2 --folder /scratch

Direct integration, collapse off. Each shard and the merge run as processes of their own, as in the workflow; each size
is made several times, and medians are printed. Nothing is asserted: absolute times move from machine to machine. Memory
is the largest resident set of any one process. What a sweep of 1,200 points takes is start-up, and is printed first;
the slope is that of processor time above the start-up of every process. Last come the stages of a shard and its merge:
how many points a second the cores could make if there were no other stage than this one, and with those above it. The
kernels alone set the first bound; with nothing but Ω² and its standard error they set one for whatever columns. Beside
them stands what is asked of the pipeline. Above them stands the same size as `run` makes it, in one process with its
kernels in memory, from the first shard's start to the closed map.
"""

import argparse
import os
import statistics
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from sweeps import systems
from sweeps.points.estimate import BLOCK_POINTS
from sweeps.points.loading import read_sweep
from sweeps.points.sweep import Grid
from sweeps.reading.stored_values import StoredValues
from sweeps.shards import merging
from sweeps.shards import shard as shards
from sweeps.shards.mapfile import MapFile

SHARD_POINTS = 5_000_000
BARE = ("omega_squared", "omega_squared_stderr")
FEW = "omega_squared, omega_squared_stderr, regime, status, propagation_error"
TEXT = """\
title: {points} points
axes: [1, 2, 3]
grid:
  I1: {{start: 0.5, stop: 1.5, num: {side}}}
  I2: {{start: 0.5, stop: 1.5, num: {side}}}
  I3: {{start: 0.8, stop: 1.2, num: 10}}
  omega0: {{start: 1.0, stop: 10.0, num: 10}}
"""
BARS = {"few": 3e6, "all": 2e6}  # points a second, by the wall on two cores, that the pipeline is to come to
COLUMNS = {"few": f"integration: {{variables: [{FEW}]}}\n", "all": ""}
STAGES = {  # what no sweep can do without, in this order, and the function that does it
    "kernels": (type(systems.resolve("rigid_body")), "columns"),
    "points": (Grid, "points"),
    "reading": (StoredValues, "read"),
    "writing and hashing": (MapFile, "put_columns"),
}


@dataclass
class Stage:
    """What processes took: wall and processor seconds, largest resident set and file sizes in bytes."""

    wall: float
    busy: float
    memory: int
    disk: int


def watched(jobs, cores, files):
    """Runs commands, so many at a time, that make some files."""
    begun, waiting, running, peak, busy = time.perf_counter(), list(jobs), {}, 0, 0.0
    while waiting or running:
        while waiting and len(running) < cores:
            command = [sys.executable, "-m", "sweeps", *waiting.pop(0)]
            process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            running[process.pid] = process
        pid, status, used = os.wait4(-1, 0)
        process = running.pop(pid)
        process.returncode = os.waitstatus_to_exitcode(status)
        if process.returncode:
            sys.exit("a process failed: " + " ".join(process.args[3:]))
        busy += used.ru_utime + used.ru_stime
        peak = max(peak, used.ru_maxrss * 1024)
    return Stage(time.perf_counter() - begun, busy, peak, sum(file.stat().st_size for file in files))


def side_of(points):
    """How many values I1 and I2 take for about so many points."""
    return max(2, int((points / 300) ** 0.5))


def written(points, columns, folder):
    """The file of a definition of about so many points, and how many there are."""
    side = side_of(points)
    definition = folder / "large.yaml"
    definition.write_text(TEXT.format(points=300 * side * side, side=side) + COLUMNS[columns])
    return definition, 300 * side * side


def shards_of(points, cores):
    """Into how many shards so many points are cut: a multiple of the cores, or one."""
    count = max(1, -(-points // SHARD_POINTS))
    return count + (-count % cores if count > 1 else 0)


def made(definition, points, cores, folder):
    """Makes the map once: what the shards took, and what the merge."""
    count = shards_of(points, cores)
    files = [folder / f"{k}-of-{count}.nc" for k in range(1, count + 1)]
    jobs = [["shard", str(definition), str(k), str(count), "-o", str(file)] for k, file in enumerate(files, 1)]
    measuring = watched(jobs, cores, files)
    target = folder / "map.nc"
    merging = watched([["merge", str(definition), *map(str, files), "-o", str(target)]], 1, [target])
    for file in (*files, target):
        file.unlink()
    return count, measuring, merging


def median(stages):
    """Medians of one stage over the rounds; memory is the largest."""
    told = {name: statistics.median(getattr(s, name) for s in stages) for name in ("wall", "busy", "disk")}
    return Stage(memory=max(s.memory for s in stages), **told)


def row(points, columns, cores, rounds, folder):
    """Makes one size of map, prints its line, and returns points, shards, and processor time of shards and merge."""
    definition, points = written(points, columns, folder)
    rounds = rounds or (15 if points < 3e5 else 5 if points < 3e6 else 3 if points < 3e7 else 1)
    found = [made(definition, points, cores, folder) for _ in range(rounds)]
    measuring, merging = (median([once[k] for once in found]) for k in (1, 2))
    cells = [f"{points:.3g}", str(rounds), str(found[0][0])]
    for stage in (measuring, merging):
        cells += [f"{stage.wall:.1f}", f"{stage.busy:.2f}", f"{stage.memory / 1e6:.0f}", f"{stage.disk / points:.1f}"]
    print("| " + " | ".join([*cells, f"{points / (measuring.wall + merging.wall):,.0f}"]) + " |", flush=True)
    return points, found[0][0], measuring.busy, merging.busy


RUN = """\
import sys, time
from pathlib import Path
from sweeps.points.loading import read_sweep
from sweeps.reading.stored_values import StoredValues
from sweeps.pipeline import steps as pipeline

small, large, cores, rounds = *map(read_sweep, sys.argv[1:3]), *map(int, sys.argv[3:])
path = Path(sys.argv[1]).with_name("made") / "map.nc"
pipeline.measure_map(small, path, cores, True)  # kernels into memory
for _ in range(rounds):
    path.unlink()
    begun, busy = time.perf_counter(), time.process_time()
    pipeline.measure_map(large, path, cores, True)
    print(time.perf_counter() - begun, time.process_time() - busy, large.grid.size)
"""


def print_run(points, columns, cores, rounds, folder):
    """A line: how `run` makes about so many points in one process, medians."""
    definitions = []
    for name, size in (("small", 1200), ("large", points)):
        definition, _ = written(size, columns, folder)
        definitions.append(definition.rename(folder / f"{name}.of.yaml"))
    command = [sys.executable, "-c", RUN, *map(str, definitions), str(cores), str(rounds or 5)]
    told = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, check=True).stdout
    walls, busy, sizes = zip(*(map(float, line.split()) for line in told.splitlines()), strict=True)
    wall = statistics.median(walls)
    print(
        f"as `run` makes {sizes[0]:.3g} points, in one process: {wall:.2f} s by the wall ({min(walls):.2f} to "
        f"{max(walls):.2f}), {statistics.median(busy):.2f} s of the processor, {sizes[0] / wall:,.0f} points/s"
    )


def slope(start_up, found):
    """Slope of the processor time above start-up against the points, in log-log."""
    _, _, shard, merge = start_up
    above = [measuring - count * shard + merging - merge for _, count, measuring, merging in found]
    return np.polyfit(np.log([points for points, *_ in found]), np.log(np.maximum(above, 0.01)), 1)[0]


def whole(points, columns, folder):
    """Makes a map of about so many points from one shard, here; returns the processor time and the points."""
    definition, points = written(points, columns, folder)
    sweep, shard, begun = read_sweep(definition), folder / "1-of-1.nc", time.process_time()
    shards.write_shard(sweep, 1, 1, shard)
    merging.merge_shards(sweep, [shard], folder / "map.nc")
    return time.process_time() - begun, points


def stages(points, columns, folder):
    """What a shard and its merge take beside start-up: ns of one core a point, by stage, each in its own thread."""
    spent, kept = dict.fromkeys(STAGES, 0.0), {name: getattr(*place) for name, place in STAGES.items()}

    def timed(name):
        def outer(*arguments):
            begun = time.thread_time()
            result = kept[name](*arguments)
            spent[name] += time.thread_time() - begun
            return result

        return outer

    whole(1200, columns, folder)  # imports, and kernels into memory
    start, _ = whole(1200, columns, folder)
    try:
        for name, place in STAGES.items():
            setattr(*place, timed(name))
        busy, points = whole(points, columns, folder)
    finally:
        for name, place in STAGES.items():
            setattr(*place, kept[name])
    spent["the rest"] = max(busy - start - sum(spent.values()), 0.0)
    return {name: seconds / points * 1e9 for name, seconds in spent.items()}


def bare(points, folder):
    """Ns of one core a point of the kernels where they measure Ω² and its error and no more."""
    from kernels.near_axis import survey  # loaded before, it would count as memory of every process that is started

    definition, points = written(points, "few", folder)
    sweep = read_sweep(definition)
    run = sweep.definition.integration
    settings = run.rotations, run.samples_per_rotation, run.tolerance
    blocks = [sweep.grid.points(low, min(low + BLOCK_POINTS, points)) for low in range(0, points, BLOCK_POINTS)]
    survey.measure_points(blocks[-1], *settings, wanted=BARE)
    begun = time.thread_time()
    for block in blocks:
        survey.measure_points(block, *settings, wanted=BARE)
    return (time.thread_time() - begun) / points * 1e9


def print_bounds(told, least, cores, columns):
    """A line a stage: what it takes, and how fast the cores were if it were all, or it and those above it."""
    bar = BARS[columns]
    print(f"asked: {bar:,.0f} points/s on two cores by the wall, {2e9 / bar:.0f} ns of a core a point")
    print(f"| stage | ns of a core a point | alone at most, points/s on {cores} cores | with those above |")
    print("|" + "---|" * 4)
    print(f"| kernels, Ω² and its error alone | {least:.0f} | {cores * 1e9 / least:,.0f} | |")
    total = 0.0
    for name, spent in told.items():
        total += spent
        print(f"| {name} | {spent:.0f} | {cores * 1e9 / max(spent, 1.0):,.0f} | {cores * 1e9 / total:,.0f} |")


def main(arguments=None):
    """Prints the table, the slope and the stages, each with the bound that it sets."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("points", nargs="+", type=float, metavar="POINTS", help="sizes to make, about")
    parser.add_argument("--cores", type=int, default=1, help="processes at a time (default 1)")
    parser.add_argument("--columns", choices=list(COLUMNS), default="few", help="variables of the map (default few)")
    parser.add_argument(
        "--rounds", type=int, default=0, help="times that each size is made (default: fewer, the larger)"
    )
    parser.add_argument("--folder", type=Path, default=None, help="where files go (default: a temporary folder)")
    args = parser.parse_args(arguments)
    print("| points | rounds | shards | s | core s | MB | B/point | merge s | core s | MB | B/point | points/s |")
    print("|" + "---|" * 12)
    with tempfile.TemporaryDirectory(dir=args.folder) as name:
        folder = Path(name)
        start_up = row(1200, args.columns, args.cores, args.rounds, folder)
        found = [row(round(points), args.columns, args.cores, args.rounds, folder) for points in args.points]
        if len(found) > 1:
            print(f"slope of processor time above start-up against points: {slope(start_up, found):.3f}")
        print_run(round(args.points[-1]), args.columns, args.cores, args.rounds, folder)
        told = stages(min(args.points[-1], 1e6), args.columns, folder)
        least = bare(min(args.points[-1], 1e6), folder)
    print_bounds(told, least, args.cores, args.columns)


if __name__ == "__main__":
    main()
