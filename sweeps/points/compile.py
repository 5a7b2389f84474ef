"""Compiling what a sweep's system calls, before it is measured: once per machine, by as many processes as processors.

`sweeps.points.columns`, the one way to the kernels, calls `ensure`. The processes are those of a program of its own,
`sweeps.points.compiler`: a process that may have no children can call it, and a script is not run again.
"""

import fcntl
import hashlib
import json
import os
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
from sweeps.systems.system import Kernel

ROOT = Path(__file__).parents[2]
SHARED = 0.65  # of the seconds of all kernels, what is left where two processes share them
_ensured: set[Kernel] = set()


def ensure(sweep: Sweep) -> None:
    """Compile the kernels of a sweep that are not compiled yet, with a bar on a terminal or in a notebook."""
    kernels = sweep.system.kernels_of(sweep.definition)
    if not _ensured.issuperset(kernels) and not jit.is_plain():
        if line := announced(sweep):
            progress.say(line)
        compile_kernels(kernels)
        _ensured.update(kernels)


def missing(kernels: Iterable[Kernel]) -> list[Kernel]:
    """Return those kernels that are not compiled on this machine, or were before an edit."""
    return [kernel for kernel in kernels if _read(_mark(kernel)) != stamp(_file(kernel))]


def seconds(kernels: Iterable[Kernel]) -> float:
    """Return how long it takes to compile those of the kernels that are missing, s, about."""
    taken = sum(kernel.seconds for kernel in missing(kernels))
    return taken * SHARED if taken and machine.cores() > 1 and not why_unkept() else taken


def announced(sweep: Sweep) -> str:
    """Return a line about what is compiled for a sweep, and how long that takes; empty where nothing is missing."""
    left, line = seconds(sweep.system.kernels_of(sweep.definition)), f"compiling the kernels of {sweep.system.name}"
    if left and (why := why_unkept()):
        return f"{line}, about {left:.0f} s: {unkept(why)}"
    return f"{line}, once per machine, about {left:.0f} s" if left else ""


def unkept(why: str) -> str:
    """Return the message about kernels that cannot be kept."""
    return f"they cannot be kept ({why}), and every process compiles them again; allowed: a folder in NUMBA_CACHE_DIR"


def compile_kernels(kernels: Iterable[Kernel]) -> None:
    """Compile those of the kernels that are missing; one program at a time does so.

    Raises:
        OSError: where another process cannot be started.
        RuntimeError: where a kernel cannot be compiled.
    """
    kernels = list(kernels)
    if not missing(kernels) or why_unkept():  # what is compiled by another process would be lost
        return
    with _alone():
        if left := missing(kernels):
            _run(left)
            for kernel in left:
                with suppress(OSError):  # where nothing can be written, nothing is kept either
                    replace(_mark(kernel), stamp(_file(kernel)).encode())


def _mark(kernel: Kernel) -> Path:
    """Return the file that holds, once a kernel is compiled, the stamp of its source."""
    types = hashlib.sha256(kernel.types.encode()).hexdigest()[:8]
    return cache_folder() / "ready" / f"{Path(kernel.module).stem}.{kernel.name}-{types}"


def _file(kernel: Kernel) -> Path:
    return Path(kernel.module) if kernel.module.endswith(".py") else ROOT / "kernels" / f"{kernel.module}.py"


def _read(path: Path) -> str:
    try:
        return path.read_text()
    except (OSError, ValueError):
        return ""


def _run(kernels: list[Kernel]) -> None:
    path = os.pathsep.join([str(ROOT), *filter(None, [os.environ.get("PYTHONPATH")])])
    options = {"env": {**os.environ, "PYTHONPATH": path}, "stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
    with tempfile.TemporaryFile("w+") as said:
        command = [sys.executable, "-P", "-m", "sweeps.points.compiler"]
        program = subprocess.Popen(command, stderr=said, text=True, **options)
        try:
            with progress.pieces(len(kernels), "compiling") as advance:
                program.stdin.write(json.dumps([kernel.call for kernel in kernels]))
                program.stdin.close()
                import numba  # noqa: F401  (settings that it cannot read are refused here, and not in the program)

                for _ in program.stdout:
                    advance()
            status = program.wait()
        finally:
            program.terminate()
            program.wait()
        if status:
            said.seek(0)
            raise RuntimeError(f"the kernels cannot be compiled: {said.read().strip()[-2000:]}")


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
