"""Small oscillations of described mechanical systems."""
