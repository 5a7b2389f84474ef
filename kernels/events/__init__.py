"""Free rotations followed for revolutions: flips, twist, tumbling, precession, flat spin."""
