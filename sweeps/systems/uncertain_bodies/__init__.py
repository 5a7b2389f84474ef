"""Uncertain bodies: moments with an uncertainty, sampled, measured draw by draw, and reported as probabilities."""
