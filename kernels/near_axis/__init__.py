"""Perturbed spins about principal axes, and the survey that measures their rates."""
