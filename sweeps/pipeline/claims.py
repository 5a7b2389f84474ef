"""Claims of a sweep's folder, by which one run of a sweep at a time writes it.

A claim is a lock (flock) on a file in the folder, which the system itself releases when the process ends, however it
ends: no lock is left for a person to remove. The file contains the identity of the process, for messages, and as the
claim itself on file systems without locks.
"""

import errno
import fcntl
import os
import threading
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

from sweeps.process import files, process_identity
from sweeps.schema.refusals import DefinitionError

CLAIM = ".running"
DEFINITION = ".definition"  # contains the path of the definition that made the files of the folder
MAX_SILENCE = 600.0  # s, after which a claim of another machine that no thread renews has ended


@contextmanager
def claim_folders(sweeps: Iterable[str], results: str | Path = "results") -> Iterator[None]:
    """Claim the folders of some sweeps for the duration of a block; see `claim`."""
    handles = claim(sweeps, results)
    try:
        yield
    finally:
        for handle in handles:
            os.close(handle)


def claim(sweeps: Iterable[str], results: str | Path = "results") -> list[int]:
    """Claim the folders of some sweeps until this process ends or closes the files that are returned.

    Temporary files of ended runs in the folders are removed.

    Raises:
        DefinitionError: if a living process has claimed a folder, or a folder cannot be written.
    """
    handles = []
    for name in sweeps:
        path = Path(results) / name / CLAIM
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            handle = os.open(path, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW, 0o666)
        except OSError as error:
            if error.errno == errno.ELOOP:
                raise DefinitionError(f"{path}: is a link; allowed: a plain file (remove the link)") from None
            problem = f"cannot be written ({error.strerror}); allowed: a folder that can be written"
            raise DefinitionError(f"{path.parent}: {problem}") from None
        _lock(handle, path.parent)
        _correct_future_times(path.parent)
        files.remove_all_leftovers(path.parent)
        handles.append(handle)
    return handles


def assign_to_definition(folder: Path, definition: Path, replace: bool = False) -> None:
    """Store the path of the definition to which a sweep's folder belongs; call it while the folder is claimed.

    Args:
        folder: of the sweep.
        definition: path of its definition.
        replace: True to replace the results of another definition.

    Raises:
        DefinitionError: if the folder belongs to another definition of the same file name that still exists and has
            another text, unless it is to be replaced.
    """
    note = folder / DEFINITION
    try:
        owner = Path(note.read_text())
        is_same = owner.resolve() == definition.resolve() or owner.read_bytes() == definition.read_bytes()
    except (OSError, ValueError):  # no owner, or its file was removed or renamed
        is_same = True
    if not is_same and not replace:
        allowed = "another file name, or polhode run with -o FOLDER or --replace"
        raise DefinitionError(f"{definition}: {folder} contains the results of {owner}; allowed: {allowed}")
    with files.replace_output(note, flush=False) as temporary:
        temporary.write_text(str(definition.resolve()))


def _lock(handle: int, folder: Path) -> None:
    """Lock the claim's file, refuse it if another process has it, and write this process into it."""
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        _refuse_claimed(handle, folder)
    except OSError as error:
        if error.errno not in files.NO_LOCKS:
            raise
        _claim_by_text(handle, folder)
    os.ftruncate(handle, 0)
    os.pwrite(handle, f"{process_identity.process_mark()}\n".encode(), 0)


def _refuse_claimed(handle: int, folder: Path) -> None:
    holder = process_identity.process_text(_read_holder(handle))
    os.close(handle)
    raise DefinitionError(f"{folder}: another run is active there ({holder}); allowed: one at a time")


def _read_holder(handle: int) -> str:
    return os.pread(handle, 200, 0).decode("ascii", "replace").strip()


def _claim_by_text(handle: int, folder: Path) -> None:
    """Claim on a file system without locks: by the text of the claim, and by its time, which a thread renews."""
    silence = time.time() - os.fstat(handle).st_mtime
    if (holder := _read_holder(handle)) and not process_identity.is_over(holder, silence, MAX_SILENCE):
        _refuse_claimed(handle, folder)
    threading.Thread(target=_renew_claim, args=(handle, os.fstat(handle).st_ino), daemon=True).start()


def _renew_claim(handle: int, number: int) -> None:
    """Touch the claim's file until it is replaced or removed, for file systems without locks."""
    while True:
        time.sleep(MAX_SILENCE / 10)
        try:
            if os.fstat(handle).st_ino != number:
                return
            os.utime(handle)
        except OSError:  # the claim has ended
            return


def _correct_future_times(folder: Path) -> None:
    """Set future times of files, of a clock that ran ahead, to now: to Snakemake these are newer than their results."""
    now = time.time()
    for file in folder.rglob("*"):
        try:
            if file.stat().st_mtime > now:
                os.utime(file)
        except OSError:
            continue


def replace_locks(workflow) -> None:
    """Let a Snakemake workflow resume after a kill without unlocking; call it after its sweeps are claimed.

    After a kill, a user must remove Snakemake's own lock and its marks at files of running jobs, and no setting in a
    Snakefile changes that. Neither is needed here: a file exists only if it is complete.
    """
    prepare = workflow._prepare_dag

    workflow._prepare_dag = lambda **settings: prepare(**settings | {"nolock": True, "ignore_incomplete": True})
