"""Compiling the kernels before anything else needs them.

Numba's disk cache is not safe when several processes compile at once, so the workflow compiles in one job of its own.
"""

import fcntl
import os

from kernels.fingerprint import cache_folder
from sweeps import claims, systems


def compile_kernels() -> None:
    """Compiles, and stores in the cache, every kernel that a sweep calls, whatever its system; one process at once."""
    handle = os.open(cache_folder() / ".compiling", os.O_RDWR | os.O_CREAT, 0o600)
    try:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX)
        except OSError as error:
            if error.errno not in claims.UNSUPPORTED:
                raise
        for name in systems.names():
            systems.resolve(name).compile()
    finally:
        os.close(handle)
