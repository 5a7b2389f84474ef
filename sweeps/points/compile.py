"""Compile what a sweep's system calls, before it is measured: once per machine, by as many processes as processors.

`sweeps.points.columns`, the one way to the kernels, calls `ensure`. The processes are those of a program of its own,
`sweeps.points.compiler`: a process that may have no children can call it, and a script is not run again.
"""

import fcntl
import os
import pickle
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from kernels import jit
from kernels.cache import cache_folder, why_unkept
from kernels.fingerprint import replace, stamp
from sweeps.points.sweep import Sweep
from sweeps.process import machine, progress
from sweeps.systems.system import Example

ROOT = Path(__file__).parents[2]
SECONDS_ALONE = 1.5  # One process takes this many times the seconds of two.
_compiled: set[str] = set()  # names of the examples of which this process knows that they are compiled


def ensure(sweep: Sweep) -> None:
    """Compile the kernels of a sweep that are not compiled yet, with a bar on a terminal or in a notebook."""
    examples = sweep.system.examples(sweep.definition)
    names = {example.name for example in examples}
    if names <= _compiled or jit.is_plain():
        return
    if line := announcement(sweep):
        progress.say(line)
        compile_examples(examples)
    _compiled.update(names)


def missing(examples: Iterable[Example]) -> list[Example]:
    """Return those examples that were not called on this machine, or were before an edit of their kernels."""
    return [example for example in examples if _read(_mark(example)) != stamp(_file(example))]


def seconds(sweep: Sweep) -> float:
    """Return how long it takes to compile the kernels of a sweep that are not compiled yet, s, about."""
    examples = sweep.system.examples(sweep.definition)
    share = len(missing(examples)) / len(examples) if examples else 0.0
    alone = share and (machine.cores() == 1 or why_unkept())
    return sweep.system.compile_seconds * share * (SECONDS_ALONE if alone else 1.0)


def announcement(sweep: Sweep) -> str:
    """Return a line about what is compiled for a sweep, and how long that takes; empty if nothing is missing."""
    time, line = seconds(sweep), f"compiling the kernels of {sweep.system.name}"
    if time and (why := why_unkept()):
        return f"{line}, about {time:.0f} s: {unkept(why)}"
    return f"{line}, once per machine, about {time:.0f} s" if time else ""


def unkept(why: str) -> str:
    """Return the message about kernels that cannot be kept."""
    return f"they cannot be kept ({why}), and every process compiles them again; allowed: a folder in NUMBA_CACHE_DIR"


def compile_examples(examples: Iterable[Example]) -> None:
    """Compile the missing kernels by calling examples in other processes; one program at a time does so.

    Raises:
        OSError: if another process cannot be started.
        RuntimeError: if a kernel cannot be compiled.
    """
    if why_unkept():  # what is compiled by another process would be lost
        return
    with _alone():
        if examples := missing(examples):
            _run(examples)
            for example in examples:
                with suppress(OSError):  # where nothing can be written, nothing is kept either
                    replace(_mark(example), stamp(_file(example)).encode())


def _mark(example: Example) -> Path:
    """Return the file that contains, once an example was called, the stamp of its module."""
    return cache_folder() / "ready" / example.name


def _file(example: Example) -> Path:
    return Path(example.module) if example.module.endswith(".py") else ROOT / "kernels" / f"{example.module}.py"


def _read(path: Path) -> str:
    try:
        return path.read_text()
    except (OSError, ValueError):
        return ""


def _run(examples: list[Example]) -> None:
    path = os.pathsep.join([str(ROOT), *filter(None, [os.environ.get("PYTHONPATH")])])
    options = {"env": {**os.environ, "PYTHONPATH": path}, "stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
    with tempfile.TemporaryFile("w+") as messages:
        command = [sys.executable, "-P", "-m", "sweeps.points.compiler"]
        program = subprocess.Popen(command, stderr=messages, **options)
        try:
            with progress.pieces(len(examples), "compiling") as advance:
                program.stdin.write(pickle.dumps(examples))
                program.stdin.close()
                import numba  # noqa: F401  (settings that it cannot read are refused here, and not in the program)

                for _ in program.stdout:
                    advance()
            status = program.wait()
        finally:
            program.terminate()
            program.wait()
        if status:
            messages.seek(0)
            raise RuntimeError(f"the kernels cannot be compiled: {messages.read().strip()[-2000:]}")


@contextmanager
def _alone() -> Iterator[None]:
    """Let one process at once continue, where the file system has locks."""
    handle = os.open(cache_folder() / ".compiling", os.O_RDWR | os.O_CREAT, 0o600)
    try:
        with suppress(OSError):
            fcntl.flock(handle, fcntl.LOCK_EX)
        yield
    finally:
        os.close(handle)
