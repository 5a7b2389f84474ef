"""Settings of the whole test run: the same examples every time, and no time limit on any of them."""

import pytest
from hypothesis import settings
from numba import config

settings.register_profile("fixed", derandomize=True, deadline=None, max_examples=60)
settings.register_profile("without_jit", derandomize=True, deadline=None, max_examples=8)
settings.load_profile("without_jit" if config.DISABLE_JIT else "fixed")


@pytest.fixture(scope="session")
def house(tmp_path_factory):
    """A copy of the sources with the kernels compiled, and the content hash of an undisturbed run."""
    from houses import House

    house = House(tmp_path_factory.mktemp("house"))
    status, said = house.run()
    assert status == 0, said
    house.hash = house.content()
    return house
