"""Regular files, opened once: what is read of one is of one state of it, and of bounded size."""

import io
import os
import stat
from pathlib import Path

from sweeps.schema.refusals import MapError


class FileBytes(io.RawIOBase):
    """A regular file whose bytes are read by their places; travels between processes by its path.

    Libraries may read it as a stream.

    Args:
        path: the file. A FIFO or a device is not waited for.
    """

    def __init__(self, path: str | Path):
        self._handle = None  # where it cannot be opened there is nothing to close
        #: name: its path as it was given, for messages; path: the same, absolute
        self.name, self.path = str(path), os.path.abspath(path)
        self._handle = os.open(self.path, os.O_RDONLY | os.O_CLOEXEC | os.O_NONBLOCK | os.O_NOCTTY)
        if not stat.S_ISREG(os.fstat(self._handle).st_mode):
            self.close()
            raise OSError(0, "is not a regular file", self.path)
        #: what tells it from what it was before: device, number, size, time of its last change
        self.state = self._state_now()
        self.size, self._place = self.state[2], 0  #: its bytes

    def _state_now(self) -> tuple[int, ...]:
        status = os.fstat(self._handle)
        return status.st_dev, status.st_ino, status.st_size, status.st_mtime_ns

    def read_at(self, address: int, size: int) -> bytes:
        """Return the bytes from a place on.

        Raises:
            MapError: where the file has been changed since it was opened.
        """
        if self._handle is None:
            raise ValueError(f"{self.path}: is closed")
        try:
            content = os.pread(self._handle, size, address)
            while content and len(content) < size:
                more = os.pread(self._handle, size - len(content), address + len(content))
                content = content + more if more else b""
        except OSError as error:  # which names no file
            raise OSError(error.errno, error.strerror, self.path) from None
        if len(content) != size or self._state_now() != self.state:
            raise self._changed("while it was read")
        return content

    def _changed(self, when: str) -> MapError:
        return MapError(f"{self.path}: was changed {when}; allowed: a file that stays as it is")

    def fileno(self) -> int:
        """Return the number under which the system has it open."""
        return self._handle

    def readable(self) -> bool:
        """Return True: it is a stream to read from."""
        return True

    def seekable(self) -> bool:
        """Return True: it has places."""
        return True

    def seek(self, offset: int, whence: int = 0) -> int:
        """Set the place from which a stream is read, and return it."""
        self._place = offset + (0, self._place, self.size)[whence]
        return self._place

    def readinto(self, buffer) -> int:
        """Read the stream's next bytes into a buffer, and return their number."""
        content = self.read_at(self._place, max(0, min(len(buffer), self.size - self._place)))
        buffer[: len(content)] = content
        self._place += len(content)
        return len(content)

    def close(self) -> None:
        """Close the file."""
        if self._handle is not None:
            os.close(self._handle)
            self._handle = None
        super().close()

    def __getstate__(self) -> tuple:
        return self.path, self.state

    def __setstate__(self, state: tuple) -> None:
        self.__init__(state[0])
        if self.state != state[1]:
            raise self._changed("since it was opened")


def content(path: str | Path, most: int) -> bytes:
    """Return the content of a regular file of at most so many bytes."""
    with FileBytes(path) as file:
        if file.size > most:
            raise OSError(0, f"is too large: {file.size:,} bytes, allowed are {most:,}", str(path))
        return file.read_at(0, file.size)
