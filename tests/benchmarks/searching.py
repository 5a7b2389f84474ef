"""Points per second of the search for equilibria, its proof included: by one process's own time, by the wall on two.

    python tests/benchmarks/searching.py [system …]

Points of a system's shipped grid, each searched as if no other were like it. Two processes are what `run` and the
workflow use on two cores, two threads what `sweeps.survey` uses. Nothing is asserted: absolute times move from machine
to machine, and the wall's are worth something only where nothing else runs.
"""

import multiprocessing
import sys
import time
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from functools import lru_cache

import numpy as np

from sweeps.mechanics import equilibria
from sweeps.mechanics.landscape import Landscape
from sweeps.points import catalogue
from sweeps.points.loading import read
from sweeps.systems import resolve

ROUNDS = 5
SYSTEMS = ("bead_on_hoop", "double_well", "pendulum", "bead_on_wire")  # of one coordinate
COUNT = 40_000  # points of a search
READY = 3.0  # s, in which workers have made ready


@lru_cache
def prepared(name, worker):
    """What one worker searches: V's derivatives, and the parameters of points, a tuple of arrays."""
    system, grid = resolve(name), read(catalogue.shipped()[name]).grid
    slots = len(system.description.names) * len(system.description.kept)
    columns = grid.points(0, grid.size)
    columns = [np.asarray(columns[p][::slots], dtype=np.float64) for p in system.description.parameters]
    landscape = Landscape(system.mechanism.equations)
    chosen = tuple(np.resize(c, COUNT) for c in columns)
    equilibria._found(landscape, [c[:64] for c in chosen])  # compiled
    return landscape, chosen


def search(name, worker=0, at=0.0):
    """Searches all points, from a moment on: seconds of the thread's own, and when it began and ended."""
    landscape, columns = prepared(name, worker)
    time.sleep(max(0.0, at - time.monotonic()))
    begun, own = time.monotonic(), time.thread_time()
    equilibria._found(landscape, columns)
    return time.thread_time() - own, begun, time.monotonic()


def together(pool, name):
    """Points per second by the wall of two workers that start at one moment: the best of some rounds."""
    best = 0.0
    for k in range(ROUNDS + 1):
        at = time.monotonic() + (READY if k == 0 else 0.1)
        told = list(pool.map(search, [name] * 2, range(2), [at] * 2))
        took = max(end for *_, end in told) - min(begun for _, begun, _ in told)
        best = max(best, 2 * COUNT / took)
    return best


def main(names):
    """Print a line a system."""
    print(f"{'points/s':16s} {'one, own time':>14s} {'one, wall':>12s} {'two processes':>14s} {'two threads':>12s}")
    spawn = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(2, spawn) as processes, ThreadPoolExecutor(2) as threads:
        for name in names:
            told = [search(name) for _ in range(ROUNDS)]
            own, wall = min(own for own, *_ in told), min(end - begun for _, begun, end in told)
            two = [together(pool, name) for pool in (processes, threads)]
            print(f"{name:16s} {COUNT / own:14,.0f} {COUNT / wall:12,.0f} {two[0]:14,.0f} {two[1]:12,.0f}", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:] or SYSTEMS)
