"""From a definition to points, and from points to columns."""
