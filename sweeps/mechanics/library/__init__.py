"""The systems of small oscillations that ship, one description a file."""
