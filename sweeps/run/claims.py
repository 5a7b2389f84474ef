"""One run of a sweep at a time: claims that end with the process that made them, however it ends."""

import errno
import fcntl
import os
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

from kernels.fingerprint import cache_folder
from sweeps.schema.refusals import DefinitionError

CLAIM = ".running"
UNSUPPORTED = (errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP)


@contextmanager
def claimed(sweeps: Iterable[str], results: str | Path = "results") -> Iterator[None]:
    """Claims the folders of some sweeps for the time of a block; see `claim`."""
    handles = claim(sweeps, results)
    try:
        yield
    finally:
        for handle in handles:
            os.close(handle)


def claim(sweeps: Iterable[str], results: str | Path = "results") -> list[int]:
    """Claims the folders of some sweeps for this process, until it ends or closes them.

    The system itself gives a claim back when a process dies, so nothing is left to be unlocked by a person.

    Args:
        sweeps: names of the sweeps.
        results: folder that their results go to.

    Returns:
        The open files that hold the claims.

    Raises:
        DefinitionError: if a living process has claimed one of them, or the folder cannot be written.
    """
    handles = []
    for name in sweeps:
        path = Path(results) / name / CLAIM
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            handle = os.open(path, os.O_RDWR | os.O_CREAT, 0o666)
        except OSError as error:
            what = f"cannot be written ({error.strerror}); allowed: a folder that can be written"
            raise DefinitionError(f"{path.parent}: {what}") from None
        _claim(handle, path.parent)
        _forget_the_future(path.parent)
        handles.append(handle)
    _forget_the_future(cache_folder())  # whose files are inputs of the workflow as well
    return handles


def _claim(handle: int, folder: Path) -> None:
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        other = os.read(handle, 20).decode("ascii", "replace").strip()
        os.close(handle)
        raise DefinitionError(
            f"{folder}: another run is at work there (process {other}); allowed: one at a time"
        ) from None
    except OSError as error:
        if error.errno not in UNSUPPORTED:
            raise
    os.ftruncate(handle, 0)
    os.write(handle, f"{os.getpid()}\n".encode())


def _forget_the_future(folder: Path) -> None:
    """Gives today's date to files of a clock that ran ahead: Snakemake would take them for newer than their results."""
    now = time.time()
    for file in folder.rglob("*"):
        try:
            if file.stat().st_mtime > now:
                os.utime(file)
        except OSError:
            continue


def replace_locks(workflow) -> None:
    """Lets a workflow of Snakemake go on by itself after a kill; call it where its sweeps are claimed.

    Snakemake's own lock, and its marks at files whose jobs were running, wait for a person once it is killed. A claim
    ends with its process, and a file of this workflow takes its place when it is whole: it is finished, or not there.
    Snakemake has no setting for this that a Snakefile can reach.
    """
    prepare = workflow._prepare_dag

    def prepared(**settings):
        return prepare(**settings | {"nolock": True, "ignore_incomplete": True})

    workflow._prepare_dag = prepared
