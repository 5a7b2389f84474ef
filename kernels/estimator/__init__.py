"""Measurement of a rate from samples alone: its reduction to zero amplitude, error and status."""
