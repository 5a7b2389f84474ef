"""Cache of compiled kernels: one file per signature, with a checksum of its content and of its sources.

Numba's own cache does not see an edit of an imported file, loses entries when two processes store at once, and runs
whatever lies in its files. Here each signature of each kernel has a file of its own, named by both, which begins with a
checksum of the machine code and of all that decides it: the source files that the kernel's own file imports, the
versions of Python, Numba and LLVM, and the processor. A file with another checksum is stale or damaged; either way the
kernel is compiled again and the file replaced. There is no index, and a file is replaced at once: processes may store
side by side and be killed at any time.
"""

import hashlib
import importlib.util
import inspect
import os
import pickle
import sys
import tempfile
from contextlib import suppress
from functools import cache
from pathlib import Path

from kernels.compile.fingerprint import home, is_safe, machine, replace, stamp

CHECKSUM = 32  # bytes
PROBE = 1 << 16  # bytes that are written to see whether a kernel could be kept: as many as a small one has


def cache_folder() -> Path:
    """Return the folder of compiled kernels: one a machine, version of Numba and checkout.

    It lies in ``$NUMBA_CACHE_DIR``, else ``polhode`` in ``$XDG_CACHE_HOME`` or ``~/.cache``; if none can be
    written, in a folder for temporary files.
    """
    return _folder(os.environ.get("NUMBA_CACHE_DIR", ""), home(), Path(__file__).resolve().parents[1])


def why_unkept() -> str:
    """Return why nothing that is compiled can be kept for another process; the empty string if it can."""
    folder = cache_folder()
    bases = _bases(os.environ.get("NUMBA_CACHE_DIR", ""), home())
    if folder.parent not in bases:  # it is this process's own
        try:
            bases[0].mkdir(parents=True, exist_ok=True)
        except OSError as error:
            return f"{bases[0]}: {error.strerror}"
        return f"{bases[0]}: belongs to another user, or cannot be written"
    try:
        replace(folder / ".probe", bytes(PROBE))
        (folder / ".probe").unlink(missing_ok=True)
    except OSError as error:
        return f"{folder}: {error.strerror}"
    return ""


def _bases(setting: str, user: Path) -> list[Path]:
    """Return the folders in which :func:`cache_folder` may be, in order of preference."""
    preferred_base = [Path(os.path.abspath(setting))] if setting else []
    return [*preferred_base, user, Path(tempfile.gettempdir()) / "polhode"]


@cache
def _folder(setting: str, user: Path, checkout: Path) -> Path:
    """Return the first folder of :func:`_bases` that can be made and is the user's alone, else a temporary one."""
    name = f"{machine()[:16]}-{hashlib.sha256(str(checkout).encode()).hexdigest()[:8]}"
    bases = _bases(setting, user)
    for base in bases:
        folder = base / name
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError:
            continue
        if is_safe(folder) and ((setting and base is bases[0]) or is_safe(base)):
            return folder
    folder = Path(tempfile.mkdtemp(prefix="polhode-")) / name
    folder.mkdir()
    return folder


def holds(module: str) -> bool:
    """Return whether some kernel of a module is stored, of whatever version."""
    return any((cache_folder() / "code").glob(f"{module}.*"))


def load(path: Path):
    """Compile a generated file or read it from the cache of kernels, by importing it once."""
    if path.stem in sys.modules:
        return sys.modules[path.stem]
    spec = importlib.util.spec_from_file_location(path.stem, path)
    module = importlib.util.module_from_spec(spec)
    sys.modules[path.stem] = module
    try:
        spec.loader.exec_module(module)
    except BaseException:
        del sys.modules[path.stem]
        raise
    return module


class KernelCache:
    """The cache of one function's compiled code, as a dispatcher of Numba calls it.

    Args:
        function (function): Of a file; one typed at a prompt is not kept.
    """

    def __init__(self, function):
        self._file = Path(inspect.getfile(function))
        self._name = f"{self._file.stem}.{function.__qualname__}-{function.__code__.co_firstlineno}"
        self._stamp = stamp(self._file) if self._file.is_file() else ""

    @property
    def cache_path(self) -> str:
        """The folder, as Numba's statistics name it."""
        return str(cache_folder())

    def load_overload(self, signature, target_context):
        """Return what was compiled for a signature; None where nothing sound is stored."""
        from numba.core.compiler import CompileResult

        target_context.refresh()
        path, key = self._place(signature, target_context.codegen())
        try:
            content = path.read_bytes() if path else b""
        except OSError:
            return None
        code = content[CHECKSUM:]
        if not code or content[:CHECKSUM] != _checksum(key, code):
            return None
        return CompileResult._rebuild(target_context, *pickle.loads(code))

    def save_overload(self, signature, compiled) -> None:
        """Store what was compiled for a signature; where nothing can be written it holds for this process alone."""
        from numba.core.serialize import dumps

        path, key = self._place(signature, compiled.codegen)
        if path and not compiled.lifted and not compiled.library.has_dynamic_globals:
            code = dumps(compiled._reduce())
            with suppress(OSError):
                replace(path, _checksum(key, code) + code)

    def flush(self) -> None:
        """Do nothing: what is compiled again replaces what is stored."""

    def _place(self, signature, codegen) -> tuple[Path | None, str]:
        """Return the file of a signature, and all that decides its code."""
        if not self._stamp:
            return None, ""
        from numba.core.sigutils import normalize_signature

        arguments, _ = normalize_signature(signature)
        if " at 0x" in repr(arguments):  # a function that another process has elsewhere
            return None, ""
        key = repr((self._name, arguments, self._stamp, codegen.magic_tuple()))
        short = hashlib.sha256(repr(arguments).encode()).hexdigest()[:16]
        return cache_folder() / "code" / f"{self._name}-{short}", key


def _checksum(key: str, code: bytes) -> bytes:
    return hashlib.sha256(key.encode() + code).digest()
