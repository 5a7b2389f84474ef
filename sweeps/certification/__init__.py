"""Judge the rotation of a free rigid body in a file: reading, frames, exact motion, errors, diagnosis, answer."""
