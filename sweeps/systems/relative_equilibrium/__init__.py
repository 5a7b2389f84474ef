"""Relative equilibria: gyroscopic, damped and driven systems, and equations of first order, by their eigenvalues."""
