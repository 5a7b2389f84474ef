"""Compilation of a sweep's kernels before it is measured: once per machine, by as many processes as processors.

`sweeps.points.columns`, the only caller of the kernels, calls `ensure_compiled`. The processes are those of a program,
`sweeps.points.compile_worker`: a process that may have no children can start it, and a script is not run again.
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

from kernels.compile import jit
from kernels.compile.cache import cache_folder, why_unkept
from kernels.compile.fingerprint import replace, stamp
from sweeps.points.sweep import Sweep
from sweeps.process import machine, progress
from sweeps.systems.system import Example

ROOT = Path(__file__).parents[2]
SERIAL_FACTOR = 1.5  # ratio of the compile time of one process to that of two
_compiled: set[str] = set()  # names of the examples that were compiled or found compiled in this process


def ensure_compiled(sweep: Sweep) -> None:
    """Compile the kernels of a sweep that are not compiled yet, with a bar on a terminal or in a notebook."""
    examples = sweep.system.examples(sweep.definition)
    names = {example.name for example in examples}
    if names <= _compiled or jit.is_plain():
        return
    if line := compile_notice(sweep):
        progress.print_line(line)
        compile_examples(examples)
    _compiled.update(names)


def missing_examples(examples: Iterable[Example]) -> list[Example]:
    """Return those examples that were not called on this machine, or were before an edit of their kernels."""
    return [example for example in examples if _read_text(_mark_file(example)) != stamp(_module_file(example))]


def compile_seconds(sweep: Sweep) -> float:
    """Return how long it takes to compile the kernels of a sweep that are not compiled yet, s, about."""
    examples = sweep.system.examples(sweep.definition)
    share = len(missing_examples(examples)) / len(examples) if examples else 0.0
    alone = share and (machine.num_processors() == 1 or why_unkept())
    return sweep.system.compile_seconds * share * (SERIAL_FACTOR if alone else 1.0)


def compile_notice(sweep: Sweep) -> str:
    """Return a line about the kernels to be compiled for a sweep, and the time for it; empty if none is missing."""
    time, line = compile_seconds(sweep), f"compiling the kernels of {sweep.system.name}"
    if time and (why := why_unkept()):
        return f"{line}, about {time:.0f} s: {cache_warning(why)}"
    return f"{line}, once per machine, about {time:.0f} s" if time else ""


def cache_warning(why: str) -> str:
    """Return the message about kernels that cannot be kept."""
    return f"they cannot be kept ({why}), and every process compiles them again; allowed: a folder in NUMBA_CACHE_DIR"


def compile_examples(examples: Iterable[Example]) -> None:
    """Compile the missing kernels by calling examples in child processes; one program at a time does so.

    Raises:
        OSError: if another process cannot be started.
        RuntimeError: if a kernel cannot be compiled.
    """
    if why_unkept():  # another process cannot pass its compiled kernels on
        return
    with _exclusive_lock():
        if examples := missing_examples(examples):
            _run_compiler(examples)
            for example in examples:
                with suppress(OSError):  # a folder that cannot be written contains no kernels either
                    replace(_mark_file(example), stamp(_module_file(example)).encode())


def _mark_file(example: Example) -> Path:
    """Return the file that contains, once an example was called, the stamp of its module."""
    return cache_folder() / "ready" / example.name


def _module_file(example: Example) -> Path:
    """Return the source file of an example's module, generated or in `kernels`."""
    return (
        Path(example.module)
        if example.module.endswith(".py")
        else ROOT / "kernels" / f"{example.module.replace('.', '/')}.py"
    )


def _read_text(path: Path) -> str:
    """Return the text of a file, "" if it cannot be read."""
    try:
        return path.read_text()
    except (OSError, ValueError):
        return ""


def _run_compiler(examples: list[Example]) -> None:
    """Compile examples in a child process, with progress; raise its errors."""
    path = os.pathsep.join([str(ROOT), *filter(None, [os.environ.get("PYTHONPATH")])])
    options = {"env": {**os.environ, "PYTHONPATH": path}, "stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
    with tempfile.TemporaryFile("w+") as messages:
        command = [sys.executable, "-P", "-m", "sweeps.points.compile_worker"]
        program = subprocess.Popen(command, stderr=messages, **options)
        try:
            with progress.count_pieces(len(examples), "compiling") as advance:
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
def _exclusive_lock() -> Iterator[None]:
    """Let one process at once run the block, if the file system has locks."""
    handle = os.open(cache_folder() / ".compiling", os.O_RDWR | os.O_CREAT, 0o600)
    try:
        with suppress(OSError):
            fcntl.flock(handle, fcntl.LOCK_EX)
        yield
    finally:
        os.close(handle)
