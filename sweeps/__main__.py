"""The command line, `polhode …` or `python -m sweeps …`.

Each command, of `sweeps.commands`, reads, calls one function and writes.
"""

import atexit
import errno
import gc
import os
import signal
import sys
from argparse import Namespace
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from threading import current_thread, main_thread
from traceback import extract_tb
from typing import NoReturn

import sweeps
from sweeps.process import startup

FIRST = """\
Polhode measures which motions of rigid bodies and other mechanical systems are stable. To begin:

  polhode body racket                    which spins of a body are stable, with periods (a body of yours: see
                                         `polhode help body`)
  polhode motion racket -o racket.gif    the motion as a film, or as numbers (.csv, .nc, .aem)
  polhode run tiny                       a first map: results/tiny holds map, figures and report
  polhode check --list                   all sweeps that ship
  polhode help                           all commands
"""

INTERRUPTED = 130  # exit status, as of shells
MOMENT = 0.05  # s, after which a KeyboardInterrupt that was swallowed is raised again
ACCESS = "files and folders that this user can read and write"
REMEDIES = {  # errno → the remedy that a message names
    errno.ENOSPC: "enough disk space",
    errno.EDQUOT: "enough disk space within the quota",
    errno.EACCES: ACCESS,
    errno.EPERM: ACCESS,
    errno.EROFS: "a file system that can be written",
    errno.EMFILE: "a higher limit of open files (ulimit -n)",
    errno.EFBIG: "a higher limit of the size of files (ulimit -f)",
    errno.ENOLCK: "HDF5_USE_FILE_LOCKING=FALSE in the environment",
}
ANY_REMEDY = "files that can be read and written"
NUMBAS_SETTINGS = os.path.join("numba", "core", "config.py")


def main(arguments: list[str] | None = None) -> int:
    """Run one command and return its exit status."""
    interrupts: list[bool] = []
    with _hooks(interrupts):
        try:
            with _ctrl_c(interrupts) as listen:
                words = sys.argv[1:] if arguments is None else arguments
                if not words:
                    print(FIRST, end="")
                    return 0
                words = [*words[1:2], "--help"] if words[0] == "help" else words
                from sweeps.commands import program

                parser, _ = program.build()
                listen()
                return _run_command(parser.parse_args(words))
        except BaseException as error:
            if not (interrupts or isinstance(error, KeyboardInterrupt)):
                raise
            print(": ".join(["interrupted", *getattr(error, "__notes__", ())]), file=sys.stderr)
            return INTERRUPTED


def command() -> NoReturn:
    """Run the command of this process and exit with its status."""
    if not hasattr(sweeps, "survey"):
        sys.exit(f"sweeps: {sweeps.__file__} is another package; allowed: Polhode in an environment of its own")
    _prepare_streams()
    try:
        startup.configure()
        status = main()
    except KeyboardInterrupt:  # nothing has been done that a message could report
        status = INTERRUPTED
    except SystemExit as ended:  # words that are no command, or a question for help
        status = ended.code
    except OSError as error:  # the help could not be written
        status = _unwritten(error)
    # Python's own cleanup remains; an interrupt of it prints nothing
    atexit.register(signal.signal, signal.SIGINT, signal.SIG_DFL)
    gc.freeze()  # else Python searches all objects for cycles as it ends, for 0.5 s
    status = _flush_output(status)
    if status == INTERRUPTED:
        os._exit(status)  # Python's end may crash after the import of a module was interrupted
    sys.exit(status)


def _prepare_streams() -> None:
    """Open the null device for each standard stream that the shell closed, so that no file gets its number.

    Print characters outside the terminal's locale as their numbers.
    """
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        if getattr(sys, name) is None:
            stream = open(os.devnull, mode, encoding="utf-8")  # noqa: SIM115
            os.set_inheritable(stream.fileno(), True)
            setattr(sys, name, stream)
    for stream in (sys.stdout, sys.stderr):
        stream.reconfigure(errors="backslashreplace")


def _flush_output(status: int) -> int:
    """Flush both output streams; return the exit status: 1 for a reader that has gone, 2 for a full disk."""
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except OSError as error:
            # the bytes that are still in its buffer go there
            os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())
            status = status or _unwritten(error)
    return status


def _unwritten(error: OSError) -> int:
    """Return the exit status for output that cannot be written: 1, quietly, if its reader has gone, else 2."""
    return (
        1
        if isinstance(error, BrokenPipeError)
        else _print_refusal(f"output: {error.strerror}; allowed: {_remedy(error)}")
    )


@contextmanager
def _ctrl_c(interrupts: list) -> Iterator[Callable]:
    """Let Ctrl-C end the process at once until the yielded function is called, then raise KeyboardInterrupt.

    During their import some modules turn the exception into a crash. Later a library may swallow it, as Cython does
    during the import of h5py, or Python while it disposes of an object: it is raised again every `MOMENT`, except
    while such an exception is being handled.
    """
    if current_thread() is not main_thread() or signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        yield lambda: None  # the handler is another program's
        return
    alarm_handler = signal.getsignal(signal.SIGALRM)

    def hear(*_):
        """Store the interrupt, start the timer that repeats it, and raise KeyboardInterrupt."""
        interrupts.append(True)
        signal.signal(signal.SIGALRM, repeat)
        signal.setitimer(signal.ITIMER_REAL, MOMENT, MOMENT)
        raise KeyboardInterrupt

    def repeat(*_):
        """Raise KeyboardInterrupt again unless one is being handled."""
        error = sys.exception()
        while error is not None and not isinstance(error, KeyboardInterrupt):
            error = error.__context__
        if error is None:
            raise KeyboardInterrupt

    signal.signal(signal.SIGINT, signal.SIG_DFL)
    try:
        yield lambda: signal.signal(signal.SIGINT, hear)
        if interrupts:
            raise KeyboardInterrupt  # swallowed less than a moment ago
    finally:
        if interrupts:
            signal.setitimer(signal.ITIMER_REAL, 0)
            signal.signal(signal.SIGALRM, alarm_handler)
        signal.signal(signal.SIGINT, signal.default_int_handler)


@contextmanager
def _hooks(interrupts: list) -> Iterator[None]:
    """Silence Python's reports of ignored exceptions after Ctrl-C: the interrupt, and errors of half-made objects.

    And silence h5py, which on a full disk prints one traceback more for each object that it cannot close.
    """
    except_hook, unraisable_hook = sys.excepthook, sys.unraisablehook

    def except_h5py(kind, value, trace):
        frames = extract_tb(trace)
        if not (frames and frames[-1].filename.endswith("_objects.pyx")):
            except_hook(kind, value, trace)

    def unraise(unraisable):
        if not interrupts and "h5py" not in str(unraisable.object):
            unraisable_hook(unraisable)

    sys.excepthook, sys.unraisablehook = except_h5py, unraise
    try:
        yield
    finally:
        sys.excepthook, sys.unraisablehook = except_hook, unraisable_hook


def _run_command(args: Namespace) -> int:
    """Run a command and return its exit status; print a refusal as one message."""
    from sweeps.schema.refusals import RefusedError

    try:
        return args.run(args) or 0
    except RefusedError as refused:
        return _print_refusal(str(refused))
    except BrokenPipeError:
        return 1
    except OSError as error:
        return _print_refusal(
            f"{error.filename or _where(error)}: {error.strerror or error}; allowed: {_remedy(error)}"
        )
    except MemoryError:
        allowed = "fewer points or variables, or a machine with more memory"
        return _print_refusal(f"memory: not enough for this sweep; allowed: {allowed}")
    except RuntimeError as error:
        from concurrent.futures import BrokenExecutor

        if isinstance(error, BrokenExecutor):
            reason = "a process that this command started was ended from outside (killed, or out of memory)"
            print(f"{reason}; the same command resumes from the finished work", file=sys.stderr)
            return 1
        if "NetCDF" not in str(error):
            raise
        return _print_refusal(f"{error}: a file is damaged; allowed: a whole file that Polhode wrote")
    except Exception as error:
        if not any(frame.filename.endswith(NUMBAS_SETTINGS) for frame in extract_tb(error.__traceback__)):
            raise
        what = " ".join(str(error).split())
        where = "Numba's settings (NUMBA_… or .numba_config.yaml)"
        return _print_refusal(f"{where}: {what}; allowed: settings that Numba can read")


def _remedy(error: OSError) -> str:
    """Return the remedy that a message names for a system error."""
    return REMEDIES.get(error.errno, ANY_REMEDY)


def _where(error: OSError) -> str:
    """Return the line of this program that an error without a file's name came through."""
    lines = [line for line in extract_tb(error.__traceback__) if "sweeps" in Path(line.filename).parts]
    return f"system (at {Path(lines[-1].filename).name}, line {lines[-1].lineno})" if lines else "system"


def _print_refusal(message: str) -> int:
    """Print a message in characters that no terminal obeys, and return the exit status 2."""
    print("".join(c if c.isprintable() or c == "\n" else "\ufffd" for c in message), file=sys.stderr)
    return 2


if __name__ == "__main__":
    command()
