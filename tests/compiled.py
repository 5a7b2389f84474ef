"""Compiled kernels for copies of the sources: those of this checkout, so that a copy need not compile its own."""

import hashlib
import shutil
from pathlib import Path

import kernels
from kernels.fingerprint import cache_folder
from kernels.stored import LEDGER

SOURCES = Path(kernels.__file__).resolve().parent


def share(folder: Path, base: Path) -> None:
    """Puts the compiled kernels into a copy's cache, under the names that the copy will look for.

    Numba names a folder by the path of the sources, ours by the path of the checkout (`kernels.fingerprint`). The
    copied sources must have their dates, which Numba compares.
    """
    theirs, ours = (folder / "kernels").resolve(), cache_folder()
    fingerprint = ours.name.partition("-")[0]
    target = base / "polhode" / f"{fingerprint}-{_hash(theirs, hashlib.sha256)[:8]}"
    written = ours / "generated"
    copies = [(path, target / "generated") for path in written.glob("*.py")]
    for what, here, there in (("kernels", SOURCES, theirs), ("generated", written, target / "generated")):
        to = target / f"{what}_{_hash(there.resolve(), hashlib.sha1)}"
        copies += [(path, to) for path in ours.glob(f"{what}_{_hash(here, hashlib.sha1)}/*.nb[ic]")]
    for path, to in copies:
        to.mkdir(parents=True, exist_ok=True)
        shutil.copy2(path, to)
    if (ours / "compiled").exists():
        shutil.copy2(ours / "compiled", target)
    assert not (target / LEDGER).exists()  # it is written anew, from what lies there


def _hash(path: Path, algorithm) -> str:
    return algorithm(str(path).encode()).hexdigest()
