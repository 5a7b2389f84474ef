"""Free memory of this machine, and memory that is reused block after block."""

import ctypes
from contextlib import suppress

KEPT_BYTES = 2**28
TRIM_THRESHOLD, MMAP_THRESHOLD = -1, -3  # of glibc's mallopt(3)


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


def available() -> int:
    """Return the bytes of memory that are available without swapping."""
    with suppress(OSError, ValueError), open("/proc/meminfo") as file:  # there is no need to load what reads it too
        sizes = dict(line.split(":", 1) for line in file)
        if "MemAvailable" in sizes:
            return 1024 * int(sizes["MemAvailable"].split()[0])
    import psutil

    return psutil.virtual_memory().available
