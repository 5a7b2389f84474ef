"""Which kernels are these, and where do their compiled forms lie.

Numba's disk cache does not see a change in a function that was imported from another file. The cache therefore lives
in a folder named by a fingerprint of every source file here together with the Numba and LLVM versions and the
processor: an edit of any kernel opens a new, empty folder.
"""

import hashlib
import os
import sys
import tempfile
from functools import cache
from importlib.metadata import version
from pathlib import Path

CODE_SETTINGS = ("NUMBA_CPU_NAME", "NUMBA_CPU_FEATURES", "NUMBA_OPT", "NUMBA_DISABLE_JIT")  # they change bits


@cache
def fingerprint() -> str:
    """Hash of the sources of ``kernels/``, the versions and settings of Numba and LLVM, and the processor.

    Returns
    -------
    str
        64 hexadecimal digits (SHA-256). Equal fingerprints on one machine mean equal bits in every result.
    """
    import llvmlite.binding as llvm

    digest = hashlib.sha256()
    for name in ("numba", "llvmlite", "numpy"):
        digest.update(f"{name} {version(name)}\n".encode())
    features = sorted(k for k, has in llvm.get_host_cpu_features().items() if has)
    digest.update(f"{llvm.get_host_cpu_name()} {features}\n".encode())
    for name in CODE_SETTINGS:
        digest.update(f"{name}={os.environ.get(name, '')}\n".encode())
    for path in sorted(Path(__file__).parent.glob("*.py")):
        digest.update(path.name.encode() + b"\n" + path.read_bytes())
    return digest.hexdigest()


def cache_folder() -> Path:
    """Folder of the compiled kernels: one a fingerprint and a checkout, below the user's cache folder.

    Numba keeps compiled functions by the path of their source, so each checkout has a folder, and compiles, of its own.

    The user's cache folder is ``$XDG_CACHE_HOME``, else ``~/.cache``; where it cannot be written, the folder for
    temporary files.
    """
    checkout = hashlib.sha256(str(Path(__file__).resolve().parent).encode()).hexdigest()[:8]
    home = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    for base in (Path(home), Path(tempfile.gettempdir())):
        folder = base / "polhode" / f"{fingerprint()[:16]}-{checkout}"
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError:
            continue
        if _is_safe(folder) and _is_safe(folder.parent):
            return folder
    return Path(tempfile.mkdtemp(prefix="polhode-"))


def _is_safe(folder: Path) -> bool:
    """Whether this user can write the folder and owns it: whoever else fills a cache runs code in our name."""
    return os.access(folder, os.W_OK) and (not hasattr(os, "getuid") or folder.stat().st_uid == os.getuid())


def use_cache() -> None:
    """Point Numba at :func:`cache_folder`, unless ``NUMBA_CACHE_DIR`` already names a folder of somebody's choice.

    A folder of ours in ``NUMBA_CACHE_DIR`` was left there by a parent process, perhaps before an edit of a kernel.
    """
    given = os.environ.get("NUMBA_CACHE_DIR")
    if given and Path(given).parent.name != "polhode":
        return
    folder = str(cache_folder())
    os.environ["NUMBA_CACHE_DIR"] = folder
    if "numba" in sys.modules:
        sys.modules["numba"].config.CACHE_DIR = folder
