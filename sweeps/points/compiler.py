"""The program that `sweeps.points.compile` starts: it calls examples, which compiles kernels, side by side."""

import gc
import pickle
import signal
import sys
import warnings
from concurrent.futures import ProcessPoolExecutor, as_completed
from importlib import import_module
from multiprocessing import get_context
from pathlib import Path

from sweeps.process import interrupts, machine, startup
from sweeps.systems.system import Example


def main() -> None:
    """Compile the kernels of the examples that the standard input contains, and print a line for each."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # who started this program hears it, and ends it
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))
    examples = pickle.load(sys.stdin.buffer)
    side_by_side = [example for example in examples if not example.is_last]
    pool = ProcessPoolExecutor(machine.cores(), get_context("spawn"), _begin)
    try:
        for group in (side_by_side, *([example] for example in examples if example.is_last)):
            for future in as_completed([pool.submit(call, example) for example in group]):
                future.result()
                print(flush=True)
    finally:
        interrupts.abandon(pool)  # all is stored: to take the compiler down would last 0.6 s


def _begin() -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    interrupts.end_with_the_parent()
    startup.configure()
    gc.set_threshold(100_000)  # most of what a compiler makes stays: at 700, looking for garbage takes a seventh


def call(example: Example) -> None:
    """Compile and store the kernels of one example, by calling it."""
    from numba import NumbaExperimentalFeatureWarning

    from kernels.cache import load

    with warnings.catch_warnings():
        # kernels take a system's compiled step as an argument, which Numba calls an experiment
        warnings.filterwarnings("ignore", category=NumbaExperimentalFeatureWarning)
        is_generated = example.module.endswith(".py")
        module = load(Path(example.module)) if is_generated else import_module(f"kernels.{example.module}")
        if example.function:
            getattr(module, example.function)(*example.arguments)


if __name__ == "__main__":
    main()
