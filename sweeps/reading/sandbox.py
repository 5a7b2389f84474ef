"""Run a reader in a child process of bounded time and memory that can open, write and contact nothing.

Libraries for binary formats were not made for files that mean harm, or that a disk has damaged: some bring them down,
keep them busy for ever, or link to files elsewhere, which they open. The child inherits the open file, and may open no
further file or socket. If it refuses the file, fails or dies, the caller gets a `ChildError`.
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
from dataclasses import astuple
from functools import partial
from importlib import import_module
from typing import Any

from sweeps.schema.refusals import RefusedError, UnreadableError

MAX_ANSWER_BYTES = 2**28  # bytes of a part of an answer
MAX_BYTES = 2**29  # memory of a reader
MAX_REASON = 200  # characters of the text of a library's error
MAX_SECONDS = 8.0  # processor time of a reader, s; a gibibyte of the file adds one second
PATIENCE = 60.0  # s between two parts of an answer, enough for a slow disk
FORKS = sys.platform == "linux"  # elsewhere a fork does not bear the threads of a parent
# The libraries that read in a child are loaded before its limits are set.
LIBRARIES = ("h5py", "pandas", "pyarrow.pandas_compat", "pyarrow.parquet", "trimesh")
SPAWNED = "import pickle, sys; sys.path[:] = pickle.load(sys.stdin.buffer); pickle.load(sys.stdin.buffer)()"
_END = b"\xff" * 8  # end of an answer, in place of a part's length


class ChildError(Exception):
    """The error by which a child ended, as text; "" for a child that died, or took too long or too much."""

    def __init__(self, reason: str = "", is_refusal: bool = False):
        super().__init__(reason)
        self.is_refusal = is_refusal  #: True if the child raised a `RefusedError`


def run_in_child(work: Callable[[], dict], size: int) -> dict:
    """Return what a function returns in a child process, a value of JSON's types; it reads a file of so many bytes."""
    (answer,) = parts_from_child(partial(_as_json, work), MAX_SECONDS + size / 2**30)
    return _from_json(answer)


def _from_json(content: bytes) -> Any:
    """Return the value of JSON text, which a child whose memory the file has overwritten may not have written."""
    try:
        return json.loads(content)
    except ValueError:
        raise ChildError from None


def _as_json(work: Callable[[], dict]) -> Iterator[bytes]:
    yield json.dumps(work()).encode()


def parts_from_child(
    work: Callable[[], Iterable[bytes]], seconds: float, memory: float | None = None
) -> Iterator[bytes]:
    """Yield the parts that a function yields in a child process.

    Args:
        work: yields parts of at most `MAX_ANSWER_BYTES`.
        seconds: processor time of the child, s.
        memory: bytes of memory that it may use; left out, `MAX_BYTES`; infinite if it may also open files, a user's own
            program, and its time alone is bounded.

    Raises:
        UnreadableError: that of the child.
        ChildError: for every other end without an answer.
    """
    reading, writing = os.pipe()
    # blocked: what Ctrl-C raises as a fork begins or ends, Python reports and forgets
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        child = (_fork_child if FORKS else _spawn_child)(
            work, writing, (seconds, MAX_BYTES if memory is None else memory)
        )
        os.close(writing)
        try:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)
            while (head := _read_bytes(reading, 8)) != _END:
                yield _read_bytes(reading, int.from_bytes(head, "little"))
            size = int.from_bytes(_read_bytes(reading, 8), "little")
            reason, *details = _from_json(_read_bytes(reading, size))
            if reason == "unreadable":
                raise UnreadableError(tuple(details[0]), *details[1:])
            if reason:
                raise ChildError(*details)
        finally:
            os.close(reading)
            _end_child(child)
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _fork_child(work: Callable, writing: int, bounds: tuple[float, float]) -> int:
    """Start a child that does the work and writes its answer to the pipe; return its process number."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # of threads: the child starts none and takes no lock
        child = os.fork()
    if not child:
        _work_and_end(work, writing, bounds)
    return child


def _spawn_child(work: Callable, writing: int, bounds: tuple[float, float]) -> int:
    """Start a new Python; `work` is pickled, and what it has open is opened again as that is read."""
    modules = [name for name in LIBRARIES if name in sys.modules]
    read_end, write_end = os.pipe()
    with os.fdopen(write_end, "wb") as pipe:  # some kilobytes: a pipe holds more
        pipe.write(pickle.dumps(sys.path) + pickle.dumps(partial(_work_and_end, work, 1, bounds, modules)))
    actions = [(os.POSIX_SPAWN_DUP2, read_end, 0), (os.POSIX_SPAWN_DUP2, writing, 1)]
    child = os.posix_spawn(sys.executable, [sys.executable, "-c", SPAWNED], os.environ, file_actions=actions)
    os.close(read_end)
    return child


def _read_bytes(reading: int, size: int) -> bytes:
    """Return `size` bytes of the child's answer; raise a ChildError for silence or an early end."""
    if size > MAX_ANSWER_BYTES:
        raise ChildError
    chunks: list[bytes] = []
    missing = size
    while missing:
        ready, _, _ = select.select([reading], [], [], PATIENCE)
        chunk = os.read(reading, min(missing, 2**20)) if ready else b""
        if not chunk:
            raise ChildError
        chunks, missing = [*chunks, chunk], missing - len(chunk)
    return b"".join(chunks)


def _end_child(child: int) -> None:
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
        os.dup2(os.open(os.devnull, os.O_WRONLY), 2)  # messages of the C library when it crashes
        _limit_all(*bounds)
        reason = _write_parts(work, writing)
        _write_bytes(writing, _END)
        _write_part(writing, json.dumps(reason).encode())
    finally:
        os._exit(0)


def _write_parts(work: Callable[[], Iterable[bytes]], writing: int) -> list:
    """Write the parts of an answer; return the error that ended it: its kind, "" without one, and its contents."""
    try:
        for part in work():
            _write_part(writing, part)
    except UnreadableError as refused:
        return ["unreadable", *astuple(refused.problem)]
    except MemoryError:
        raise
    except Exception as error:  # libraries let errors of every class through
        is_refusal = isinstance(error, RefusedError)
        text = str(error)[: None if is_refusal else MAX_REASON] or type(error).__name__
        return ["failed", "".join(c if c.isprintable() else " " for c in text), is_refusal]
    return [""]


def _write_part(writing: int, content: bytes) -> None:
    _write_bytes(writing, len(content).to_bytes(8, "little"))
    _write_bytes(writing, content)


def _write_bytes(writing: int, content: bytes) -> None:
    remaining = memoryview(content)
    while remaining:
        remaining = remaining[os.write(writing, remaining) :]


def _limit_all(seconds: float, memory: float) -> None:
    """Bound time, memory and files of this process; time alone on a system without the further limits."""
    _set_limit(resource.RLIMIT_CPU, math.ceil(seconds))
    _set_limit(resource.RLIMIT_CORE, 0)
    if math.isinf(memory):
        return
    with suppress(OSError), open("/proc/self/statm") as file:
        mapped_bytes = int(file.read().split()[0]) * resource.getpagesize()
        _set_limit(resource.RLIMIT_AS, mapped_bytes + memory)
    _set_limit(resource.RLIMIT_FSIZE, 0)
    for name in ("ascii", "latin-1", "utf-16", "utf-8-sig"):
        codecs.lookup(name)  # Python reads these from files on their first use
    _set_limit(resource.RLIMIT_NOFILE, 0)  # what is open stays open


def _set_limit(resource_number: int, value: int) -> None:
    soft, hard = resource.getrlimit(resource_number)
    limits = [limit for limit in (value, soft, hard) if limit != resource.RLIM_INFINITY]
    resource.setrlimit(resource_number, (min(limits), hard))
