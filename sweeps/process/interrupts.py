"""Child processes that leave Ctrl-C to their parent and end with it."""

import multiprocessing
import os
import signal
import threading
from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from multiprocessing import resource_tracker

MAX_EXIT_SECONDS = 2.0  # s that a terminated process has for its end, before the pool is closed without it


@contextmanager
def ignore_interrupts() -> Iterator[None]:
    """Let processes started in this block ignore Ctrl-C from their first instruction; a terminal sends it to all."""
    resource_tracker.ensure_running()  # if it started later, it would unblock the signal
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def exit_with_parent() -> None:
    """Let this child process end when its parent has ended, for whatever reason."""

    def wait():
        multiprocessing.parent_process().join()
        os._exit(1)

    threading.Thread(target=wait, daemon=True).start()


def end_processes(pool: Executor) -> None:
    """End the processes that this process has started by `multiprocessing`, then their pool.

    If the pool were closed first, a process that is just starting would report that its connection is missing.
    """
    children = multiprocessing.active_children()
    for child in children:
        child.terminate()
    for child in children:
        child.join(MAX_EXIT_SECONDS)
    pool.shutdown(cancel_futures=True)  # waits: its thread, with no process left, ends at once
