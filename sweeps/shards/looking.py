"""A look at a file in a child process of bounded time and memory, whose death is an answer too.

The library that reads HDF5 was not made for files that mean harm, or that a disk has damaged: some bring it down, or
keep it busy for ever. What the child survives, this process does.
"""

import faulthandler
import json
import math
import os
import resource
import select
import signal
import sys
import time
import warnings
from collections.abc import Callable
from contextlib import suppress

MOST_TOLD_BYTES = 2**28
ROOM = 2**29  # bytes that a look may take
SECONDS = 8.0  # of processor that a look may take, and one more a gibibyte of the file
PATIENCE = 60.0  # s, where a disk is slow


def told(look: Callable[[], dict], size: int) -> dict | None:
    """Run a function in a child process and return its result; None where it died, or took too long or too much.

    Args:
        look: what is called; its answer is of JSON's types.
        size: bytes of the file that it looks at.
    """
    if sys.platform != "linux":  # elsewhere a fork does not bear the threads of a parent
        return look()
    reading, writing = os.pipe()
    # blocked: what Ctrl-C raises as a fork begins or ends, Python tells of and forgets
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DeprecationWarning)  # of threads: the child starts none and takes no lock
            child = os.fork()
        if not child:
            _look_and_tell(look, writing, SECONDS + size / 2**30)
        os.close(writing)
        try:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)
            answer = _read_all(reading)
        finally:
            os.close(reading)
            _end(child)
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
    try:
        return json.loads(answer)
    except ValueError:
        return None


def _read_all(reading: int) -> bytes:
    """What comes out of a pipe until it is closed; b"" after a long wait."""
    parts, end, size = [], time.monotonic() + PATIENCE, 0
    while True:
        ready, _, _ = select.select([reading], [], [], max(0.0, end - time.monotonic()))
        part = os.read(reading, 2**20) if ready else b""
        if not ready or (size := size + len(part)) > MOST_TOLD_BYTES:
            return b""
        if not part:
            return b"".join(parts)
        parts.append(part)


def _end(child: int) -> None:
    with suppress(ProcessLookupError):
        os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)


def _look_and_tell(look: Callable[[], dict], writing: int, seconds: float) -> None:
    """In the child: looks, tells and ends, whatever happens; the process it was copied from must not go on here."""
    try:
        faulthandler.disable()
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGALRM):
            signal.signal(number, signal.SIG_DFL)
        os.dup2(os.open(os.devnull, os.O_WRONLY), 2)  # what the C library has to say at its death
        with open("/proc/self/statm") as file:
            mapped = int(file.read().split()[0]) * resource.getpagesize()
        _limit(resource.RLIMIT_AS, mapped + ROOM)
        _limit(resource.RLIMIT_CPU, math.ceil(seconds))
        _limit(resource.RLIMIT_CORE, 0)
        answer = json.dumps(look()).encode()
        while answer:
            answer = answer[os.write(writing, answer) :]
    finally:
        os._exit(0)


def _limit(what: int, value: int) -> None:
    soft, hard = resource.getrlimit(what)
    least = [limit for limit in (value, soft, hard) if limit != resource.RLIM_INFINITY]
    resource.setrlimit(what, (min(least), hard))
