"""Time, memory and bytes of a large sweep: direct integration, collapse off, five columns, shards and merge.

    python tests/benchmarks/large.py 1e6 1e7
    python tests/benchmarks/large.py 1e8 --cores 2 --folder /scratch

Each shard and the merge run as processes of their own, as in the workflow. Nothing is asserted: absolute times move
from machine to machine. Memory is the largest resident set of any one process, sampled every tenth of a second.
"""

import argparse
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import psutil

SHARD_POINTS = 5_000_000
TEXT = """\
title: {points} points
axes: [1, 2, 3]
grid:
  I1: {{start: 0.5, stop: 1.5, num: {side}}}
  I2: {{start: 0.5, stop: 1.5, num: {side}}}
  I3: {{start: 0.8, stop: 1.2, num: 10}}
  omega0: {{start: 1.0, stop: 10.0, num: 10}}
integration:
  variables: [omega_squared, omega_squared_stderr, regime, status, propagation_error]
"""


def watched(jobs, cores):
    """Runs commands, so many at a time: (wall seconds, processor seconds, largest resident set in bytes)."""
    begun, waiting, running, peak, busy = time.perf_counter(), list(jobs), [], 0, {}
    while waiting or running:
        while waiting and len(running) < cores:
            command = [sys.executable, "-m", "sweeps", *waiting.pop(0)]
            running.append(psutil.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL))
        for process in running:
            try:
                peak = max(peak, process.memory_info().rss)
                busy[process.pid] = sum(process.cpu_times()[:2])
            except psutil.Error:
                continue
        if any(process.poll() for process in running):
            sys.exit("a process failed: " + " ".join(process.args[3:]))
        running = [process for process in running if process.poll() is None]
        time.sleep(0.1)
    return time.perf_counter() - begun, sum(busy.values()), peak


def measure(points, cores, folder):
    """Makes one map of about so many points and prints a line of the table."""
    side = max(2, round((points / 300) ** 0.5))
    points = 300 * side * side
    definition = folder / "large.yaml"
    definition.write_text(TEXT.format(points=points, side=side))
    count = max(1, -(-points // SHARD_POINTS))
    files = [folder / f"{k}-of-{count}.nc" for k in range(1, count + 1)]
    jobs = [["shard", str(definition), str(k), str(count), "-o", str(file)] for k, file in enumerate(files, 1)]
    wall, busy, peak = watched(jobs, cores)
    on_disk = sum(file.stat().st_size for file in files)
    merged = ["merge", str(definition), *map(str, files), "-o", str(folder / "map.nc"), "--threads", str(cores)]
    merge_wall, merge_busy, merge_peak = watched([merged], 1)
    row = (
        *(f"{points:.3g}", f"{count}", f"{wall:.0f}", f"{busy:.0f}", f"{peak / 1e6:.0f}", f"{on_disk / points:.1f}"),
        *(f"{merge_wall:.0f}", f"{merge_busy:.0f}", f"{merge_peak / 1e6:.0f}"),
        f"{(folder / 'map.nc').stat().st_size / points:.1f}",
    )
    print("| " + " | ".join(row) + " |", flush=True)
    for file in (*files, folder / "map.nc"):
        file.unlink()


def main():
    """Prints the table."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("points", nargs="+", type=float, metavar="POINTS", help="sizes to make, about")
    parser.add_argument("--cores", type=int, default=1, help="processes at a time (default 1)")
    parser.add_argument("--folder", type=Path, default=None, help="where files go (default: a temporary folder)")
    args = parser.parse_args()
    print("| points | shards | s | core s | MB | B/point | merge s | core s | MB | B/point |")
    print("|" + "---|" * 10)
    with tempfile.TemporaryDirectory(dir=args.folder) as folder:
        for points in args.points:
            measure(round(points), args.cores, Path(folder))


if __name__ == "__main__":
    main()
