"""Hashes of kernels: of their sources, of the compiler's versions and settings, and of the processor.

A map carries the fingerprint of what made it: of those files alone that its own kernels import. Compiled kernels carry
the stamp of their file (:mod:`kernels.compile.cache`).
"""

import ast
import hashlib
import os
import platform
import re
import sys
from collections.abc import Iterable
from functools import cache
from importlib import metadata
from pathlib import Path

CODE_SETTINGS = (  # they change bits
    *("NUMBA_CPU_NAME", "NUMBA_CPU_FEATURES", "NUMBA_ENABLE_AVX", "NUMBA_OPT", "NUMBA_LOOP_VECTORIZE"),
    *("NUMBA_SLP_VECTORIZE", "NUMBA_DISABLE_INTEL_SVML", "NUMBA_DISABLE_JIT", "NUMBA_BOUNDSCHECK", "NUMBA_DEBUGINFO"),
)
SETTINGS_FILE = ".numba_config.yaml"  # Numba reads the same settings from this file in the working directory
PROCESSOR = ("vendor_id", "cpu family", "model", "model name", "stepping", "flags", "Features", "CPU part")  # Linux's
IMPORTS = re.compile(r"(?:^|[:;])[ \t]*((?:from|import)\b(?:\\\n|[^\n(;#])*(?:\([^)]*\))?)", re.MULTILINE)


@cache
def fingerprint(*modules: str) -> str:
    """Return a hash of sources in ``kernels/``, of versions and settings of Numba and LLVM, and the processor.

    The sources are those of the named modules and of all that they import from ``kernels``; without names, every file.
    64 hexadecimal digits (SHA-256): if they are equal on one machine, every result has equal bits.
    """
    digest = hashlib.sha256(machine().encode())
    _add(digest, sources(*modules))
    return digest.hexdigest()


@cache
def machine() -> str:
    """Return a hash of the compiler's versions and settings and of the processor: 64 hexadecimal digits."""
    import llvmlite.binding as llvm  # 40 ms, which a command that calls no kernel need not wait for

    digest = hashlib.sha256(sys.version.encode())
    for name in ("numba", "llvmlite", "numpy"):
        digest.update(f"{name} {metadata.version(name)}\n".encode())
    features = sorted(name for name, has in llvm.get_host_cpu_features().items() if has)
    digest.update(f"{llvm.get_host_cpu_name()} {features}\n".encode())
    for name in CODE_SETTINGS:
        digest.update(f"{name}={os.environ.get(name, '')}\n".encode())
    if os.path.isfile(SETTINGS_FILE):
        digest.update(Path(SETTINGS_FILE).read_bytes())
    return digest.hexdigest()


@cache
def stamp(path: Path) -> str:
    """Return a hash of a file that holds kernels and of all that it imports from ``kernels``: 64 hexadecimal digits.

    Args:
        path (Path): A file of ``kernels``, or a generated file.
    """
    digest = hashlib.sha256()
    _add(digest, _with_imports({path.resolve()}))
    return digest.hexdigest()


def _add(digest, paths: Iterable[Path]) -> None:
    for path in paths:
        digest.update(path.name.encode() + b"\n" + _read(path)[0])


def processor() -> list[str]:
    """Return what the system reports of this processor that distinguishes it from another kind."""
    try:
        first = Path("/proc/cpuinfo").read_text().split("\n\n", 1)[0].splitlines()
    except OSError:
        return [platform.machine(), platform.node()]
    return [line for line in first if line.partition(":")[0].strip() in PROCESSOR] or [platform.node()]


def replace(path: Path, content: bytes) -> None:
    """Write a file that only the user can read; no process ever reads an incomplete file."""
    path.parent.mkdir(exist_ok=True)
    temporary = path.with_name(f".{path.name}.{os.urandom(8).hex()}")
    try:
        temporary.touch(0o600, exist_ok=False)
        temporary.write_bytes(content)
        temporary.replace(path)
    finally:
        temporary.unlink(missing_ok=True)


def sources(*modules: str) -> list[Path]:
    """Return the files of modules of ``kernels`` and of all that they import from it; with none given, every file.

    Modules are named by their path in the package: ``free.exact``. The packages around a module are run before it, and
    are among the files with what they import. Found by reading: nothing is imported. An import counts wherever it
    stands in a file.
    """
    folder = _package_folder()
    if not modules:
        return sorted(folder.rglob("*.py"))
    files = {folder / f"{name.replace('.', '/')}.py" for name in modules}
    return _with_imports(files.union(*(_module_files(f"kernels.{name}") for name in modules)))


def _package_folder() -> Path:
    """Return the folder of the package ``kernels``."""
    return Path(__file__).parents[1]


def _module_files(name: str) -> set[Path]:
    """Return the files that an import of a module of ``kernels`` runs: its own and those of the packages around it.

    If a module defines the name, so that it has no file, the files of the packages around it are returned.
    """
    path_words = name.split(".")[1:]
    paths = ["/".join(path_words[:depth]) for depth in range(1, len(path_words) + 1)]
    files = ["__init__.py", *(f"{path}{suffix}" for path in paths for suffix in (".py", "/__init__.py"))]
    return {path for file in files if (path := _package_folder() / file).exists()}


def _with_imports(pending: set[Path]) -> list[Path]:
    """Return files and all that they import from ``kernels``, by name."""
    files: set[Path] = set()
    names: set[str] = set()
    while pending:
        path = pending.pop()
        if path not in files:
            files.add(path)
            new_names = _read(path)[1] - names
            names |= new_names
            pending = pending.union(*map(_module_files, new_names))
    return sorted(files, key=lambda path: (path.name, path))


def _read(path: Path) -> tuple[bytes, frozenset[str]]:
    """Return a file's content, and the names that it imports from ``kernels``; read again when the file has changed."""
    status = path.stat()
    return _content(path, status.st_mtime_ns, status.st_size)


@cache
def _content(path: Path, _date: int, _size: int) -> tuple[bytes, frozenset[str]]:
    """Return a file's content and the names it imports from ``kernels``, kept per date of change and size."""
    content, names = path.read_bytes(), set()
    package = path.relative_to(_package_folder().parent).parts[:-1] if _package_folder() in path.parents else ()
    for node in _imports(content.decode("utf-8")):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            around = package[: len(package) - node.level + 1] if node.level else ()
            base = ".".join([*around, *([node.module] if node.module else [])])
            names |= {base, *(f"{base}.{alias.name}" for alias in node.names)}
    return content, frozenset(name for name in names if name.split(".")[0] == "kernels")


def _imports(text: str) -> Iterable[ast.AST]:
    """Return the nodes of a source text that import from ``kernels``: parsing whole files takes 0.3 s."""
    statements = [line for line in IMPORTS.findall(text) if "kernels" in line or re.match(r"from\s*\.", line)]
    try:
        return ast.parse("\n".join(statements)).body
    except SyntaxError:  # words of a sentence, or a comment within an import
        return ast.walk(ast.parse(text))


def home() -> Path:
    """Return the user's folder of Polhode's caches, which may not be there."""
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "polhode"


def is_safe(folder: Path) -> bool:
    """Return True if this user owns and can write the folder: who else fills a cache runs code in our name."""
    return os.access(folder, os.W_OK) and (not hasattr(os, "getuid") or folder.stat().st_uid == os.getuid())
