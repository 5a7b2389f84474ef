"""What a process that a command is, or starts, does without: parts of libraries, and words that are for nobody."""

import gc
import os
import sys
from types import ModuleType

from sweeps.awaited import once_asked, once_loaded

SELDOM = 10_000  # new objects between two looks for rings of dead ones; start-up makes many, and no dead ones
MANUAL = ("numpy._core._add_newdocs", "numpy._core._add_newdocs_scalars")  # what `help` says of compiled functions
_is_alone = False  # whether this process is for one thing, which knows what it calls


def leave_out(alone: bool = False) -> None:
    """Leaves out Dask, a quarter of xarray's time to load, and other things beside.

    Plugins of pydantic: it would look for them in what all installed packages say of themselves. Matplotlib's advice
    on where it keeps its list of fonts when the user has no folder to write into: pictures are the same.

    Args:
        alone: whether the process is for one thing, which may leave out the compiler too.
    """
    global _is_alone
    _is_alone = _is_alone or alone
    if alone:
        _start_lightly()
    if "xarray" not in sys.modules:  # which remembers what it has once found
        for name in ("dask", "dask.array"):  # a command computes all that it shows, and nothing later
            sys.modules.setdefault(name, None)
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")
    once_loaded("matplotlib.artist", _without_its_manual)
    once_loaded("logging", lambda logging: logging.getLogger("matplotlib").setLevel(logging.ERROR))


def _start_lightly() -> None:
    """Of a process that is for one thing, which NumPy's threads of linear algebra start with: matrices here are small.

    The table of glyphs' names is TeX's alone.
    """
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    gc.set_threshold(SELDOM)
    once_asked("fontTools.agl")
    for name in MANUAL:
        sys.modules.setdefault(name, ModuleType(name))


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
