"""Free rotations followed for revolutions: flips, twist, periods of tumbling and precession."""
