"""Settings of the whole test run: the same examples every time, and no time limit on any of them."""

from hypothesis import settings
from numba import config

settings.register_profile("fixed", derandomize=True, deadline=None, max_examples=60)
settings.register_profile("without_jit", derandomize=True, deadline=None, max_examples=8)
settings.load_profile("without_jit" if config.DISABLE_JIT else "fixed")
