"""What errors cost, piece by piece: ns a point on the default sweep, beside the survey with and without them.

    python tests/benchmarks/cost_of_errors.py [--tiny]

Two surveys are told apart: without errors and their terms, and without what stands on them as well: the reduced rate²,
regimes and rates, ten columns more that are no errors. The second spares the pieces that are printed. Beside some 700
ns, 1.05 leaves 35, and each piece has a bound of its own on a core that starts two packed operations a cycle (8 lanes,
2.7 GHz): the reduction 20 a sample, 50 samples, 23 ns; terms 4 roots of 24 cycles and 4 quotients of 16, 7 ns; rates 5
and 4, 9 ns; 160 bytes of columns, written twice and read once between a core's own caches, 15 ns and more. So the first
ratio can be 1.05, the second cannot.

Least of interleaved rounds by the thread's processor time: other work on the machine only adds.
"""

import argparse
import math
import time

import kernel
import numpy as np
from numba import njit

from kernels import findings, lanes, survey
from kernels.blocks import W, scratch

ALL, FEW, NONE = kernel.WITH_ERRORS, kernel.WITHOUT_ERRORS, kernel.FREE_OF_ERRORS


def samples_by(take):
    """Samples of every lane, taken by a loop of `kernels.lanes`; how many windows are open."""

    @njit(error_model="numpy")
    def sampled(S, times):
        opened = 0
        for _ in range(times):
            opened += take(S, True)
        return opened

    return sampled


sampled, reduced = (samples_by(take) for take in (lanes._sample_alone, lanes._sample_first_order))


@njit(error_model="numpy")
def told(S, times):
    """The reduced rate² and the terms of errors."""
    for _ in range(times):
        findings._tell_errors(S, False, False, False)


@njit(error_model="numpy")
def rated(S, times):
    """Rates of both rates², with errors."""
    for _ in range(times):
        findings._tell_rates(S)
        findings._tell_reduced_rates(S)


@njit(error_model="numpy")
def stored(S, kept, rows):
    """Columns of as many blocks as there is room for, kept as a survey keeps them."""
    for j in range(kept.shape[0]):
        survey._keep(S, rows, kept[j])


def filled(points, settings):
    """A block whose lanes all follow the first of the points, at its end."""
    S, spacing = scratch(findings.ROWS), 2.0 * math.pi / settings[1]
    given = {lanes.MA: "I1", lanes.MB: "I2", lanes.MC: "I3", lanes.EPSILON: "epsilon"}
    for row, name in given.items():
        S[row : row + W] = points[name][0] / (points["I3"][0] if name[0] == "I" else 1.0)
    for row, value in ((lanes.SPIN, 1.0), (lanes.COSINE, 0.8), (lanes.SINE, 0.6), (lanes.SPACING, spacing)):
        S[row : row + W] = value
    S[lanes.STEPS : lanes.STEPS + W], S[findings.MORE.spin_rate : findings.MORE.spin_rate + W] = 1.0, 1.0
    lanes.follow(S, -12, 1, 8, True, True, False, lanes.FIRST_ORDER)
    findings.tell(S, True, True, False, True, lanes.FIRST_ORDER, False, False, settings[2])
    return S


def pieces(settings, points):
    """Name → what is timed and how often it is to be counted, for all the points."""
    count = points["I1"].size
    S, blocks = filled(points, settings), math.ceil(count / W)
    samples = round(survey.measured(points, *settings, wanted=("samples_used",))["samples_used"].mean())
    more = np.flatnonzero([name in ALL and name not in NONE for name in findings.MEASURED])
    size = min(count, survey.TILE)
    kept, at = np.empty((math.ceil(size / W), more.size | 1, W)), np.random.default_rng(1).permutation(size)
    at = (at // W * kept.shape[1] * W + at % W).astype(np.uint32)
    out, tiles = np.empty((more.size, size)), count / size
    return {
        "all columns": (lambda: survey.measured(points, *settings, wanted=ALL), 1),
        "without errors": (lambda: survey.measured(points, *settings, wanted=FEW), 1),
        "... regimes and rates": (lambda: survey.measured(points, *settings, wanted=NONE), 1),
        "samples": (lambda: sampled(S, blocks * samples), 1),
        "samples, reduced": (lambda: reduced(S, blocks * samples), 1),
        "terms of errors": (lambda: told(S, blocks), 1),
        "rates": (lambda: rated(S, blocks), 1),
        "columns kept": (lambda: stored(S, kept, more), tiles),
        "columns sorted back": (lambda: survey._sort_back(0, kept.ravel(), at, 0, size, out), tiles),
    }


def main(arguments=None):
    """Print ns a point of each piece, and both ratios."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--tiny", action="store_true", help="a few points and rounds: does it run")
    tiny = parser.parse_args(arguments).tiny
    settings, points = kernel.part_of_default(1000 if tiny else 16384)
    count, timed, least = points["I1"].size, pieces(settings, points), {}
    for call, _ in timed.values():
        call()
    for _ in range(2 if tiny else 100):
        for name, (call, times) in timed.items():
            begun = time.thread_time()
            call()
            least[name] = min(least.get(name, math.inf), times * (time.thread_time() - begun) * 1e9 / count)
    least["the reduction's first order"] = least.pop("samples, reduced") - least.pop("samples")
    for name, nanoseconds in least.items():
        print(f"{name:28s} {nanoseconds:8.1f} ns a point")
    print(f"with errors over without {least['all columns'] / least['without errors']:.3f}")
    print(f"... and without regimes, rates {least['all columns'] / least['... regimes and rates']:.3f}")


if __name__ == "__main__":
    main()
