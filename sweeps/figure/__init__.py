"""Style and colours of figures, terminal and report."""
