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
    """Processes started in this block do not hear Ctrl-C, which a terminal sends to all; nor do threads.

    They are blocked from their first instruction on, where nothing of ours could yet ignore it.
    """
    resource_tracker.ensure_running()  # which unblocks it where it is started later
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def end_with_the_parent() -> None:
    """Lets this process, which another started, end when that one has ended, however that ended."""

    def wait():
        multiprocessing.parent_process().join()
        os._exit(1)

    threading.Thread(target=wait, daemon=True).start()


def abandon(pool: Executor) -> None:
    """Ends a pool and what this process has started by `multiprocessing`.

    The processes first: one that is only starting would miss what it shares with the pool, and say so.
    """
    abandon_processes()
    pool.shutdown(wait=False, cancel_futures=True)


def abandon_processes() -> None:
    """Ends what this process has started by `multiprocessing`: where they wrote, nothing more comes.

    What was half-written, who shared the place with them removes, or the next run.
    """
    children = multiprocessing.active_children()
    for child in children:
        child.terminate()
    for child in children:
        child.join(PATIENCE)
