"""Compiling the kernels before anything else needs them.

Numba's disk cache is not safe when several processes compile at once, so the workflow compiles in jobs of their own:
what the default system calls in one, and what another one calls, generated for it or not, in a second. Such a job has
two processes, which both go through the list of what there is to compile, take from it what the other has not begun,
and store one at a time.
"""

import fcntl
import multiprocessing
import os
import warnings
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager, nullcontext, suppress
from functools import partial
from pathlib import Path

from kernels.cache import cache_folder
from kernels.fingerprint import fingerprint
from sweeps import interrupts, processors, startup, systems
from sweeps.files import replaced, temporary_folder
from sweeps.run import claims, progress


@contextmanager
def _alone() -> Iterator[None]:
    """One process at once."""
    handle = os.open(cache_folder() / ".compiling", os.O_RDWR | os.O_CREAT, 0o600)
    try:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX)
        except OSError as error:
            if error.errno not in claims.UNSUPPORTED:
                raise
        yield
    finally:
        os.close(handle)


def compile_kernels(
    everything: bool = False,
    without: Sequence[str] = (),
    seldom: bool = True,
) -> None:
    """Compiles, and stores in the cache, what the default system calls, or all systems; one process at once.

    Args:
        everything: the kernels of every system.
        without: modules of `systems.DESCRIBED` whose shared kernels are left to those that need them.
        seldom: also what few definitions ask for, where everything is compiled.
    """
    asked, compiled = (everything, without, seldom), cache_folder() / "compiled"
    with _alone(), temporary_folder(compiled) as taken:
        other = _second(asked, taken) if processors.cores() > 1 else nullcontext()
        with other as second, progress.pieces(len(systems.compilations(*asked)), "compiling", partial(_done, taken)):
            _compile(asked, taken)
            if second:
                second.join()
                if second.exitcode:  # what it had taken is done here
                    _run(systems.compilations(*asked))
    for name in systems.MODULES if everything else (systems.DEFAULT_SYSTEM,):
        _say_compiled(systems.resolve(name))


def _compile(asked: tuple[bool, Sequence[str], bool], taken: Path) -> None:
    _run(_left(enumerate(systems.compilations(*asked)), taken))


@contextmanager
def _second(asked: tuple[bool, Sequence[str], bool], taken: Path) -> Iterator:
    """The other process, begun before this one loads Numba: they do so side by side. It is over where the block fails.

    Args:
        asked: what is to be compiled.
        taken: the folder that both share.
    """
    way = multiprocessing.get_context("spawn")
    second = way.Process(target=_compile_as_the_second, args=(asked, taken), daemon=True)
    try:
        with interrupts.left_to_the_parent():
            second.start()
        yield second
    except BaseException:
        interrupts.abandon_processes()
        raise


def _compile_as_the_second(asked: tuple[bool, Sequence[str], bool], taken: Path) -> None:
    interrupts.end_with_the_parent()  # its work is of use to the first alone
    startup.configure()
    _compile(asked, taken)


DONE = ".done"


def _left(numbered: Iterable[tuple[int, Callable[[], None]]], taken: Path) -> Iterator[Callable[[], None]]:
    """What the other process has not begun: each takes it by making a file of its number, another when it is done."""
    for number, compilation in numbered:
        with suppress(FileExistsError):
            (taken / str(number)).touch(exist_ok=False)
            yield compilation
            (taken / f"{number}{DONE}").touch()


def _done(taken: Path) -> int:
    """How many compilations are done, by either process."""
    return sum(name.endswith(DONE) for name in os.listdir(taken))


def _run(compilations: Iterable[Callable[[], None]]) -> None:
    """One after the other, in whichever process, without Numba's remarks."""
    from numba import NumbaExperimentalFeatureWarning

    with warnings.catch_warnings():
        # kernels take a system's compiled step as an argument, which Numba calls an experiment
        warnings.simplefilter("ignore", NumbaExperimentalFeatureWarning)
        for compilation in compilations:
            compilation()


def compile_system(system: systems.Dynamics) -> None:
    """Compiles, and stores in the cache, what one system calls, and says so there; one process at once.

    Raises:
        DescriptionError: for what is wrong with its description.
    """
    with _alone():
        _run([system.compile])
    _say_compiled(system)


def _say_compiled(system: systems.Dynamics) -> None:
    compiled = system.compiled()
    compiled.parent.mkdir(parents=True, exist_ok=True)
    with replaced(compiled) as temporary:
        temporary.write_text(fingerprint() + "\n")


def compile_missing(system: systems.Dynamics) -> None:
    """Compiles, alone, what one system calls, unless it lies in the cache whole: call it before work that is shared."""
    if _is_compiled(system):
        return
    if systems.calls_the_defaults(system) and not _is_compiled(systems.resolve(systems.DEFAULT_SYSTEM)):
        compile_kernels()
    if not _is_compiled(system):
        compile_system(system)


def _is_compiled(system: systems.Dynamics) -> bool:
    try:
        return system.compiled().read_text().strip() == fingerprint()
    except (OSError, ValueError):
        return False
