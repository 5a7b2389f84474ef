"""A free rigid body that loses energy at constant angular momentum."""
