"""Where the time of an exact run goes: the race's bodies, ns a run of one core, the parts beside the whole.

    python tests/benchmarks/parts.py [--tiny]

Steps and samples are what no set-up can spare: the whole over them is the most that could still be gained. Least of
interleaved rounds, by processor time: other work on the machine only adds.
"""

import argparse
import math
import time

import bodies as task
import contenders
import numpy as np
from numba import njit
from timing import least

from kernels import estimates, lanes, rigid_body, survey
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
    estimates.fill(S, (False, False, False, False, False), lanes.NONE, True, False, 1e-10)


@njit(error_model="numpy")
def gathered(S, T, order):
    """What the lanes of a tile's blocks are given."""
    for first in range(0, order.size, W):
        survey._gather(S, T, order[first : first + W], 1)


@njit(error_model="numpy")
def stored(S, rows, kept):
    """Columns of as many blocks as there is room for."""
    for j in range(kept.shape[0]):
        survey._keep(S, rows, kept[j])


def filled(body):
    """A block whose lanes all follow one body."""
    S = scratch(estimates.ROWS)
    for row, value in enumerate(contenders._row(body, 1)):
        S[W * row : W * (row + 1)] = value
    S[estimates.MORE.spin_rate : estimates.MORE.spin_rate + W] = 1.0
    lanes.follow(S, lanes.RECURRENCE, 1, task.SAMPLES, (False,) * 5, lanes.NONE)
    return S


def laid_out(bodies):
    """A tile's rows and keys, planned; and what plans them anew."""
    I1, I2, I3, axis, omega0, epsilon, phase = rigid_body.points_of(bodies.points)
    T, keys = np.empty(survey.PITCH * (survey.GATHERED + 1)), np.zeros(len(bodies), dtype=np.int64)

    def plan():
        survey._lay_out(T, (I1, I2, I3, omega0, epsilon, phase))
        survey._plan(T, axis, task.SPACING, task.SAMPLES, keys)

    plan()
    return T, keys, plan


def parts(count):
    """Name → what is timed, and how many runs it stands for."""
    bodies = task.draw(count)
    few = bodies[:: max(count // survey.TILE, 1)][: survey.TILE]  # a tile
    S, size, blocks = filled(bodies[:1]), len(few), math.ceil(len(few) / W)
    T, keys, plan = laid_out(few)
    order, _ = cut(keys, survey.LEVELS)
    rows = np.flatnonzero([name in contenders.WANTED for name in estimates.MEASURED])
    kept, at = np.empty((blocks, rows.size | 1, W)), np.arange(size, dtype=np.uint32)
    out = np.empty((rows.size, size))
    loops = {
        "constants of the recurrence": (lanes.begin_recurrence, 1),
        "state, sums, windows": (lanes.begin, 1),
        "first guess": (lanes.guess, 1),
        "64 steps and samples": (steps_and_samples, task.SAMPLES // lanes.AT_ONCE),
        "columns from sums": (told, 1),
    }
    run = contenders.Polhode.run
    return {
        "the whole": (lambda: survey.measured(bodies.points, *run, 1e-10, "exact", contenders.WANTED), count),
        "laid out and planned": (plan, size),
        "sorted": (lambda: cut(keys, survey.LEVELS), size),
        "gathered": (lambda: gathered(S.copy(), T, order), size),
        **{name: (lambda loop=loop, n=n: repeated(loop, S, blocks * n), size) for name, (loop, n) in loops.items()},
        "columns kept": (lambda: stored(S, rows, kept), size),
        "columns sorted back": (lambda: survey._sort_back(0, kept.ravel(), at, 0, size, out), size),
    }


def main(arguments=None):
    """Print ns a run of each part, and the whole over steps and samples."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--tiny", action="store_true", help="a few bodies and rounds: does it run")
    tiny = parser.parse_args(arguments).tiny
    count, rounds = (64, 2) if tiny else (8 * survey.TILE, 60)
    timed = parts(count)
    calls, runs = zip(*timed.values(), strict=True)
    for call in calls:
        call()
    found = np.divide(least(rounds, *calls, clock=time.thread_time), runs) * 1e9
    told = dict(zip(timed, found, strict=True))
    for name, nanoseconds in told.items():
        print(f"{name:28s} {nanoseconds:8.1f} ns a run")
    known = found.sum() - told["the whole"]
    print(f"{'the rest':28s} {told['the whole'] - known:8.1f} ns a run")
    print(f"the whole over steps and samples: {told['the whole'] / told['64 steps and samples']:.2f}")


if __name__ == "__main__":
    main()
