"""Compiled numerics: floats and arrays in, floats and arrays out; NumPy and Numba only."""
