"""What the door costs: a map opened by Polhode and by xarray alone, in turns, in one process that has both loaded.

    python tests/benchmarks/opening.py [MAP]

prints medians, of wall and of processor time, children included. Without a map, the default sweep's is measured first.
"""

import resource
import statistics
import sys
import tempfile
import time
from pathlib import Path

import xarray as xr

import sweeps
from sweeps.maps import storage
from sweeps.points import catalogue

ROUNDS = 41


def spent():
    used = [resource.getrusage(whose) for whose in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return time.perf_counter(), sum(one.ru_utime + one.ru_stime for one in used)


def timed(opened):
    """(Wall, processor) s of opening a map, and of closing it again."""
    begun = spent()
    with opened():
        pass
    return [after - before for before, after in zip(begun, spent(), strict=True)]


def main():
    with tempfile.TemporaryDirectory() as folder:
        path = Path(sys.argv[1]) if sys.argv[1:] else Path(folder) / "map.nc"
        if not sys.argv[1:]:
            storage.write_map(sweeps.survey(catalogue.DEFAULT), path)
        ways = {"by the door": lambda: sweeps.open_map(path), "by xarray": lambda: xr.open_dataset(path)}
        taken = {name: [] for name in ways}
        for _ in range(ROUNDS):
            for name, opened in ways.items():
                taken[name].append(timed(opened))
        for name, times in taken.items():
            wall, processor = (1e3 * statistics.median(column) for column in zip(*times, strict=True))
            print(f"{name:12} {wall:7.1f} ms of wall, {processor:7.1f} ms of processor")


if __name__ == "__main__":
    main()
