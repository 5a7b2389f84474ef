"""Copies of the sources, Python run in them, and this checkout's compiled kernels, which they then need not compile."""

import hashlib
import os
import shutil
import subprocess
import sys
from pathlib import Path

from kernels.compile.cache import cache_folder
from kernels.compile.fingerprint import machine

ROOT = Path(__file__).parents[1]


def copy_sources(folder: Path) -> Path:
    """Copy the sources and the workflow into a folder, and return it."""
    for name in ("kernels", "sweeps"):
        shutil.copytree(ROOT / name, folder / name, ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy2(ROOT / "Snakefile", folder)
    return folder


def environment_of(folder: Path, **settings: str) -> dict[str, str]:
    """Return the environment of programs in a copy of the sources, with a compiler cache of its own."""
    environment = {**os.environ, "PYTHONPATH": str(folder), "XDG_CACHE_HOME": str(folder / ".cache"), **settings}
    environment.pop("NUMBA_CACHE_DIR", None)
    return environment


def run(folder: Path, *arguments, **settings: str) -> subprocess.CompletedProcess:
    """Run Python in a copy of the sources, with some settings added to the environment."""
    command = [sys.executable, *map(str, arguments)]
    environment = environment_of(folder, **settings)
    return subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)


def share(folder: Path, base: Path) -> None:
    """Put the compiled kernels into the cache of a copy of the sources; the copy's path names the folder."""
    checkout = hashlib.sha256(str((folder / "kernels").resolve()).encode()).hexdigest()[:8]
    target = base / "polhode" / f"{machine()[:16]}-{checkout}"
    for path in (path for folder in ("code", "ready", "generated") for path in cache_folder().glob(f"{folder}/*")):
        if path.suffix not in (".lock",) and path.is_file():
            to = target / path.relative_to(cache_folder())
            to.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(path, to)
