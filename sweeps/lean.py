"""What a process that a command is, or starts, does without: parts of libraries, and words that are for nobody."""

import os
import sys

from sweeps.awaited import once_loaded

_is_alone = False  # whether this process is for one thing, which knows what it calls


def leave_out(alone: bool = False) -> None:
    """Leaves out Dask, a quarter of xarray's time to load, and three things beside.

    Plugins of pydantic: it would look for them in what all installed packages say of themselves. Matplotlib's advice
    on where it keeps its list of fonts when the user has no folder to write into: pictures are the same.

    Args:
        alone: whether the process is for one thing, which may leave out the compiler too.
    """
    global _is_alone
    _is_alone = _is_alone or alone
    if "xarray" not in sys.modules:  # which remembers what it has once found
        for name in ("dask", "dask.array"):  # a command computes all that it shows, and nothing later
            sys.modules.setdefault(name, None)
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")
    once_loaded("matplotlib.artist", _without_its_manual)
    once_loaded("logging", lambda logging: logging.getLogger("matplotlib").setLevel(logging.ERROR))


def leave_out_the_compiler() -> bool:
    """Leaves out Numba in a command that asks kernels for few numbers; whether it is, so that kernels are plain."""
    from kernels import plain

    return _is_alone and plain.leave_out_numba()


def _without_its_manual(artist) -> None:
    """Matplotlib lists, as it loads, all properties of each of its classes for `help`: half of its time to load."""
    artist.kwdoc = lambda drawn: ""
