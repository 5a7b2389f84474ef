"""Rigid bodies: the one model of a body, its shapes and parameters, and what systems of free bodies share."""
