"""What is waited for, said once it has taken long."""

import contextvars
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager

from sweeps.process import progress

SECONDS_ON_A_TERMINAL, SECONDS_IN_A_LOG = 2.0, 10.0


@contextmanager
def said(what: str) -> Iterator[None]:
    """Print a line on the error stream if the block takes more than two seconds; in a log, more than ten."""
    seconds = SECONDS_ON_A_TERMINAL if sys.stderr.isatty() else SECONDS_IN_A_LOG
    timer = threading.Timer(seconds, contextvars.copy_context().run, (progress.say, f"{what} …"))
    timer.daemon = True
    timer.start()
    try:
        yield
    finally:
        timer.cancel()
        timer.join()  # a process without threads can be copied
