"""From a definition to its files: compiling, claims, progress."""
