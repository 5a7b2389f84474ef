"""Where the time of an exact run goes: the race's bodies, ns a run of one core, the parts beside the whole.

    python tests/benchmarks/parts.py [--tiny]

Steps and samples are what no set-up can spare: the whole over them is the most that could still be gained. Least of
interleaved rounds, by the wall: other work on the machine only adds.
"""

import argparse
import math
import time

import bodies as task
import contenders
import numpy as np
from numba import njit

from kernels import findings, lanes, survey
from kernels.blocks import W, cut, scratch


@njit(error_model="numpy")
def repeated(loop, S, times):
    """A loop over the lanes of one block, so many times."""
    for _ in range(times):
        loop(S)


@njit(error_model="numpy")
def steps_and_samples(S):
    """Some exact steps of every lane, each with its sample."""
    lanes._exact_samples(S)


@njit(error_model="numpy")
def told(S):
    """Columns from sums, without errors."""
    findings.tell(S, False, False, False, lanes.NONE, True, False, 1e-10)


def filled(body):
    """A block whose lanes all follow one body."""
    S = scratch(findings.ROWS)
    for row, value in enumerate(contenders._row(body, 1)):
        S[W * row : W * (row + 1)] = value
    S[findings.MORE.spin_rate : findings.MORE.spin_rate + W] = 1.0
    lanes.follow(S, -lanes.EXACT, 1, task.SAMPLES, False, False, False, lanes.NONE)
    return S


def parts(count):
    """Name → what is timed, of about so many runs."""
    bodies = task.draw(count)
    arrays = survey._point_arrays(bodies.points)
    S, blocks = filled(bodies[:1]), math.ceil(count / W)
    keys = np.zeros(count, dtype=np.int64)
    plan = (np.empty(count), *(np.empty(count, dtype=np.int64) for _ in range(3)))
    loops = {
        "constants of the recurrence": (lanes.begin_recurrence, 1),
        "state, sums, windows": (lanes.begin, 1),
        "first guess": (lanes.guess, 1),
        "64 steps and samples": (steps_and_samples, task.SAMPLES // lanes.AT_ONCE),
        "columns from sums": (told, 1),
    }
    run = contenders.Polhode.run
    return {
        "the whole": lambda: survey.measured(bodies.points, *run, 1e-10, "exact", contenders.WANTED),
        "plan": lambda: survey._plan(*arrays[:4], arrays[5], task.SPACING, task.SAMPLES, 1e-10, True, plan, keys),
        "blocks": lambda: cut(keys, survey.LEVELS),
        **{name: lambda loop=loop, n=n: repeated(loop, S, blocks * n) for name, (loop, n) in loops.items()},
    }


def main(arguments=None):
    """Print ns a run of each part, and the whole over steps and samples."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--tiny", action="store_true", help="a few bodies and rounds: does it run")
    tiny = parser.parse_args(arguments).tiny
    count, rounds = (64, 2) if tiny else (4096, 60)
    timed, least = parts(count), {}
    for call in timed.values():
        call()
    for _ in range(rounds):
        for name, call in timed.items():
            begun = time.perf_counter()
            call()
            least[name] = min(least.get(name, math.inf), time.perf_counter() - begun)
    for name, seconds in least.items():
        print(f"{name:28s} {1e9 * seconds / count:8.1f} ns a run")
    known = sum(seconds for name, seconds in least.items() if name != "the whole")
    print(f"{'load, unload, sort, call':28s} {1e9 * (least['the whole'] - known) / count:8.1f} ns a run")
    print(f"the whole over steps and samples: {least['the whole'] / least['64 steps and samples']:.2f}")


if __name__ == "__main__":
    main()
