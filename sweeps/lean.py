"""What a process that a command is, or starts, does without: parts of libraries, and words that are for nobody."""

import atexit
import gc
import os
import sys
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from importlib import import_module
from importlib.util import find_spec
from types import ModuleType
from typing import NoReturn

from sweeps.awaited import once_asked, once_loaded, while_loaded

SELDOM = 100_000  # new objects between two looks for rings of dead ones; start-up makes many, and no dead ones
MANUAL = ("numpy._core._add_newdocs", "numpy._core._add_newdocs_scalars")  # what `help` says of compiled functions
METADATA = "importlib.metadata"
BLAS = "scipy.linalg.cython_blas"
_is_alone = False  # whether this process is for one thing, which knows what it calls
_status: int | None = None  # what this process ends with at once; None where it is to end in Python's way


def leave_out(alone: bool = False) -> None:
    """Leaves out Dask, a quarter of xarray's time to load, and other things beside.

    Plugins of pydantic: it would look for them in what all installed packages say of themselves. Matplotlib's advice
    on where it keeps its list of fonts when the user has no folder to write into: pictures are the same.

    Args:
        alone: whether the process is for one thing, which may leave out the compiler too.
    """
    global _is_alone
    if alone and not _is_alone:
        _is_alone = True
        _start_lightly()
    if "xarray" not in sys.modules:  # which remembers what it has once found
        for name in ("dask", "dask.array"):  # a command computes all that it shows, and nothing later
            sys.modules.setdefault(name, None)
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")
    once_loaded("matplotlib.artist", _without_its_manual)
    once_loaded("logging", lambda logging: logging.getLogger("matplotlib").setLevel(logging.ERROR))


def _start_lightly() -> None:
    """Of a process that is for one thing, which NumPy's threads of linear algebra start with: matrices here are small.

    The table of glyphs' names is TeX's alone. What packages say of themselves, pydantic looks up for plugins, which are
    left out. NumPy's types for annotations are loaded for its linear algebra's alone. Numba looks for SciPy's linear
    algebra as it loads, and again where compiled code is to call it, which no kernel does.
    """
    atexit.register(_end)  # first, and so done last: what is loaded from now on has its own ends before
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    gc.set_threshold(SELDOM)
    once_asked("fontTools.agl")
    while_loaded("numpy.linalg._linalg", _with_types_unloaded)
    while_loaded("numba.np.arraymath", _with_blas_unloaded)
    while_loaded("pydantic.plugin._loader", _with_metadata_unloaded)
    for name in MANUAL:
        sys.modules.setdefault(name, ModuleType(name))


def _with_blas_unloaded() -> AbstractContextManager:
    """Shows a SciPy that is installed to whoever looks for its linear algebra, which takes 0.2 s to load."""
    return nullcontext() if find_spec("scipy") is None else _with_unloaded(BLAS)


def _with_types_unloaded() -> AbstractContextManager:
    """Lets annotations of NumPy's results name what is not loaded, which takes 20 ms: nobody reads them here."""
    return _with_unloaded("numpy._typing", __getattr__=lambda name: list)


def _with_metadata_unloaded() -> AbstractContextManager:
    """Has what packages say of themselves loaded when it is asked for: it takes 15 ms, most of them for e-mail."""
    return _with_unloaded(METADATA, entry_points=lambda **group: import_module(METADATA).entry_points(**group))


@contextmanager
def _with_unloaded(name: str, **shown) -> Iterator[None]:
    """Shows another module in the place of one that is not loaded, while the block lasts."""
    if name in sys.modules:
        yield
        return
    sys.modules[name] = ModuleType(name)
    vars(sys.modules[name]).update(shown)
    try:
        yield
    finally:
        del sys.modules[name]


def end_at_once(status: int) -> NoReturn:
    """Ends this command's process, with all that is to be done at its end, but does not take down what it has loaded.

    That is a fifth of what a short command takes, and half a second where kernels were compiled: the system has the
    memory back in any case.
    """
    ends_with(status)
    sys.exit(status)


def ends_with(status: int) -> None:
    """Has a process that is for one thing end in that way, when it ends, with this status."""
    global _status
    _status = status


def _end() -> None:
    """The last of what is done at a process's end."""
    if _status is None:
        return
    try:
        sys.stdout.flush()
        sys.stderr.flush()
    except OSError:  # which Python tells of, as it ends
        return
    os._exit(_status)


def is_alone() -> bool:
    """Whether this process is for one command alone."""
    return _is_alone


def leave_out_the_compiler() -> bool:
    """Leaves out Numba in a command that asks kernels for few numbers; whether it is, so that kernels are plain."""
    from kernels import plain

    return _is_alone and plain.leave_out_numba()


def _without_its_manual(artist) -> None:
    """Matplotlib lists, as it loads, all properties of each of its classes for `help`: half of its time to load."""
    artist.kwdoc = lambda drawn: ""
