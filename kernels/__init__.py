"""The compiled floor of Polhode: floats and arrays in, floats and arrays out, NumPy and Numba only."""
