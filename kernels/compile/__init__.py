"""Compilation of kernels, the cache of their machine code, blocks of lanes, tables of columns."""
