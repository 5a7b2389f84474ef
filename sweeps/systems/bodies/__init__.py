"""Rigid bodies: the model of a body, its shapes and parameters, and common parts of systems of free bodies."""
