"""Run a reader in a child process of bounded time and memory that can open, write and contact nothing.

Libraries for binary formats were not made for files that mean harm, or that a disk has damaged: some bring them down,
keep them busy for ever, or point to other files, which they follow. The child has the one file open already, and may
open no other, nor a socket. Its death is an answer too.
"""

import codecs
import faulthandler
import json
import math
import os
import pickle
import resource
import select
import signal
import sys
import warnings
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from functools import partial
from importlib import import_module

MOST_ANSWER_BYTES = 2**28
ROOM = 2**29  # bytes that a reader may take
SECONDS = 8.0  # of processor that a reader may take, and one more a gibibyte of the file
PATIENCE = 60.0  # s between two parts of an answer, where a disk is slow
FORKS = sys.platform == "linux"  # elsewhere a fork does not bear the threads of a parent
# what reads in a child: loaded before it is limited
LIBRARIES = ("h5py", "pandas", "pyarrow.pandas_compat", "pyarrow.parquet", "trimesh")
SPAWNED = "import pickle, sys; sys.path[:] = pickle.load(sys.stdin.buffer); pickle.load(sys.stdin.buffer)()"
_END = b"\xff" * 8  # in place of the length of one more part


class ChildError(Exception):
    """The child died, or took too long or too much."""


def run_in_child(work: Callable[[], dict], size: int) -> dict | None:
    """Return what a function returns in a child process; None where the child died, or took too long or too much.

    It returns a value of JSON's types, and reads a file of so many bytes.
    """
    try:
        (answer,) = parts_from_child(partial(_as_json, work), SECONDS + size / 2**30)
        return json.loads(answer)
    except (ChildError, ValueError):
        return None


def _as_json(work: Callable[[], dict]) -> Iterator[bytes]:
    yield json.dumps(work()).encode()


def parts_from_child(work: Callable[[], Iterable[bytes]], seconds: float, room: float | None = None) -> Iterator[bytes]:
    """Yield the parts that a function yields in a child process.

    Args:
        work: yields parts of at most `MOST_ANSWER_BYTES`.
        seconds: of processor that the child may take.
        room: bytes of memory that it may take; left out, `ROOM`; infinite where it may also open files, a user's own
            program, and its time alone is bounded.
    """
    reading, writing = os.pipe()
    # blocked: what Ctrl-C raises as a fork begins or ends, Python reports and forgets
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        child = (_forked if FORKS else _spawned)(work, writing, (seconds, ROOM if room is None else room))
        os.close(writing)
        try:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)
            while (head := _read(reading, 8)) != _END:
                yield _read(reading, int.from_bytes(head, "little"))
        finally:
            os.close(reading)
            _end(child)
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _forked(work: Callable, writing: int, bounds: tuple[float, float]) -> int:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # of threads: the child starts none and takes no lock
        child = os.fork()
    if not child:
        _work_and_end(work, writing, bounds)
    return child


def _spawned(work: Callable, writing: int, bounds: tuple[float, float]) -> int:
    """Start a new Python; `work` is pickled, and what it has open is opened again as that is read."""
    loaded = [name for name in LIBRARIES if name in sys.modules]
    given, giving = os.pipe()
    with os.fdopen(giving, "wb") as pipe:  # some kilobytes: a pipe holds more
        pipe.write(pickle.dumps(sys.path) + pickle.dumps(partial(_work_and_end, work, 1, bounds, loaded)))
    actions = [(os.POSIX_SPAWN_DUP2, given, 0), (os.POSIX_SPAWN_DUP2, writing, 1)]
    child = os.posix_spawn(sys.executable, [sys.executable, "-c", SPAWNED], os.environ, file_actions=actions)
    os.close(given)
    return child


def _read(reading: int, size: int) -> bytes:
    if size > MOST_ANSWER_BYTES:
        raise ChildError
    parts, left = [], size
    while left:
        ready, _, _ = select.select([reading], [], [], PATIENCE)
        part = os.read(reading, min(left, 2**20)) if ready else b""
        if not part:
            raise ChildError
        parts, left = [*parts, part], left - len(part)
    return b"".join(parts)


def _end(child: int) -> None:
    with suppress(ProcessLookupError):
        os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)


def _work_and_end(
    work: Callable[[], Iterable[bytes]], writing: int, bounds: tuple[float, float], modules: Sequence[str] = ()
) -> None:
    """Work, answer and end, in the child, whatever happens; the process it was copied from must not go on here."""
    try:
        faulthandler.disable()
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGALRM):
            signal.signal(number, signal.SIG_DFL)
        for name in modules:
            import_module(name)
        os.dup2(os.open(os.devnull, os.O_WRONLY), 2)  # what the C library has to say at its death
        _limit_all(*bounds)
        for part in work():
            _write(writing, len(part).to_bytes(8, "little"))
            _write(writing, part)
        _write(writing, _END)
    finally:
        os._exit(0)


def _write(writing: int, content: bytes) -> None:
    content = memoryview(content)
    while content:
        content = content[os.write(writing, content) :]


def _limit_all(seconds: float, room: float) -> None:
    """Bound what this process may take; where a system does not know a limit, time alone is bounded."""
    _limit(resource.RLIMIT_CPU, math.ceil(seconds))
    _limit(resource.RLIMIT_CORE, 0)
    if math.isinf(room):
        return
    with suppress(OSError), open("/proc/self/statm") as file:
        mapped = int(file.read().split()[0]) * resource.getpagesize()
        _limit(resource.RLIMIT_AS, mapped + room)
    _limit(resource.RLIMIT_FSIZE, 0)
    for name in ("ascii", "latin-1", "utf-16", "utf-8-sig"):
        codecs.lookup(name)  # Python reads these from files on their first use
    _limit(resource.RLIMIT_NOFILE, 0)  # what is open stays open


def _limit(what: int, value: int) -> None:
    soft, hard = resource.getrlimit(what)
    least = [limit for limit in (value, soft, hard) if limit != resource.RLIM_INFINITY]
    resource.setrlimit(what, (min(least), hard))
