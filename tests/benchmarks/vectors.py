"""How much whole vectors are worth: the survey's kernel with all of 512 bits and with the half that LLVM takes.

    python tests/benchmarks/vectors.py [--quick]

Two processes, each compiled one way, measure the same points of the default sweep in turn; processor time, medians of
ratios within a round, so that a busy machine moves both alike. Says so where the processor has no such choice.
"""

import argparse
import os
import statistics
import subprocess
import sys
from pathlib import Path

sys.path[:0] = [str(Path(__file__).parent), str(Path(__file__).parents[2])]

TASKS = ("rates alone", "all columns")


def answer(count):
    """A worker: for every line with a task's name the processor time that it took, s."""
    import time

    from kernel import BARE, part_of_default

    from kernels import survey

    settings, points = part_of_default(count)
    wanted = dict(zip(TASKS, (BARE, survey.MEASURED), strict=True))
    for line in sys.stdin:
        begun = time.process_time()
        survey.measured(points, *settings, wanted=wanted[line.strip()])
        print(time.process_time() - begun, flush=True)


def started(features, count):
    """A worker with these features of the processor."""
    environment = {**os.environ, "NUMBA_CPU_FEATURES": features}
    command = [sys.executable, __file__, "--answer", str(count)]
    return subprocess.Popen(command, env=environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)


def asked(worker, task):
    """Processor time of one task, s."""
    worker.stdin.write(task + "\n")
    worker.stdin.flush()
    return float(worker.stdout.readline())


def main(arguments=None):
    """Print the ratios."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="a few points and rounds: does it run")
    parser.add_argument("--answer", type=int, help=argparse.SUPPRESS)
    given = parser.parse_args(arguments)
    if given.answer:
        answer(given.answer)
        return
    import llvmlite.binding as llvm

    found = llvm.get_host_cpu_features()
    if not found.get("avx512f"):
        print(f"{llvm.get_host_cpu_name()}: no vectors of 512 bits")
        return
    features, count, rounds = found.flatten(), *((500, 2) if given.quick else (20_000, 25))
    half, whole = (started(f"{features},{sign}prefer-256-bit,+64bit", count) for sign in "+-")
    for task in TASKS:
        for worker in (half, whole):
            asked(worker, task)
        times = [(asked(half, task), asked(whole, task)) for _ in range(rounds)]
        ratios = [a / b for a, b in times]
        least = min(a for a, _ in times) / min(b for _, b in times)
        print(
            f"{llvm.get_host_cpu_name()}, {task}: whole vectors are faster by {statistics.median(ratios):.2f} "
            f"({min(ratios):.2f} to {max(ratios):.2f}; least over least {least:.2f})"
        )
    for worker in (half, whole):
        worker.stdin.close()
        worker.wait()


if __name__ == "__main__":
    main()
