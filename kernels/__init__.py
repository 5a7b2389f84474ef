"""The compiled floor of Polhode: floats and arrays in, floats and arrays out, NumPy and Numba only."""

from kernels.fingerprint import use_cache_with_numba

use_cache_with_numba()
