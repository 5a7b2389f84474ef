"""Compiled kernels for copies of the sources: those of this checkout, so that a copy need not compile its own."""

import hashlib
import shutil
from pathlib import Path

from kernels.cache import cache_folder
from kernels.fingerprint import machine


def share(folder: Path, base: Path) -> None:
    """Puts the compiled kernels into the cache of a copy of the sources, whose folder is named by the copy's path."""
    checkout = hashlib.sha256(str((folder / "kernels").resolve()).encode()).hexdigest()[:8]
    target = base / "polhode" / f"{machine()[:16]}-{checkout}"
    for path in (path for folder in ("code", "ready", "generated") for path in cache_folder().glob(f"{folder}/*")):
        if path.suffix not in (".lock",) and path.is_file():
            to = target / path.relative_to(cache_folder())
            to.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(path, to)
