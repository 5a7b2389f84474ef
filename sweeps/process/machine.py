"""Processors and memory of this machine that a process uses."""

import ctypes
import os
from array import array
from contextlib import suppress

KEPT_BYTES = 2**28
TRIM_THRESHOLD, MMAP_THRESHOLD = -1, -3  # parameters of glibc's mallopt(3)


def cores() -> int:
    """Return the number of processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def rounds_to_nearest() -> bool:
    """Return True if this thread rounds to the nearest double and keeps subnormal numbers (IEEE 754's defaults).

    Other programs in the process may have changed the processor's mode; threads started here inherit it.
    """
    one, tiny, least = (array("d", [value]) for value in (1.0, 2.0**-54, 5e-324))  # no constants that Python folds
    up, down = one[0] + tiny[0] > 1.0, -one[0] - tiny[0] < -1.0
    toward_zero = one[0] + 3.0 * tiny[0] == 1.0
    return not (up or down or toward_zero) and least[0] * one[0] > 0.0


def keep_freed() -> None:
    """Let this process keep freed memory, up to a quarter of a gibibyte, where the C library allows it.

    glibc gives large blocks back to the system at once. Columns of the next block then cost a page fault for every
    4 KiB, on which threads wait for each other: a tenth of a sweep's time.
    """
    try:
        mallopt = ctypes.CDLL(None).mallopt
    except (AttributeError, OSError, TypeError):  # another C library
        return
    mallopt(MMAP_THRESHOLD, KEPT_BYTES)
    mallopt(TRIM_THRESHOLD, KEPT_BYTES)


def give_back() -> None:
    """Return the memory that :func:`keep_freed` has kept to the system, where the C library allows it."""
    with suppress(AttributeError, OSError, TypeError):
        ctypes.CDLL(None).malloc_trim(0)
