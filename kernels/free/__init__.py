"""Free rigid body: Euler's equations, closed forms, integrators, linear theory."""
