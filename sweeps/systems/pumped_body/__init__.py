"""A free rigid body whose moments of inertia change periodically in time."""
