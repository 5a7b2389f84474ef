"""The program that `sweeps.points.compile_kernels` starts: it calls examples, which compiles kernels, side by side."""

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
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent process receives it, and ends this program
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))
    examples = pickle.load(sys.stdin.buffer)
    side_by_side = [example for example in examples if not example.is_last]
    pool = ProcessPoolExecutor(machine.num_processors(), get_context("spawn"), _start_worker)
    try:
        for group in (side_by_side, *([example] for example in examples if example.is_last)):
            for future in as_completed([pool.submit(call_example, example) for example in group]):
                future.result()
                print(flush=True)
    finally:
        interrupts.end_processes(pool)  # all is stored; a regular end of the compiler would last 0.6 s


def _start_worker() -> None:
    """Prepare a process of the pool: no interrupts, end with the parent, rare garbage collection."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    interrupts.exit_with_parent()
    startup.configure()
    gc.set_threshold(100_000)  # most objects of a compiler stay: at 700, collection takes a seventh of the time


def call_example(example: Example) -> None:
    """Compile and store the kernels of one example, by calling it."""
    from numba import NumbaExperimentalFeatureWarning

    from kernels.compile.cache import load

    with warnings.catch_warnings():
        # kernels take a system's compiled step as an argument, which Numba calls an experiment
        warnings.filterwarnings("ignore", category=NumbaExperimentalFeatureWarning)
        has_path = example.module.endswith(".py")
        module = load(Path(example.module)) if has_path else import_module(f"kernels.{example.module}")
        if example.function:
            getattr(module, example.function)(*example.arguments)


if __name__ == "__main__":
    main()
