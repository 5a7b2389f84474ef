"""A rigid body on a Kepler ellipse, under the torque of the gravity gradient."""
