"""Search for all zeros of functions in a box, each proved by interval arithmetic."""
