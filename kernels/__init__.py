"""Compiled numerics: floats and arrays in, floats and arrays out; NumPy and Numba only."""

PROJECT = "polhode"  # `sweeps` refuses another package that is called kernels
