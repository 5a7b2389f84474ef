"""A free rigid body with periodically modulated moments of inertia."""
