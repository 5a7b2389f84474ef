"""Motions of described systems, their linear flow, spectra and multipliers with errors."""
