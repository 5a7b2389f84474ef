"""Regular files, opened once: what is read of one is of one state of it, and of bounded size."""

import io
import os
import stat
from pathlib import Path

from sweeps.schema.refusals import MapError


class FileBytes(io.FileIO):
    """A regular file with bytes that are read by their places, or as a stream; travels between processes by its path.

    Args:
        path: the file. A FIFO or a device is not waited for.
    """

    read, readall = io.RawIOBase.read, io.RawIOBase.readall  # by `readinto`
    __del__ = io.FileIO.close  # Datasets are often left open: no word of that

    def __init__(self, path: str | Path):
        self.path = os.path.abspath(path)
        super().__init__(self.path, opener=_open_regular)
        self.name = str(path)  #: the path as it was given, for messages; path: the same, absolute
        #: what tells it from what it was before: device, number, size, time of its last change
        self.state = self._state_now()
        self.size = self.state[2]  #: its bytes

    def _state_now(self) -> tuple[int, ...]:
        status = os.fstat(self.fileno())
        return status.st_dev, status.st_ino, status.st_size, status.st_mtime_ns

    def read_at(self, address: int, size: int) -> bytes:
        """Return the bytes from a place on.

        Raises:
            MapError: where the file has been changed since it was opened.
        """
        try:
            content = os.pread(self.fileno(), size, address)
            while content and len(content) < size:
                more = os.pread(self.fileno(), size - len(content), address + len(content))
                content = content + more if more else b""
        except OSError as error:  # which names no file
            raise OSError(error.errno, error.strerror, self.path) from None
        if len(content) != size or self._state_now() != self.state:
            raise self._changed("while it was read")
        return content

    def _changed(self, when: str) -> MapError:
        return MapError(f"{self.path}: was changed {when}; allowed: a file that stays as it is")

    def readinto(self, buffer) -> int:
        """Read the stream's next bytes into a buffer, and return their number."""
        place = self.tell()
        content = self.read_at(place, max(0, min(len(buffer), self.size - place)))
        buffer[: len(content)] = content
        return self.seek(len(content), os.SEEK_CUR) - place

    def __getstate__(self) -> tuple:
        return self.path, self.state

    def __setstate__(self, state: tuple) -> None:
        self.__init__(state[0])
        if self.state != state[1]:
            raise self._changed("since it was opened")


def _open_regular(path: str, flags: int) -> int:
    """Open a file without waiting, and return its handle; refuse pipes, devices and folders."""
    handle = os.open(path, flags | os.O_NONBLOCK | os.O_NOCTTY)
    if not stat.S_ISREG(os.fstat(handle).st_mode):
        os.close(handle)
        raise OSError(0, "is not a regular file", path)
    return handle


def content(path: str | Path, most: int) -> bytes:
    """Return the content of a regular file of at most so many bytes."""
    with FileBytes(path) as file:
        if file.size > most:
            raise OSError(0, f"is too large: {file.size:,} bytes, allowed are {most:,}", str(path))
        return file.read_at(0, file.size)
