"""Identify a process by host, boot, PID namespace, PID and start time, and report whether it still runs.

A PID alone is not sufficient: it is used again later, and by different processes on each machine and in each container.
"""

import os
import platform
import re
import time
from functools import cache
from pathlib import Path

import psutil

DAY = 86_400.0  # s
_MARK_PATTERN = re.compile(r"([A-Za-z0-9]{1,32})-([0-9a-f]{1,12})-([0-9]+)-([0-9]+)-([0-9]+)")


def process_mark() -> str:
    """Return a mark that identifies this process: host, boot, container, number, start time."""
    return f"{host_name()}-{_namespace()}-{os.getpid()}-{_start_time(os.getpid())}"


def host_name() -> str:
    """Return the name of the machine, in letters and digits."""
    return re.sub(r"[^A-Za-z0-9]", "", platform.node())[:32] or "host"


@cache
def _namespace() -> str:
    """Return the scope of PIDs as text: boot of this machine and PID namespace (container)."""
    try:
        boot = Path("/proc/sys/kernel/random/boot_id").read_text().replace("-", "")[:12]
        container = re.sub(r"\D", "", os.readlink("/proc/self/ns/pid"))
    except OSError:  # without /proc, the host's name is used
        boot, container = f"{sum(map(ord, platform.node())):x}", "0"
    return f"{boot}-{container or 0}"


def _start_time(number: int) -> int | None:
    """Return when a process of this machine started, in 0.01 s since the machine did; None if it has ended.

    A clock that is set changes the time of both starts, and not their difference.
    """
    try:
        process = psutil.Process(number)
        if process.status() == psutil.STATUS_ZOMBIE:  # it has ended, and its parent has not read its status yet
            return None
        return max(0, round(100 * (process.create_time() - psutil.boot_time())))
    except psutil.NoSuchProcess:
        return None


def is_over(mark_text: str, silence: float, max_silence: float = DAY) -> bool:
    """Return True if the process of the mark in `mark_text` has ended; `silence` is the age of its file, s.

    A process of another machine or container, or of no mark, counts as ended if its file has not changed for more
    than `max_silence` seconds.
    """
    match = _MARK_PATTERN.search(mark_text)
    if match is None or f"{match[2]}-{match[3]}" != _namespace():
        return silence > max_silence
    try:
        return _start_time(int(match[4])) != int(match[5])
    except psutil.AccessDenied:  # a living process of another user
        return False


def seconds_since_change(path: Path) -> float:
    """Return the seconds since a file, or the contents of a folder, last changed; 0 if it does not exist."""
    try:
        return time.time() - max(p.lstat().st_mtime for p in (path, *path.rglob("*")))
    except OSError:
        return 0.0


def process_text(mark_text: str) -> str:
    """Return the process of a mark in words: "process 123", of another machine or container "process 123 on HOST"."""
    match = _MARK_PATTERN.search(mark_text)
    if match is None:
        return "process unknown"
    return f"process {match[4]}" + ("" if f"{match[2]}-{match[3]}" == _namespace() else f" on {match[1]}")
