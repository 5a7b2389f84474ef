"""What a definition may hold: values, parameters, variables, and what is said of wrong ones."""
