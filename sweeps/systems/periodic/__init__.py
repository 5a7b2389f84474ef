"""Described systems with equations that are periodic in time, by their Floquet multipliers."""
