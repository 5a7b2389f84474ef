"""What drives the way from a definition to its files: compiling, claims, progress."""
