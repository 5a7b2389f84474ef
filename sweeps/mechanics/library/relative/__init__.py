"""The relative equilibria that ship, one description a file: spun, turned, damped or driven, not of T and V alone."""
