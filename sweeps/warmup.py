"""Compiling the kernels before anything else needs them.

Numba's disk cache is not safe when several processes compile at once, so the workflow compiles in one job of its own.
"""

from sweeps import systems


def compile_kernels() -> None:
    """Compiles, and stores in the cache, every kernel that a sweep calls, whatever its system."""
    for name in systems.names():
        systems.resolve(name).compile()
