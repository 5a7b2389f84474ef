"""The free rigid body, spun about a principal axis and perturbed."""
