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


@cache
def fingerprint() -> str:
    """Hash of the sources of ``kernels/``, the Numba and LLVM versions and the processor.

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
    for path in sorted(Path(__file__).parent.glob("*.py")):
        digest.update(path.name.encode() + b"\n" + path.read_bytes())
    return digest.hexdigest()


def cache_folder() -> Path:
    """Folder of the compiled kernels: one a fingerprint, below the user's cache folder.

    The user's cache folder is ``$XDG_CACHE_HOME``, else ``~/.cache``; where it cannot be written, the folder for
    temporary files.
    """
    home = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    for base in (Path(home), Path(tempfile.gettempdir())):
        folder = base / "polhode" / fingerprint()[:16]
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError:
            continue
        if os.access(folder, os.W_OK):
            return folder
    return Path(tempfile.mkdtemp(prefix="polhode-"))


def use_cache() -> None:
    """Point Numba at :func:`cache_folder`, unless ``NUMBA_CACHE_DIR`` already names a folder."""
    if os.environ.get("NUMBA_CACHE_DIR"):
        return
    folder = str(cache_folder())
    os.environ["NUMBA_CACHE_DIR"] = folder
    if "numba" in sys.modules:
        sys.modules["numba"].config.CACHE_DIR = folder
