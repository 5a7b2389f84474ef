"""The two observed periods of a tumbling body: which bodies have both, in which mode, at which energy."""
