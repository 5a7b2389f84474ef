"""The free symmetric top, spun at any angle to its figure axis."""
