"""Settings of the whole test run: the same examples every time, and no time limit on any of them.

Tests run in parallel, a process a core (pytest-xdist). What they share is the compiled kernels: compiled once, before
the processes start, and whatever a test compiles besides is stored by one process at a time.
"""

import subprocess
import sys

import pytest
from hypothesis import settings
from numba import config

from kernels import stored
from kernels.fingerprint import cache_folder

settings.register_profile("fixed", derandomize=True, deadline=None, max_examples=60)
settings.register_profile("without_jit", derandomize=True, deadline=None, max_examples=8)
settings.load_profile("without_jit" if config.DISABLE_JIT else "fixed")


def pytest_configure(config):
    """Compiles the kernels, where there are processes to share them and no other run has."""
    compiled, everything = cache_folder() / "compiled", cache_folder() / "everything"
    if not hasattr(config, "workerinput") and getattr(config.option, "numprocesses", None) and not everything.exists():
        subprocess.run([sys.executable, "-m", "sweeps", "compile", "--all", "--output", compiled], check=True)
        everything.touch()


stored.store_in_turn()


@pytest.fixture(scope="session")
def house(tmp_path_factory):
    """A copy of the sources with the kernels compiled, and the content hash of an undisturbed run."""
    from houses import House

    house = House(tmp_path_factory.mktemp("house"))
    status, said = house.run()
    assert status == 0, said
    house.hash = house.content()
    return house
