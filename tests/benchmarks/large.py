"""The pipeline of a large sweep, from the first shard's start to the closed map: time, memory, bytes.

    python tests/benchmarks/large.py 1e5 1e6 1e7 --cores 2
    python tests/benchmarks/large.py 1e7 --cores 2 --columns all
    python tests/benchmarks/large.py 1e8 --cores 2 --folder /scratch

Direct integration, collapse off. Each shard and the merge run as processes of their own, as in the workflow; each size
is made several times, and medians are printed. Nothing is asserted: absolute times move from machine to machine. Memory
is the largest resident set of any one process. The time of a sweep of 1,200 points is start-up, and is printed first;
the slope is that of processor time above the start-up of every process. Last comes the largest size as `run` makes it,
in one process with its kernels in memory, from the first shard's start to the closed map.
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

SHARD_POINTS = 5_000_000
FEW_COLUMNS = "omega_squared, omega_squared_stderr, regime, status, propagation_error"
TEXT = """\
title: {points} points
axes: [1, 2, 3]
grid:
  I1: {{start: 0.5, stop: 1.5, num: {side}}}
  I2: {{start: 0.5, stop: 1.5, num: {side}}}
  I3: {{start: 0.8, stop: 1.2, num: 10}}
  omega0: {{start: 1.0, stop: 10.0, num: 10}}
"""
COLUMNS = {"few": f"integration: {{variables: [{FEW_COLUMNS}]}}\n", "all": ""}


@dataclass
class Stage:
    """Resources of processes: wall and processor seconds, largest resident set and file sizes in bytes."""

    wall: float
    busy: float
    memory: int
    disk: int


def run_jobs(jobs, cores, files):
    """Runs commands, so many at a time, that make some files."""
    begin, queue, processes, peak, busy = time.perf_counter(), list(jobs), {}, 0, 0.0
    while queue or processes:
        while queue and len(processes) < cores:
            command = [sys.executable, "-m", "sweeps", *queue.pop(0)]
            process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            processes[process.pid] = process
        pid, status, usage = os.wait4(-1, 0)
        process = processes.pop(pid)
        process.returncode = os.waitstatus_to_exitcode(status)
        if process.returncode:
            sys.exit("a process failed: " + " ".join(process.args[3:]))
        busy += usage.ru_utime + usage.ru_stime
        peak = max(peak, usage.ru_maxrss * 1024)
    return Stage(time.perf_counter() - begin, busy, peak, sum(file.stat().st_size for file in files))


def side_of(points):
    """How many values I1 and I2 take for about so many points."""
    return max(2, int((points / 300) ** 0.5))


def write_definition(points, columns, folder):
    """The file of a definition of about so many points, and how many there are."""
    side = side_of(points)
    definition = folder / "large.yaml"
    definition.write_text(TEXT.format(points=300 * side * side, side=side) + COLUMNS[columns])
    return definition, 300 * side * side


def shards_of(points, cores):
    """Into how many shards so many points are cut: a multiple of the cores, or one."""
    count = max(1, -(-points // SHARD_POINTS))
    return count + (-count % cores if count > 1 else 0)


def make_map(definition, points, cores, folder):
    """Make the map once; return the number of shards and the stages of shards and merge."""
    count = shards_of(points, cores)
    files = [folder / f"{k}-of-{count}.nc" for k in range(1, count + 1)]
    jobs = [["shard", str(definition), str(k), str(count), "-o", str(file)] for k, file in enumerate(files, 1)]
    shard_stage = run_jobs(jobs, cores, files)
    target = folder / "map.nc"
    merge = run_jobs([["merge", str(definition), *map(str, files), "-o", str(target)]], 1, [target])
    for file in (*files, target):
        file.unlink()
    return count, shard_stage, merge


def median(stages):
    """Medians of one stage over the rounds; memory is the largest."""
    medians = {name: statistics.median(getattr(s, name) for s in stages) for name in ("wall", "busy", "disk")}
    return Stage(memory=max(s.memory for s in stages), **medians)


def row(points, columns, cores, rounds, folder):
    """Makes one size of map, prints its line, and returns points, shards, and processor time of shards and merge."""
    definition, points = write_definition(points, columns, folder)
    rounds = rounds or (15 if points < 3e5 else 5 if points < 3e6 else 3 if points < 3e7 else 1)
    rounds_made = [make_map(definition, points, cores, folder) for _ in range(rounds)]
    shard_stage, merge = (median([results[k] for results in rounds_made]) for k in (1, 2))
    cells = [f"{points:.3g}", str(rounds), str(rounds_made[0][0])]
    for stage in (shard_stage, merge):
        cells += [f"{stage.wall:.1f}", f"{stage.busy:.2f}", f"{stage.memory / 1e6:.0f}", f"{stage.disk / points:.1f}"]
    print("| " + " | ".join([*cells, f"{points / (shard_stage.wall + merge.wall):,.0f}"]) + " |", flush=True)
    return points, rounds_made[0][0], shard_stage.busy, merge.busy


RUN = """\
import sys, time
from pathlib import Path
from sweeps.points.loading import read_sweep
from sweeps.pipeline import run as pipeline

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
        definition, _ = write_definition(size, columns, folder)
        definitions.append(definition.rename(folder / f"{name}.of.yaml"))
    command = [sys.executable, "-c", RUN, *map(str, definitions), str(cores), str(rounds or 5)]
    output = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, check=True).stdout
    walls, busy, sizes = zip(*(map(float, line.split()) for line in output.splitlines()), strict=True)
    wall = statistics.median(walls)
    print(
        f"as `run` makes {sizes[0]:.3g} points, in one process: {wall:.2f} s by the wall ({min(walls):.2f} to "
        f"{max(walls):.2f}), {statistics.median(busy):.2f} s of the processor, {sizes[0] / wall:,.0f} points/s"
    )


def slope(start_up, sizes):
    """Slope of the processor time above start-up against the points, in log-log."""
    _, _, shard, merge = start_up
    above = [shard_time - count * shard + merge_time - merge for _, count, shard_time, merge_time in sizes]
    return np.polyfit(np.log([points for points, *_ in sizes]), np.log(np.maximum(above, 0.01)), 1)[0]


def main(arguments=None):
    """Print the table, the slope, and the time of `run`."""
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
        rows = [row(round(points), args.columns, args.cores, args.rounds, folder) for points in args.points]
        if len(rows) > 1:
            print(f"slope of processor time above start-up against points: {slope(start_up, rows):.3f}")
        print_run(round(args.points[-1]), args.columns, args.cores, args.rounds, folder)


if __name__ == "__main__":
    main()
