"""Which kernels are these, and where do their compiled forms lie.

Numba's disk cache does not see a change in a function that was imported from another file. The cache therefore lives
in a folder named by a fingerprint of every source file here together with the Numba and LLVM versions and the
processor: an edit of any kernel opens a new, empty folder. A map carries the fingerprint of what made it: of those
files alone that its own kernels import.
"""

import ast
import hashlib
import json
import os
import platform
import re
import sys
import tempfile
import warnings
from collections.abc import Iterable
from contextlib import suppress
from functools import cache
from importlib.machinery import PathFinder
from importlib.util import find_spec
from pathlib import Path

CODE_SETTINGS = (  # they change bits
    *("NUMBA_CPU_NAME", "NUMBA_CPU_FEATURES", "NUMBA_ENABLE_AVX", "NUMBA_OPT", "NUMBA_LOOP_VECTORIZE"),
    *("NUMBA_SLP_VECTORIZE", "NUMBA_DISABLE_INTEL_SVML", "NUMBA_DISABLE_JIT", "NUMBA_BOUNDSCHECK", "NUMBA_DEBUGINFO"),
)
SETTINGS_FILE = ".numba_config.yaml"  # in the folder where a process starts: the same settings, says Numba
# Processors for which LLVM takes 256 bits of 512, and that do not lower their clock for whole ones. (Skylake-X, Cascade
# Lake, Cooper Lake and Cannon Lake do: they keep LLVM's choice.)
WHOLE = {
    *("icelake-client", "icelake-server", "tigerlake", "rocketlake"),
    *("sapphirerapids", "emeraldrapids", "graniterapids", "graniterapids-d"),
}
PROCESSOR = ("vendor_id", "cpu family", "model", "model name", "stepping", "flags", "Features", "CPU part")  # Linux's
WIDE, NARROW = ",-prefer-256-bit", ",+prefer-256-bit"  # ends of the features, by which they are known as set here
IMPORTS = re.compile(r"(?:^|[:;])[ \t]*((?:from|import)\b(?:\\\n|[^\n(;#])*(?:\([^)]*\))?)", re.MULTILINE)
OURS = re.compile("[0-9a-f]{16}-[0-9a-f]{8}")  # names of our folders of compiled kernels


@cache
def fingerprint(*modules: str) -> str:
    """Hash of sources in ``kernels/``, of the versions and settings of Numba and LLVM, and of the processor.

    Parameters
    ----------
    modules : str
        Names of modules of ``kernels``: they count, and whatever they import from ``kernels``. With none, every file.

    Returns
    -------
    str
        64 hexadecimal digits (SHA-256). Equal fingerprints on one machine mean equal bits in every result.
    """
    _settle_vectors()
    digest = hashlib.sha256()
    for name in ("numba", "llvmlite", "numpy"):
        digest.update(f"{name} {_version(name)}\n".encode())
    host, features = _host()
    digest.update(f"{host} {_present(features)}\n".encode())
    for name in CODE_SETTINGS:
        digest.update(f"{name}={os.environ.get(name, '')}\n".encode())
    if os.path.isfile(SETTINGS_FILE):
        digest.update(Path(SETTINGS_FILE).read_bytes())
    for path in sources(*modules):
        digest.update(path.name.encode() + b"\n" + path.read_bytes())
    return digest.hexdigest()


def _version(name: str) -> str:
    """A package's version, by the name of what its installer left beside it: Python's own way takes 20 ms to load."""
    spec = PathFinder.find_spec(name)  # which does not set up the cache, as to look for Numba otherwise does
    left = list(Path(spec.origin).parents[1].glob(f"{name}-[0-9]*.dist-info")) if spec and spec.origin else []
    if len(left) == 1:
        return left[0].name.removeprefix(f"{name}-").removesuffix(".dist-info")
    from importlib.metadata import version

    return version(name)


def _host() -> tuple[str, str]:
    """LLVM's name of this processor, and its features as LLVM writes them, +one,-other.

    To load LLVM takes 40 ms: a process that has not, and will call no kernel, believes what one that had has noted of
    the same processor by the same library.
    """
    basis = hashlib.sha256("\n".join(_known_of_the_host()).encode()).hexdigest()
    note, noted = _home() / f"processor.{basis[:16]}.json", None
    with suppress(OSError, ValueError, TypeError, KeyError):
        noted = json.loads(note.read_text()) if _is_safe(note.parent) else {}
        if "llvmlite.binding" not in sys.modules and noted["basis"] == basis:
            return str(noted["name"]), str(noted["features"])
    import llvmlite.binding as llvm

    features = ",".join(f"{'+' if has else '-'}{name}" for name, has in sorted(llvm.get_host_cpu_features().items()))
    told = {"basis": basis, "name": llvm.get_host_cpu_name(), "features": features}
    if noted != told:
        _write_note(note, told)
    return told["name"], told["features"]


def _known_of_the_host() -> list[str]:
    """What tells this processor from one of another kind, and LLVM from another, without LLVM; changes with either."""
    spec = PathFinder.find_spec("llvmlite")
    library = [file for file in Path(spec.origin).parent.glob("binding/*llvmlite.*")] if spec and spec.origin else []
    weights = [(str(file), (status := file.stat()).st_size, status.st_mtime_ns) for file in library]
    return [str(weights), *processor()]


def processor() -> list[str]:
    """What the system says of this processor that tells it from one of another kind."""
    try:
        first = Path("/proc/cpuinfo").read_text().split("\n\n", 1)[0].splitlines()
    except OSError:
        return [platform.machine(), platform.node()]
    return [line for line in first if line.partition(":")[0].strip() in PROCESSOR] or [platform.node()]


def _present(features: str) -> list[str]:
    return sorted(feature[1:] for feature in features.split(",") if feature.startswith("+"))


def _write_note(note: Path, told: dict) -> None:
    """Writes it where the user has a folder of caches already, and may."""
    from kernels import stored

    with suppress(OSError):
        if _is_safe(note.parent):
            stored.write_whole(note, told)


def sources(*modules: str) -> list[Path]:
    """The files of modules of ``kernels``, and of all that they import from it, by name; with none given, every file.

    The package's own ``__init__`` is run before any of them, and is among them with what it imports. Found by reading:
    nothing is imported. An import counts wherever it stands in a file.
    """
    folder = Path(__file__).parent
    if not modules:
        return sorted(folder.glob("*.py"))
    found, left = set(), [folder / "__init__.py", *(folder / f"{name}.py" for name in modules)]
    while left:
        path = left.pop()
        if path not in found:
            found.add(path)
            left += _imported(path)
    return sorted(found)


def _imported(path: Path) -> set[Path]:
    """The files beside one that it imports, by ``from . import x``, ``import kernels.x`` or however else.

    A name that is no file is one that the package's ``__init__`` defines.
    """
    names: set[str] = set()
    for node in _imports(path.read_text(encoding="utf-8")):
        if isinstance(node, ast.Import):
            names |= {alias.name.removeprefix("kernels.") for alias in node.names if alias.name.startswith("kernels.")}
        elif isinstance(node, ast.ImportFrom):
            module = "kernels" + f".{node.module or ''}".rstrip(".") if node.level else node.module
            if module == "kernels":
                names |= {alias.name for alias in node.names}
            elif module.startswith("kernels."):
                names.add(module.removeprefix("kernels."))
    beside = {path.with_name(f"{name}.py") for name in names}
    return {file for file in beside if file.exists()}


def _imports(text: str) -> Iterable[ast.AST]:
    """Nodes of a source text that hold its imports of ``kernels``: each process asks, and whole files take 0.3 s."""
    found = [own for own in IMPORTS.findall(text) if "kernels" in own or re.match(r"from\s*\.", own)]
    try:
        return ast.parse("\n".join(found)).body
    except SyntaxError:  # words of a sentence, or a comment within an import
        return ast.walk(ast.parse(text))


def cache_folder() -> Path:
    """Folder of the compiled kernels: one a fingerprint and a checkout, below a folder of the user's.

    Numba keeps compiled functions by the path of their source, so each checkout has a folder, and compiles, of its own.

    The user's folder is ``$NUMBA_CACHE_DIR``, else ``polhode`` in ``$XDG_CACHE_HOME`` or ``~/.cache``; where it cannot
    be written, one for temporary files.
    """
    checkout = hashlib.sha256(str(Path(__file__).resolve().parent).encode()).hexdigest()[:8]
    name = f"{fingerprint()[:16]}-{checkout}"
    chosen = _chosen()
    for base in (chosen, _home(), Path(tempfile.gettempdir()) / "polhode"):
        if base is None:
            continue
        folder = base / name
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError:
            continue
        if _is_safe(folder) and (base is chosen or _is_safe(base)):
            return folder
    folder = Path(tempfile.mkdtemp(prefix="polhode-")) / name
    folder.mkdir()
    return folder


def _home() -> Path:
    """The user's own folder of caches of ours, which may not be there."""
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "polhode"


def _chosen() -> Path | None:
    """The folder that ``NUMBA_CACHE_DIR`` names, if it does.

    A folder of ours there was left by this process or a parent, perhaps before an edit of a kernel: what was chosen is
    the folder that holds it.
    """
    given = os.environ.get("NUMBA_CACHE_DIR")
    if not given:
        return None
    folder = Path(os.path.abspath(given))
    return folder.parent if OURS.fullmatch(folder.name) else folder


def _is_safe(folder: Path) -> bool:
    """Whether this user can write the folder and owns it: whoever else fills a cache runs code in our name."""
    return os.access(folder, os.W_OK) and (not hasattr(os, "getuid") or folder.stat().st_uid == os.getuid())


def use_whole_vectors() -> None:
    """Have Numba's code use whole vectors where that is faster, by rule (WHOLE): a quarter faster in rates alone.

    The processor's features are set, in the environment for processes to come and for Numba if it is imported already.
    Where the user has set any, theirs hold. Features that a parent process set are formed anew: this may be another
    machine. Where Numba has begun to compile, what it has holds, and a warning says so.
    """
    set_here = os.environ.get("NUMBA_CPU_FEATURES", "")
    narrow = set_here.endswith(NARROW)
    if set_here and (_has_begun() or not (narrow or set_here.endswith(WIDE))):
        return
    os.environ.pop("NUMBA_CPU_FEATURES", None)
    host, features = _host()
    if host not in WHOLE or "avx512f" not in _present(features) or _settings_of_the_processor():
        return
    if not narrow and _has_begun():
        narrow = True
        message = "Numba compiled before Polhode was imported: kernels use half of each vector. Import Polhode first."
        warnings.warn(message, RuntimeWarning, stacklevel=2)
    os.environ["NUMBA_CPU_FEATURES"] = features + (NARROW if narrow else WIDE)
    if "numba" in sys.modules and not _has_begun():
        sys.modules["numba"].config.CPU_FEATURES = os.environ["NUMBA_CPU_FEATURES"]


@cache
def _settle_vectors() -> None:
    """Calls :func:`use_whole_vectors` once, whether Numba is to come or not: the features are in the fingerprint."""
    use_whole_vectors()


def _settings_of_the_processor() -> bool:
    """Whether the user has settings of their own that bear on the processor's features."""
    if any(os.environ.get(name) for name in ("NUMBA_CPU_NAME", "NUMBA_ENABLE_AVX")):
        return True
    return os.path.isfile(SETTINGS_FILE) and bool(re.search(b"(?i)cpu_|avx", Path(SETTINGS_FILE).read_bytes()))


def _has_begun() -> bool:
    """Whether Numba has set up its code generator, with the features it had then."""
    registry = sys.modules.get("numba.core.registry")
    return registry is not None and "_toplevel_target_context" in vars(registry.cpu_target)


class _BeforeNumba:
    """Waits for the first import of Numba, which reads its settings as it loads."""

    def find_spec(self, name: str, path=None, target=None):
        """Where Numba is, once its cache is set; nothing of any other module."""
        if name != "numba":
            return None
        sys.meta_path.remove(self)
        use_cache()
        return find_spec(name)


def use_cache_with_numba() -> None:
    """Calls :func:`use_cache` before Numba is loaded, which may be never; now where it is there."""
    if "numba" in sys.modules:
        use_cache()
    else:
        sys.meta_path.insert(0, _BeforeNumba())


def use_cache() -> None:
    """Point Numba at :func:`cache_folder`, and leave nothing there that has changed on the disk."""
    import llvmlite.binding  # noqa: F401  (Numba loads it: what holds for code is asked of LLVM, and of no note)

    from kernels import stored

    use_whole_vectors()
    folder = cache_folder()
    os.environ["NUMBA_CACHE_DIR"] = str(folder)
    if "numba" in sys.modules:
        sys.modules["numba"].config.CACHE_DIR = str(folder)
    stored.watch(folder)
