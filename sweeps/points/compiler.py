"""The program that `sweeps.points.compile` starts: it compiles kernels, and loads little besides Numba before."""

import gc
import json
import signal
import sys
import warnings
from concurrent.futures import FIRST_COMPLETED, ProcessPoolExecutor, wait
from importlib import import_module
from multiprocessing import get_context
from pathlib import Path

from sweeps.process import interrupts, machine, startup


def main() -> None:
    """Compile the kernels that the standard input lists, and print a line for each."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # who started this program hears it, and ends it
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))
    pending, running = dict(enumerate(json.load(sys.stdin))), {}
    cores = machine.cores()
    pool = ProcessPoolExecutor(cores, get_context("spawn"), _begin)
    try:
        while pending:
            ready = [number for number in pending if number not in running.values() and _is_ready(pending, number)]
            for number in ready[: cores - len(running)]:
                running[pool.submit(compile_kernel, *pending[number])] = number
            for done in wait(running, return_when=FIRST_COMPLETED).done:
                done.result()
                del pending[running.pop(done)]
                print(flush=True)
    finally:
        interrupts.abandon(pool)  # all is stored: to take the compiler down would last 0.6 s


def _is_ready(pending: dict[int, list], number: int) -> bool:
    """Return True where no kernel of an earlier stage, above this one in the table, is still to be compiled."""
    return all(pending[other][-1] >= pending[number][-1] for other in pending if other < number)


def _begin() -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    interrupts.end_with_the_parent()
    startup.configure()
    gc.set_threshold(100_000)  # most of what a compiler makes stays: at 700, looking for garbage takes a seventh


def compile_kernel(module: str, name: str, types: str, example: list, _stage: int) -> None:
    """Compile one kernel: a function for types, or whatever a call or an import of its module compiles."""
    from numba import NumbaExperimentalFeatureWarning

    with warnings.catch_warnings():
        # kernels take a system's compiled step as an argument, which Numba calls an experiment
        warnings.filterwarnings("ignore", category=NumbaExperimentalFeatureWarning)
        if module.endswith(".py"):
            from kernels.cache import load

            load(Path(module))
            return
        loaded = import_module(f"kernels.{module}")
        if types:
            getattr(loaded, name).compile(types)
        elif name:
            getattr(loaded, name)(*example)


if __name__ == "__main__":
    main()
