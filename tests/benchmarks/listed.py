"""A table of bodies against the grid of the same bodies: processor time above start-up, and memory.

    python tests/benchmarks/listed.py 1e6 --rounds 3
    python tests/benchmarks/listed.py 1e7 --rounds 1 --folder /scratch

The rows of a CSV file are the points of a grid, in its order, so that kernels do the same work; about three axes, with
every column that a definition asks for if it says nothing. The table is read and checked once (`check`, as a workflow
does before its jobs), then measured in shards and merged, each in processes of their own, in turn with the grid; all of
it counts. What the same takes of 300 points is start-up, and is taken off.
"""

import argparse
import os
import shutil
import statistics
import tempfile
from itertools import product
from pathlib import Path

import large
import numpy as np

RANGES = {"I1": (1.0, 1.5), "I2": (1.0, 1.5), "I3": (0.8, 1.2), "omega0": (1.0, 10.0)}  # all of them bodies
LEAST = 100


def lengths(rows):
    """Numbers of I1, I2, I3 and omega0 for about so many rows."""
    side = max(1, round((rows / 100) ** 0.5))
    return side, side, 10, 10


def written(rows, folder):
    """Definitions of a table and of its grid, the table's file, and how many rows there are."""
    numbers = lengths(rows)
    along = [np.linspace(*ends, num) for ends, num in zip(RANGES.values(), numbers, strict=True)]
    with (folder / "rows.csv").open("w") as file:
        file.write(",".join(RANGES) + "\n")
        for head in product(*along[:-1]):
            text = ",".join(map(repr, map(float, head)))
            file.writelines(f"{text},{last!r}\n" for last in along[-1].tolist())
    (folder / "listed.yaml").write_text("table: rows.csv\n")
    entries = [
        f"  {name}: {{start: {low}, stop: {high}, num: {num}}}\n" if num > 1 else f"  {name}: {low}\n"
        for (name, (low, high)), num in zip(RANGES.items(), numbers, strict=True)
    ]
    (folder / "gridded.yaml").write_text("grid:\n" + "".join(entries))
    return folder / "listed.yaml", folder / "gridded.yaml", folder / "rows.csv", int(np.prod(numbers))


def renewed(file, number):
    """The same table in other bytes, which nobody has read: a first value with more zeros, other ones in every run."""
    other = file.with_suffix(".other")
    with file.open("rb") as old, other.open("wb") as new:  # a process begins as large as the one that starts it
        head, line = old.readline(), old.readline()
        new.write(head + line.rstrip(b"\n0") + b"0" * (2 + number + os.getpid() % 10_000) + b"\n")
        shutil.copyfileobj(old, new)
    other.replace(file)


def made(definition, points, cores, folder):
    """What reading, measuring and merging take: processor seconds and the largest resident set."""
    reading = large.watched([["check", str(definition)]], 1, [])
    _, measuring, merging = large.made(definition, points, cores, folder)
    stages = (reading, measuring, merging)
    return [stage.busy for stage in stages], max(stage.memory for stage in stages)


def row(rows, cores, rounds, folder):
    """Both ways, in turn: medians of the processor seconds of each stage, and the largest resident sets."""
    listed, gridded, file, rows = written(rows, folder)
    found = {listed: [], gridded: []}
    for number in range(rounds):
        renewed(file, number)
        for definition, all_of_it in found.items():
            all_of_it.append(made(definition, 3 * rows, cores, folder))
    told = []
    for all_of_it in found.values():
        stages = np.array([busy for busy, _ in all_of_it])
        told.append(([statistics.median(stage) for stage in stages.T], max(memory for _, memory in all_of_it)))
    return rows, told


def main(arguments=None):
    """Prints the table."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("rows", nargs="+", type=float, metavar="ROWS", help="sizes of the table, about")
    parser.add_argument("--cores", type=int, default=2, help="processes at a time (default 2)")
    parser.add_argument("--rounds", type=int, default=3, help="times that each is made (default 3); medians are told")
    parser.add_argument("--folder", type=Path, default=None, help="where files go (default: a temporary folder)")
    args = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory(dir=args.folder) as name:
        folder = Path(name)
        start = [stages for stages, _ in row(LEAST, 1, args.rounds, folder)[1]]
        print("| rows | table: read, measure, merge, core s | MB | grid: the same | MB | speed of the table |")
        print("|" + "---|" * 6)
        for wanted in args.rows:
            rows, told = row(round(wanted), args.cores, args.rounds, folder)
            count = large.shards_of(3 * rows, args.cores)
            cells, above = [f"{rows:.3g}"], []
            for (stages, memory), (reading, shard, merge) in zip(told, start, strict=True):
                own = [stages[0] - reading, stages[1] - count * shard, stages[2] - merge]
                cells += [", ".join(f"{seconds:.2f}" for seconds in own), f"{memory / 1e6:.0f}"]
                above.append(sum(own))
            print("| " + " | ".join([*cells, f"{above[1] / above[0]:.0%}"]) + " |", flush=True)


if __name__ == "__main__":
    main()
