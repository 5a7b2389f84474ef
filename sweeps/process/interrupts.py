"""Child processes that leave Ctrl-C to their parent and end with it."""

import multiprocessing
import os
import signal
import threading
from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from multiprocessing import resource_tracker

PATIENCE = 2.0  # s for a process to end that was told to


@contextmanager
def left_to_the_parent() -> Iterator[None]:
    """Let processes started in this block ignore Ctrl-C, which a terminal sends to all, from the first instruction."""
    resource_tracker.ensure_running()  # which unblocks it where it is started later
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def end_with_the_parent() -> None:
    """Let this child process end when its parent has ended, for whatever reason."""

    def wait():
        multiprocessing.parent_process().join()
        os._exit(1)

    threading.Thread(target=wait, daemon=True).start()


def abandon(pool: Executor) -> None:
    """End the processes that this process has started by `multiprocessing`, then their pool.

    One that is only starting would miss what it shares with the pool, and say so.
    """
    children = multiprocessing.active_children()
    for child in children:
        child.terminate()
    for child in children:
        child.join(PATIENCE)
    pool.shutdown(cancel_futures=True)  # waits: its thread, with no process left, ends at once
