"""Processors and memory of this machine that a process uses."""

import ctypes
import os
from array import array
from contextlib import suppress

MAX_FREED_BYTES = 2**28  # freed memory that a process keeps, several blocks of columns
TRIM_THRESHOLD, MMAP_THRESHOLD = -1, -3  # parameters of glibc's mallopt(3)


def num_processors() -> int:
    """Return the number of processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def rounds_to_nearest() -> bool:
    """Return True if this thread rounds to the nearest double and keeps subnormal numbers (IEEE 754's defaults).

    A library in the process may have changed the processor's mode; threads started here inherit it.
    """
    unit, tiny, smallest = (array("d", [value]) for value in (1.0, 2.0**-54, 5e-324))  # no constants that Python folds
    rounds_up, rounds_down = unit[0] + tiny[0] > 1.0, -unit[0] - tiny[0] < -1.0
    toward_zero = unit[0] + 3.0 * tiny[0] == 1.0
    return not (rounds_up or rounds_down or toward_zero) and smallest[0] * unit[0] > 0.0


def keep_freed_memory() -> None:
    """Let this process keep freed memory, up to a quarter of a gibibyte, if the C library allows it.

    glibc returns large blocks to the system at once. Columns of the next block then cost a page fault for every 4 KiB,
    for which threads wait: a tenth of a sweep's time.
    """
    try:
        mallopt = ctypes.CDLL(None).mallopt
    except (AttributeError, OSError, TypeError):  # another C library
        return
    mallopt(MMAP_THRESHOLD, MAX_FREED_BYTES)
    mallopt(TRIM_THRESHOLD, MAX_FREED_BYTES)


def return_freed_memory() -> None:
    """Return the memory that :func:`keep_freed_memory` has kept to the system, if the C library allows it."""
    with suppress(AttributeError, OSError, TypeError):
        ctypes.CDLL(None).malloc_trim(0)
