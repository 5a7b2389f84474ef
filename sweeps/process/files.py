"""Output files that appear complete or not at all: written under a temporary name, then renamed."""

import errno
import glob
import os
import shutil
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

from sweeps.process import process_identity

NO_LOCKS = (errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP)  # errors of flock on a file system without locks


@contextmanager
def replace_output(path: str | Path, is_folder: bool = False, flush: bool = True) -> Iterator[Path]:
    """Yield a temporary path next to `path`, and rename it to `path` when the block has ended without error.

    If the block fails, the temporary file is removed, and `path` is as it was. Temporary files that a killed process
    left of the same file are removed first. No link is followed.

    Args:
        path: the file or folder to write.
        is_folder: whether it is a folder. Files of a folder that exists are replaced by those of the same name.
        flush: whether the content reaches the disk before the name does; files with checksums that can be made again do
            not need it.

    Raises:
        OSError: if a link, a folder or a device is at the path of a file.
    """
    path = Path(path)
    if not is_folder and (path.is_symlink() or (path.exists() and not path.is_file())):  # a device would be lost
        raise OSError(errno.EINVAL, "is a link, a folder or a device, not a file", str(path))
    path.parent.mkdir(parents=True, exist_ok=True)
    remove_leftovers(path)
    temporary = _temporary_path(path)
    try:
        temporary.mkdir() if is_folder else temporary.touch(exist_ok=False)
        yield temporary
        if flush and not is_folder:
            _flush(temporary)
        _rename(temporary, path)
        if flush:
            _flush(path.parent)
    finally:
        _remove(temporary)


def remove_leftovers(path: Path) -> None:
    """Remove the temporary files and folders of `path` of ended processes."""
    _remove_ended(path.parent.glob(f".{glob.escape(path.name)}.*.part"))


def remove_all_leftovers(folder: Path) -> None:
    """Remove all temporary files of ended processes in a folder and below."""
    _remove_ended(folder.rglob(".*.part"))


def _remove_ended(leftovers: Iterable[Path]) -> None:
    for leftover in list(leftovers):
        if process_identity.is_over(leftover.name, process_identity.seconds_since_change(leftover)):
            _remove(leftover)


def _temporary_path(path: Path) -> Path:
    """Return a temporary name for the file `path`: it exists before the file does, so that no Ctrl-C comes between."""
    return path.with_name(f".{path.name}.{process_identity.process_mark()}.{os.urandom(8).hex()}.part")


def _rename(temporary: Path, path: Path) -> None:
    """Give a file or a new folder its name; move the files of a folder into a folder that exists."""
    if temporary.is_dir() and path.is_dir():
        for file in temporary.iterdir():
            file.replace(path / file.name)
    else:
        temporary.replace(path)


def _remove(path: Path) -> None:
    """Remove a file, a link, or a folder with its contents."""
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path, ignore_errors=True)
    else:
        path.unlink(missing_ok=True)


def _flush(path: Path) -> None:
    """Force the content of a file or a folder to the disk, if the system can."""
    try:
        handle = os.open(path, os.O_RDONLY)
    except OSError:  # folders cannot be opened on every system
        return
    try:
        os.fsync(handle)
    except OSError as error:
        if error.errno not in (errno.EBADF, errno.EINVAL, errno.ENOTSUP):  # a full or failing disk must be reported
            raise
    finally:
        os.close(handle)
