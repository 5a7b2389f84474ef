"""A tumbling body: its mode and its two periods."""
