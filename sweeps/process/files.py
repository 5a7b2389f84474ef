"""Output files that appear complete or not at all: written under a temporary name, then renamed."""

import errno
import glob
import os
import shutil
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

from sweeps.process import living

NO_LOCKS = (errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP)  # errors of flock on a file system without locks


@contextmanager
def replaced(path: str | Path, flush: bool = True) -> Iterator[Path]:
    """Yield a temporary path beside `path`, and rename it to `path` when the block has ended without error.

    Where the block fails, the temporary file is removed and whatever stood at `path` is as it was. A link stays one:
    the file that it names is replaced. What a process that was killed left of the same file is removed first. With
    `flush` the content reaches the disk before the name does: files with checksums that can be made again need it not.

    Raises:
        OSError: where something stands at `path` that is no file.
    """
    path = Path(os.path.realpath(path)) if os.path.islink(path) else Path(path)
    if path.exists() and not path.is_file():  # a device would be one no more
        raise OSError(errno.EINVAL, "is a folder or a device, not a file", str(path))
    path.parent.mkdir(parents=True, exist_ok=True)
    remove_leftovers(path)
    temporary = _beside(path)
    try:
        temporary.touch(exist_ok=False)
        yield temporary
        if flush:
            _flush(temporary)
        temporary.replace(path)
        if flush:
            _flush(path.parent)
    finally:
        temporary.unlink(missing_ok=True)


def remove_leftovers(path: Path) -> None:
    """Remove the temporary files and folders of `path` whose process has ended."""
    _remove_dead(path.parent.glob(f".{glob.escape(path.name)}.*.part"))


def remove_all_leftovers(folder: Path) -> None:
    """Remove all temporary files of ended processes in a folder and below."""
    _remove_dead(folder.rglob(".*.part"))


def _remove_dead(parts: Iterable[Path]) -> None:
    for part in list(parts):
        if living.is_over(part.name, living.age(part)):
            if part.is_dir() and not part.is_symlink():
                shutil.rmtree(part, ignore_errors=True)
            else:
                part.unlink(missing_ok=True)


def _beside(path: Path) -> Path:
    """Return a temporary name for the file `path`: it exists before the file does, so that no Ctrl-C comes between."""
    return path.with_name(f".{path.name}.{living.mark()}.{os.urandom(8).hex()}.part")


@contextmanager
def replaced_folder(path: str | Path) -> Iterator[Path]:
    """Yield a temporary folder; move its files to `path`, whole if that is new, when the block ends without error."""
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    remove_leftovers(path)
    folder = _beside(path)
    made = folder / "made"
    try:
        made.mkdir(parents=True)
        yield made
        try:
            made.rename(path)
        except OSError:
            path.mkdir(exist_ok=True)
            for file in made.iterdir():
                file.replace(path / file.name)
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _flush(path: Path) -> None:
    """Force a file's (or a folder's) content to the disk, where the system can."""
    try:
        handle = os.open(path, os.O_RDONLY)
    except OSError:  # folders cannot be opened on every system
        return
    try:
        os.fsync(handle)
    except OSError as error:
        if error.errno not in (errno.EBADF, errno.EINVAL, errno.ENOTSUP):  # a full or failing disk must be heard
            raise
    finally:
        os.close(handle)
