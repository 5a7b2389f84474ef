"""Settings of the processes that Polhode starts; importing Polhode sets nothing."""

import os

SETTINGS = {
    "HDF5_USE_FILE_LOCKING": "FALSE",  # some file systems have no locks; claims guard the folders
    "MPLBACKEND": "agg",  # pictures go to files
    "OPENBLAS_NUM_THREADS": "1",  # matrices here are small
    "PYDANTIC_DISABLE_PLUGINS": "__all__",  # else pydantic searches all installed packages for them
}
_is_own = False


def configure() -> None:
    """Apply the settings to this process, which is a command or a worker of one."""
    global _is_own
    _is_own = True
    os.environ["MPLBACKEND"] = SETTINGS["MPLBACKEND"]  # whatever it was: a backend that is missing stops Matplotlib
    for name, value in SETTINGS.items():
        os.environ.setdefault(name, value)
    import logging

    # Matplotlib warns if the user has no folder for its list of fonts: pictures are the same
    logging.getLogger("matplotlib").setLevel(logging.ERROR)


def leave_out_compiler() -> bool:
    """Run kernels as plain Python in a command that calls few of them; return whether this process does so."""
    from kernels.compile import jit

    return _is_own and jit.leave_out_compiler()
