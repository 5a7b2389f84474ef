"""Figures, the report, and maps as text."""
