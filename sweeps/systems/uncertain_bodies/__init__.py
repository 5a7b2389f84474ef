"""Bodies as they are known: moments with an uncertainty, drawn, measured draw by draw, and told as probabilities."""
