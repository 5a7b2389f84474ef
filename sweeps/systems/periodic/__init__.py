"""Described systems whose equations are periodic in time, by their Floquet multipliers."""
