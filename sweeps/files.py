"""Files that a reader never sees half of: written under another name beside their place, then renamed."""

import errno
import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def replaced(path: str | Path, flush: bool = True) -> Iterator[Path]:
    """Gives a temporary path beside `path`; once the block has ended well, what it wrote takes that place.

    Where the block fails, the temporary file is removed and whatever stood at `path` is as it was.

    Args:
        path: the file to write.
        flush: whether the content must reach the disk before the name does. Files that carry checksums and can be
            made again need not wait for it.
    """
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, name = tempfile.mkstemp(prefix=f".{path.name}.", suffix=".part", dir=path.parent)
    os.close(handle)
    temporary = Path(name)
    try:
        yield temporary
        if flush:
            _flush(temporary)
        temporary.chmod(0o666 & ~_umask())
        temporary.replace(path)
        if flush:
            _flush(path.parent)
    finally:
        temporary.unlink(missing_ok=True)


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask


def _flush(path: Path) -> None:
    """Forces a file's (or a folder's) content to the disk, where the system can."""
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
