"""Identity of processes, beyond their numbers, which are given again and mean others elsewhere; and which are alive."""

import os
import platform
import re
import time
from functools import cache
from pathlib import Path

DAY = 86_400.0
_FORM = re.compile(r"([A-Za-z0-9]{1,32})-([0-9a-f]{1,12})-([0-9]+)-([0-9]+)-([0-9]+)")


def mark() -> str:
    """Return a mark that identifies this process: host, boot, container, number, start time."""
    return f"{host()}-{_world()}-{os.getpid()}-{_begun(os.getpid()) or 0}"


def host() -> str:
    """Return the name of the machine, in letters and digits."""
    return re.sub(r"[^A-Za-z0-9]", "", platform.node())[:32] or "host"


@cache
def _world() -> str:
    """Return where process numbers are valid: this start of this machine, and this container."""
    try:
        boot = Path("/proc/sys/kernel/random/boot_id").read_text().replace("-", "")[:12]
        space = re.sub(r"\D", "", os.readlink("/proc/self/ns/pid"))
    except OSError:  # where there is no /proc, the host's name must do
        boot, space = f"{sum(map(ord, platform.node())):x}", "0"
    return f"{boot}-{space or 0}"


def _begun(process: int) -> int | None:
    """Return when a process of this machine began, in ticks since the machine did; None if there is no such process."""
    try:
        status = Path(f"/proc/{process}/stat").read_text()
    except FileNotFoundError:
        return None if Path("/proc/self").exists() else _exists(process)
    except OSError:
        return 0
    state, *others = status.rpartition(")")[2].split()
    return None if state in "ZX" else int(others[18])  # it has ended, and nobody has asked for its status yet


def _exists(process: int) -> int | None:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return None
    except PermissionError:  # it is somebody else's
        return 0
    return 0


def is_over(made_by: str, untouched: float, patience: float = DAY) -> bool:
    """Return True if the process of a mark, in the text `made_by`, has ended.

    One that cannot be looked at (of another machine or container, or of no mark) counts as ended if nothing has been
    seen of it for more than `patience` seconds.
    """
    match = _FORM.search(made_by)
    if match is None or f"{match[2]}-{match[3]}" != _world():
        return untouched > patience
    begun = _begun(int(match[4]))
    return begun is None or (begun > 0 and int(match[5]) > 0 and begun != int(match[5]))


def age(path: Path) -> float:
    """Return the seconds since a file, or the contents of a folder, last changed; 0 if it does not exist."""
    try:
        return time.time() - max(p.lstat().st_mtime for p in (path, *path.rglob("*")))
    except OSError:
        return 0.0


def in_words(made_by: str) -> str:
    """Return the process of a mark in words: "process 123", of another machine or container "process 123 on HOST"."""
    match = _FORM.search(made_by)
    if match is None:
        return "process unknown"
    return f"process {match[4]}" + ("" if f"{match[2]}-{match[3]}" == _world() else f" on {match[1]}")
